"""An observer that feeds a vibration beside the motion is taken back until it does not.

    v~ = v - LP v,   c~ = c - LP c                   of velocity and observer's torque as it acted; 3 Hz
    E <- min(E + (FED_MOST b v~^2 - c~ v~) T + (bank - E) T/FORGOTTEN_S, bank)
                                                     `TURN_S` after the joint last turned, while it slides;
                                                     of a stand once it goes on the same way
    share = clip(1 + E/bank, 0, 1)                   of the observer that is sent

Why. The certificate has every hand and every gear keep a quarter of its damping, on a joint that slides, by
eigenvalues. Dry friction that falls with speed is no linear loop: a joint that sticks and slips about a slow
motion leaves the observer's low-passes behind at each slip, and is pushed on by what held it before. Rigid
Coulomb friction in undamped hands at .03 and .08 rad/s was shaken so by 65 to 94 mrad/s beside the motion
(33 to 43 without help, 9 to 33 with the feed-forward alone, which has no lag). The same question is asked of
the motion as it is, then: does the observer take more than `FED_MOST` of the joint's own viscous damping from
what is quicker than a hand?

- Friction that is constant in sliding takes nothing from a vibration, so an observer that is right gives it
  nothing. In a turn friction takes, and the observer gives: nothing is counted there.
- A stand that ends in a turn is part of it. Where friction holds without bending it turns with the hand's
  push before the joint does, and the observer with it, while the low-passes remember how the joint stopped:
  each turn counted as one and a half banks, and an observer alone had a third of its torque for .5 s.
- It is not asked of the feed-forward, which lags by nothing and goes by the speed: beside a sine of a hand
  its torque falls while the joint is quick, which counts as feeding.
- What is fed is forgotten within seconds, so that the share settles where about a bank is fed in
  `FORGOTTEN_S`.

Less help breaks no proof. A virtual mass has a watch of its own."""

from __future__ import annotations

import math

from rtctl.control.display import is_admittance
from rtctl.control.dry_friction import slides
from rtctl.control.handle import own_rad
from rtctl.control.jit import compiled
from rtctl.control.records import HELD, Record
from rtctl.control.states import is_powered

BESIDE_TIMES = 1.5
"""What is slower than so many times `resting.REST_HZ` is the motion itself: 3 Hz."""

FED_MOST = 0.75
"""Share of the joint's own damping that help may take from a vibration: what the certificate lets it take
(`observer_margin.KEPT_LEAST`)."""

BANK_RAD = 0.001
"""The bank is what friction takes over this way."""

TURN_S = 0.2
"""After a turn its step of friction is gone from the low-passes."""

FORGOTTEN_S = 2.0


@compiled
def _feed(s: Record, p: Record, axis: int, bank: float, elapsed: int) -> None:
    """Take in the period up to this sample; what is no number leaves an empty account."""
    T = p.period_s * elapsed
    late = min(max(p.actuator_delay_ticks[axis], 0), HELD - 3)
    v = (s.position_rad[axis] - s.position_before_rad[axis]) / T - s.fed_rad_s[axis]
    acted = s.fed_sent_nm[axis, (s.ticks - 1 - late) % HELD] - s.fed_nm[axis]
    # the same for both: a lag between them would make power
    alpha = min(BESIDE_TIMES * p.rest_alpha[axis] * elapsed, 1.0)
    s.fed_rad_s[axis] += alpha * v
    s.fed_nm[axis] += alpha * acted
    forgotten = min(T / FORGOTTEN_S, 1.0)
    energy = s.fed_j[axis] + forgotten * (bank - s.fed_j[axis])
    s.fed_standing_j[axis] -= forgotten * s.fed_standing_j[axis]
    if slides(s, axis):
        if s.bristle_share[axis] != s.fed_side[axis]:  # of one direction: a turn begins anew
            s.fed_slid_s[axis] = s.fed_standing_j[axis] = 0.0
            s.fed_side[axis] = s.bristle_share[axis]
        else:
            s.fed_slid_s[axis] += T
        if s.fed_slid_s[axis] > TURN_S:
            # what viscous damping may lose, less what is fed
            s.fed_standing_j[axis] += (FED_MOST * p.viscous_nms_rad[axis] * v - acted) * v * T
        if s.rest_ticks[axis] == 0:  # it goes on as it went before it stood: a stick and a slip
            energy += s.fed_standing_j[axis]
            s.fed_standing_j[axis] = 0.0
    if not math.isfinite(energy + s.fed_standing_j[axis] + s.fed_rad_s[axis] + s.fed_nm[axis]):
        energy = s.fed_standing_j[axis] = s.fed_rad_s[axis] = s.fed_nm[axis] = 0.0
    s.fed_j[axis] = max(min(energy, bank), -bank)  # at -bank nothing is sent: more debt would only last


@compiled
def unfed_share(s: Record, p: Record, axis: int, elapsed: int) -> float:
    """Advance the account; return the share of the observer that is left, 0 to 1. It is full without
    power."""
    bank = p.paying_nm[axis] * own_rad(p, axis, BANK_RAD)
    if not bank > 0.0:
        return 1.0
    if not is_powered(s.state) or is_admittance(s, axis):
        s.fed_j[axis] = bank
        s.fed_rad_s[axis] = s.fed_nm[axis] = s.fed_slid_s[axis] = s.fed_standing_j[axis] = 0.0
        return 1.0
    if elapsed > 0:
        _feed(s, p, axis, bank, elapsed)
    return min(max(1.0 + s.fed_j[axis] / bank, 0.0), 1.0)
