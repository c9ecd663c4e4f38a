"""The soft start is paid for, on every axis, from the store that pays for all that a renderer puts in."""

import math

import pytest
from law_rig import LawRig, T

from rtctl.control.authority import FREE_SHARE, raise_authority
from rtctl.control.jit import records
from rtctl.control.records import new_records
from rtctl.control.vocabulary import Environment, State


def rows(stored, left, authority=0.0, soft_start_ticks=10, budget_j=0.0):
    """Parameters and state of as many axes as numbers are given."""
    params, state, _, _ = (records(array)[0] for array in new_records(len(stored)))
    params["soft_start_ticks"], params["energy_budget_j"] = soft_start_ticks, budget_j
    state["authority"], state["stored_energy_j"], state["renderer_store_j"] = authority, stored, left
    raise_authority(state, params)
    return state


def test_what_little_is_stored_is_paid_and_granted_and_the_rise_is_even():
    state = rows([0.5], [0.1])
    assert state["authority"] == 0.1
    assert state["authority_grant_j"][0] == pytest.approx(0.05)
    assert state["renderer_store_j"][0] == pytest.approx(0.05)


@pytest.mark.parametrize("poor", [0, 1])
def test_the_axis_that_can_pay_least_sets_the_rise_of_all(poor):
    stored, left = [0.4, 0.4], [1.0, 1.0]
    left[poor] = 0.02
    state = rows(stored, left)
    assert state["authority"] == pytest.approx(0.05)
    assert list(state["authority_grant_j"]) == pytest.approx([0.02, 0.02])
    assert state["renderer_store_j"][poor] == pytest.approx(0.0, abs=1e-15)
    assert state["renderer_store_j"][1 - poor] == pytest.approx(0.98)


def test_nothing_is_granted_that_was_not_paid():
    state = rows([5.0], [0.0])
    assert (state["authority"], state["authority_grant_j"][0], state["renderer_store_j"][0]) == (
        0.0,
        0.0,
        0.0,
    )
    # an encoder count: it may rise, unpaid and not granted
    state = rows([0.01], [0.0], budget_j=0.01 / FREE_SHARE)
    assert (state["authority"], state["authority_grant_j"][0], state["renderer_store_j"][0]) == (
        0.1,
        0.0,
        0.0,
    )


def test_full_authority_costs_nothing_and_takes_back_the_last_grant():
    state = rows([3.0], [0.1], authority=1.0)
    assert (state["authority"], state["authority_grant_j"][0], state["renderer_store_j"][0]) == (
        1.0,
        0.0,
        0.1,
    )


@pytest.mark.parametrize("broken", [math.nan, math.inf])
def test_energy_that_is_not_a_number_raises_nothing(broken):
    state = rows([broken], [0.1])
    assert (state["authority"], state["authority_grant_j"][0], state["renderer_store_j"][0]) == (
        0.0,
        0.0,
        0.1,
    )
    assert rows([0.5], [math.nan])["authority"] == 0.0


def test_arming_in_a_stretched_spring_takes_as_long_as_the_store_needs_to_pay_for_it_and_no_longer():
    for way_rad, extra_s in ((0.1, 0.0), (0.4, 0.5 * 10 * 60 / 70 * 0.4**2 - 0.1)):
        rig = LawRig(coupling_stiffness_nm_rad=60.0)
        rig.environment("spring", environment_stiffness_nm_rad=10.0, environment_center_rad=way_rad)
        rig.run(40)
        rig.command["epoch"] = rig.state["epoch"]
        rig.request("arm_count")
        ticks = 0
        while rig["authority"] < 1.0 and ticks < 2000:
            rig.tick()
            ticks += rig.mode is State.ACTIVE
        assert ticks == pytest.approx(max(50, extra_s / T), abs=3)


def test_a_rise_is_granted_once_though_the_authority_rises_no_further():
    rig = LawRig(coupling_stiffness_nm_rad=60.0).arm()
    rig.params["energy_bank_j"] = 1.0
    rig.environment("remote").request("target_count")
    rig.run(30)  # and nothing after it
    assert rig.mode is State.HOLD
    before = rig["energy_port_j"]
    rig.state["authority_grant_j"] = 0.01
    rig.run(3)
    assert rig["energy_port_j"] == pytest.approx(before + 0.01)


def test_each_axis_pays_for_what_its_hand_wound_up_in_a_silence_of_the_renderer_of_another():
    """Axis 1 has a spring of its own; while axis 0 waits for its renderer nothing of it is felt."""
    rig = LawRig(2, coupling_stiffness_nm_rad=60.0)
    rig.arm()
    rig.command["environment_kind"] = [int(Environment.REMOTE), int(Environment.SPRING)]
    rig.command["environment_stiffness_nm_rad"] = 10.0
    rig.request("target_count")
    rig.run(10)
    for k in range(50):
        rig.tick([0.0, 0.4 * (k + 1) / 50])
    assert rig.mode is State.HOLD
    rig.params["renderer_power_w"] = 0.0
    rig.state["energy_port_j"] = 0.0
    spent, granted = rig.state["renderer_store_j"][0, 1].copy(), 0.0
    for _ in range(300):
        rig.request("target_count")
        rig.tick()
        granted += float(rig.state["authority_grant_j"][0, 1])
    stored = float(rig.state["stored_energy_j"][0, 1])
    assert stored == pytest.approx(0.5 * 10 * 60 / 70 * 0.4**2, rel=1e-3)
    assert rig["authority"] == pytest.approx(spent / stored, rel=0.01)
    assert granted == pytest.approx(spent)
