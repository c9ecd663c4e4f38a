"""What `rtctl check` judges: a list of tests, each of which gives rows with a verdict, the worst row last.

A test is a function of one axis that gives no, one or several rows. To add one, write it and name it in
`EITHER` or in the list of the display it is for. A row that fails refuses the rig file (exit code 5, no
start); what cannot be proved is a row that says so."""

from __future__ import annotations

from collections.abc import Callable

from rtctl.check import (
    verdicts_of_admittance,
    verdicts_of_admittance_steps,
    verdicts_of_device,
    verdicts_of_force,
    verdicts_of_friction,
    verdicts_of_load,
    verdicts_of_loop,
    verdicts_of_motion,
    verdicts_of_numbers,
    verdicts_of_observer,
    verdicts_of_slips,
    verdicts_of_units,
)
from rtctl.check.verdict import Subject, Verdict, ranked

Test = Callable[[Subject], list[Verdict]]

IMPEDANCE: tuple[Test, ...] = (
    verdicts_of_loop.sampled_loop,
    verdicts_of_loop.any_world,
    verdicts_of_loop.declared_delay,
    verdicts_of_loop.elastic_joint,
    verdicts_of_loop.encoder_steps,
    verdicts_of_friction.two_lines,
    verdicts_of_motion.moved,
    verdicts_of_motion.slope_of_the_torque,
    verdicts_of_observer.closed_loop,
    verdicts_of_observer.unknown_gear,
    verdicts_of_observer.steps_of_the_encoder,
    verdicts_of_observer.bias,
    verdicts_of_force.sensor_of_an_observer,
    verdicts_of_units.torque_of_a_count,
)
"""Tests of a coupling, of what only the device's damping is held against, and of the observer, which sends
nothing beside a virtual mass."""

ADMITTANCE: tuple[Test, ...] = (
    verdicts_of_admittance.closed_loop,
    verdicts_of_admittance.stuck_joint,
    verdicts_of_admittance.dry_friction,
    verdicts_of_admittance.help_with_friction,
    verdicts_of_admittance.other_worlds,
    verdicts_of_admittance.any_hand,
    verdicts_of_admittance.vibrations,
    verdicts_of_admittance.lateness,
    verdicts_of_force.sensor_of_an_admittance,
    verdicts_of_admittance_steps.steps,
    verdicts_of_admittance_steps.hunting,
    verdicts_of_admittance_steps.creeping,
)
"""Tests of an axis that is displayed as an admittance, in their place; why, says `verdicts_of_admittance`."""

EITHER: tuple[Test, ...] = (
    verdicts_of_loop.fresh_samples,
    verdicts_of_friction.energy_account,
    verdicts_of_friction.motion_seen,
    verdicts_of_friction.policy_at_rest,
    verdicts_of_friction.wish,
    verdicts_of_friction.follows,
    verdicts_of_friction.conservative_part,
    verdicts_of_motion.places_seen,
    verdicts_of_motion.travel,
    verdicts_of_motion.count_is_no_jump,
    verdicts_of_load.load,
    verdicts_of_friction.damping_and_model,
    verdicts_of_units.acceleration,
    verdicts_of_units.current,
    verdicts_of_device.cut,
    verdicts_of_device.remembered,
    verdicts_of_device.pulse_in_steps,
    verdicts_of_device.overshoot,
    verdicts_of_units.ticks_to_full_torque,
    verdicts_of_units.time_constant,
    verdicts_of_units.viscous_torque,
    verdicts_of_units.force_at_the_handle,
    verdicts_of_units.dry_friction,
    verdicts_of_units.counts_of_the_travel,
    verdicts_of_units.time_to_speed,
    verdicts_of_numbers.counts_of_the_motor,
    verdicts_of_numbers.step_of_the_device,
    verdicts_of_numbers.range_of_the_force,
    verdicts_of_numbers.numbers_of_the_force,
    verdicts_of_slips.presliding,
    verdicts_of_slips.softness,
    verdicts_of_slips.delay,
    verdicts_of_slips.given,
    verdicts_of_slips.push_of_a_hand,
    verdicts_of_slips.place_of_the_world,
)


TELL = (verdicts_of_force.sensor_of_an_observer, verdicts_of_admittance_steps.creeping)
"""Tests that refuse nothing and take long."""


def tests_of(axis: Subject) -> tuple[Test, ...]:
    """Every test of an axis, in any order."""
    tests = EITHER
    for display, own in (("impedance", IMPEDANCE), ("admittance", ADMITTANCE)):
        tests += own if axis.table.may_show(display) else ()
    return tests


def verdicts(axis: Subject, *, telling: bool = True) -> list[Verdict]:
    """All rows of one axis in its units, the worst last; without `telling` all but those of `TELL`."""
    rows = ranked(row for test in tests_of(axis) if telling or test not in TELL for row in test(axis))
    return [row.spoken(axis.table.motion) for row in rows]
