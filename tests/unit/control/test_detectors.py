"""Actuator that does not follow, heat, the window of late ticks."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from law_rig import LawRig

from rtctl.control import window
from rtctl.control.detectors import age_fault
from rtctl.control.jit import records
from rtctl.control.records import MARK_WORDS, state_dtype
from rtctl.control.vocabulary import Fault, GateFlag, State

PER_AMPERE = 80 * 0.8 * 0.02


@settings(max_examples=200, deadline=None)
@given(st.lists(st.booleans(), min_size=1, max_size=3000))
def test_the_sliding_count_is_the_count_of_the_last_thousand(marks):
    words, count = np.zeros(MARK_WORDS, np.int64), 0
    for tick, mark in enumerate(marks):
        count += window.push(words, tick, mark)
        assert count == sum(marks[max(0, tick - 999) : tick + 1])


@pytest.mark.parametrize("at", [0, 1, 62, 63, 503, 999, 1000, 2017])
def test_a_mark_counts_for_a_thousand_ticks_to_the_tick(at):
    words = np.zeros(MARK_WORDS, np.int64)
    changes = [(tick, change) for tick in range(4000) if (change := window.push(words, tick, tick == at))]
    assert changes == [(at, 1), (at + 1000, -1)]


def test_a_zeroed_state_has_room_for_the_marks():
    state = records(np.zeros(1, state_dtype(1)))
    assert state["late_marks"].shape == (1, MARK_WORDS)


def pushing_rig(delay_ticks=0, **params):
    """An armed rig that sends 1.2 N m and measures its current."""
    rig = LawRig(
        coupling_stiffness_nm_rad=60.0,
        energy_budget_j=100.0,
        follow_kind=1,
        follow_delay_ticks=delay_ticks,
        **params,
    )
    rig.environment("spring", environment_stiffness_nm_rad=1e9, environment_center_rad=0.02)
    rig.sent = [0.0] * 8
    follow(rig, 40)
    rig.request("arm_count")
    follow(rig, 70)
    assert rig.mode is State.ACTIVE
    assert rig["torque_applied_nm"] == pytest.approx(1.2, rel=1e-3)
    return rig


def follow(rig, n, gap_nm=0.0, delay=1, **more):
    """Run with a motor that gives what was sent `delay` ticks ago, less `gap_nm`."""
    for _ in range(n):
        rig.tick(current_a=(rig.sent[-delay] - gap_nm) / PER_AMPERE, **more)
        rig.sent.append(rig["torque_applied_nm"])
    return rig


def test_a_motor_that_follows_is_no_fault():
    assert follow(pushing_rig(), 200).faults == Fault(0)
    assert follow(pushing_rig(), 200, gap_nm=0.59).faults == Fault(0)
    assert follow(pushing_rig(), 200, gap_nm=-0.59).faults == Fault(0)


@pytest.mark.parametrize("gap_nm", [0.61, -0.61, 1.4, -1.4])
def test_a_gap_of_a_fifth_of_the_limit_ramps_after_twenty_ticks(gap_nm):
    rig = follow(pushing_rig(), 19, gap_nm)
    assert rig.mode is State.ACTIVE
    follow(rig, 1, gap_nm)
    assert rig.mode is State.STOPPING
    assert rig["fault_first"] == Fault.ACTUATOR_LAG.value.bit_length() - 1


def test_a_gap_that_closes_once_starts_the_count_again():
    rig = pushing_rig()
    for _ in range(5):
        follow(rig, 19, 1.0)
        follow(rig, 1)
    assert rig.mode is State.ACTIVE


@pytest.mark.parametrize("gap_nm", [1.51, -1.51])
def test_a_gap_of_half_the_limit_cuts_at_once(gap_nm):
    rig = follow(pushing_rig(), 1, gap_nm)
    assert rig.mode is State.FAULT
    assert rig["torque_applied_nm"] == 0.0
    assert rig["fault_first"] == Fault.ACTUATOR_WRONG.value.bit_length() - 1


def test_a_motor_that_pushes_by_itself_keeps_the_rig_from_being_ready():
    rig = LawRig(follow_kind=1).run(100, current_a=1.6 / PER_AMPERE)
    rig.request("arm_count")
    assert rig.run(5, current_a=1.6 / PER_AMPERE).mode is State.IDLE
    assert rig.faults & Fault.ACTUATOR_WRONG


def test_a_declared_delay_and_missed_samples_widen_what_may_be_measured():
    def step(rig, delay):
        for centre in (rig.command["environment_center_rad"], rig.state["world_center_rad"]):
            centre[...] = -0.02  # 2.4 N m less within a few ticks
        return follow(rig, 40, delay=delay)

    assert step(pushing_rig(delay_ticks=4, torque_rate_nm=0.6), 5).faults == Fault(0)
    assert step(pushing_rig(delay_ticks=0, torque_rate_nm=0.6), 5).mode is State.FAULT
    late = pushing_rig()
    late.tick(fresh=False).tick(fresh=False)
    assert follow(late, 5).faults == Fault(0)


def test_after_skipped_slots_a_device_may_have_let_go():
    rig = pushing_rig()
    follow(rig, 1, gap_nm=1.2, skipped=5)
    assert rig.mode is State.ACTIVE


def test_a_rig_without_current_sensor_is_not_judged():
    rig = LawRig().arm()
    assert rig.run(100, current_a=19.0).faults == Fault(0)


HOT = {"temperature_kind": 1, "temperature_warn_c": 70.0, "temperature_trip_c": 90.0}


def warm_rig(**params):
    rig = LawRig(coupling_stiffness_nm_rad=60.0, energy_budget_j=100.0, **HOT, **params)
    rig.environment("spring", environment_stiffness_nm_rad=1e9, environment_center_rad=0.1)
    rig.run(40, temperature_c=25.0)
    rig.request("arm_count")
    rig.run(70, temperature_c=25.0)
    assert rig["torque_applied_nm"] == pytest.approx(3.0)
    return rig


@pytest.mark.parametrize(("temperature_c", "torque"), [(70.0, 3.0), (75.0, 2.25), (80.0, 1.5), (89.0, 0.15)])
def test_between_warning_and_trip_the_torque_is_derated(temperature_c, torque):
    rig = warm_rig().run(10, temperature_c=temperature_c)
    assert rig.mode is State.ACTIVE
    assert rig["torque_applied_nm"] == pytest.approx(torque)
    assert rig["torque_share"] == pytest.approx(torque / 3.0)
    assert bool(int(rig["gate_flags"]) & GateFlag.SHARE) == (torque < 3.0)


def test_derating_obeys_the_torque_rate():
    rig = warm_rig(torque_rate_nm=0.5).tick(temperature_c=80.0)
    assert rig["torque_applied_nm"] == pytest.approx(2.5)


def test_the_trip_ramps_down_and_cold_again_is_no_way_back_by_itself():
    rig = warm_rig().tick(temperature_c=90.0)
    assert rig.mode is State.STOPPING
    rig.run(60, temperature_c=25.0)
    assert rig.mode is State.FAULT
    assert rig["fault_first"] == Fault.OVERTEMPERATURE.value.bit_length() - 1
    assert rig.run(500, temperature_c=25.0).mode is State.FAULT


@pytest.mark.parametrize("missing", [math.nan, math.inf, -273.0, 1000.0])
def test_a_configured_sensor_that_falls_silent_trips_on_the_third_tick(missing):
    rig = warm_rig().run(2, temperature_c=missing)
    assert rig.mode is State.ACTIVE
    rig.tick(temperature_c=missing)
    assert rig.mode is State.STOPPING
    assert rig.faults == Fault.OVERTEMPERATURE


def test_a_silent_sensor_does_not_give_back_what_heat_took():
    rig = warm_rig().run(10, temperature_c=80.0)
    assert rig.tick(temperature_c=math.nan)["torque_applied_nm"] == pytest.approx(1.5)


def test_a_rig_without_temperature_sensor_is_not_judged():
    rig = LawRig().arm()
    for temperature_c in (math.nan, 500.0, 0.0):
        assert rig.run(10, temperature_c=temperature_c).faults == Fault(0)


def ages_until_fault(answered_ticks, proof_ticks):
    """Samples in a row, each one tick old, until SAMPLE_AGE; 0: never. The file declares one tick, the pulse
    said another.
    """
    rig = LawRig(declared_delay_s=0.001, proof_delay_s=0.001 * proof_ticks, stale_limit_ticks=20)
    rig.state["answer_delay"], rig.state["answer_count"] = answered_ticks, 1
    rig.state["sample_age_ticks"] = 1
    for tick in range(200):
        rig.state["ticks"] = tick
        if age_fault(rig.state[0], rig.params[0]):
            return tick + 1
    return 0


@pytest.mark.parametrize(
    ("answered_ticks", "proof_ticks", "stops"),
    [(0.5, 2.1, False), (0.5, 1.9, True), (2.5, 3.6, False), (2.5, 3.4, True), (math.nan, 5.0, True)],
)
def test_an_old_sample_is_covered_only_by_what_the_proof_leaves_beside_the_delay(
    answered_ticks, proof_ticks, stops
):
    assert bool(ages_until_fault(answered_ticks, proof_ticks)) is stops
