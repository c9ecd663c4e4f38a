"""Tests of the disturbance observer: the loop it closes with a hand, steps of the encoder, bias of the force
sensor."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

from rtctl.check import observer_tuning
from rtctl.check.observer_tuning import judged
from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.rounded import down

if TYPE_CHECKING:
    from rtctl.control.proofs.observer_loop import Loop
    from rtctl.control.proofs.observer_margin import Finding

NOISE_SHARE = 0.3
"""Torque of one encoder count through the observer, as a share of the least friction: less is not felt."""

NOISE_MOST = 1.0
"""With more than the friction itself the joint would move at every count."""


def closed_loop(s: Subject) -> list[Verdict]:
    """Largest eigenvalue over a box of hands, on the joint as it is known, and on elastic ones if it is
    not."""
    if not observes(s):
        return []
    loop = loop_of(s)
    found = judged(loop)
    # grid resonances stand for it: failing one is no proof of harm (20 Hz decides, for joints that have 60:
    # decision 0066)
    unknown = s.joint.motor_share < 1 and not s.joint.stiffness_nm_rad > 0
    beyond = Outcome.NOT_PROVED if unknown else Outcome.FAIL
    outcome = Outcome.PASS if found.ok else beyond
    joint = "20 to 100 Hz, as its stiffness is not known" if unknown else "the joint as declared"
    meaning = (
        f"largest |eigenvalue| over {found.points} points: hands to {600 * s.hand:g} N m/rad, {s.hand:g} N "
        f"m s/rad, {0.02 * s.hand:g} kg m^2, {joint}; sliding and stuck, on the coupling and free; shown at "
        "the points of this grid, not between them"
    )
    if not found.ok:
        meaning = f"unstable or hardly damped with a {found.at}: {_remedy(s, loop)}"
    return [
        s.row(
            "disturbance observer in a hand",
            f"{found.radius:.6f}",
            f"<= 1, {_kept_least():.0%} of all damping kept",
            outcome,
            meaning,
            _use(found),
            f"{s.where}.friction.observer: axis {s.axis.name}: gain = {loop.gain:g} with bandwidth_hz = "
            f"{loop.bandwidth_hz:g}: {meaning}"
            if outcome == Outcome.FAIL
            else "",
        )
    ]


def _use(found: Finding) -> float:
    """1 where a vibration keeps no more of its damping than it must."""
    return _kept_least() / found.kept if found.kept > 0 else math.inf


def _kept_least() -> float:
    from rtctl.control.proofs import observer_margin  # reading a report's names must not load the compiler

    return observer_margin.KEPT_LEAST


@lru_cache(maxsize=64)
def _passing(loop: Loop) -> tuple[float, float]:
    """Largest gain at this bandwidth, nearest bandwidth at this gain; behind a late sensor of some gains, and
    of slower ones, as the law would be tuned then."""
    from rtctl.control.proofs import observer_margin, observer_match

    if observer_match.late_ticks(loop) > 0:
        gains = [gain for gain in observer_margin.GAINS[::5] if gain < loop.gain]
        slower = [float(hz) for hz in reversed(observer_margin.BANDWIDTHS_HZ) if hz < loop.bandwidth_hz]
        tried = (observer_match.tuned(replace(loop, gain=gain), [loop.bandwidth_hz]) for gain in gains)
        one = observer_match.tuned(loop, slower)
        return next((gain.gain for gain in tried if judged(gain).ok), 0.0), one.bandwidth_hz if judged(
            one
        ).ok else 0.0
    return observer_margin.largest_gain(loop), observer_margin.nearest_bandwidth(loop)


def _remedy(s: Subject, loop: Loop) -> str:
    gain, bandwidth_hz = _passing(loop)
    # each by itself: one of them will do
    ways = [f"gain of at most {gain:g} at {loop.bandwidth_hz:g} Hz"]
    if bandwidth_hz > 0:
        ways.append(f"bandwidth_hz = {bandwidth_hz:g} at this gain")
    if s.axis.stiffness_nm_rad > 0:
        ways.append("less coupling.stiffness_nm_rad")
    return ", or ".join(ways)


def loop_of(s: Subject) -> Loop:
    """The loop of an axis as `observer_loop` wants it."""
    # as the law is tuned, by the same plan: what is judged is what runs
    loop = observer_tuning.loop_of(
        s.table, s.joint, s.period_s, s.axis.between, s.axis.force_way, s.axis.observer
    )
    return replace(loop, bristle_nm_rad=s.axis.guarantee.bristle_nm_rad)


def unknown_gear(s: Subject) -> list[Verdict]:
    """Damping that a gear of which nobody says how stiff it is keeps, while a hand holds its link."""
    if not observes(s):
        return []
    from rtctl.control.proofs import observer_match

    loop, gears = loop_of(s), observer_tuning.gears_of(s.table, s.joint)
    # None: the joint's stiffness is declared, and no gear is unknown
    found = observer_match.in_gears(loop, gears)
    if found is None:
        return []
    # a person's own choice is refused; what the plan chose is told
    named = s.table.friction.observer.bandwidth_hz > 0
    beyond = Outcome.FAIL if named else Outcome.NOT_PROVED  # none bears gears and holds the joint as declared
    outcome = Outcome.PASS if found.ok else beyond
    meaning = (
        "least share of the damping of a motor on its gear, 20 to 100 Hz or from drive.resonance_hz on, "
        "that is left in any undamped hand of the box"
    )
    if not found.ok and not named:
        meaning = (
            f"it may ring with a {found.at}, and no bandwidth bears both it and a rigid joint in a hand: "
            "drive.resonance_hz where the joint is known to be stiffer"
        )
    elif not found.ok:
        hz = observer_match.largest_in_gears(loop, gears, observer_tuning.slower_hz(loop.bandwidth_hz))
        ways = f"friction.observer.bandwidth_hz = {hz:g}" if hz > 0 else "friction.observer.gain = 0"
        meaning = (
            f"it rings with a {found.at}: {ways}, or drive.resonance_hz where the joint is known to be "
            "stiffer"
        )
    return [
        s.row(
            "disturbance observer, gear not declared",
            f"{found.kept:.0%}",
            f">= {_kept_least():.0%}",
            outcome,
            meaning,
            _use(found),
            f"{s.where}.friction.observer: axis {s.axis.name}: at bandwidth_hz = {loop.bandwidth_hz:g} "
            f"{meaning}"
            if outcome == Outcome.FAIL
            else "",
        )
    ]


def steps_of_the_encoder(s: Subject) -> list[Verdict]:
    """One count is a pulse of speed; the observer takes it for an acceleration."""
    if not observes(s):
        return []
    # the bandwidth in force, which need not be the rig file's
    held, bandwidth_hz = _held_nm(s), s.axis.observer.bandwidth_hz
    # at rest nothing is answered (6.1): it counts while the joint moves slowly, count by count
    jump = count_torque_nm(s, bandwidth_hz)
    # without friction that is vouched for, a count moves the joint
    share = jump / held if held > 0 else math.inf
    outcome = Outcome.PASS if share <= NOISE_SHARE else Outcome.WARN if share <= NOISE_MOST else Outcome.FAIL
    remedy = f"bandwidth_hz = {down(_quiet_bandwidth(s))}, or gain = 0" if held > 0 else "gain = 0"
    meaning = "torque of one encoder count through the observer, of the least friction of the joint"
    if outcome != Outcome.PASS:
        meaning += f": friction.observer: {remedy}, or a finer encoder"
    return [
        s.row(
            "observer, one encoder count",
            f"{jump:.3g} N m",
            f"<= {NOISE_SHARE * held:.3g} N m",
            outcome,
            meaning,
            share / NOISE_SHARE,
            f"{s.where}.friction.observer.bandwidth_hz: axis {s.axis.name}: at {bandwidth_hz:g} Hz one of "
            f"{s.table.encoder_counts_per_rev:g} counts is {jump:.3g} N m, the bound is "
            f"{NOISE_SHARE * held:.3g} N m: {remedy}, or a finer encoder"
            if outcome == Outcome.FAIL
            else "",
        )
    ]


def count_torque_nm(s: Subject, bandwidth_hz: float) -> float:
    """Torque that one count makes the observer send, N m: gain (1 + r) J w_q (Delta/T) alpha, alpha of the
    faster low-pass, r the share by which the inertia is taken too high behind a late sensor (6.4)."""
    from rtctl.control.disturbance_observer import SMOOTHING
    from rtctl.control.velocity import lowpass_alpha

    T = s.period_s * s.axis.sample_ticks
    alpha = lowpass_alpha(SMOOTHING * bandwidth_hz, T)
    # a speed for one sample, and none in the next
    pulse = s.axis.count_rad / T * alpha
    inertia = (1 + s.axis.observer.excess) * s.table.inertia_kgm2
    return s.table.friction.observer.gain * inertia * 2 * math.pi * bandwidth_hz * pulse


def _quiet_bandwidth(s: Subject) -> float:
    """Largest bandwidth at which a count is below the bound, Hz: the torque rises with the bandwidth."""
    low, high = 0.0, s.axis.observer.bandwidth_hz
    # to a millionth of a millionth: printed are three digits
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (
            (middle, high) if count_torque_nm(s, middle) <= NOISE_SHARE * _held_nm(s) else (low, middle)
        )
    return low


def _held_nm(s: Subject) -> float:
    """Dry friction that holds the joint against such a step: guaranteed, without a model what may be
    compensated."""
    sure = s.axis.guarantee
    return sure.floor_nm if s.axis.friction is not None else max(s.table.dry_friction_nm, sure.peak_nm)


def bias(s: Subject) -> list[Verdict]:
    """Offset of the force sensor from which on a joint at rest would creep."""
    if not observes(s):
        return []
    from rtctl.control.disturbance_observer import TARGET_AT_REST

    observer = s.table.friction.observer
    # of the model, else what the rig file vouches for
    floor = s.axis.guarantee.floor_nm or s.table.dry_friction_nm
    # what of the friction the observer leaves at rest, (6.2)
    left = (1 - TARGET_AT_REST * observer.gain) / observer.gain
    creeps_at = (s.axis.guarantee.observer_deadband_nm + left * floor) / TARGET_AT_REST
    return [
        s.row(
            "observer, bias of the force sensor",
            f"{creeps_at:.3g} N m",
            "> offset after the tare",
            Outcome.PASS,
            "a joint at rest creeps if the sensor is off by more; the account of the compensation then "
            "stops it (friction.observer.deadband_nm, or less gain)",
        )
    ]


def observes(s: Subject) -> bool:
    """Whether the observer helps on this axis."""
    return s.axis.compensates and s.axis.force_sensor and s.table.friction.observer.gain > 0
