"""Tests for a wrong unit of what no proof refuses by itself: presliding length, coupling, delay, energies.

Found by rig files of outsiders (decisions 0140, 0166): degrees for radians, N m per degree, seconds for
ticks, mJ for J."""

from __future__ import annotations

import math

from rtctl.check.verdict import Subject, Verdict
from rtctl.check.verdicts_of_units import Band, judged
from rtctl.control.environments.table import Environment

PRESLIDING_RAD = Band(1e-7, 1e-5, 0.03, 0.3)
"""From ball bearings to cables; the account lends half a bristle of this length, so degrees for radians let
help give 57 times as much."""
PRESLIDING_M = Band(1e-8, 1e-7, 3e-3, 3e-2)
"""Presliding length of a carriage, m."""
COUPLING_SHARE = Band(1e-12, 0.02, 1e6, 1e12)
"""Stiffness of the coupling over the stiffest that passes: a soft one is harmless, and told only. How far it
turns says less: direct drives that damp little have 2 rad and more of it at the torque limit."""
DELAY_TICKS = Band(1e-12, 0.01, 20.0, 20.0)
"""What a rig file states beside what devices declare: too little is told only, as those count where they are
worse."""

PUSH_SHARE = Band(1e-12, 0.01, 1.0, 1e12)
"""Push of a hand over the friction that it is helped with: .1 and .2 by themselves. Told only: in mN m there
is no help, in kN m it is switched."""
PLACE_SHARE = Band(0.0, 0.0, 1.0, 1e12)
"""Place of the world that begins over the travel, or a turn."""

GIVEN_J = Band(0.0, 0.0, 1.0, 1e3)
"""Energy that accounts let a hand have at once: 1 J is a handle of 100 g at 4.5 m/s. Told only: a rig that
plays a log back has none to give."""


def given(s: Subject) -> list[Verdict]:
    """What the accounts of the port may be short of before they stop anything."""
    from rtctl.control.take_back import FLOOR_FACTOR  # the names of a report must not load the compiler

    passivity = s.passivity
    if passivity is None:
        return []
    return judged(
        s,
        "energy that a hand may be given at once",
        passivity.renderer_store_j + passivity.bank_j + FLOOR_FACTOR * passivity.budget_j,
        "J",
        GIVEN_J,
        f"renderer_store_j, bank_j and {FLOOR_FACTOR:g} budget_j of [passivity]",
        "passivity: its energies are meant in J (20 mJ is 0.02)",
    )


def presliding(s: Subject) -> list[Verdict]:
    """How far friction is a spring, where somebody said so."""
    sure = s.axis.guarantee  # as the law has it
    # what is assumed has no unit that somebody could have got wrong
    if not sure.measured:
        return []
    # bands of their own: metres and radians have no ratio that holds for all
    slides = s.table.motion == "linear"
    return judged(
        s,
        "presliding length",
        sure.length_rad,
        "rad",
        PRESLIDING_M if slides else PRESLIDING_RAD,
        f"motion over which friction is a spring ({sure.length_source})",
        "friction.presliding_rad: it is meant in rad at the link, as in the model file (F_s over sigma0)",
    )


def softness(s: Subject) -> list[Verdict]:
    """A coupling far softer than it may be."""
    # of the rig file, not what compensation adds: the unit of this number is asked for
    k_c, most = s.table.coupling.stiffness_nm_rad, s.axis.sampled_data_k_max_nm_rad
    # no coupling is in force, whatever stands in the file; or none passes, which is refused elsewhere
    if k_c == 0 or most <= 0 or not s.table.may_show("impedance"):
        return []
    slides = s.table.motion == "linear"
    return judged(
        s,
        "coupling over the stiffest that passes",
        k_c / most,
        "",
        COUPLING_SHARE,
        f"coupling.stiffness_nm_rad over {most:.4g} N m/rad",
        f"coupling.stiffness_nm_rad: {k_c:g} is meant in N m/rad "
        + ("(1 N/mm is 1000)" if slides else "at the link (1 N m per degree is 57.3)"),
    )


def delay(s: Subject) -> list[Verdict]:
    """A delay that a person stated."""
    ticks = s.table.coupling.delay_ticks
    # the default, which says nothing
    if ticks == 0:
        return []
    return judged(
        s,
        "stated delay",
        ticks,
        "ticks",
        DELAY_TICKS,
        "coupling.delay_ticks; what devices declare and what is measured counts where it is more",
        f"coupling.delay_ticks: {ticks:g} is meant in ticks of {s.period_s:g} s",
    )


def push_of_a_hand(s: Subject) -> list[Verdict]:
    """Pushes that open the help, against the friction that it helps with."""
    found, table = s.axis.friction, s.table.friction
    if found is None or found.feedforward_max_nm == 0 or table.policy not in ("hybrid", "intent"):
        return []
    rows = []
    for key in ("intent_nm", "gate_nm"):
        push = getattr(table, key)
        # 0: the law takes its own share of the friction
        if push > 0:
            rows += judged(
                s,
                f"{key} over the help",
                push / found.feedforward_max_nm,
                "",
                PUSH_SHARE,
                f"friction.{key} over the largest feed-forward, {found.feedforward_max_nm:.3g} N m",
                f"friction.{key}: {push:g} is meant in N m at the link; 0 takes a share of the friction",
            )
    return rows


def place_of_the_world(s: Subject) -> list[Verdict]:
    """A world at a place where the joint never is: a spring in degrees would pull it there with all of its
    torque."""
    shown, table, rows = s.table.environment, s.table, []
    slides = table.motion == "linear"
    fields = type(table).model_fields
    ends = table.position_min_rad, table.position_max_rad
    given = ends != (fields["position_min_rad"].default, fields["position_max_rad"].default)
    reach = max(abs(end) for end in ends) if given else 1.0 if slides else 2 * math.pi
    for parameter in Environment[shown.kind.upper()].about.parameters:
        value = getattr(shown, parameter.name)
        # places and lengths; stiffness and damping end with other units
        if parameter.name in ("center_rad", "pitch_rad") and value != 0:
            rows += judged(
                s,
                f"{parameter.name} of the world over the travel",
                abs(value) / reach,
                "",
                PLACE_SHARE,
                f"environment.{parameter.name} over {reach:.3g} rad"
                + ("" if given else (", a metre" if slides else ", a turn")),
                f"environment.{parameter.name}: {value:g} is meant in rad at the link"
                + (" (mm are thousandths)" if slides else " (1 degree is 0.01745)"),
            )
    return rows
