"""Who moves a remote proxy and what becomes of the rig when they fall silent: targets, leases, HOLD;
sequences over many ticks.
"""

import math

import pytest
from law_rig import LawRig

from rtctl.control.vocabulary import Fault, State


def remote_rig():
    rig = LawRig(coupling_stiffness_nm_rad=60.0)
    rig.environment("remote", target_position_rad=0.002)
    rig.request("target_count")
    rig.run(40)
    rig.request("arm_count", "target_count")
    for _ in range(70):
        rig.request("target_count")
        rig.tick()
    assert rig.mode is State.ACTIVE
    assert rig["torque_applied_nm"] == pytest.approx(0.12)
    return rig


def test_an_old_target_holds_with_damping_only_and_a_new_one_starts_softly():
    rig = remote_rig().run(20)
    assert rig.mode is State.ACTIVE
    assert rig.tick().mode is State.HOLD
    rig.run(5)
    assert rig["torque_applied_nm"] == 0.0
    for k in range(10):
        rig.tick(1e-3 * (k + 1))
    assert rig["torque_applied_nm"] == pytest.approx(-0.05)
    rig.request("target_count")
    rig.tick()
    assert rig.mode is State.ACTIVE
    assert rig["authority"] == 0.0


def test_the_damping_of_hold_is_capped():
    rig = remote_rig().run(30)
    rig.params["hold_damping_nms_rad"] = 100.0
    for k in range(20):
        rig.tick(1e-3 * (k + 1))
    assert rig["torque_applied_nm"] == pytest.approx(-0.2 * 3.0)


def test_a_deficit_before_hold_adds_nothing_to_its_damping():
    """The damping of HOLD is all that is sure: twice of it feeds a late joint in a stiff hand."""
    rig = remote_rig().run(25)
    rig.state["energy_port_j"] = -0.5 * rig.params["energy_budget_j"]
    for k in range(10):
        rig.tick(1e-3 * (k + 1))
    assert rig["energy_port_j"] < 0.0, "else nothing is asked"
    assert rig["torque_applied_nm"] == pytest.approx(-0.05)
    assert rig["injected_damping_nms_rad"] == 0.0


def test_a_target_lost_for_long_stops_and_only_the_operator_brings_it_back():
    rig = remote_rig().run(101)
    assert rig.mode is State.STOPPING
    assert rig["fault_first"] == Fault.TARGET_LOST.value.bit_length() - 1
    for _ in range(60):
        rig.request("target_count")
        rig.tick()
    assert rig.mode is State.IDLE  # nothing is broken, but only an operator's ARM leads back
    assert rig["torque_applied_nm"] == 0.0


def test_a_target_of_an_older_epoch_does_not_count_as_fresh():
    rig = remote_rig()
    for _ in range(30):
        rig.request("target_count")
        rig.command["target_epoch"] -= 1
        rig.tick()
    assert rig.mode is State.HOLD
    assert rig["targets_refused"] == 30


def test_only_the_holder_of_the_lease_moves_the_proxy_until_it_falls_silent():
    rig = remote_rig()
    assert rig["lease_held"] == 1
    rig.request("target_count")
    rig.command["target_lease"], rig.command["target_position_rad"] = 99, 0.005
    rig.tick()
    assert rig["proxy_position_rad"] == pytest.approx(0.002)
    assert rig["targets_refused"] == 1
    rig.run(60)
    assert rig["lease_held"] == 1
    rig.run(60)
    assert rig["lease_held"] == 0
    rig.request("target_count")
    rig.command["target_lease"] = 99
    assert rig.tick()["lease_held"] == 1
    rig.request("target_count")  # the former holder comes back too late
    assert rig.tick()["targets_refused"] == 2


def test_a_stop_ends_the_lease_and_empties_the_slot():
    rig = remote_rig()
    rig.request("stop_count")
    rig.tick()
    assert rig["lease_held"] == 0
    rig.run(60)
    for _ in range(700):
        rig.tick()  # the target of before still stands in the command
    rig.command["epoch"] = rig.state["epoch"]
    rig.request("arm_count")
    rig.run(14)
    assert rig.mode is State.STOPPING  # armed, and no target of this epoch ever came
    assert rig["torque_applied_nm"] == 0.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["target_position_rad", "target_velocity_rad_s"])
def test_a_target_that_is_not_finite_is_refused_in_the_loop_too(field, bad):
    rig = remote_rig()
    rig.request("target_count")
    rig.command[field] = bad
    rig.tick()
    assert rig["targets_refused"] == 1
    assert rig["torque_applied_nm"] == pytest.approx(0.12)


def changed_to_remote(**before):
    """A rig in a spring that has just been asked to follow a renderer, which has not sent anything."""
    rig = LawRig(coupling_stiffness_nm_rad=60.0)
    rig.environment("spring", environment_stiffness_nm_rad=5.0, **before).arm()
    return rig.environment("remote")


def test_an_active_rig_can_change_to_a_remote_environment_and_waits_for_the_renderer():
    rig = changed_to_remote().run(20)
    assert rig.mode is State.ACTIVE
    rig.run(20)
    assert rig.mode is State.HOLD
    rig.command["target_position_rad"] = 0.001
    for _ in range(80):
        rig.request("target_count")
        rig.tick()
    assert rig.mode is State.ACTIVE
    assert rig["proxy_position_rad"] == pytest.approx(0.001)


def test_a_renderer_that_never_comes_stops_the_rig_after_as_long_as_one_that_falls_silent():
    rig = changed_to_remote().run(100)
    assert rig.mode is State.HOLD
    rig.run(1)
    assert rig.mode is State.STOPPING
    assert rig["fault_first"] == Fault.TARGET_LOST.value.bit_length() - 1


def test_what_a_renderer_sent_before_the_change_moves_nothing():
    rig = remote_rig()
    rig.environment("free").run(5)
    rig.environment("remote").run(15)
    assert rig.mode is State.ACTIVE
    assert rig["torque_applied_nm"] == pytest.approx(0.0, abs=1e-9)
