"""Tests for a wrong unit of what no proof refuses by itself: presliding length, coupling, delay, energies.

Found by rig files of outsiders (decisions 0140, 0166): degrees for radians, N m per degree, seconds for
ticks, mJ for J."""

from __future__ import annotations

from rtctl.check.verdict import Subject, Verdict
from rtctl.check.verdicts_of_units import Band, judged

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
