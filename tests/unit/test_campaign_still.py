"""The judge of hands that hold still: what it measures, and what it lets pass as a joint's own ring."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rtctl.cli import campaign
from rtctl.simulation import campaign_still
from rtctl.simulation.campaign_still_cases import Case, drawn, rig

CASE = Case(
    index=3,
    policy="hybrid",
    model="lugre",
    bristle_stiffness_nm_rad=1000.0,
    bristle_damping_nms_rad=0.4,
    joint_hz=31.0,
    hand_stiffness_nm_rad=50.0,
    hand_damping_nms_rad=0.0,
    hand_inertia_kgm2=0.0,
    amplitude_rad=0.15,
    place_rad=0.0,
    ends="middle",
    stop_s=0.0,
)
LOUD = campaign_still.Found(CASE, 0.006, 0.0, -1, 0.003, 0.2)


def test_of_an_elastic_joint_the_hand_holds_the_link():
    simulation = rig(CASE)
    simulation.plant_params["hand_start_s"] = 0.0
    simulation.run(0.5)
    truth = simulation.truth
    bent_rad = truth["hand_position_rad"][:, 0] - campaign_still._held_rad(simulation)
    assert np.ptp(truth["joint_twist_rad"]) > 1e-3, "the other mass is somewhere else"
    assert truth["hand_torque_nm"][:, 0] == pytest.approx(CASE.hand_stiffness_nm_rad * bent_rad, abs=0.01)


def alone(monkeypatch, by_wish):
    """Let the joint without help ring as `by_wish` has it: wish over the case's: speed, late speed, swing."""

    def run(case, hold_s):
        assert case.policy == "off"
        assert hold_s == campaign_still.JUDGED_S
        speed, late, swing = by_wish[round(case.amplitude_rad / CASE.amplitude_rad, 3)]
        return campaign_still.Found(case, speed, 0.0, -1, late, swing)

    monkeypatch.setattr(campaign_still, "run_case", run)


STUCK = (0.001, 0.0005, 0.01)


@pytest.mark.parametrize(
    ("by_wish", "own"),
    [
        ({1.0: (0.005, 0.0025, 0.01)}, True),
        ({1.0: STUCK, 1.2: (0.005, 0.0025, 0.2)}, True),
        ({1.0: STUCK, 1.2: STUCK, 1.5: (0.005, 0.0025, 0.2)}, True),
        ({1.0: STUCK, 1.2: (0.005, 0.0025, 0.21)}, False),  # went farther than with help
        ({1.0: STUCK, 1.2: (0.0047, 0.0025, 0.2), 1.5: (0.1, 0.1, 0.3)}, False),
        ({1.0: (0.02, 0.002, 0.01), 1.2: (0.1, 0.1, 0.3)}, False),  # with help it does not die away
        (dict.fromkeys(campaign_still.FARTHER, STUCK), False),
    ],
)
def test_a_ring_is_the_joints_own_if_it_rings_so_without_help_and_goes_no_farther(monkeypatch, by_wish, own):
    alone(monkeypatch, by_wish)
    assert campaign_still.rings_by_itself(LOUD, campaign_still.JUDGED_S) is own


def test_a_ring_of_the_motion_is_met_in_another_phase_without_help(monkeypatch):
    def run(case, hold_s):
        later_s = case.stop_s - CASE.stop_s
        assert case.ends == ("middle" if later_s == 0 else "anywhere"), "no hand jumps"
        loud = 0.005 * abs(math.sin(2 * math.pi * 10.0 * later_s))
        return campaign_still.Found(case, loud, 0.0, -1, 0.5 * loud, 0.2)

    monkeypatch.setattr(campaign_still, "run_case", run)
    assert campaign_still.rings_by_itself(LOUD, campaign_still.JUDGED_S)


@pytest.mark.compiled
def test_a_hand_that_rings_in_motion_is_not_shaken_by_the_moment_at_which_it_stops():
    """2.52 mrad/s, 1.67 without help, which stops it in another phase of the same ring: 2.22 from 40 ms later
    on. The observer sends nothing by then.
    """
    found = campaign_still.run_case(drawn(32, 819))
    assert found.speed_rad_s > campaign_still.QUIET_RAD_S, "or it asks nothing"
    assert campaign_still.rings_by_itself(found, campaign_still.JUDGED_S)


def test_what_is_quiet_at_the_end_has_died_away(monkeypatch):
    alone(monkeypatch, {1.0: (0.005, 1e-6, 0.01)})
    assert campaign_still.rings_by_itself(
        replace(LOUD, late_rad_s=campaign_still.QUIET_RAD_S), campaign_still.JUDGED_S
    )


@pytest.mark.parametrize("loud", [{"fault": 4}, {"fed_j": 0.002}, {"fed_j": math.nan}])
def test_a_fault_and_energy_are_never_a_joints_own(loud):
    assert not campaign_still.rings_by_itself(replace(LOUD, **loud), campaign_still.JUDGED_S)


@pytest.mark.compiled
def test_swing_and_the_last_second_are_those_of_the_run():
    found = campaign_still.run_case(replace(CASE, policy="off", hand_damping_nms_rad=1.0, joint_hz=0.0))
    assert 0.1 < found.swing_rad < 2 * CASE.amplitude_rad
    assert 0 <= found.late_rad_s <= campaign_still.QUIET_RAD_S


def test_hands_that_share_a_gear_and_a_sensor_are_otherwise_their_own():
    """Else a thousand hands in `make test` would be fifty."""
    own = [drawn(1, index) for index in range(60)]
    shared = [drawn(1, index, hands=20) for index in range(60)]
    of_rig = {(one.joint_hz, one.sensor_hz, one.sensor_ticks) for one in shared}
    assert len(of_rig) == 3
    assert {(one.joint_hz, one.sensor_hz, one.sensor_ticks) for one in own[::20]} == of_rig
    for alone, one in zip(own, shared, strict=True):
        there = own[one.index - one.index % 20]
        of_first = {name: getattr(there, name) for name in ("joint_hz", "sensor_hz", "sensor_ticks")}
        assert one == replace(alone, **of_first)


def test_a_case_is_told_with_the_command_that_draws_the_same_case():
    order = campaign_still.Order(seed=5, hold_s=60.0, policies=("observer", "lugre", "hybrid"))
    found = campaign_still.Findings(loud=[replace(LOUD, case=drawn(5, 7, order.policies))])
    *_, command = found.text(order).splitlines()
    read = campaign.command.make_context("campaign", command.split()[2:]).params
    again = drawn(read["seed"], read["index"], read["policies"])
    assert (again, read["hold_s"], read["still"]) == (found.loud[0].case, 60.0, True)
    usual = campaign_still.Order(seed=5)
    assert usual.reproduce(7) == "rtctl campaign --still --seed 5 --rig 7"


def test_a_rig_that_did_not_arm_stands_before_the_loudest():
    speeds = enumerate((1, math.nan, 3))
    cases = [replace(LOUD, case=replace(CASE, index=i), speed_rad_s=v) for i, v in speeds]
    lines = campaign_still.Findings(loud=cases).text(campaign_still.Order()).splitlines()
    assert [line.split(":")[0] for line in lines[1::2]] == ["case 1", "case 2", "case 0"]
