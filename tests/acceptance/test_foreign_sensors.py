"""Rigs of another make on which every row of `check` passed, and that shook: a joint at rest, a force sensor
with a filter of its own.
"""

import math

import numpy as np
import pytest
from foreign_files import certified, model, rig_file
from foreign_rig import DEVICE, HAND, JOINT, Rig, axis

from rtctl.control.vocabulary import Environment, State

pytestmark = pytest.mark.compiled


def rms(speeds):
    return np.sqrt(np.mean(np.square(speeds), axis=0))


def test_a_carriage_at_rest_is_not_fed_by_how_it_bends_its_bristles(tmp_path):
    """It swung on at 42 Hz and 1 mm/s, every row passed: help that fell with speed, and rose with the
    bristles, 3 ms late.
    """
    own = dict(
        JOINT, motor=0.066719, viscous=0.305136, coulomb=0.656646, breakaway=0.944106, stribeck=0.0103821,
        bristle=1008.596, exponent=0.6, backward=1.0354708,
    )  # fmt: skip
    holder = dict(HAND, spring=3422.84, damper=0.015033, amplitude=0.0972788, hz=1.0, to_s=5.178523)
    says = {
        "inertia_kgm2": 0.066719, "viscous_nms_rad": 0.305136, "torque_limit_nm": 7.27288,
        "torque_rate_nm_s": 727.288, "velocity_limit_rad_s": 1.54749, "current_limit_a": 2.41144,
        "drive": {"current_loop_hz": 101.19067}, "force": {"limit_n": 436.37},
        "encoder_counts_per_rev": 20000.0,
        "coupling": {"delay_ticks": 0.0, "damping_nms_rad": 0.0871622, "stiffness_nm_rad": 61.60156},
        "friction": {
            "policy": "hybrid", "gain": 0.8, "intent_nm": 0.131329, "gate_nm": 0.0656645,
            "blend_rad_s": 0.0206332, "tanh_rad_s": 0.0051583, "deadband_rad_s": 0.00257915,
            "presliding_rad": 9.3606e-4,
        },
        "environment": {"kind": "spring", "stiffness_nm_rad": 1776.49, "center_rad": 0.0090926},
    }  # fmt: skip
    timing = {"timing": {"sample_every_ticks": 1, "transport_delay_ticks": 0.875}}
    loaded = rig_file("mock-linear.toml", [says], tmp_path, models=[model(own, "slide", "linear")],
        device=timing)  # fmt: skip
    assert certified(loaded)
    sensors = dict(
        DEVICE, delay_ticks=0.875, lag_s=0.00157282, lever=1.0, current_noise=0.005, force_noise=0.005,
        force_step=0.005, force_bias=0.3,
    )  # fmt: skip
    rig = Rig(loaded, [axis(**own, **holder, **sensors)], seed=2)
    speeds, _, states = rig.run(14.0)
    assert states[-1] == State.ACTIVE
    assert rms(speeds[-2000:])[0] < 1e-4


def test_an_admittance_rests_behind_the_sensor_that_it_is_proved_with_and_grows_behind_a_slower_one(tmp_path):
    """The shipped display bears a low-pass of 229 Hz, in the spring that it likes least; friction of .003 N m
    hardly holds its joint, which steps of its encoder leave .005 rad/s.
    """
    own = dict(JOINT, coulomb=0.003, breakaway=0.0033, bristle=3.0)
    holder = dict(HAND, spring=120.0, damper=0.0, amplitude=0.004, hz=2.0, from_s=1.5, to_s=2.1)

    def run(sensor_hz):
        loaded = rig_file("admittance.toml", [{"force": {"sensor_lowpass_hz": sensor_hz}}], tmp_path)
        sensor = dict(DEVICE, force_lag_s=1 / (2 * math.pi * sensor_hz))
        rig = Rig(loaded, [axis(**own, **holder, **sensor)])
        rig.law[2]["watch_floor_nm"], rig.law[2]["energy_budget_j"] = (
            math.inf,
            1e6,
        )  # they would calm or stop it
        rig.law[2]["mass_rest_nms_rad"] = 0.0  # and so would what is for a joint that sticks
        rig.law[3]["compensation"], rig.law[3]["environment_kind"] = 0.0, int(Environment.SPRING)
        rig.law[3]["environment_stiffness_nm_rad"], rig.law[3]["environment_center_rad"] = 203.0, 0.0
        rig.law[3]["environment_damping_nms_rad"] = 0.0
        speeds, _, states = rig.run(8.0)
        return certified(loaded), states[-1] == State.ACTIVE and rms(speeds[-1000:])[0] < 0.01

    assert run(400.0) == (True, True)
    assert run(60.0) == (False, False)
