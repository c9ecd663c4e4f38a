"""Joints and hands of another make than the mock: what the law meets in a laboratory that nobody here
modelled.

One file from first principles, small explicit steps, no line shared with the mock but its sensors: a motor
with friction (Dahl's bristle of any exponent, or unequal Maxwell elements, under a Stribeck curve that may
lag), an elastic gear that may have play, and a hand whose mass hangs on its grip. Units as everywhere: rad, N
m, s, at the link; a torque is positive when it accelerates the joint.
"""

import math
from typing import NamedTuple

import numpy as np

from hw.entry_points import call
from hw.simulators.mock_sensors import sense_axes, sense_force
from rtctl.control.jit import compiled
from rtctl.control.vocabulary import State
from rtctl.simulation.closed_loop import Simulation


class Joint(NamedTuple):
    """What turns. One mass where `link_kgm2` is 0."""

    motor_kgm2: float = 0.012
    viscous_nms_rad: float = 0.05
    coulomb_nm: float = 0.25
    breakaway_nm: float = 0.35
    stribeck_rad_s: float = 0.1
    bristle_nm_rad: float = 300.0
    bristle_nms_rad: float = 0.02
    exponent: float = 1.0
    friction_lag_s: float = 0.0
    link_kgm2: float = 0.0
    gear_nm_rad: float = 0.0
    gear_nms_rad: float = 0.0
    play_rad: float = 0.0
    delay_ticks: float = 0.0
    current_lag_s: float = 0.0


class Holder(NamedTuple):
    """A hand: spring and damper to what it wishes, to a mass on a grip (or straight to the joint where there
    is no mass).
    """

    spring_nm_rad: float = 5.0
    damper_nms_rad: float = 0.1
    mass_kgm2: float = 0.0
    grip_nm_rad: float = 0.0
    grip_nms_rad: float = 0.0
    amplitude_rad: float = 0.3
    stiffening_rad2: float = 0.0
    """The spring is stiffer by this times the square of its stretch, as flesh is."""
    from_s: float = 1.5
    to_s: float = 5.5
    """It swings at .5 Hz in between, then holds still."""


X, V, LINK_X, LINK_V, BRISTLE, HAND_X, HAND_V, SLOW_V, FORCE, CURRENT, SIZE = range(11)


@compiled
def _friction(y, elements, shares, stiffnesses, joint, dt):
    v = y[V]
    speed = abs(v)
    if joint.friction_lag_s > 0.0:
        y[SLOW_V] += (speed - y[SLOW_V]) * min(dt / joint.friction_lag_s, 1.0)
        speed = y[SLOW_V]
    level = joint.coulomb_nm + (joint.breakaway_nm - joint.coulomb_nm) * math.exp(
        -speed / joint.stribeck_rad_s
    )
    near = math.exp(-((v / 0.05) ** 2))
    if len(elements) == 0:
        end, z = level / joint.bristle_nm_rad, y[BRISTLE]
        left = 1.0 - (z / end if v > 0.0 else -z / end)
        y[BRISTLE] = min(max(z + dt * v * max(left, 0.0) ** joint.exponent, -end), end)
        bent = joint.bristle_nm_rad * y[BRISTLE] + joint.bristle_nms_rad * near * (y[BRISTLE] - z) / dt
    else:
        bent = joint.bristle_nms_rad * near * v
        for i in range(len(elements)):
            most = shares[i] * level
            elements[i] = min(max(elements[i] + joint.bristle_nm_rad * stiffnesses[i] * v * dt, -most), most)
            bent += elements[i]
    return bent + joint.viscous_nms_rad * v


@compiled
def _gear(y, joint):
    twist, rate = y[X] - y[LINK_X], y[V] - y[LINK_V]
    beyond = twist - min(max(twist, -joint.play_rad), joint.play_rad)
    if joint.play_rad > 0.0 and beyond == 0.0:
        return 0.0
    torque = joint.gear_nm_rad * beyond + joint.gear_nms_rad * rate
    # teeth push and never pull
    return torque if joint.play_rad == 0.0 or torque * beyond > 0.0 else 0.0


@compiled
def _spring(stretch, hand):
    return hand.spring_nm_rad * stretch * (1.0 + hand.stiffening_rad2 * stretch**2)


@compiled
def _step(y, elements, shares, stiffnesses, joint, hand, motor_nm, time_s, dt):
    """Advance everything by `dt`; returns the torque of the hand on the joint, as a sensor between them shows
    it.
    """
    friction = _friction(y, elements, shares, stiffnesses, joint, dt)
    outer, outer_v = (LINK_X, LINK_V) if joint.link_kgm2 > 0.0 else (X, V)
    moved_s = min(max(time_s - hand.from_s, 0.0), hand.to_s - hand.from_s)
    wish = hand.amplitude_rad * math.sin(math.pi * moved_s)
    if hand.mass_kgm2 > 0.0:
        held = hand.grip_nm_rad * (y[HAND_X] - y[outer]) + hand.grip_nms_rad * (y[HAND_V] - y[outer_v])
        pull = _spring(wish - y[HAND_X], hand) - hand.damper_nms_rad * y[HAND_V]
        y[HAND_V] += dt * (pull - held) / hand.mass_kgm2
        y[HAND_X] += dt * y[HAND_V]
    else:
        held = _spring(wish - y[outer], hand) - hand.damper_nms_rad * y[outer_v]
    if joint.link_kgm2 > 0.0:
        gear = _gear(y, joint)
        y[V] += dt * (motor_nm - friction - gear) / joint.motor_kgm2
        y[LINK_V] += dt * (held + gear) / joint.link_kgm2
        y[LINK_X] += dt * y[LINK_V]
    else:
        y[V] += dt * (motor_nm + held - friction) / joint.motor_kgm2
    y[X] += dt * y[V]
    return held


@compiled
def _loop(
    law_at,
    params,
    command,
    model,
    state,
    plant_params,
    plant_state,
    tick,
    y,
    elements,
    shares,
    stiffnesses,
    joint,
    hand,
    line,
    steps,
    out,
):
    p, s, t = plant_params[0], plant_state[0], tick[0]
    period_s = params[0].period_s
    dt = period_s / steps
    keep = math.exp(-dt / joint.current_lag_s) if joint.current_lag_s > 0.0 else 0.0
    for k in range(len(out)):
        now_s = t.tick * period_s
        t.time_ns = int(1e9 * now_s)
        t.link_faults, t.estop = 0, 0
        s.tick = t.tick
        s.position_rad[0], s.hand_torque_nm[0], s.current_a[0] = y[X], y[FORCE], y[CURRENT]
        sense_axes(t, s, p, 1)
        sense_force(t, s, p, 1)
        s.sample_count += 1
        t.sample_count = s.sample_count
        call(law_at, (tick, state, params, command, model))
        for j in range(len(line) - 1, 0, -1):
            line[j] = line[j - 1]
        line[0] = t.current_command_a[0] if t.enabled != 0 else 0.0
        for i in range(steps):
            since = (i + 0.5) / steps - joint.delay_ticks
            wanted = line[0 if since >= 0.0 else math.ceil(-since)]
            y[CURRENT] = wanted + keep * (y[CURRENT] - wanted)
            motor_nm = y[CURRENT] * p.torque_per_ampere[0]
            y[FORCE] = _step(y, elements, shares, stiffnesses, joint, hand, motor_nm, now_s + i * dt, dt)
        out[k, 0], out[k, 1] = y[V], t.state
        t.tick += 1


class Run(NamedTuple):
    """What became of it."""

    speed_rad_s: float
    """RMS of the motor in the last 2.5 s."""
    before_rad_s: float
    """And in the 2.5 s before."""
    swung_rad_s: float
    """While the hand moved it."""
    fault: int
    """Bit number of the fault that ended it, -1 for none."""

    @property
    def shakes(self):
        """True when it moves after ten seconds and no less than before; NaN shakes."""
        return not (self.speed_rad_s <= 0.002 or self.speed_rad_s < 0.7 * self.before_rad_s)


def run(loaded, joint, hand, elements=(), seconds=16.0):
    """The rig of `loaded` on this joint in this hand: armed while the hand rests, swung, held. `elements`:
    shares and stiffnesses of Maxwell elements.
    """
    simulation = Simulation(loaded)
    period_s = simulation.plan.period_s
    shares, stiffnesses = (np.array(part, float) for part in (elements or ((), ())))
    y, bent, line = np.zeros(SIZE), np.zeros(len(shares)), np.zeros(8)
    parts, arming = [], 0.05
    for k in range(round(seconds / arming)):
        if k * arming < hand.from_s - 0.05:
            asked = int(simulation.command["arm_count"][0]) + 1
            simulation.change(arm_count=asked, epoch=int(simulation.state["epoch"][0]))
        parts.append(np.zeros((round(arming / period_s), 2)))
        _loop(
            simulation.addresses()[1], simulation.params, simulation.command, simulation.model,
            simulation.state, simulation.plant_params, simulation.plant_state,
            simulation.tick, y, bent, shares, stiffnesses, joint, hand, line, max(10, round(period_s / 2e-5)),
            parts[-1],
        )  # fmt: skip
    out = np.concatenate(parts)
    after = round(2.5 / period_s)
    rms = [
        float(np.sqrt(np.mean(np.square(part)))) for part in (out[-after:, 0], out[-2 * after : -after, 0])
    ]
    moved = out[round(hand.from_s / period_s) : round(hand.to_s / period_s), 0]
    armed = np.all(out[round(hand.from_s / period_s) :, 1] == State.ACTIVE)
    return Run(
        *rms,
        float(np.sqrt(np.mean(np.square(moved)))),
        -1 if armed else int(simulation.state["fault_first"][0]),
    )
