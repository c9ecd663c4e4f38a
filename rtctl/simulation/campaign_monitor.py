"""The invariants of the safety contract, judged from outside, tick by tick.

Nothing here is taken from the law: states, reactions and bounds are written down once more, from the
contract. `watch` returns one bit per violated invariant, by the contract's number."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from rtctl.control.records import Record
from rtctl.control.vocabulary import Fault, Program, State
from rtctl.simulation.jit import compiled

_IDLE, _ARMING, _ACTIVE = int(State.IDLE), int(State.ARMING), int(State.ACTIVE)
_HOLD, _STOPPING, _FAULT = int(State.HOLD), int(State.STOPPING), int(State.FAULT)
_ESTOP, _LOCKOUT = int(State.ESTOP), int(State.LOCKOUT)
_OFF, _BRAKE = int(Program.OFF), int(Program.BRAKE)

# written down once more: a fault that the law's own table gives the wrong reaction shows
_CUT = int(
    Fault.STALE | Fault.BAD_SAMPLE | Fault.JUMP | Fault.CHECKSUM | Fault.LINK_LOST | Fault.DEVICE
    | Fault.ACTUATOR_WRONG | Fault.OVERSPEED | Fault.STALLED | Fault.PASSIVITY_GROSS | Fault.WIRING
    | Fault.ARMING_MOVED | Fault.CURRENT | Fault.LAW_NOT_FINITE | Fault.GATE | Fault.ESTOP | Fault.VELOCITY
)  # fmt: skip
_RAMP = int(
    Fault.ACTUATOR_LAG | Fault.OVERTORQUE | Fault.OVERTEMPERATURE | Fault.OVERRUN | Fault.PASSIVITY
    | Fault.TARGET_LOST | Fault.DELAY | Fault.SAMPLE_AGE | Fault.HOST_SILENT
    | Fault.FORCE_FROZEN | Fault.FORCE_CLIPPED | Fault.FORCE_OFFSET | Fault.OFF_AXIS
)  # fmt: skip

STOP_TICKS = 51
ROUNDING = 1e-9

INVARIANTS = {
    1: "torque leaves only in ACTIVE, HOLD, STOPPING (5 % in ARMING), from a sample at most 2 ticks old",
    2: "the encoded torque is within the limit",
    3: "the torque changes by at most its rate, or is cut to zero",
    4: "what is sent is finite",
    5: "disabled states send torque 0 and enable 0",
    6: "ACTIVE comes only from ARMING or HOLD, ARMING only from IDLE by a fresh request of the present epoch",
    7: "a restart or a cleared cause does not arm",
    8: "a cut acts in its tick; a ramp is monotone and ends in 50 ticks",
    9: "the first cause is kept",
    10: "only targets of the lease holder and the present epoch have an effect; a program begins by a "
    "fresh request of that epoch in ACTIVE and ends with it",
    13: "no port gives out more than 1.5 budgets",
    14: "feed-forward and friction observer together stay under their cap, and are zero outside the "
    "trained range; the factor of the friction that is followed stays within its bounds",
    15: "torque times velocity is not positive above v_max",
    18: "a stop disables within 51 ticks",
    19: "a fault does not raise the torque in the tick that detects it",
    20: "a device that hears nothing is without torque after its time to live",
    21: "a passive hand is given, since arming, at most the renderer's store, its power times the time, "
    "and 1.5 budgets",
}


@cache
def memory_dtype(n_axes: int) -> np.dtype[np.void]:
    """What the monitor remembers of the ticks before."""
    axis = (n_axes,)
    return np.dtype(
        [
            ("ticks", "<i8"),
            ("state", "<i8"),
            ("epoch", "<i8"),
            ("faults", "<i8"),
            ("fault_first", "<i8"),
            ("arm_count", "<i8"),
            ("stop_count", "<i8"),
            ("target_count", "<i8"),
            ("stop_age", "<i8"),  # ticks since a stop was asked for while powered; -1: none pending
            ("ramp_age", "<i8"),
            ("lease", "<i8"),
            ("silent", "<i8"),
            ("has_target", "<i8"),
            ("torque_nm", "<f8", axis),
            ("target_rad", "<f8", axis),
            ("program_count", "<i8", axis),
            ("program_kind", "<i8", axis),
            ("armed_ticks", "<i8"),
            ("hand_nm", "<f8", axis),  # true hand torque and place at the end of the period before
            ("place_rad", "<f8", axis),
            ("given_j", "<f8", axis),  # to the hand since arming, less what the device had stored by then
        ]
    )


@compiled
def _powered(state: int) -> bool:
    return _ARMING <= state <= _STOPPING


@compiled
def _torque(t: Record, p: Record, m: Record, axis: int) -> int:
    """Invariants of one axis' torque."""
    bad = 0
    torque, before = t.torque_applied_nm[axis], m.torque_nm[axis]
    limit, rate = p.torque_limit_nm[axis], p.torque_rate_nm[axis]
    if not (math.isfinite(torque) and math.isfinite(t.current_command_a[axis])):
        return 1 << 4
    # back from the current that is sent: a law that limits one number and encodes another would pass
    per_ampere = p.gear_ratio[axis] * p.gear_efficiency[axis] * p.torque_constant_nm_a[axis]
    if not (abs(torque) <= limit and abs(t.current_command_a[axis] * per_ampere) <= limit * (1 + ROUNDING)):
        bad |= 1 << 2
    if torque != 0.0:
        if not _powered(t.state) or t.sample_age_ticks > 2:
            bad |= 1 << 1
        if t.state == _ARMING and abs(torque) > 0.05 * limit * (1 + ROUNDING):
            bad |= 1 << 1
        if abs(torque - before) > rate * (1 + ROUNDING) + ROUNDING * limit:
            bad |= 1 << 3
        if (
            abs(t.velocity_rad_s[axis]) > p.velocity_limit_rad_s[axis]
            and torque * t.velocity_rad_s[axis] > 0.0
        ):
            bad |= 1 << 15
    if t.state == _STOPPING and abs(torque) > abs(before):  # a ramp only falls
        bad |= 1 << 8
    # new in this tick: one that stays has had its reaction
    appeared = np.int64(t.faults) & (_CUT | _RAMP) & ~m.faults
    if appeared and _powered(m.state) and abs(torque) > abs(before):
        bad |= 1 << 19
    return bad


@compiled
def _feedforward(t: Record, p: Record, model: Record, axis: int) -> int:
    """Invariant 14; without a model there is no trained range, and the observer alone has none to keep to."""
    value, observer = t.feedforward_torque_nm[axis], t.observer_torque_nm[axis]
    cap = p.friction_cap_nm[axis] * (1 + ROUNDING)
    if abs(value) > cap or abs(value + observer) > cap:
        return 1 << 14
    factor, most = t.friction_factor[axis], 1.0 + p.friction_raise[axis]
    if not 0.7 * (1 - ROUNDING) <= factor <= most * (1 + ROUNDING):
        return 1 << 14
    # of the direction that was measured farther: a branch may be that of what is helped, not of what moves
    end = max(
        model.speed_max_rad_s[0] + model.speed_fade_rad_s[0],
        model.speed_max_rad_s[1] + model.speed_fade_rad_s[1],
    )
    # both directions: a model has a curve for each, or is none
    learned = model.n_segments[0] > 0 and model.n_segments[1] > 0
    left = value != 0.0 or (learned and observer != 0.0)
    return 1 << 14 if abs(t.velocity_rad_s[axis]) > end and left else 0


@compiled
def _entries(t: Record, c: Record, m: Record) -> int:
    """Invariants of how states are entered."""
    bad = 0
    state, before = t.state, m.state
    fresh_arm = c.arm_count > m.arm_count and c.epoch == m.epoch  # of the epoch before the tick
    if (t.enabled != 0) != _powered(state):
        bad |= 1 << 5
    if state == _ARMING and before != _ARMING and not (before == _IDLE and fresh_arm):
        bad |= 1 << 6
    if state == _ACTIVE and before not in (_ACTIVE, _ARMING, _HOLD):
        bad |= 1 << 6
    # of any powered state: a shortcut past ARMING would be no entry into it
    if _powered(state) and not _powered(before) and not fresh_arm:
        bad |= 1 << 7
    return bad


@compiled
def _reactions(t: Record, m: Record) -> int:
    """Invariants of cuts, ramps and the latched cause."""
    bad = 0
    state, before = t.state, m.state
    # in both: else it has just begun to move, or to stop
    moving = before in (_ARMING, _ACTIVE, _HOLD) and state in (_ARMING, _ACTIVE, _HOLD)
    faults = np.int64(t.faults)
    if (faults & _CUT and _powered(state)) or (faults & _RAMP and moving):
        bad |= 1 << 8
    m.ramp_age = m.ramp_age + 1 if state == _STOPPING else 0
    if m.ramp_age > STOP_TICKS:  # 50 and the tick that ends it
        bad |= 1 << 8
    if state in (_FAULT, _LOCKOUT) and t.fault_first < 0:
        bad |= 1 << 9
    latched = state in (_FAULT, _ESTOP, _LOCKOUT) and before in (_FAULT, _ESTOP, _LOCKOUT)
    if latched and m.fault_first >= 0 and t.fault_first != m.fault_first:
        bad |= 1 << 9
    return bad


@compiled
def _stop(t: Record, c: Record, m: Record) -> int:
    """Invariant 18: how long ago a stop was asked for that has not yet disabled."""
    # powered before the tick: a stop at rest has nothing to disable
    if c.stop_count > m.stop_count and _powered(m.state):
        m.stop_age = 0
    if not _powered(t.state):
        m.stop_age = -1
    elif m.stop_age >= 0:
        m.stop_age += 1
    return 1 << 18 if m.stop_age > STOP_TICKS else 0


@compiled
def _target_fits(c: Record, m: Record) -> bool:
    if c.target_epoch != m.epoch or c.target_lease == 0:
        return False
    if m.lease != 0 and m.lease != c.target_lease:
        return False
    for axis in range(len(c.target_position_rad)):
        if not math.isfinite(c.target_position_rad[axis] + c.target_velocity_rad_s[axis]):
            return False
    return True


@compiled
def _lease(t: Record, s: Record, p: Record, c: Record, m: Record) -> int:
    """Invariant 10: the lease and the target in force are those that follow from the rules."""
    risen = c.target_count > m.target_count
    if risen and _target_fits(c, m):
        m.lease, m.silent, m.has_target = c.target_lease, 0, 1
        for axis in range(len(m.target_rad)):
            m.target_rad[axis] = c.target_position_rad[axis]
    else:
        m.silent += 1
        # the lease, not the target: the last place stays in force while the rig comes to rest
        if m.silent > p.target_stop_ticks:
            m.lease = 0
    if t.epoch != m.epoch:
        m.lease = 0
    bad = 0
    if (t.lease_held != 0) != (m.lease != 0):
        bad |= 1 << 10
    for axis in range(len(m.target_rad)):
        if m.has_target and s.target_position_rad[axis] != m.target_rad[axis]:
            bad |= 1 << 10
    return bad


@compiled
def _program(t: Record, c: Record, m: Record, axis: int) -> int:
    """Invariant 10, of the motions the rig makes by itself."""
    kind, before = t.program_kind[axis], m.program_kind[axis]
    fresh = c.program_count[axis] > m.program_count[axis] and c.epoch == m.epoch and m.state == _ACTIVE
    m.program_kind[axis], m.program_count[axis] = kind, c.program_count[axis]
    # a guard may end any program in BRAKE
    begun = kind != _OFF and (before == _OFF or (kind != before and kind != _BRAKE))
    return 1 << 10 if (begun and not fresh) or (kind != _OFF and m.state != _ACTIVE) else 0


@compiled
def watch_hand(t: Record, plant: Record, plant_p: Record, p: Record, m: Record) -> int:
    """Invariant 21, from the truth of the simulated rig at the end of the period that follows the tick."""
    bad = 0
    # the renderer's power counts while somebody can be given something
    m.armed_ticks = m.armed_ticks + 1 if _powered(t.state) else 0
    allowed = p.renderer_store_j + p.renderer_power_w * p.period_s * m.armed_ticks + 1.5 * p.energy_budget_j
    for axis in range(len(m.given_j)):
        hand, place = plant.hand_torque_nm[axis], plant.position_rad[axis]
        # the truth, not the sensor; by the trapezium, since the torque of a tick's end over its way errs by
        # k_h dx^2 / 2 in a spring, always the same way
        m.given_j[axis] -= 0.5 * (m.hand_nm[axis] + hand) * (place - m.place_rad[axis])
        if m.armed_ticks == 0:
            bristle = 0.5 * plant_p.bristle_stiffness_nm_rad[axis] * plant.bristle_rad[axis] ** 2
            # what bristles and motion hold when it is armed may come back to the hand
            m.given_j[axis] = -bristle - 0.5 * plant_p.inertia_kgm2[axis] * plant.velocity_rad_s[axis] ** 2
        if not m.given_j[axis] <= allowed:
            bad = 1 << 21
        m.hand_nm[axis], m.place_rad[axis] = hand, place
    return bad


@compiled
def watch(t: Record, s: Record, p: Record, c: Record, model: np.ndarray, m: Record, passive: bool) -> int:
    """Judge the tick the law has just written; bits of the violated invariants by number.

    Parameters
    ----------
    m : record of `memory_dtype`
        Zeroed at every (re)start of the law but for `stop_age` -1; brought up to date here.
    passive : bool
        Rig, hand and environment are passive and nothing is broken: invariant 13 is claimed."""
    bad = _entries(t, c, m) | _reactions(t, m) | _stop(t, c, m) | _lease(t, s, p, c, m)
    for axis in range(len(t.torque_applied_nm)):
        bad |= _torque(t, p, m, axis) | _feedforward(t, p, model[axis], axis) | _program(t, c, m, axis)
        if not _powered(t.state) and t.torque_applied_nm[axis] != 0.0:
            bad |= 1 << 5
        if passive and not t.energy_port_j[axis] >= -1.5 * p.energy_budget_j:  # not: NaN breaks it, too
            bad |= 1 << 13
        m.torque_nm[axis] = t.torque_applied_nm[axis]
    m.state, m.epoch, m.faults, m.fault_first = t.state, t.epoch, np.int64(t.faults), t.fault_first
    m.arm_count, m.stop_count, m.target_count = c.arm_count, c.stop_count, c.target_count
    m.ticks += 1
    return bad
