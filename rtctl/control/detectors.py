"""Faults that show only over time: late ticks, old samples, an actuator that does not follow, heat.

Each is a pure function of tick, state and parameters that returns `Fault` bits; NaN never passes a
comparison that would excuse it."""

from __future__ import annotations

from rtctl.control import window
from rtctl.control.jit import compiled, inlined
from rtctl.control.records import HELD, Record
from rtctl.control.vocabulary import Fault

_F_OVERRUN = int(Fault.OVERRUN)
_F_STALLED = int(Fault.STALLED)
_F_LAG = int(Fault.ACTUATOR_LAG)
_F_WRONG = int(Fault.ACTUATOR_WRONG)
_F_HOT = int(Fault.OVERTEMPERATURE)
_F_REALTIME = int(Fault.REALTIME)
_F_OVERTORQUE = int(Fault.OVERTORQUE)
_F_AGE = int(Fault.SAMPLE_AGE)

LATE_OF_1000 = 10
"""More late ticks than this among 1000 are an OVERRUN."""

OLD_OF_1000 = 50
"""More samples older than the proof covers among 1000 ticks are a SAMPLE_AGE, as many as damaged frames are
one."""

STALL_PERIODS = 10
"""One tick this many whole periods late is STALLED. Slots of the grid that were skipped are counted: the law
reads no clock."""

LAG_SHARE = 0.2
LAG_TICKS = 20
WRONG_SHARE = 0.5
"""Gap between commanded and measured torque, as shares of the limit, and how long the smaller one may
last.

Of the limit, not of the torque: near 0 an offset of the sensor is any share of it. The range of torques sent
lately is taken, not one of them: the gate lets a torque change by all of its rate within the delay."""

WINDOW_FACTOR = 1.1
"""Mean torque of the window above this many continuous limits is OVERTORQUE."""


@compiled
def count_late(t: Record, s: Record) -> int:
    """Grid slots skipped just before this tick; keeps the counts in a row and of the last 1000 ticks."""
    # the first tick follows none: slots before it were not its
    skipped = 0 if s.ticks == 0 else max(t.missed_ticks - s.missed_ticks, 0)
    s.missed_ticks = t.missed_ticks
    s.late_ticks = s.late_ticks + 1 if skipped > 0 else 0
    s.late_count += window.push(s.late_marks, s.ticks, skipped > 0)
    return skipped


@compiled
def late_fault(s: Record, p: Record, skipped: int) -> int:
    """OVERRUN or STALLED; nothing on a rig whose late ticks are only counted."""
    if p.late_limit_ticks <= 0:  # a simulated rig without real-time rights: nobody is hurt
        return 0
    if skipped >= STALL_PERIODS:
        return _F_STALLED
    return _F_OVERRUN if s.late_ticks >= p.late_limit_ticks or s.late_count > LATE_OF_1000 else 0


@compiled
def _outside(s: Record, p: Record) -> bool:
    """True when the held sample is older than what the proof of some axis' coupling leaves beside its
    delay."""
    age_s = s.sample_age_ticks * p.period_s
    for axis in range(len(s.answer_delay)):
        if s.sample_age_ticks <= p.proof_age_ticks[axis]:  # that old the proof has them already (2.6)
            continue
        delay_s = p.declared_delay_s[axis]
        measured_s = s.answer_delay[axis] * p.period_s
        # a delay that is no number is covered by nothing
        # the worse of what was declared and what the test pulse saw
        if s.answer_count[axis] > 0 and not measured_s <= delay_s:
            delay_s = measured_s
        if p.proof_delay_s[axis] > 0.0 and not delay_s + age_s <= p.proof_delay_s[axis]:
            return True
    return False


@inlined
def age_fault(s: Record, p: Record) -> int:
    """SAMPLE_AGE while samples come too late too often.

    One that is as old as STALE is that one's matter. One that came in time but was refused because the joint
    was out of reach is JUMP's, or OVERSPEED's: a joint about as fast as its limit would otherwise be blamed
    on its device."""
    # [0]: a jump refuses the sample of all axes
    late = 0 < s.sample_age_ticks < p.stale_limit_ticks and s.jump_count[0] == 0
    old = late and _outside(s, p)
    s.old_count += window.push(s.old_marks, s.ticks, old)
    return _F_AGE if s.old_count > OLD_OF_1000 else 0


@compiled
def realtime_fault(t: Record, p: Record) -> int:
    """REALTIME while the rig runs without rights that nobody waived."""
    return _F_REALTIME if t.waiver != 0 and not p.waiver_share > 0.0 else 0


@compiled
def remember_torque(s: Record, axis: int) -> None:
    """Keep the torque just sent for `follow_fault`."""
    s.held_nm[axis, s.ticks % HELD] = s.torque_applied_nm[axis]


@compiled
def held_torque(s: Record, axis: int, ticks_ago: int) -> float:
    """Torque sent this many ticks before the present one (1: the last), N m."""
    return float(s.held_nm[axis, (s.ticks - ticks_ago) % HELD])


@inlined
def follow_fault(t: Record, s: Record, p: Record, axis: int, elapsed: int, skipped: int) -> int:
    """ACTUATOR_LAG or ACTUATOR_WRONG: does the measured torque lie among those sent lately?

    Notes
    -----
    The measurement may show any torque sent since the last valid sample, or within the declared delay
    before it, or, after skipped slots, the zero of a device whose time to live ran out. Its distance from
    that range is the gap."""
    if p.follow_kind[axis] == 0 or elapsed == 0:
        return 0
    low = high = 0.0 if skipped > 0 else held_torque(s, axis, 1)  # a device may have let go meanwhile
    for ago in range(1, min(elapsed + p.follow_delay_ticks[axis], HELD) + 1):
        torque = held_torque(s, axis, ago)
        low, high = min(low, torque), max(high, torque)
    measured = t.motor_torque_nm[axis]
    gap = max(low - measured, measured - high, 0.0)
    limit = p.torque_limit_nm[axis]
    s.lag_ticks[axis] = 0 if gap <= LAG_SHARE * limit else s.lag_ticks[axis] + 1
    if not gap <= WRONG_SHARE * limit:  # NaN is wrong
        return _F_WRONG
    return _F_LAG if s.lag_ticks[axis] >= LAG_TICKS else 0


@compiled
def temperature_share(t: Record, s: Record, p: Record, axis: int) -> float:
    """Share of the torque limit that the motor's temperature leaves: 1 up to the warning, 0 at the trip.

    A sensor that is configured and silent (NaN) keeps the last share; `temperature_fault` counts it."""
    if p.temperature_kind[axis] == 0:
        return 1.0
    temperature = t.temperature_c[axis]
    if not -100.0 < temperature < 500.0:  # NaN is in no range
        s.cold_ticks[axis] += 1
        return 1.0 - s.heat_share[axis]
    s.cold_ticks[axis] = 0
    warn, trip = p.temperature_warn_c[axis], p.temperature_trip_c[axis]
    # the share taken, not left: a zeroed state leaves all
    s.heat_share[axis] = min(max((temperature - warn) / (trip - warn), 0.0), 1.0)
    return 1.0 - s.heat_share[axis]


@compiled
def temperature_fault(s: Record, p: Record, axis: int) -> int:
    """OVERTEMPERATURE at the trip, or when the configured sensor is silent as long as a stale sample."""
    if p.temperature_kind[axis] == 0:
        return 0
    silent = s.cold_ticks[axis] >= p.stale_limit_ticks
    return _F_HOT if silent or not s.heat_share[axis] < 1.0 else 0


@compiled
def window_fault(s: Record, p: Record, axis: int) -> int:
    """OVERTORQUE while the mean of 250 ms is above what the gate defends."""
    continuous = p.torque_continuous_nm[axis]
    return _F_OVERTORQUE if s.window_mean_nm[axis] > WINDOW_FACTOR * continuous else 0
