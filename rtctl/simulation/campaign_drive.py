"""One rig of a campaign, compiled: plant, law, monitor, random commands, tick after tick."""

from __future__ import annotations

import math

import numpy as np

from hw.entry_points import Address, call, call_for_int
from hw.fault_kinds import Channel, Effect
from hw.scripted_faults import due_ticks
from rtctl.control.records import Record
from rtctl.control.vocabulary import State
from rtctl.simulation.campaign_events import (
    change_display,
    change_world,
    operate,
    render,
    slots_missed,
    stream_world,
)
from rtctl.simulation.campaign_monitor import watch, watch_hand
from rtctl.simulation.campaign_programs import ask_for_programs
from rtctl.simulation.campaign_pursuit import pursue
from rtctl.simulation.jit import compiled

_SHUTDOWN, _LOCKOUT = int(State.SHUTDOWN), int(State.LOCKOUT)
_ACTUATOR, _HOLD = int(Channel.ACTUATOR), int(Effect.HOLD)

CLOSED_TICKS = 20
"""A closed rig is restarted after so many ticks, as a person or systemd would."""


@compiled
def _stuck(plant: Record, plant_p: Record, elapsed: int) -> bool:
    """Whether a motor held its current by a scripted fault, `elapsed` ticks after the first sample."""
    for k in range(plant_p.fault_count):
        holds = plant_p.fault_channel[k] == _ACTUATOR and plant_p.fault_effect[k] == _HOLD
        if holds and plant.fault_on >> k & 1 and due_ticks(plant_p, k, elapsed) >= 0:
            return True
    return False


@compiled
def _heard_nothing(plant: Record, plant_p: Record, skipped: int) -> int:
    """Invariant 20: after more slots than time to live and actuation delay, the motor holds no torque."""
    for axis in range(len(plant.motor_torque_nm)):
        # commands under way still act
        late = math.ceil(plant_p.torque_delay_ticks[axis] + plant_p.transport_delay_ticks)
        silent = skipped > plant_p.time_to_live_ticks + late
        if silent and plant.motor_torque_nm[axis] != 0.0:
            return 1 << 20
    return 0


@compiled
def _restart(c: Record) -> None:
    """Nothing has been asked for yet."""
    c.epoch, c.arm_count, c.stop_count, c.reset_count = 0, 0, 0, 0
    c.tare_count, c.shutdown_count, c.target_count = 0, 0, 0
    c.target_epoch, c.target_lease = 0, 0
    for axis in range(len(c.program_count)):
        c.program_count[axis] = 0


@compiled
def drive(
    at: tuple[Address, Address, Address],
    params: np.ndarray,
    state: np.ndarray,
    command: np.ndarray,
    model: np.ndarray,
    plant_params: np.ndarray,
    plant_state: np.ndarray,
    tick: np.ndarray,
    memory: np.ndarray,
    fresh_state: np.ndarray,
    fresh_memory: np.ndarray,
    rng: np.ndarray,
    foe: np.ndarray,
    ticks: int,
    passive: bool,
    visits: np.ndarray,
    seen: np.ndarray,
    programs: np.ndarray,
    trace: np.ndarray,
) -> tuple[int, int]:
    """Run `ticks` ticks, or up to the first violated invariant.

    Parameters
    ----------
    at
        Addresses of the plant's reading, the law and the plant's writing (`Simulation.addresses`).
    fresh_state, fresh_memory : array, shape (1,)
        Law and monitor as after a restart of the daemon.
    foe : array, shape (1,), `pursuit.FOE`
        A renderer after the hand's energy, on a passive rig; kind 0: none.
    passive : bool
        The rig is left alone but for arming and streams of parameters or such a renderer: no stops, no
        lateness.
    visits : int array, shape (states,)
        Counts ticks spent in each state.
    seen : int array, shape (64,)
        Counts ticks in which each fault bit appeared.
    programs : int array, shape (kinds,)
        Counts ticks spent in each kind of program, on any axis.
    trace : array, shape (n,)
        Ring of the last ticks, row `k % n`; n may be 0.

    Returns
    -------
    violated, after : int
        Bits of `monitor.INVARIANTS` (0: none), and the ticks run by then."""
    t, s, p, c, m = tick[0], state[0], params[0], command[0], memory[0]
    silence, closed, faults_before = 0, 0, np.int64(0)
    for k in range(ticks):
        skipped = 0
        if passive:
            if k % 50 == 0:  # asks until it is ready, and again after a fault
                c.arm_count += 1
                c.epoch = s.epoch
            stream_world(c, k, rng)
            if foe[0].kind != 0:
                pursue(s, p, c, plant_state[0], foe[0], k, rng)
        else:
            operate(s, c, rng)
            change_world(c, rng)
            change_display(p, c, rng)
            ask_for_programs(s, p, c, rng)
            silence = render(s, c, rng, silence)
            skipped = slots_missed(rng)
        c.seq += 1
        t.tick += 1 + skipped  # slots are never caught up
        t.missed_ticks += skipped
        # before the reading: in it the missed periods pass, and with them the script may end
        stuck = _stuck(plant_state[0], plant_params[0], t.tick - 1 - plant_state[0].first_tick)
        call_for_int(at[0], (tick, plant_state, plant_params))
        # a motor that a script holds hears nothing
        bad = 0 if stuck else _heard_nothing(plant_state[0], plant_params[0], skipped)
        call(at[1], (tick, state, params, command, model))
        bad |= watch(t, s, p, c, model, m, passive)
        visits[t.state] += 1
        for axis in range(len(t.program_kind)):
            programs[t.program_kind[axis]] += 1
        faults = np.int64(t.faults)  # signed: Numba makes a float of signed and unsigned together
        for bit in range(32):
            seen[bit] += (faults & ~faults_before) >> bit & 1  # appeared, not stayed
        faults_before = faults
        call_for_int(at[2], (tick, plant_state, plant_params))
        if passive:
            # after the plant's step: the truth of this period
            bad |= watch_hand(t, plant_state[0], plant_params[0], p, m)
        if len(trace) > 0:
            trace[k % len(trace)] = tick[0]
        if bad:
            return bad, k + 1
        closed = closed + 1 if t.state in (_SHUTDOWN, _LOCKOUT) else 0
        if closed > CLOSED_TICKS:
            closed = 0
            _restart(c)
            state[0] = fresh_state[0]
            memory[0] = fresh_memory[0]  # the monitor is restarted with the law it watches
    return 0, ticks
