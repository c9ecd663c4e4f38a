"""What `rtctl check` judges: a list of tests, each of which gives rows with a verdict, the worst row last.

A test is a function of one axis that gives no, one or several rows. To add one, write it and name it in `TESTS`. A row
that fails refuses the rig file (exit code 5, no start); what cannot be proved is a row that says so.
"""

from __future__ import annotations

from collections.abc import Callable

from rtctl.check import verdicts_of_friction, verdicts_of_loop, verdicts_of_observer, verdicts_of_units
from rtctl.check.verdict import Subject, Verdict, ranked

TESTS: tuple[Callable[[Subject], list[Verdict]], ...] = (
    verdicts_of_loop.sampled_loop,
    verdicts_of_loop.any_world,
    verdicts_of_loop.declared_delay,
    verdicts_of_loop.elastic_joint,
    verdicts_of_loop.encoder_steps,
    verdicts_of_friction.two_lines,
    verdicts_of_friction.energy_account,
    verdicts_of_friction.motion_seen,
    verdicts_of_friction.policy_at_rest,
    verdicts_of_friction.wish,
    verdicts_of_observer.closed_loop,
    verdicts_of_observer.steps_of_the_encoder,
    verdicts_of_observer.bias,
    verdicts_of_friction.conservative_part,
    verdicts_of_friction.damping_and_model,
    verdicts_of_units.acceleration,
    verdicts_of_units.current,
    verdicts_of_units.ticks_to_full_torque,
    verdicts_of_units.torque_of_a_count,
    verdicts_of_units.time_constant,
    verdicts_of_units.viscous_torque,
)
"""Every test of an axis, in any order."""


def verdicts(axis: Subject) -> list[Verdict]:
    """All rows of one axis, the worst last."""
    return ranked(row for test in TESTS for row in test(axis))
