"""Excitation programs in a campaign: an identification or a positioning experiment asks for motions, sound
and broken ones.

A program is a source of energy by intent, so passive rigs get none."""

from __future__ import annotations

import math

import numpy as np

from hw.generator import uniform
from rtctl.control.records import Record
from rtctl.control.vocabulary import Program, Shape, State
from rtctl.simulation.campaign_events import between, broken, chance
from rtctl.simulation.jit import compiled

_ACTIVE = int(State.ACTIVE)
_OFF = int(Program.OFF)
_KINDS = len(Program)
_SHAPES = len(Shape)

START_ONE_IN = 6000.0
"""Ticks between two requests on an axis without a program, on average."""
NEXT_ONE_IN = 1500.0
"""Ticks between two requests on an axis with a program, on average: the next motion, or its end."""


@compiled
def ask_for_programs(s: Record, p: Record, c: Record, rng: np.ndarray) -> None:
    """Now and then a motion, or its end; most requests are of the present epoch and made in ACTIVE, but not
    all."""
    for axis in range(len(c.program_kind)):
        one_in = START_ONE_IN if s.program_kind[axis] == _OFF else NEXT_ONE_IN
        # now and then in every state: a program that is asked for too early must do nothing
        if not chance(rng, one_in) or (s.state != _ACTIVE and not chance(rng, 10.0)):
            continue
        c.program_count[axis] += 1
        # one of twenty bears the epoch of before, as a host that is late would send it
        if s.state == _ACTIVE and not chance(rng, 20.0):
            c.epoch = s.epoch
        c.program_kind[axis] = int(_KINDS * uniform(rng))
        # a number that the law's table does not have
        if chance(rng, 50.0):
            c.program_kind[axis] = 7  # no kind
        _motion(p, c, axis, rng)
        _guards(s, p, c, axis, rng)


@compiled
def _log(rng: np.ndarray, low: float, high: float) -> float:
    return math.exp(between(rng, math.log(low), math.log(high)))


@compiled
def _motion(p: Record, c: Record, axis: int, rng: np.ndarray) -> None:
    """Gains from sound to reckless, and a reference of any shape."""
    inertia, most = p.inertia_kgm2[axis], p.velocity_limit_rad_s[axis]
    stiffness = inertia * _log(rng, 10.0, 1e5)
    c.program_stiffness_nm_rad[axis] = broken(rng, stiffness)
    # in units of sqrt(k J): from undamped to twice critical
    c.program_damping_nms_rad[axis] = broken(rng, between(rng, 0.0, 4.0) * math.sqrt(stiffness * inertia))
    c.program_integral_nm_rad_s[axis] = broken(rng, stiffness * between(rng, 0.0, 5.0))
    c.program_inertia_kgm2[axis] = broken(rng, inertia * between(rng, 0.0, 2.0))
    c.program_friction_gain[axis] = broken(rng, uniform(rng))
    c.program_error_rad[axis] = broken(rng, _log(rng, 1e-4, 1e-1))
    c.program_alpha[axis] = broken(rng, between(rng, 0.01, 1.0))
    c.program_velocity_rad_s[axis] = broken(rng, between(rng, -most, most))
    c.program_acceleration_rad_s2[axis] = broken(rng, _log(rng, 0.1, 1e3))
    c.program_ramp_nm_s[axis] = broken(rng, between(rng, -1.0, 1.0) * p.torque_limit_nm[axis])
    c.program_fast_nm[axis] = broken(rng, uniform(rng) * p.torque_limit_nm[axis])
    c.program_shape[axis] = int(_SHAPES * uniform(rng))
    c.program_amplitude_rad[axis] = broken(rng, between(rng, -0.6, 0.6))
    c.program_rate[axis] = broken(rng, _log(rng, 1e-2, 20.0))


@compiled
def _guards(s: Record, p: Record, c: Record, axis: int, rng: np.ndarray) -> None:
    """Limits of the motion, from ones that trip at once to ones that never do."""
    here = s.position_rad[axis]
    c.program_limit_ticks[axis] = int(_log(rng, 10.0, 5000.0))
    c.program_torque_max_nm[axis] = broken(rng, between(rng, 0.05, 1.0) * p.torque_limit_nm[axis])
    c.program_slip_rad[axis] = broken(rng, _log(rng, 1e-3, 10.0))
    c.program_hand_nm[axis] = broken(rng, _log(rng, 0.1, 100.0))
    c.program_hand_zero_nm[axis] = broken(rng, between(rng, -0.05, 0.05))
    c.program_min_rad[axis] = broken(rng, max(p.position_min_rad[axis], here - _log(rng, 0.05, 10.0)))
    c.program_max_rad[axis] = broken(rng, min(p.position_max_rad[axis], here + _log(rng, 0.05, 10.0)))
