import math

import pytest
from law_rig import LawRig

from rtctl.control.gate import gate_torque
from rtctl.control.vocabulary import Fault, GateFlag, State

LIMITS = {"limit": 2.0, "rate": 0.1, "v_limit": 10.0, "enabled": True}


def gate(wanted, previous=0.0, velocity=0.0, **changed):
    limits = {**LIMITS, **changed}
    torque, flags = gate_torque(
        wanted, previous, velocity, limits["limit"], limits["rate"], limits["v_limit"], limits["enabled"]
    )
    return torque, GateFlag(int(flags))


def test_each_intervention_has_its_flag():
    assert gate(0.05) == (0.05, GateFlag(0))
    assert gate(3.0, previous=1.95) == (2.0, GateFlag.ABSOLUTE)
    assert gate(1.0) == (0.1, GateFlag.RATE)
    assert gate(-1.0, previous=0.5) == (0.4, GateFlag.RATE)
    assert gate(3.0) == (0.1, GateFlag.ABSOLUTE | GateFlag.RATE)
    assert gate(1.0, enabled=False) == (0.0, GateFlag.DISABLED)
    assert gate(math.nan) == (0.0, GateFlag.NOT_FINITE)
    assert gate(0.05, velocity=math.nan) == (0.0, GateFlag.NOT_FINITE)


@pytest.mark.parametrize("velocity", [10.1, -10.1])
def test_above_the_speed_limit_torque_may_only_brake_and_at_once(velocity):
    push = math.copysign(1.0, velocity)
    assert gate(push, previous=push, velocity=velocity) == (0.0, GateFlag.OVERSPEED)
    assert gate(-push, previous=-push, velocity=velocity) == (-push, GateFlag(0))


def test_one_axis_that_is_not_finite_cuts_every_axis_in_the_same_tick():
    rig = LawRig(n_axes=2, coupling_stiffness_nm_rad=50.0)
    rig.environment("spring", environment_stiffness_nm_rad=10.0).arm()
    rig.tick([0.01, 0.01])
    assert rig.now["torque_applied_nm"][0] == pytest.approx([-0.0833, -0.0833], rel=1e-2)
    rig.state["ramp_step_nm"] = 0.0
    rig.state["proxy_position_rad"][0] = [0.0, math.nan]
    rig.params["coupling_damping_nms_rad"][0, 1] = 1.0
    rig.tick()
    assert rig.now["torque_applied_nm"][0] == pytest.approx([0.0, 0.0], abs=0)
    assert rig.faults & Fault.LAW_NOT_FINITE
    assert rig.mode is State.FAULT
    assert rig["enabled"] == 0.0
