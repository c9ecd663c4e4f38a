"""Tests of an axis displayed as an admittance: its closed loop in every hand of the box.

Rows of the impedance display that such an axis does not get, unless its display may change, and why:

- `coupling, sampled and late` and `worlds that are not linear, behind the lag`: there is no coupling; the
  joint follows the virtual mass, and the certificate here judges the energy that it gives;
- `elastic joint`: its damping counts there for a proof with any hand; here the joint is inside the loop;
- `steps of the encoder`, and the unit test of one count: here they come through K_v (a row below);
- `feed-forward of any sign (two-line)`: it compares the feed-forward with friction, for a port that nothing
  else drives. Here a torque that is wrong is one against a velocity loop: the certificate is asked with the
  damping that the feed-forward leaves, and its work is bounded by the account, as everywhere;
- `disturbance observer in a hand`, and its steps and bias: it sends nothing beside a virtual mass.

The rows of account, policy, intent, places and units hold as they are."""

from __future__ import annotations

import math

from rtctl.check.admittance_advice import passing_together
from rtctl.check.admittance_figures import AdmittanceFigures, figures_of, loop_of
from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.check.verdicts_of_loop import between_text, still_rad_s
from rtctl.rounded import down, up

KEPT_LEAST = 0.25
"""Least share of its ideal damping that a vibration should keep."""


def found(s: Subject) -> AdmittanceFigures:
    """What the certificate says of the axis."""
    return figures_of(loop_of(s.axis, s.table, s.joint, s.period_s))


def closed_loop(s: Subject) -> list[Verdict]:
    """Every hand of the box, every linear world: eigenvalues over a grid, and a proof between its points."""
    one, box = found(s), s.table.admittance
    outcome = Outcome.FAIL if not one.stable else Outcome.PASS if one.proved else Outcome.NOT_PROVED
    shown = (
        f"masses to {box.mass_max_kgm2:g} kg m^2, more damping; " if box.mass_max_kgm2 > box.mass_kgm2 else ""
    )
    hands = (
        f"{shown}hands to {box.hand_stiffness_nm_rad:g} N m/rad, {box.hand_damping_nms_rad:g} N m s/rad, "
        f"{box.hand_inertia_kgm2:g} kg m^2"
    )
    if not one.stable:
        meaning = f"grows with a {one.worst}: {remedy(s, one)}{_together(s)}"
    elif one.proved:
        meaning = (
            f"{hands}, any linear world: proved between the points, too, in {one.cells} cells; {_room(one)}"
        )
    else:
        meaning = (
            f"{hands}, any linear world: stable at {one.points} points; between them not proved "
            f"({one.not_proved_at or 'cells'}); {_room(one)}"
        )
    most = one.hand_stiffness_max_nm_rad
    return [
        s.row(
            "admittance in a hand",
            f"{one.radius:.6f}",
            "<= 1, and between points",
            outcome,
            meaning,
            box.hand_stiffness_nm_rad / most if most > 0 else math.inf,
            f"{s.where}.admittance.mass_kgm2: axis {s.axis.name}: {box.mass_kgm2:g} with damping_nms_rad = "
            f"{box.damping_nms_rad:g}, velocity_gain_nms_rad = {box.velocity_gain_nms_rad:g}: {meaning}"
            if outcome == Outcome.FAIL
            else "",
        )
    ]


def _together(s: Subject) -> str:
    """One set of numbers with which all these rows pass: what helps one of them alone may fail another."""
    advice = passing_together(loop_of(s.axis, s.table, s.joint, s.period_s))
    if advice.keys:
        return f"; all hands, dry friction and a joint that sticks pass with {advice.words()}"
    return (
        "; no masses, dampings and gains that were tried pass together: less delay or lag, or less "
        "hand_stiffness_nm_rad and hand_inertia_kgm2, if no stiffer or heavier hand holds it"
    )


def _room(one: AdmittanceFigures) -> str:
    return (
        f"passes up to a hand of {down(one.hand_stiffness_max_nm_rad, 4)} N m/rad "
        f"({down(one.hand_stiffness_max_free_nm_rad, 4)} in free motion), down to a mass of "
        f"{up(one.mass_min_kgm2)} kg m^2"
    )


def remedy(s: Subject, one: AdmittanceFigures) -> str:
    """What passes nearest by."""
    ways = []
    # below the rig file's it is no remedy: 0 says that no mass passes
    if one.mass_min_kgm2 > s.table.admittance.mass_kgm2:
        ways.append(f"mass_kgm2 = {up(one.mass_min_kgm2)}")
    if one.damping_min_nms_rad > 0:
        ways.append(f"damping_nms_rad = {up(one.damping_min_nms_rad)}")
    if one.hand_stiffness_max_nm_rad > 0:
        ways.append(
            f"hand_stiffness_nm_rad = {down(one.hand_stiffness_max_nm_rad)}, if no stiffer hand holds it"
        )
    return (
        ", or ".join(ways)
        if ways
        else "no mass passes at these gains: another velocity_gain_nms_rad, or less delay"
    )


def stuck_joint(s: Subject) -> list[Verdict]:
    """While dry friction holds the joint, it is a spring: what grows there shakes the hand."""
    one = found(s)
    if one.stuck_radius is None:
        return []
    speed, mrad, still = one.stuck_speed_rad_s, s.axis.guarantee.length_rad * 1e3, still_rad_s(s)
    outcome, meaning = (
        Outcome.PASS,
        "the same hands and worlds while dry friction holds the joint: at the points of the grid",
    )
    if one.stuck_worst:
        shakes = (
            f"within a presliding of {mrad:.3g} mrad, where friction is a spring, the joint shakes with a "
            f"{one.stuck_worst}"
        )
        outcome, meaning = Outcome.PASS, f"{shakes}: too slowly to be felt"
        # what shakes more slowly than this nobody feels, though an eigenvalue grows
        if speed > still:
            outcome, meaning = Outcome.FAIL, f"{shakes}: {_rest_remedy(one)}{_together(s)}"
            if s.axis.guarantee.may_be_shorter:
                outcome = Outcome.NOT_PROVED
                meaning += f"; {s.axis.guarantee.length_in_doubt}"
    refusal = (
        f"{s.where}.admittance.rest_damping_nms_rad: axis {s.axis.name}: "
        f"{s.table.admittance.rest_damping_nms_rad:g} lets the joint shake at {speed:.3g} rad/s RMS, the "
        f"bound is {still:g}: {meaning}"
    )
    return [
        s.row(
            "admittance, joint that sticks",
            f"{speed:.3g} rad/s RMS",
            f"<= {still:g} rad/s",
            outcome,
            meaning,
            speed / still if one.stuck_worst else one.stuck_radius,
            refusal if outcome == Outcome.FAIL else "",
        )
    ]


def _rest_remedy(one: AdmittanceFigures) -> str:
    ways = (
        "less hand_inertia_kgm2, if no heavier hand holds it, less velocity_gain_nms_rad, or more "
        "damping_nms_rad"
    )
    if one.rest_damping_min_nms_rad > 0:
        return f"rest_damping_nms_rad = {up(one.rest_damping_min_nms_rad)}, or {ways}"
    return ways


def dry_friction(s: Subject) -> list[Verdict]:
    """Dry friction in the joint: does it keep a hand, the mass and the servo's spring swinging?"""
    one, table = found(s), s.table.admittance
    passes = not one.rubbing_worst
    meaning = "dry friction, as damping of every size, lets nothing swing on"
    if not passes:
        meaning = (
            f"swings on where dry friction is as {one.rubbing_damping_nms_rad:.3g} N m s/rad of damping, "
            f"with a {one.rubbing_worst}: "
            f"{'less position_gain_nm_rad, or ' if table.position_gain_nm_rad > 0 else ''}more "
            f"velocity_gain_nms_rad or damping_nms_rad{_together(s)}"
        )
    refusal = (
        f"{s.where}.admittance.position_gain_nm_rad: axis {s.axis.name}: {table.position_gain_nm_rad:g} "
        f"with velocity_gain_nms_rad = {table.velocity_gain_nms_rad:g}: {meaning}"
    )
    outcome = Outcome.PASS if passes else Outcome.FAIL
    return [
        s.row(
            "admittance, dry friction",
            f"{one.rubbing_radius:.6f}",
            "<= 1",
            outcome,
            meaning,
            one.rubbing_radius,
            "" if passes else refusal,
        )
    ]


def help_with_friction(s: Subject) -> list[Verdict]:
    """The help turns with the mass, friction with the joint: does that keep a hand swinging?"""
    # Reading a report's names must not load the compiler.
    from rtctl.control.proofs.admittance_help import GROWS_1_S

    # of the loop and not of the rig file: a model that helps with nothing has none
    present = loop_of(s.axis, s.table, s.joint, s.period_s).help_share
    if present == 0:
        return []
    one, share = found(s), s.table.admittance.compensation_share
    helped, passes = one.helped, one.helped.ok
    meaning = "no swing, of any amplitude that was tried, is fed by it"
    if not passes:
        least = down(share * one.help_share_max / present)
        meaning = (
            f"it turns with the mass, before the joint, and may keep up a swing of {helped.speed_rad_s:.2g} "
            f"rad/s RMS with a {helped.at}: compensation_share = {least}, or more damping_nms_rad or "
            "velocity_gain_nms_rad"
        )
    refusal = (
        f"{s.where}.admittance.compensation_share: axis {s.axis.name}: {share:g} of the learned help: "
        f"{meaning}"
    )
    return [
        s.row(
            "admittance, help with friction",
            f"{helped.growth_1_s:+.3g}/s",
            f"<= {GROWS_1_S:+g}/s",
            Outcome.PASS if passes else Outcome.FAIL,
            meaning,
            1.0 + helped.growth_1_s if not passes else 0.0,
            "" if passes else refusal,
        )
    ]


def other_worlds(s: Subject) -> list[Verdict]:
    """The certificate knows springs and dampers. What lets go or snaps is no such world."""
    return [
        s.row(
            "admittance, worlds that are not linear",
            "none certified",
            "walls, detents",
            Outcome.NOT_PROVED,
            "hands of the box came to rest in walls, but may swing on about the crest of a detent, where "
            "the mass runs ahead of a joint that sticks",
        )
    ]


def any_hand(s: Subject) -> list[Verdict]:
    """The continuous bound, told: no sampled display with lags is passive with every hand."""
    one, table = found(s), s.table.admittance
    least, lasting = one.mass_min_continuous_kgm2, table.position_gain_nm_rad * s.axis.total_damping_nms_rad
    passive = table.mass_kgm2 >= least and lasting == 0  # K_p b > 0 breaks it at low frequency (2.13)
    why = "" if lasting == 0 else ", and position_gain_nm_rad breaks it where the joint is damped"
    return [
        s.row(
            "admittance without lag, any hand",
            f"{table.mass_kgm2:.4g} kg m^2",
            f">= {up(least, 4)}, K_p b = 0",
            Outcome.PASS,
            ("without lags it would be" if passive else "not even without lags would it be")
            + f" passive with any hand{why}; told only: with lags none is, so a box of hands is certified",
        )
    ]


def vibrations(s: Subject) -> list[Verdict]:
    """How much of the damping of virtual mass, hand and world is left."""
    if not found(s).stable:
        return []
    kept = found(s).damping_kept
    return [
        s.row(
            "admittance, damping of vibrations",
            f"{kept:.3g}",
            f">= {KEPT_LEAST:g}",
            Outcome.PASS if kept >= KEPT_LEAST else Outcome.WARN,
            "least share that a vibration keeps of the damping that virtual mass, hand and world have by "
            "themselves (or of 20/s)",
            KEPT_LEAST / kept if kept > 0 else math.inf,
        )
    ]


def lateness(s: Subject) -> list[Verdict]:
    """Delay and lag that the certificate rests on, and whether a device says them."""
    # a delay of the rig file is an answer, too: somebody has measured it
    silent = bool(s.axis.undeclared_devices) and s.axis.delay_ticks == 0
    steady = s.axis.jitter_ticks == 0
    told = f"{between_text(s.axis)}: the worse of declared and measured"
    if silent:
        told = (
            f"{' and '.join(s.axis.undeclared_devices)} does not say how late it is and "
            "coupling.delay_ticks is 0"
        )
    # the certificate is of constant delays: an eigenvalue knows no other
    elif not steady:
        told += "; a delay that changes from tick to tick is none of those"
    return [
        s.row(
            "admittance, delay and lag",
            "not declared" if silent else f"{s.axis.delay_ticks:.3g} ticks",
            "declared, constant",
            Outcome.PASS if steady and not silent else Outcome.NOT_PROVED,
            told,
        )
    ]
