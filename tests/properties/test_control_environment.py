"""Discrete passivity of coupling and environment: sum f_k (x_k - x_{k-1}) >= -(energy stored at start)."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.control.environments.coupling import coupling_torque
from rtctl.control.environments.laws import environment_energy
from rtctl.control.environments.table import OWN, Environment
from rtctl.control.jit import records
from rtctl.control.records import new_records

T = 1e-3

stiffness = st.floats(0.0, 1e6) | st.floats(0.0, 200.0)


@settings(max_examples=300, deadline=None)
@given(
    kind=st.sampled_from([kind for kind in Environment if not kind.about.active]),
    k_c=st.floats(0.1, 300.0),
    b_c=st.floats(0.0, 0.2),
    k=stiffness,
    b=st.floats(0.0, 10.0),
    center=st.floats(-0.05, 0.05),
    side=st.sampled_from([-1, 1]),
    pitch=st.floats(0.005, 0.3),
    seed=st.integers(0, 2**32 - 1),
    reach=st.floats(1e-5, 0.02),
    turn=st.floats(0.0, 0.9),
)
def test_no_motion_of_the_joint_gains_energy_from_an_environment(
    kind, k_c, b_c, k, b, center, side, pitch, seed, reach, turn
):
    params, state, command, _ = (records(array)[0] for array in new_records(1))
    params["period_s"] = T
    params["coupling_stiffness_nm_rad"][0], params["coupling_damping_nms_rad"][0] = k_c, b_c
    command["environment_kind"][0], command["environment_side"][0] = int(kind), side
    for own in OWN:
        if own.name not in ("side", "pitch_rad"):
            command[f"environment_{own.name}"][0] = own.tried[seed % 2]
    command["environment_stiffness_nm_rad"][0], command["environment_damping_nms_rad"][0] = k, b
    command["environment_center_rad"][0], command["environment_pitch_rad"][0] = center, pitch
    rng = np.random.default_rng(seed)
    step, absorbed, scale = 0.0, 0.0, 1e-12
    coupling_torque(state, params, command, 0, 1, 0.0, True)
    stored_at_start = environment_energy(state, 0, state["proxy_position_rad"][0])
    stored_at_start += 0.5 * k_c * (state["position_rad"][0] - state["proxy_position_rad"][0]) ** 2
    for _ in range(120):
        step = turn * step + (1 - turn) * reach * rng.uniform(-1, 1)
        state["position_before_rad"][0] = state["position_rad"][0]
        state["position_rad"][0] += step
        torque = coupling_torque(state, params, command, 0, 1, step / T, False)
        assert math.isfinite(torque)
        absorbed -= torque * step
        scale += abs(torque * step)
        assert absorbed >= -stored_at_start - 1e-9 * (1.0 + scale)
