"""The simulated rig, compiled: `plant_read` and `plant_write` are all a closed loop needs.

Signs as in the tick record: link side, a torque is positive when it accelerates towards positive angle.
The plant lives on the loop's grid: a read at slot k sees the rig at time k T, the write of slot k holds
its current over [k T, (k+1) T). Missed slots are caught up at the next read with the current still held,
until its time to live ends."""

from __future__ import annotations

import math

import numpy as np

from hw import scripted_faults as faults
from hw.simulators import mock_hand
from hw.simulators.jit import compiled, inlined
from hw.simulators.mock_bristles import coupled_step, implicit_share
from hw.simulators.mock_force_filter import advance_force
from hw.simulators.mock_joint import advance_detailed, is_detailed
from hw.simulators.mock_records import DELAY_LINE
from hw.simulators.mock_sensors import hold_sample, sense_axes, sense_force

CATCH_UP_TICKS = 50
"""Up to so many missed periods are simulated one by one, and as many more as the motor may still hold torque.
What remains of a longer gap is simulated in one go, in as many steps as this number of periods has."""

_AT_ONCE = 1e-6
"""A fraction of the transport delay below this share of a period counts as zero: a step of that length would
do nothing."""


@inlined
def _advance_axis(
    s: np.record, p: np.record, axis: int, time_s: float, duration_s: float, steps: int
) -> None:
    """Advance one axis by `duration_s` in equal `steps` under its present motor current."""
    # steps of one length end on the grid of the loop: a sample is of its slot, not near it
    h = duration_s / steps
    rate = 1.0 / h
    x, v, z = s.position_rad[axis], s.velocity_rad_s[axis], s.bristle_rad[axis]
    k_h, b_h, m_h = mock_hand.hold(time_s, p, axis)
    # the hand's wish, linear over the duration: 4e-7 rad off at 1 kHz on the fast sine
    x_d, v_d = s.hand_position_rad[axis], s.hand_velocity_rad_s[axis]
    x_end, v_end = mock_hand.wanted(time_s + duration_s, p, axis)
    dx, dv = (x_end - x_d) / steps, (v_end - v_d) / steps
    inertia = p.inertia_kgm2[axis] + m_h
    motor, friction = s.motor_torque_nm[axis], s.friction_torque_nm[axis]
    # the most that may damp: by it the step is chosen implicit enough to be stable
    damping = b_h + p.bristle_damping_nms_rad[axis] + p.viscous_nms_rad[axis] + p.thinning_nms_rad[axis]
    share = implicit_share(inertia, damping, k_h + p.bristle_stiffness_nm_rad[axis], h)
    drag = b_h + share * h * k_h
    a = (motor + s.hand_torque_nm[axis] - friction) / p.inertia_kgm2[axis]
    ripple = p.ripple_nm[axis]
    for _ in range(steps):
        torque = motor + k_h * (x_d + share * dx - x) + b_h * (v_d + share * dv)
        # most rigs have none, and a sine in each step takes longer than a comparison
        if ripple != 0.0:
            torque += ripple * math.sin(p.ripple_per_rad[axis] * (x + (1.0 - share) * h * v))
        v_before = v
        v, z, v_step, friction = coupled_step(v, z, x, a, torque, drag, inertia, h, share, p, axis)
        a = (v - v_before) * rate
        x += h * v_step
        x_d += dx
        v_d += dv
    s.position_rad[axis], s.velocity_rad_s[axis], s.bristle_rad[axis] = x, v, z
    s.friction_torque_nm[axis] = friction
    hand_torque = k_h * (x_end - x) + b_h * (v_end - v)
    if m_h > 0.0:
        # between hand and handle: the hand's own mass is on the hand's side of the sensor
        pull = motor - friction + ripple * math.sin(p.ripple_per_rad[axis] * x)
        hand_torque -= m_h * (hand_torque + pull) / inertia
    s.hand_torque_nm[axis] = hand_torque
    s.hand_position_rad[axis], s.hand_velocity_rad_s[axis] = x_end, v_end


@inlined
def _drive_axis(
    s: np.record, p: np.record, axis: int, time_s: float, duration_s: float, steps: int, wanted_a: float
) -> None:
    """Advance one axis by `duration_s` while its amplifier is asked for `wanted_a`."""
    current, direction = wanted_a, 1.0
    if p.fault_count > 0:
        current, direction = faults.driven(s, p, axis, s.tick - s.first_tick, current, s.current_a[axis])
    if is_detailed(p, axis):
        per_a = direction * p.torque_per_ampere[axis]
        advance_detailed(s, p, axis, time_s, duration_s, steps, current, per_a)
        return
    s.current_a[axis] = current
    s.motor_torque_nm[axis] = direction * current * p.torque_per_ampere[axis]
    _advance_axis(s, p, axis, time_s, duration_s, steps)


@compiled
def _delayed(p: np.record, axis: int) -> tuple[int, float]:
    """Transport delay of the current: whole periods, and the share of one on top."""
    delay = p.torque_delay_ticks[axis] + p.transport_delay_ticks
    whole = math.floor(delay)
    share = delay - whole
    if whole >= DELAY_LINE - 1:
        return DELAY_LINE - 1, 0.0
    return int(whole), share if share > _AT_ONCE else 0.0


@compiled
def advance(s: np.record, p: np.record, periods: int, steps: int) -> None:
    """Advance all axes by whole `periods` in equal `steps`, the delay line by one place."""
    time_s = (s.tick - s.first_tick) * p.period_s
    s.held_ticks += periods
    for axis in range(len(s.position_rad)):
        line = s.current_line_a[axis]
        # the newest place of the line alone: what is on its way to the motor still arrives
        if s.held_ticks > p.time_to_live_ticks:
            line[0] = 0.0
        whole, share = _delayed(p, axis)
        if s.held_ticks > p.time_to_live_ticks + math.ceil(whole + share):
            s.current_a[axis] = 0.0  # the watchdog opens the bridge: no current is left to decay
        duration_s = periods * p.period_s
        if share > 0.0:
            # the current that comes within this period acts from there on, in sub-steps of its own
            late, early = max(1, math.ceil(share * steps)), max(1, math.ceil((1.0 - share) * steps))
            _drive_axis(s, p, axis, time_s, share * duration_s, late, line[whole + 1])
            time_on_s, rest_s = time_s + share * duration_s, (1.0 - share) * duration_s
            _drive_axis(s, p, axis, time_on_s, rest_s, early, line[whole])
        else:
            _drive_axis(s, p, axis, time_s, duration_s, steps, line[whole])
        for k in range(DELAY_LINE - 1, 0, -1):
            line[k] = line[k - 1]
    advance_force(s, p, periods)
    s.tick += periods


@compiled
def _catch_up(s: np.record, p: np.record, tick: int) -> None:
    """Advance over missed slots, so that the rig stands at slot `tick`. Bounded work."""
    if s.started == 0:
        s.started = 1
        s.first_tick = tick
        # where the loop is: one that begins at another slot has missed none before it
        s.tick, s.sensed_tick = tick, tick - 1
        for axis in range(len(s.position_rad)):
            s.hand_position_rad[axis], s.hand_velocity_rad_s[axis] = mock_hand.wanted(0.0, p, axis)
    # behind the time to live the line of currents runs empty: in one go it would move by one place only
    for _ in range(min(tick - s.tick, max(CATCH_UP_TICKS, p.time_to_live_ticks + DELAY_LINE))):
        advance(s, p, 1, p.substeps)
    rest = tick - s.tick
    # the last of them by themselves again: a late force sensor shows one of each
    late = min(rest, p.force_delay_ticks)
    if rest > late:
        # torque-free by now, and the implicit step is stable
        advance(s, p, rest - late, CATCH_UP_TICKS * p.substeps)
    for _ in range(late):
        advance(s, p, 1, p.substeps)


@compiled
def plant_read(tick: np.ndarray, state: np.ndarray, params: np.ndarray) -> int:
    """Write what the sensors show at slot `tick[0].tick` into the tick's backend fields. Returns 0: it always
    can."""
    t, s, p = tick[0], state[0], params[0]
    _catch_up(s, p, t.tick)
    t.link_faults = 0
    time_s = (s.tick - s.first_tick) * p.period_s
    # a half-open interval: equal ends are never
    t.estop = 1 if p.estop_from_s <= time_s < p.estop_to_s else 0
    periods, s.sensed_tick = s.tick - s.sensed_tick, s.tick
    sense_axes(t, s, p, periods)
    sense_force(t, s, p, periods)
    if p.sample_every_ticks > 1:
        hold_sample(t, s, p)
    else:
        s.sample_count += 1
        t.sample_count = s.sample_count
    if p.fault_count > 0:
        faults.inject(t, s, p, s.tick - s.first_tick)
    return 0


@compiled
def _take_current(t: np.record, s: np.record, p: np.record) -> None:
    """Take over the current sent."""
    s.held_ticks = 0
    for axis in range(len(t.current_command_a)):
        current = t.current_command_a[axis]
        if t.enabled == 0 or not math.isfinite(current):
            current = 0.0
        # after the command is known to be finite: min and max of NaN are NaN
        limit = p.current_max_a[axis]
        s.current_line_a[axis, 0] = min(max(current, -limit), limit)


@compiled
def plant_write(tick: np.ndarray, state: np.ndarray, params: np.ndarray) -> int:
    """Apply `current_command_a` (zero unless `enabled`) and advance the rig to slot `tick[0].tick` + 1.

    A current that is not finite counts as zero, as a drive would refuse it; the amplifier saturates at
    `current_max_a`. Writing a slot twice, or an older one, moves nothing. Returns 0: it always can."""
    t, s, p = tick[0], state[0], params[0]
    _catch_up(s, p, t.tick)
    if p.fault_count > 0:
        s.fault_enabled_ticks = s.fault_enabled_ticks + 1 if t.enabled != 0 else 0
    if p.fault_count == 0 or s.fault_unplugged == 0:
        _take_current(t, s, p)
    # once a slot: a loop that writes twice must not make the rig run twice as fast
    if s.tick == t.tick:
        advance(s, p, 1, p.substeps)
    return 0


@compiled
def next_slot(tick: np.ndarray, state: np.ndarray) -> None:
    """Go on to the slot that follows in virtual time, past those that a scripted stall makes the loop
    miss."""
    missed = state[0].fault_stall_ticks
    tick[0].missed_ticks += missed
    tick[0].tick += 1 + missed
