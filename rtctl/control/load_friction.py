"""Friction that grows with the torque through the gear, in the law (docs/theory.md 8.10).

    L = |k_e e - k_m m| + s (|p_e e - p_m m| + q),         s = exp(-(v / v_s)^a)

e the hand's torque and m the motor's, both at the joint with the same sign; q = q_e e^2 where the motor
drives against the hand (e m < 0, |e| < |m|), q_m m^2 where the hand drives it back. m is what coupling and
world ask for in this tick, and the help with friction as it was sent in the last one: the help loads the
gear, too, and what it adds to itself in a tick is bounded by `rtctl check` (`friction.load.LOOP_MOST`), so
that the sum settles. s is a table, even over the fourth root of v: a power takes 40 ns."""

from __future__ import annotations

import math

from rtctl.control.display import is_admittance
from rtctl.control.jit import compiled
from rtctl.control.records import HELD, LOAD_CELLS, Record


@compiled
def load_magnitude(model: Record, speed: float, outside: float, motor: float) -> float:
    """What the load adds to the friction of no load, N m, >= 0.

    Parameters
    ----------
    model : MODEL record
    speed : float
        |v|, rad/s.
    outside, motor : float
        Torques of hand and motor, N m, of one sign; beyond the torque that was measured they count as that.
    """
    most = model.load_most_nm
    # the squares would run away beyond what was measured
    e, m = min(max(outside, -most), most), min(max(motor, -most), most)
    # the load of a gear is a difference: hand and motor that push alike load its teeth less
    base = abs(model.load_outside * e - model.load_motor * m)
    peak = abs(model.load_outside_peak * e - model.load_motor_peak * m)
    if e * m < 0.0:
        if abs(e) < abs(m):
            peak += model.load_outside_square_per_nm * e * e
        elif abs(e) > abs(m):
            peak += model.load_motor_square_per_nm * m * m
    if not peak > 0.0:
        return base + peak  # or NaN
    u = math.sqrt(math.sqrt(speed * model.load_cells_s_rad))  # fine near standstill, where s falls
    # compared first: an integer of a NaN is any number
    j = min(int(u), LOAD_CELLS - 1) if u < LOAD_CELLS else LOAD_CELLS - 1
    fall = model.load_fall
    return base + peak * (fall[j] + min(u - j, 1.0) * (fall[j + 1] - fall[j]))


@compiled
def motor_through_gear(t: Record, s: Record, p: Record, axis: int) -> float:
    """The motor's torque on the gear, N m: what coupling and world ask for now, and the help that was sent in
    the last tick."""
    limit = p.torque_limit_nm[axis]
    asked = min(max(s.authority * t.coupling_torque_nm[axis], -limit), limit)  # as the gate lets it through
    # this tick's is not there yet: it goes by the load
    return float(asked + s.compensation_nm[axis, (s.ticks - 1) % HELD])


@compiled
def load_gain(p: Record, axis: int, speed: float) -> float:
    """Share of what the load adds that is compensated at a speed (|v|, rad/s): none at rest, all beyond the
    blend of `hybrid`.

    A joint that sticks under load needs no help to stay, and stiction that is larger by the load is larger by
    what the load does: with the load's help at rest a joint that a hand leans on crept, or trembled by
    2 mrad/s."""
    gain = p.friction_load_gain[axis]
    if not gain > 0.0:
        return 0.0
    # as `blend` of the feed-forward, whose rest is this one's motion
    return float(gain * (1.0 - math.exp(-((speed / p.friction_blend_rad_s[axis]) ** 2))))


@compiled
def load_friction(t: Record, s: Record, p: Record, model: Record, axis: int, speed: float) -> float:
    """What the present load adds to the friction, N m, >= 0; 0 where the law does not go by load, or a
    virtual mass is shown.

    The servo of a virtual mass works against the friction itself: a load computed from its torque would be an
    answer to friction."""
    if not p.friction_load_gain[axis] > 0.0 or is_admittance(s, axis):
        return 0.0
    return load_magnitude(model, speed, s.calm_hand_nm[axis], motor_through_gear(t, s, p, axis))
