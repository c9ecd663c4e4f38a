"""Tests of the sampled loop: coupling, delay, lag, age of samples, joint, and steps of the encoder."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hw.motion import HANDLE_M, own_size
from rtctl.check.devices_of_axis import sure_damping
from rtctl.check.lateness import STALE_LIMIT_TICKS
from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.check.verdicts_of_device import of_first_order
from rtctl.control.environments.table import Environment
from rtctl.friction.guarantee import holds_flicker
from rtctl.rounded import down, up

if TYPE_CHECKING:
    from rtctl.check.axis_report import AxisFigures

SHAKE_RAD_S = 0.002
"""A shake slower than this, RMS, counts as none: it is what a hand that holds still may be left with."""

FELT_RAD_S = 0.02
"""A shake that may be faster than this is refused; in between it is said that the joint may not be quite
still."""

MOST_COUNTS = 5.0
"""Largest amplitude, in counts, of a shake that the encoder's steps keep up in a loop that passes the exact
test."""

TIP_STIFFNESS_N_M = 1e4
"""Stiffest hand at the tip, N/m, in which the encoder's steps may not shake the joint. A tensed finger or arm
has some 1e3; what is stiffer than ten of them is a vice."""

FLICKER_COUNTS = 1.5
"""A shake up to so many counts is a flicker, which is not answered (`control.flicker.WIDE`)."""

_ROUNDING = 1e-12


def sampled_loop(s: Subject) -> list[Verdict]:
    """The exact test of coupling, delay, lag and age of samples: the one the energy of a hand's safety rests
    on."""
    axis = s.axis
    # a coupling at the bound that this row prints must pass
    passed = axis.sampled_data_margin_nms_rad >= -_ROUNDING * (1 + axis.damping_needed_nms_rad)
    b, needed = axis.device_damping_nms_rad, axis.damping_needed_nms_rad
    row = s.row(
        "coupling, sampled and late",
        f"needs {needed:.4g} N m s/rad",
        f"<= {b:.4g}",
        Outcome.PASS if passed else Outcome.FAIL,
        f"k_c up to {down(axis.sampled_data_k_max_nm_rad, 4)} N m/rad at this b_c is passive with every "
        "passive hand and every passive virtual environment",
        needed / b if b > 0 else (0.0 if passed else math.nan),  # no number: ranked as the worst
        "" if passed else _coupling_refusal(s),
    )
    return [row]


def any_world(s: Subject) -> list[Verdict]:
    """Behind a lag the exact test covers linear worlds; others (walls, detents) want a little more."""
    axis = s.axis
    linear = ", ".join(kind.word for kind in Environment if kind.about.linear)
    others = ", ".join(kind.word for kind in Environment if not (kind.about.linear or kind.about.active))
    if axis.current_loop_hz == 0:  # without a lag both tests are one (2.7)
        return []
    passed = axis.damping_needed_any_world_nms_rad <= axis.device_damping_nms_rad * (1 + _ROUNDING)
    return [
        s.row(
            "worlds that are not linear, behind the lag",
            f"need {axis.damping_needed_any_world_nms_rad:.4g} N m s/rad",
            f"<= {axis.device_damping_nms_rad:.4g}",
            Outcome.PASS if passed else Outcome.NOT_PROVED,
            f"{others}; the row above covers {linear}"
            if passed
            else f"{others}: these may give a hand energy; a little less stiffness_nm_rad proves them, too",
            axis.damping_needed_any_world_nms_rad / max(axis.device_damping_nms_rad, 1e-300),
        )
    ]


def declared_delay(s: Subject) -> list[Verdict]:
    """A device that declares no delay, in a rig file that states none."""
    axis = s.axis
    if (
        not axis.undeclared_devices
        or axis.delay_ticks > 0
        or axis.stiffness_nm_rad + axis.damping_nms_rad == 0
    ):
        return []
    return [
        s.row(
            "delay of the devices",
            "not declared",
            "declared, or coupling.delay_ticks",
            Outcome.NOT_PROVED,
            f"{' and '.join(axis.undeclared_devices)} does not say how late it is and coupling.delay_ticks "
            "is 0: the coupling is proved without any delay",
        )
    ]


def fresh_samples(s: Subject) -> list[Verdict]:
    """Samples that come so seldom that the law takes the device for a silent one: the rig would never
    arm."""
    every, most = s.axis.sample_ticks, STALE_LIMIT_TICKS
    if every <= 1:  # fresh in every tick: no row
        return []
    slower_hz = most / (every * s.period_s)  # the rate at which it is old by so much and no more
    # what was measured in ticks stays as many of them, whatever the rate
    anew = ", where measured.sample_ticks is to be measured anew" if s.axis.sample_from == "measured" else ""
    return [
        s.row(
            "fresh samples",
            f"every {every} ticks ({s.axis.sample_from})",
            f"<= {most}",
            Outcome.PASS if every <= most else Outcome.FAIL,
            f"a sample of {most} ticks is STALE, and such a rig never arms",
            every / most,
            f"{s.where}: axis {s.axis.name}: a fresh sample comes every {every} ticks "
            f"({s.axis.sample_from}), and one that is {most} old is STALE: the rig would never arm; "
            f"loop.rate_hz = {down(slower_hz, 6)} at most{anew}, or a quicker device"
            if every > most
            else "",
        )
    ]


def elastic_joint(s: Subject) -> list[Verdict]:
    """Only the damping on the motor's side of an elastic joint is sure, and only if the encoder turns with
    the motor."""
    axis = s.axis
    if axis.joint_encoder == "link":  # asked first: with it no share of damping proves anything
        return [
            s.row(
                "elastic joint, encoder at the link",
                "",
                'encoder = "motor"',
                Outcome.NOT_PROVED,
                "torque and angle are on two sides of a spring: no damping proves this with every hand",
            )
        ]
    if axis.motor_share == 1:
        return []
    b = s.table.viscous_nms_rad
    link = sure_damping(b, s.joint) - s.joint.motor_share * b
    # within the play of a gear the motor has no damping but its own
    in_play = axis.device_damping_nms_rad - link
    plays = link == 0 or axis.damping_needed_nms_rad <= in_play
    told = (
        "the damping behind the joint's spring can be cancelled by a hand: the rows here count on what is "
        "left of it"
    )
    if not plays:
        told += f"; in the play of a gear that is {in_play:.4g}: joint_damping_nms_rad = 0 where there is any"
    return [
        s.row(
            "elastic joint",
            f"{axis.device_damping_nms_rad:.4g} of {axis.total_damping_nms_rad:.4g} N m s/rad",
            "what every hand leaves",
            Outcome.PASS if plays else Outcome.NOT_PROVED,
            told,
        )
    ]


def encoder_steps(s: Subject) -> list[Verdict]:
    """Steps of the encoder shake a joint that nothing holds still: what holds it, or how slow the shake
    is."""
    axis = s.axis
    needed, held = axis.quantisation_torque_nm, axis.dry_friction_nm
    if needed == 0:  # no coupling, so no steps through one
        return []
    sticks, bent = held >= needed, axis.guarantee.length_rad / axis.count_rad
    # beyond its bristles it slides, and friction ends it
    counts = min(shake_counts(s), bent) if sticks else shake_counts(s)  # inf where nothing damps
    if counts <= FLICKER_COUNTS and holds_flicker(s.table, axis.guarantee, s.joint.dry_share):
        figure, bound = f"{counts:.2g} counts", f"<= {FLICKER_COUNTS:g} counts"
        meaning = (
            "most they can shake a joint at rest: a flicker, which the law does not answer; dry friction "
            "holds the joint meanwhile"
        )
        return [_steps_row(s, figure, bound, Outcome.PASS, meaning, counts / FLICKER_COUNTS)]
    counts = min(counts, MOST_COUNTS)
    shake = shake_rad_s(s, counts, axis.guarantee.bristle_nm_rad if sticks else 0.0)
    still = still_rad_s(s)  # of a carriage as at a handle
    outcome = Outcome.PASS if shake <= still else Outcome.NOT_PROVED
    meaning = (
        f"most they can shake a joint at rest, {counts:.2g} counts, in a hand of up to "
        f"{TIP_STIFFNESS_N_M:.0e} N/m"
    )
    if sticks:
        meaning += (
            f": friction holds it, but its bristles bend over {bent:.3g} counts, and are a spring so far"
        )
    else:
        meaning += f"; {up(needed)} N m of dry friction hold it still (dry_friction_nm)"
        outcome = Outcome.FAIL if shake > _felt_rad_s(s) else outcome
    refusal = _steps_refusal(s, shake) if outcome == Outcome.FAIL else ""
    figure, bound = f"{shake:.3g} rad/s RMS", f"<= {still:g} rad/s"
    return [_steps_row(s, figure, bound, outcome, meaning, shake / still, refusal)]


def still_rad_s(s: Subject) -> float:
    """Shake of this axis that counts as none, rad/s: of a carriage as at a handle, like `_felt_rad_s`."""
    return own_size("shake_rad_s", SHAKE_RAD_S, s.table.motion)


def _felt_rad_s(s: Subject) -> float:
    return own_size("felt_rad_s", FELT_RAD_S, s.table.motion)


def _steps_row(
    s: Subject, figure: str, bound: str, outcome: Outcome, meaning: str, use: float, refusal: str = ""
) -> Verdict:
    return s.row("steps of the encoder", figure, bound, outcome, meaning, use, refusal)


def shake_counts(s: Subject) -> float:
    """Amplitude of the shake that the steps of the encoder keep up in a joint that nothing holds, in counts;
    infinite without damping.

    Notes
    -----
    The coupling answers a step of one count, k_c Delta, at worst L = (n + d) T + tau after the joint passed
    it, on the average half a sample earlier. The average takes k_c (L - n T/2) of the damping b + b_c; what
    is left, b_s, has to spend in a cycle of amplitude A, pi b_s A^2 w, what two steps a cycle at the middle
    of the motion can give, each k_c Delta times the way A w L: A = (2/pi) k_c L Delta/b_s, whatever the
    frequency. An estimate, not a proof: the tests run random rigs in time against it."""
    axis = s.axis
    T, k_c, n = s.period_s, axis.stiffness_nm_rad, axis.sample_ticks
    lag_s = 1 / (2 * math.pi * axis.current_loop_hz) if axis.current_loop_hz > 0 else 0.0
    late = (n + axis.delay_ticks) * T + lag_s  # from the edge to the torque, at worst
    spare = axis.device_damping_nms_rad + axis.damping_nms_rad - k_c * (late - n * T / 2)
    return 2 / math.pi * k_c * late / spare if spare > 0 else math.inf


def shake_rad_s(s: Subject, counts: float, bristle_nm_rad: float = 0.0) -> float:
    """RMS speed of a shake of so many counts to either side, rad/s, on the coupling and the stiffest hand,
    and on the bristles of a joint that sticks."""
    axis = s.axis
    # at the handle, which is beyond the sensor where moments are measured: its lever may be nothing
    hand = TIP_STIFFNESS_N_M * s.hand * HANDLE_M**2
    stiffness = axis.stiffness_nm_rad + hand + bristle_nm_rad  # all of them hold the joint
    return counts * axis.count_rad * math.sqrt(stiffness / (2 * s.table.inertia_kgm2))


def _steps_refusal(s: Subject, shake: float) -> str:
    axis = s.axis
    return (
        f"{s.where}.encoder_counts_per_rev: axis {axis.name}: {s.table.encoder_counts_per_rev:g} counts "
        f"make the coupling step by {axis.quantisation_torque_nm:.3g} N m and shake the joint at "
        f"{shake:.3g} rad/s, the bound is {_felt_rad_s(s):g} rad/s or {up(axis.quantisation_torque_nm)} N m "
        f"of guaranteed dry friction (there is {axis.dry_friction_nm:.3g}): a finer encoder, less "
        "coupling.stiffness_nm_rad, or dry_friction_nm if the joint surely has it"
    )


def _coupling_refusal(s: Subject) -> str:
    """File, axis, key, value, bound and remedy, on one line."""
    axis, b = s.axis, s.axis.device_damping_nms_rad  # that no hand can cancel
    k_max, found = down(axis.sampled_data_k_max_nm_rad, 4), axis.friction  # as printed it must pass
    pair = (
        f"recommended: stiffness_nm_rad = {down(axis.recommended_stiffness_nm_rad, 4)}, "
        f"damping_nms_rad = {down(axis.recommended_damping_nms_rad, 4)}"
    )
    # first: no coupling helps where friction is compensated beyond itself
    if found is not None and not b > 0:
        return (
            f"{s.where}.friction.gain: axis {axis.name}: the feed-forward may exceed the friction: at "
            f"{found.secant_speed_rad_s:.3g} rad/s it leaves {b:.4g} N m s/rad of damping, the bound is > 0; "
            f"no coupling passes; a gain of at most {down(found.gain_max, 4)} does for this coupling, or a "
            f"better model (its largest error is {found.error_max_nm:.3g} N m)"
        )
    if axis.damping_nms_rad > b:  # then no stiffness passes, however small
        return (
            f"{s.where}.coupling.damping_nms_rad: axis {axis.name}: {axis.damping_nms_rad:g} is above its "
            f"bound {down(b, 4)} N m s/rad, the damping the device surely has, so no stiffness passes; {pair}"
        )
    return (
        f"{s.where}.coupling.stiffness_nm_rad: axis {axis.name}: {axis.stiffness_nm_rad:g} is not provably "
        f"passive; the largest that passes is {k_max} N m/rad with damping_nms_rad = "
        f"{axis.damping_nms_rad:g}, {between_text(axis)} and {b:.4g} N m s/rad of "
        f"guaranteed damping; {pair}{of_first_order(s)}"
    )


def between_text(axis: AxisFigures) -> str:
    """What lies between law and joint, in words, and who said so."""
    parts = [f"a delay of {axis.delay_ticks:.4g} ticks ({axis.delay_from})"]
    if axis.jitter_ticks > 0:  # only what is there is told
        parts.append(f"up to {axis.jitter_ticks:.3g} less at times")
    if axis.current_loop_hz > 0:
        exceeds = f" that overshoots by {axis.current_overshoot:.2g}" if axis.current_overshoot > 0 else ""
        parts.append(f"a current loop of {axis.current_loop_hz:.4g} Hz{exceeds} ({axis.lag_from})")
    if axis.sample_ticks > 1:
        parts.append(f"a fresh sample every {axis.sample_ticks} ticks ({axis.sample_from})")
    return ", ".join(parts)
