"""Whether what the model says of place is what the force sensor sees: nothing is compensated by place until
it is.

    e = F_seen - LP[d F_0(v)],     m = LP[d F_place(v, x) - tau_c(x)]     over sliding motion, d its direction

LP is the observer's own low-pass: what passes as quick as its bandwidth is seen weaker and an eighth of a
wave late, and is compared with what the model would be seen as.

An encoder that counts from where it was switched on, an index that was found half a turn off, a gear taken
apart: all leave a model that is right in speed and wrong in place. So mean and spread of e and m are followed
over the way, forgotten over `place_length_rad`: where m explains e, their slope cov/var(m) is near 1 and
their correlation high. `place_kind` SEEN trusts a model once they are, and as far; what was trusted stays so
where noise drowns what one place says, as long as the slope fits and so much noise would leave a whole turn
its correlation. GIVEN (an absolute encoder) trusts it from the start, until the slope says that it is wrong.
The mean of each direction is left out: it is what friction has drifted, and says nothing of place. A way that
stays at one place says little, and counts by what it says. Waves of tau_c that pass quicker than the observer
sees at any speed are not in m: with SEEN they are never compensated.

The compensation by place is a share of what is trusted; energy does not depend on it (`assistance`,
`dry_friction`: what they credit is the friction at the weakest place)."""

from __future__ import annotations

import math

from rtctl.control.dry_friction import slides
from rtctl.control.friction_curve import BACKWARD, FORWARD
from rtctl.control.handle import own_rad
from rtctl.control.jit import compiled
from rtctl.control.place_friction import conservative_torque, curve_and_place
from rtctl.control.records import Record
from rtctl.control.vocabulary import PlaceUse

_SEEN = int(PlaceUse.SEEN)
_GIVEN = int(PlaceUse.GIVEN)

SLOW_RAD_S = 0.02
"""Slower motion is not looked at: creep."""

CORRELATION_LOW, CORRELATION_FULL = 0.5, 0.8
"""Correlation from which a model is trusted, and trusted in full."""

SLOPE_LOW, SLOPE_HIGH = 0.5, 1.6
"""Slope between which it is."""

WRONG_SLOPE = 0.25
"""Slope below which a model that was given is wrong."""

SMALLEST_NM = 0.002
"""A place that should matter less than this over the way says nothing."""


@compiled
def place_of(s: Record, p: Record, axis: int) -> float:
    """Position of the joint in the model's places, rad."""
    return s.position_rad[axis] - p.place_shift_rad[axis]


@compiled
def place_trust(s: Record, p: Record, axis: int) -> float:
    """Share of what the model says of place that is believed, 0 to 1."""
    kind = p.place_kind[axis]
    if kind == _SEEN:
        return s.place_evidence[axis]
    return 1.0 - s.place_evidence[axis] if kind == _GIVEN else 0.0


@compiled
def _as_seen(s: Record, p: Record, model: Record, axis: int, d: float, side: int, speed: float) -> bool:
    """Go on with what the model says of speed and of this place as the observer shows it; whether it says
    something."""
    x = place_of(s, p, axis)
    curve, place = curve_and_place(model, side, speed, x)
    curve, place = d * curve, d * place  # a torque on the joint: with the sign of the motion
    if p.conservative_judged[axis] > 0.0:  # waves too quick for the observer would count as error
        place -= conservative_torque(model, x)
    if not math.isfinite(curve + place):  # else a NaN would stay in the low-passes
        return False
    s.place_model_nm[axis, 0] += p.observer_alpha[axis] * (curve - s.place_model_nm[axis, 0])
    s.place_model_nm[axis, 1] += p.observer_alpha[axis] * (place - s.place_model_nm[axis, 1])
    return True


@compiled
def judge_place(t: Record, s: Record, p: Record, model: Record, axis: int, dx: float) -> None:
    """Go on with the statistics by the last period's motion `dx`, rad; reads the friction observed of the
    tick."""
    v, length = t.velocity_rad_s[axis], p.place_length_rad[axis]
    if p.place_kind[axis] == 0 or not length > 0.0 or not p.observer_alpha[axis] > 0.0:
        return
    speed, side = abs(v), FORWARD if v >= 0.0 else BACKWARD
    d = 1.0 if v >= 0.0 else -1.0
    if not _as_seen(s, p, model, axis, d, side, speed) or dx == 0.0:  # the low-passes go on at rest, too
        return
    sliding = slides(s, axis) and s.bristle_share[axis] * v > 0.0  # and the direction is sure
    if (
        not sliding
        or not own_rad(p, axis, SLOW_RAD_S) < speed < p.place_speed_rad_s[axis]
        or speed > model.speed_max_rad_s[side]
    ):
        return
    e, m = s.friction_observed_nm[axis] - s.place_model_nm[axis, 0], s.place_model_nm[axis, 1]
    if not math.isfinite(e + m):
        return
    way = min(abs(dx) / length, 0.1)  # a jump of the encoder is a tenth of what is known, at most
    s.place_way[axis] = min(s.place_way[axis] + way, 1.0)
    share = way / s.place_way[axis]  # a plain mean at first, then forgotten over the way
    off, off_model = e - s.place_mean_nm[axis, side, 0], m - s.place_mean_nm[axis, side, 1]
    # twice: each direction sees half of the way
    s.place_mean_nm[axis, side, 0] += min(2.0 * share, 1.0) * off
    s.place_mean_nm[axis, side, 1] += min(2.0 * share, 1.0) * off_model
    s.place_square_nm2[axis, 0] += share * (off * off - s.place_square_nm2[axis, 0])
    s.place_square_nm2[axis, 1] += share * (off_model * off_model - s.place_square_nm2[axis, 1])
    s.place_square_nm2[axis, 2] += share * (off * off_model - s.place_square_nm2[axis, 2])
    # by way and not by time: a joint that stands learns nothing of places
    if s.place_way[axis] >= 1.0:  # not sooner: a short way correlates by chance
        s.place_evidence[axis] += way * _telling(s, p, axis) * (_target(s, p, axis) - s.place_evidence[axis])


@compiled
def _whole_nm2(p: Record, axis: int) -> float:
    """Mean square of what the model says of places over a whole turn, as one wave as deep as its trough has
    it."""
    return 0.5 * p.place_trough_nm[axis] * p.place_trough_nm[axis]


@compiled
def _telling(s: Record, p: Record, axis: int) -> float:
    """How much the last way says of the places, 0 to 1: its spread of them over that of a whole turn,
    squared."""
    whole = _whole_nm2(p, axis)
    return min(s.place_square_nm2[axis, 1] / whole, 1.0) if whole > 0.0 else 1.0


@compiled
def _believed(square: float, left: float) -> float:
    """Share that a correlation is believed by, 0 to 1, of places of this mean square beside what they leave
    over."""
    correlation = math.sqrt(square / max(square + left, 1e-30))
    return min(max((correlation - CORRELATION_LOW) / (CORRELATION_FULL - CORRELATION_LOW), 0.0), 1.0)


@compiled
def _target(s: Record, p: Record, axis: int) -> float:
    """Where the evidence is going: trust of SEEN, doubt of GIVEN."""
    now, model, both = s.place_evidence[axis], s.place_square_nm2[axis, 1], s.place_square_nm2[axis, 2]
    if not model > SMALLEST_NM * SMALLEST_NM:
        return now
    slope = both / model
    if p.place_kind[axis] == _GIVEN:
        return 1.0 if slope < WRONG_SLOPE else 0.0
    left = max(s.place_square_nm2[axis, 0] - slope * both, 0.0)
    if not SLOPE_LOW < slope < SLOPE_HIGH:
        # a slope that does not fit takes trust away as far as noise does not explain it
        return now * left / (left + model)
    turned = slope * slope * max(model, _whole_nm2(p, axis))  # what a whole turn would show beside this noise
    return min(max(now, _believed(slope * both, left)), _believed(turned, left))


@compiled
def conservative_feedforward(t: Record, s: Record, p: Record, model: Record, axis: int, fade: float) -> float:
    """Torque against the conservative part, N m: a spring, kept apart from the help with friction; NaN stays
    NaN."""
    gain = p.conservative_gain[axis]
    if not gain > 0.0:
        return 0.0
    trust = place_trust(s, p, axis)
    if trust <= 0.0:  # nor is a NaN of the model asked for then
        return 0.0
    return -t.compensation[axis] * gain * trust * fade * conservative_torque(model, place_of(s, p, axis))
