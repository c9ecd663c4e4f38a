"""Load-dependent friction: what the torque through the gear adds to Coulomb friction and to the Stribeck
peak.

With tau_m the motor's torque and tau_e the one from outside (hand), both at the link and both positive when
they accelerate it, s(v) the fall of the Stribeck peak:

    g = F_c + |e tau_e - m tau_m| + s(v) (F_s - F_c + |e_s tau_e - m_s tau_m| + q)

q = e_q tau_e^2 where the motor drives, m_q tau_m^2 where it is driven back, nil where both push the same way.
These are the models m1 to m6 of Duclusaud, Passault, Padois, Ly: Extended Friction Models for the Physics
Simulation of Servo Actuators, arXiv 2410.08650; those with fewer terms have zeros for the rest, and m3 and m4
e = m."""

from __future__ import annotations

import numpy as np

from hw.simulators.jit import compiled


@compiled
def load_levels(motor_nm: float, outside_nm: float, p: np.record, axis: int) -> tuple[float, float]:
    """What the load adds to Coulomb friction and to the peak above it, N m."""
    base = abs(p.load_outside[axis] * outside_nm - p.load_motor[axis] * motor_nm)
    peak = abs(p.load_outside_peak[axis] * outside_nm - p.load_motor_peak[axis] * motor_nm)
    # the larger one drives the other through the gear; of two that push the same way nobody is driven
    if motor_nm * outside_nm < 0.0:
        if abs(outside_nm) < abs(motor_nm):
            peak += p.load_outside_square_nm[axis] * outside_nm * outside_nm
        elif abs(outside_nm) > abs(motor_nm):
            peak += p.load_motor_square_nm[axis] * motor_nm * motor_nm
    return base, peak
