"""A position controller on the simulated rig, compiled: PD or PID with friction and inertia feed-forward.

The formula is that of `rtctl.control.position`, which the law's TRACK program follows on a rig; here it runs
on the bare plant, thousands of times faster than the whole law. v is the low-passed backward difference. The
torque goes through the same gate as the law's: limit, rate, velocity limit. No hand is on the rig."""

from __future__ import annotations

import math

import numpy as np

from hw.simulators.mock_plant import plant_read, plant_write
from rtctl.control.gate import gate_torque
from rtctl.control.jit import compiled
from rtctl.control.position import friction_toward

GAINS = np.dtype(
    [
        ("kp_nm_rad", "<f8"),
        ("ki_nm_rad_s", "<f8"),
        ("kd_nms_rad", "<f8"),
        ("integral_max_nm", "<f8"),  # most torque of the integral
        ("inertia_kgm2", "<f8"),
        ("alpha", "<f8"),  # low-pass of the velocity, per tick
        ("friction_gain", "<f8"),  # kappa
        ("error_rad", "<f8"),  # e_0
    ]
)


@compiled
def follow(
    reference: np.ndarray,
    gains: np.ndarray,
    model: np.ndarray,
    params: np.ndarray,
    plant_params: np.ndarray,
    plant_state: np.ndarray,
    tick: np.ndarray,
    out: np.ndarray,
) -> None:
    """Follow `reference` (n, 3: position, velocity, acceleration) from rest; write (n, 2): true position,
    torque sent.

    Parameters
    ----------
    gains : array, shape (1,), `GAINS`
    model : array, shape (1,), `MODEL`
    params : array, shape (1,)
        Parameters of the law: limits and torque per ampere."""
    g, p, t = gains[0], params[0], tick[0]
    per_ampere = p.gear_ratio[0] * p.gear_efficiency[0] * p.torque_constant_nm_a[0]
    v, integral, sent = 0.0, 0.0, 0.0
    x_before = math.nan
    for k in range(len(reference)):
        plant_read(tick, plant_state, plant_params)
        x = t.position_rad[0]
        if k > 0:  # no place before: it would be a jump
            v += g.alpha * ((x - x_before) / p.period_s - v)
        x_before = x
        x_r, v_r, a_r = reference[k, 0], reference[k, 1], reference[k, 2]
        error = x_r - x
        integral += g.ki_nm_rad_s * error * p.period_s
        # held at its bound: against the limit of the torque it would wind up, and overshoot by all of it
        integral = min(max(integral, -g.integral_max_nm), g.integral_max_nm)
        wanted = g.kp_nm_rad * error + integral + g.kd_nms_rad * (v_r - v) + g.inertia_kgm2 * a_r
        # toward the reference where that moves, toward the error where it stands (`control.position`)
        wanted += friction_toward(model[0], g.friction_gain, v_r, v, error, g.error_rad)
        limit = p.torque_limit_nm[0]
        # the law's own gate: a controller that only works without rate and limit would win here and not on a
        # rig
        sent, _ = gate_torque(
            wanted, sent, v, limit, limit, p.torque_rate_nm[0], p.velocity_limit_rad_s[0], True
        )
        t.enabled = 1
        t.current_command_a[0] = sent / per_ampere
        out[k, 0] = plant_state[0].position_rad[0]  # the truth, not the encoder
        out[k, 1] = sent
        plant_write(tick, plant_state, plant_params)
        t.tick += 1
