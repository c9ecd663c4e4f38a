import math

import pytest
from law_rig import LEVER, LawRig


def test_hand_torque_is_lever_times_force_after_tare():
    rig = LawRig()
    rig.force_n[:] = [9.0, 0.3, -9.0]
    rig.run(20)
    assert rig["hand_torque_raw_nm"] == pytest.approx(0.3 * LEVER)
    assert rig["hand_torque_nm"] == pytest.approx(0.0, abs=1e-15)
    rig.force_n[1] = 1.3
    assert rig.tick()["hand_torque_nm"] == pytest.approx(LEVER)


def test_spoilt_samples_do_not_enter_the_tare():
    rig = LawRig()
    rig.force_n[1] = 0.2
    for k in range(30):
        rig.tick(**({"force_n": [0.0, math.nan, 0.0]} if k % 3 == 1 else {}))
    assert rig["hand_torque_nm"] == pytest.approx(0.0, abs=1e-15)


def test_a_request_tares_again_only_while_disabled():
    rig = LawRig().arm()
    rig.force_n[1] = 2.0
    rig.request("tare_count")
    rig.run(20)
    assert rig["hand_torque_nm"] == pytest.approx(2.0 * LEVER)
    rig.request("stop_count")
    rig.run(60)
    rig.request("tare_count")
    rig.run(20)
    assert rig["hand_torque_nm"] == pytest.approx(0.0, abs=1e-15)


def test_the_low_pass_closes_in_by_its_coefficient():
    rig = LawRig(force_alpha=0.25).run(20)
    rig.force_n[1] = 1.0
    assert rig.tick()["hand_torque_nm"] == pytest.approx(0.25 * LEVER)
    assert rig.tick()["hand_torque_nm"] == pytest.approx(0.4375 * LEVER)


def test_several_axes_read_the_same_sensor_through_their_own_levers():
    rig = LawRig(n_axes=2, tare_ticks=0)
    rig.params["lever_m"] = [[[0.0, 0.1, 0.0], [0.2, 0.0, -0.1]]]
    rig.force_n[:] = [1.0, 2.0, 3.0]
    rig.tick()
    assert rig.now["hand_torque_nm"][0] == pytest.approx([0.2, -0.1])


def test_the_weight_of_the_tip_is_not_in_the_tare():
    rig = LawRig()
    rig.params["tip_weight_n"][0, :3] = [0.0, -2.0, 0.0]
    rig.force_n[:] = [0.1, 0.3 - 2.0, 0.0]
    rig.run(20)
    assert rig.state["tare"][0, 0, :3] == pytest.approx([0.1, 0.3, 0.0])
    assert rig["hand_torque_nm"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("moment_nm", [math.nan, math.inf, 5.1])
def test_a_moment_out_of_range_is_no_sample(moment_nm):
    rig = LawRig(moment_used=1, moment_limit_nm=5.0)
    assert rig.tick(moment_nm=[0.0, 5.0, 0.0]).state["sample_age_ticks"][0] == 0
    assert rig.tick(moment_nm=[0.0, moment_nm, 0.0]).state["sample_age_ticks"][0] == 1
    rig.params["moment_used"] = 0
    assert rig.tick(moment_nm=[0.0, moment_nm, 0.0]).state["sample_age_ticks"][0] == 0, "nobody uses it"
