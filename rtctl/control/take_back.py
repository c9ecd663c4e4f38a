"""No more torque than the energy account can pay for until the gate has taken it back.

The gate lets a torque fall by r per tick, whatever the law wants by then. Torque f that is still held while
the joint runs along with it, at most at w = OVERSPEED_FACTOR v_max T per tick, gives out at worst

    c(f) = w (f + (f - r) + (f - 2 r) + ...)  <=  w f                        f <= r
                                                  w (f^2/(2 r) + f/2 + r/8)  f > r

A stiff spring behind a slow gate is a source for that reason, though the spring itself is passive: where the
joint is faster than r/(k T) the torque lags. So the torque held is bounded by the account E (`passivity`):

    c(|f|) <= E + FLOOR_FACTOR budget    or    |f| <= |f before| - r                                     (1)

Claim: E >= -FLOOR_FACTOR budget at all times, for any law, hand and environment, as long as the joint moves
by at most w per tick and every sample arrives. Proof: let c(|f|) <= A = E + FLOOR_FACTOR budget hold, f be
the torque sent. One period takes at most w |f| from A (or all of f's cost where |f| <= r); everything else
that `observe_port` does adds to A, and its cap leaves it c(|f|). As c(|f| - r) <= c(|f|) - w |f| for |f| > r,
(1) allows a torque for which the inequality holds again, and A >= c >= 0.

A motor that acts d ticks late still gives what was sent: w |f| for each torque in flight comes to c in (1)
and in the cap. A period then takes the oldest of them from A and from what is asked for, so that the claim
holds as before, E by the torque that acted.

OVERSPEED is why w is enough: above v_max the gate cuts any torque that drives, above OVERSPEED_FACTOR v_max
every one. A late loop or a missed sample holds a torque for longer than (1) knows; the faults of `passivity`
remain for them."""

from __future__ import annotations

import math

from rtctl.control.jit import compiled
from rtctl.control.records import HELD, Record

LATE_MOST = HELD - 12
"""Most ticks by which a torque counts as late: those of a sample that took some ticks must be remembered,
too. Twelve: a sample of ten ticks, and one torque more at either end where the delay is not whole
(`acted_torque`)."""

FLOOR_FACTOR = 1.5
"""No port gives out more than this many budgets (safety contract, invariant 13)."""

OVERSPEED_FACTOR = 1.2
"""Above this many v_max the torque is cut (safety contract)."""


@compiled
def cost(torque: float, rate: float, way: float) -> float:
    """c(|torque|), J; infinite for NaN. `rate` N m per tick, `way` rad per tick."""
    size = abs(torque)
    if size <= rate:  # gone within one tick
        return way * size
    if not (rate > 0.0 and math.isfinite(size)):  # after `<=`, which NaN does not pass
        return math.inf
    # n + 1 terms f - i r add up to (n + 1) f - r n (n + 1)/2, at most (f + r/2)^2/(2 r), at n = f/r - 1/2
    return way * (size * size / (2.0 * rate) + 0.5 * size + 0.125 * rate)


@compiled
def most_torque(left: float, rate: float, way: float) -> float:
    """Largest f, N m, of which c(f) <= `left` J; 0 for NaN. `rate` N m per tick, `way` rad per tick."""
    if not (left > 0.0 and rate > 0.0):
        return 0.0
    if left <= way * rate:
        return left / way
    # c jumps at r, from w r to 9/8 w r: what is left in between pays for r and no more
    return max(rate, math.sqrt(2.0 * rate * left / way) - 0.5 * rate)  # c(f) solved for f


@compiled
def _way(p: Record, axis: int) -> float:
    """Most that the joint moves in one tick, rad."""
    return OVERSPEED_FACTOR * p.velocity_limit_rad_s[axis] * p.period_s


@compiled
def cost_to_take_back(p: Record, axis: int, torque: float) -> float:
    """Most energy that `torque`, N m, gives out until the gate has taken it back, J; infinite for NaN."""
    return cost(torque, p.torque_rate_nm[axis], _way(p, axis))


@compiled
def torque_to_take_back(p: Record, axis: int, energy: float) -> float:
    """Largest |torque| that an account of `energy`, J, can pay for, N m, >= 0; 0 for NaN."""
    left = energy + FLOOR_FACTOR * p.energy_budget_j
    return most_torque(left, p.torque_rate_nm[axis], _way(p, axis))


@compiled
def acting_delay(p: Record, axis: int) -> float:
    """Ticks by which the torque acts late, as far as is declared, not whole."""
    return float(min(max(p.acting_delay_s[axis] / p.period_s, 0.0), LATE_MOST))


@compiled
def acted_torque(s: Record, p: Record, axis: int, ticks: int) -> float:
    """Mean torque that the motor held over the last so many periods, N m: the one sent last, or earlier ones
    where it acts late."""
    late = acting_delay(p, axis)
    if late == 0.0:
        return float(s.torque_applied_nm[axis])
    whole, total = int(late), 0.0
    share, ticks = late - whole, min(max(ticks, 1), HELD - LATE_MOST - 2)  # what the ring still holds
    for k in range(1, ticks + 1):
        at = s.ticks - k - whole
        total += (1.0 - share) * s.held_nm[axis, at % HELD] + share * s.held_nm[axis, (at - 1) % HELD]
    return total / ticks


@compiled
def in_flight(s: Record, p: Record, axis: int) -> float:
    """Most energy that torques which were sent and have not acted yet give out, J."""
    late = acting_delay(p, axis)
    whole = int(late)
    # of the oldest a part has acted
    total = (late - whole) * abs(s.held_nm[axis, (s.ticks - 1 - whole) % HELD])
    for k in range(1, whole + 1):
        total += abs(s.held_nm[axis, (s.ticks - k) % HELD])
    return _way(p, axis) * total
