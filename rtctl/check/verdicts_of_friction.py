"""Tests of friction model, feed-forward and policy."""

from __future__ import annotations

import math

import numpy as np

from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.control.compensation_limit import FACTOR_LEAST, FACTOR_MOST
from rtctl.friction.policies import STANDINGS
from rtctl.rounded import down, up

HEAVIEST_HAND_KGM2 = 0.02
"""Heaviest hand of the box of hands, at the link."""

COUNT_SHARE_MAX = 1.0
"""Encoder counts per presliding length: the mock is quiet in every hand with 1.1, and shakes stiff ones with
2.2 (`rtctl experiment policies`)."""

_GATED_BY_WISH = ("hybrid", "intent")
"""Policies in which the hand's torque decides the direction."""


def energy_account(s: Subject) -> list[Verdict]:
    """Most energy that the compensation gives a hand: the account's bound, if the presliding length is
    known."""
    if not s.axis.compensates:
        return []
    sure = s.axis.guarantee
    text = (
        "all that the help with friction can give a hand over any time, whatever its sign or delay "
        f"(control.assistance); presliding {sure.length_rad * 1e3:.3g} mrad ({sure.length_source})"
    )
    if not sure.measured:
        text += ", and nobody measured it: `rtctl identify`, or friction.presliding_rad"
    if sure.may_be_shorter:
        text += "; a joint that hardly bends turns all of its friction at once: more of it is left there"
    swing_j = s.axis.friction.conservative_swing_j if s.axis.friction else 0.0
    if swing_j > 0:
        more = f"{up(swing_j * 1e3)} mJ more"
        text += f"; {more} that the conservative part gives from one place to another, and takes back"
    return [
        s.row(
            "energy account of the compensation",
            f"{up(sure.given_most_j * 1e3)} mJ",
            "presliding length known",
            Outcome.PASS if sure.measured else Outcome.NOT_PROVED,
            text,
        )
    ]


def motion_seen(s: Subject) -> list[Verdict]:
    """The account knows the motion by the encoder: it does not see a joint that vibrates within one count."""
    if not s.axis.compensates:
        return []
    length_rad = s.axis.guarantee.length_rad  # as the law has it, measured or assumed
    share, most = s.axis.count_rad / length_rad, COUNT_SHARE_MAX
    counts = math.ceil(2 * math.pi / (most * length_rad))
    remedy = f'an encoder of {counts} counts per turn of the link, or policy = "off"'
    seen = share <= most
    return [
        s.row(
            "encoder count against the presliding length",
            f"{share:.3g}",
            f"<= {most:g}",
            Outcome.PASS if seen else Outcome.FAIL,
            "so that the account of the compensation sees the joint bend before it slides"
            if seen
            else remedy,
            share / most,
            ""
            if seen
            else f"{s.where}.encoder_counts_per_rev: axis {s.axis.name}: one of "
            f"{s.table.encoder_counts_per_rev:g} counts is {share:.3g} presliding lengths, the bound is "
            f"{most:g}: {remedy}",
        )
    ]


SWINGS_OUT = "a hand that does not damp may swing out for some seconds: what is helped stops it later"
"""What no policy that helps can promise."""


def policy_at_rest(s: Subject) -> list[Verdict]:
    """A policy that shakes a hand that holds still is none for a real one."""
    if not s.axis.compensates:
        return []
    policy = s.table.friction.policy
    standing = STANDINGS[policy]  # what was measured of it, in one table for rows and documents
    # nobody holds a simulated rig, and experiments compare policies
    beyond = Outcome.WARN if s.simulated else Outcome.FAIL
    remedy = 'policy = "hybrid"' if s.axis.force_sensor else 'policy = "off", or a force sensor'
    return [
        s.row(
            "policy at rest",
            policy,
            "quiet with a hand that holds still",
            Outcome.PASS if standing.quiet else beyond,
            f"{standing.evidence}; {SWINGS_OUT}"
            if standing.quiet
            else f"{standing.evidence}; a baseline of the experiments, for no real hand: {remedy}",
            0.0,
            ""
            if standing.quiet
            else f"{s.where}.friction.policy: axis {s.axis.name}: {policy} shakes a hand that holds still "
            f"({standing.evidence}), the bound is none: {remedy}",
        )
    ]


def wish(s: Subject) -> list[Verdict]:
    """The loop of the intent over the mass of a hand."""
    table, found = s.table.friction, s.axis.friction
    if (
        not s.axis.compensates
        or not s.axis.force_sensor
        or found is None
        or table.policy not in _GATED_BY_WISH
    ):
        return []
    lead = found.feedforward_max_nm / s.axis.guarantee.intent_nm  # from the hand's torque to the motor's
    heaviest = HEAVIEST_HAND_KGM2 * s.hand  # the same hand, at this lever
    lead *= heaviest / (s.table.inertia_kgm2 + heaviest)
    lowpass_hz = table.intent_lowpass_at(1 / s.period_s)
    alpha = -math.expm1(-2 * math.pi * lowpass_hz * s.period_s)
    loop = lead * alpha / (2 - alpha)  # at half the rate a low-pass lets so much through
    passes_hz = _intent_bound_hz(lead, s.period_s)
    # whole ticks, up: a characteristic equation has no others. Without the lag of the current loop, which
    # lets pass more (83 Hz for 46 at 200 Hz and no delay) or 1 % less (2 ticks behind 100 Hz)
    late = math.ceil(s.axis.delay_ticks) + s.axis.sample_ticks - 1 + s.axis.force_way.ticks
    later_hz = _late_bound_hz(lead, late, s.period_s, s.axis.force_way.sensor_hz)
    quiet = lowpass_hz <= later_hz  # inf: any
    beyond = Outcome.FAIL if not loop < 1 else Outcome.NOT_PROVED  # a gain of NaN is refused
    meaning = (
        f"loop gain at half the rate with a hand of {heaviest:g} kg m^2: intent_lowpass_hz up to "
        f"{down(passes_hz, 4)}"
    )
    if late > 0 or s.axis.force_way.sensor_hz > 0:
        own = f" and a sensor of {s.axis.force_way.sensor_hz:g} Hz" if s.axis.force_way.sensor_hz > 0 else ""
        meaning += f", and {down(later_hz, 4)} with what is {late} ticks late{own}"
    return [
        s.row(
            "intent over the mass of a hand",
            f"{loop:.3g}",
            "< 1",
            Outcome.PASS if loop < 1 and quiet else beyond,
            meaning,
            max(loop, lowpass_hz / later_hz if later_hz > 0 else math.inf),  # 0: below .1 Hz
            ""
            if loop < 1
            else f"{s.where}.friction.intent_lowpass_hz: axis {s.axis.name}: {lowpass_hz:g} Hz lets a hand "
            f"of {heaviest:g} kg m^2 buzz at half the rate (loop gain {loop:.3g}), the bound is "
            f"{down(passes_hz, 4)} Hz: that, or a larger intent_nm",
        )
    ]


def _intent_bound_hz(lead: float, T: float) -> float:
    """Bandwidth below which `lead` alpha/(2 - alpha) < 1, Hz, rounded down."""
    if lead <= 1:  # no low-pass is needed
        return math.inf
    alpha = 2 / (1 + lead)  # lead alpha/(2 - alpha) = 1
    hz = -math.log1p(-alpha) / (2 * math.pi * T)
    return math.floor(10 * hz * (1 - 1e-9)) / 10


def _late_bound_hz(lead: float, late: int, T: float, sensor_hz: float = 0.0) -> float:
    """Bandwidth up to which the same loop settles if the torque comes `late` ticks later, behind the sensor's
    own low-pass, Hz, rounded down.

    With beta of that low-pass: z^late (z - (1 - alpha))(z - (1 - beta)) + alpha beta lead z = 0; without it
    the same with beta 1."""
    low, high, kept = 0.0, 1.0, math.exp(-2 * math.pi * sensor_hz * T) if sensor_hz > 0 else 0.0
    # 2^-30: finer than the millionth that counts as all of it, below
    for _ in range(30):
        alpha = 0.5 * (low + high)
        own = [1.0, alpha - 1.0 - kept, (1.0 - alpha) * kept, *[0.0] * late]
        own[-2] += alpha * (1.0 - kept) * lead
        roots = np.roots(own)
        low, high = (alpha, high) if np.abs(roots).max() < 1 else (low, alpha)
    if low > 1 - 1e-6:
        return math.inf
    return math.floor(-10 * math.log1p(-low) / (2 * math.pi * T)) / 10


def two_lines(s: Subject) -> list[Verdict]:
    """The feed-forward below the friction whatever its sign: told; where it fails, the account is what bounds
    it.

    Friction is credited here as F_lo v^0, which it is only in motions beyond its presliding: of smaller ones,
    where it is a spring, the test says nothing."""
    found, sure = s.axis.friction, s.axis.guarantee
    if found is None or found.feedforward_max_nm == 0:  # nothing that could be of a wrong sign
        return []
    passed = found.two_line_margin_nm >= 0  # NaN does not pass
    # the account holds whatever the sign; it rests on the presliding length
    covered = passed or (s.axis.compensates and sure.measured)
    beyond = f"in motions beyond {sure.credited_rad * 1e3:.3g} mrad; of smaller ones it says nothing"
    return [
        s.row(
            "feed-forward of any sign (two-line)",
            f"{found.two_line_margin_nm:+.4g} N m",
            ">= 0" if passed or not covered else ">= 0, or the account",
            Outcome.PASS if covered else Outcome.NOT_PROVED,
            f"passive whatever sign or delay the feed-forward errs by, {beyond}"
            if passed
            else f"of the wrong sign it would exceed the friction, {beyond}: what it can give then is "
            "bounded by the energy account, not by this",
            0.0 if covered else 1.0 - found.two_line_margin_nm / max(found.friction_floor_nm, 1e-9),
        )
    ]


def follows(s: Subject) -> list[Verdict]:
    """How far the feed-forward may follow a friction that changes: every row is judged at the largest
    factor."""
    found, per_min = s.axis.friction, s.table.friction.drift.adapt_per_min
    if not per_min > 0:  # it is not asked to follow anything
        return []
    able = found is not None and s.table.friction.policy not in ("off", "observer") and s.axis.force_sensor
    most = found.factor_max if found is not None else 1.0  # what every other row is judged at
    if not able:
        meaning = (
            "follows nothing: that takes a learned feed-forward and a force sensor "
            "(friction.drift.adapt_per_min)"
        )
    elif most < FACTOR_MOST:
        meaning = (
            "beyond it the two-line test, or the damping that the coupling is proved with, does not pass: "
            "less friction.gain and cap_share leave room (`rtctl fit --config` recommends both)"
        )
    else:
        meaning = "every row of this table holds at the largest factor, hence at all"
    return [
        s.row(
            "compensation that follows the friction",
            f"{FACTOR_LEAST:g} to {most:.3f}" if able else "1",
            f"{FACTOR_LEAST:g} to {FACTOR_MOST:g} of the learned",
            Outcome.PASS if able else Outcome.WARN,
            f"by {100 * per_min:.3g} % a minute of motion at most; {meaning}" if able else meaning,
        )
    ]


def conservative_part(s: Subject) -> list[Verdict]:
    """A joint at rest does not creep off whatever is wrong with the places: friction holds twice the
    conservative part."""
    found = s.axis.friction
    if found is None or not found.conservative_most_nm > 0:
        return []
    # compensated half a period off it doubles
    worst, least = 2 * found.conservative_most_nm, s.axis.guarantee.floor_nm
    passed = worst < least  # at rest nothing else holds it
    remedy = 'friction.place = "off", or a smaller friction.gain'
    return [
        s.row(
            "conservative part at rest",
            f"{worst:.4g} N m",
            f"< {least:.4g}",
            Outcome.PASS if passed else Outcome.FAIL,
            "twice what is compensated of it, half a period off, against the dry friction that is surely "
            "there: nothing creeps"
            if passed
            else f"half a period off it could move a joint at rest: {remedy}",
            worst / least if least > 0 else 2.0,
            ""
            if passed
            else f"{s.where}.friction.place: axis {s.axis.name}: a conservative part of "
            f"{found.conservative_most_nm:.3g} N m that is compensated half a period off moves the "
            f"joint with {worst:.3g} N m, the bound is the dry friction surely there, {least:.3g} N m: "
            f"{remedy}",
        )
    ]


def damping_and_model(s: Subject) -> list[Verdict]:
    """`viscous_nms_rad` alone may not be more than all the friction that the model was taught."""
    found = s.axis.friction
    if found is None:
        return []
    b, most = s.table.viscous_nms_rad, found.drag_nms_rad
    passed = b <= most  # NaN does not pass
    return [
        s.row(
            "viscous_nms_rad against the model",
            f"{b:.4g} N m s/rad",
            f"<= {down(most, 4)}",
            Outcome.PASS if passed else Outcome.FAIL,
            "all the friction that was measured, over speed, where that is least",
            b / most if most > 0 else 2.0,
            ""
            if passed
            else f"{s.where}.viscous_nms_rad: axis {s.axis.name}: {b:g} alone would be more than all the "
            f"friction that the model was taught at {found.drag_speed_rad_s:.3g} rad/s, the bound is "
            f"{down(most, 4)} N m s/rad: measure it again (rtctl identify), or look for a wrong unit",
        )
    ]
