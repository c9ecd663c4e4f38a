"""The detectors' functions one by one, to the tick and to the last bit of their thresholds: late ticks,
actuator, heat.
"""

import math

import pytest
from safety_rows import Rows, sent

from rtctl.control import detectors
from rtctl.control.records import HELD
from rtctl.control.vocabulary import Fault


def late(rig, missed, ticks=1):
    rig["ticks"], rig.tick["missed_ticks"] = ticks, missed
    return detectors.count_late(rig.tick[0], rig.state[0])


def test_skipped_slots_are_counted_from_the_second_tick_on_in_a_row_and_in_all():
    rig = Rows()
    assert late(rig, 5, ticks=0) == 0, "what was missed before the first tick is nobody's fault"
    assert (rig["missed_ticks"], rig["late_ticks"], rig["late_count"]) == (5, 0, 0)
    seen = [
        (late(rig, missed, ticks), rig["late_ticks"], rig["late_count"])
        for ticks, missed in enumerate((7, 8, 8, 11, 4, 5), 1)
    ]
    assert seen == [(2, 1, 1), (1, 2, 2), (0, 0, 2), (3, 1, 3), (0, 0, 3), (1, 1, 4)]


@pytest.mark.parametrize(
    ("limit", "skipped", "in_a_row", "count", "fault"),
    [
        (3, 9, 2, 10, 0), (3, 10, 0, 0, Fault.STALLED), (3, 11, 3, 11, Fault.STALLED),
        (3, 0, 3, 0, Fault.OVERRUN),
        (3, 0, 0, 11, Fault.OVERRUN), (3, 0, 4, 0, Fault.OVERRUN), (0, 50, 50, 50, 0), (-1, 50, 50, 50, 0),
        (1, 0, 0, 0, 0),
        (1, 0, 1, 0, Fault.OVERRUN),
    ],
)  # fmt: skip
def test_late_ticks_become_faults_at_their_bounds(limit, skipped, in_a_row, count, fault):
    rig = Rows(late_limit_ticks=limit)
    rig["late_ticks"], rig["late_count"] = in_a_row, count
    assert detectors.late_fault(rig.state[0], rig.params[0], skipped) == int(fault)


@pytest.mark.parametrize(
    ("waiver", "share", "fault"),
    [(0, 0.0, 0), (1, 0.0, Fault.REALTIME), (1, -1.0, Fault.REALTIME), (1, math.nan, Fault.REALTIME),
        (1, 0.25, 0), (2, 0.0, Fault.REALTIME)],
)  # fmt: skip
def test_missing_rights_are_a_fault_unless_waived(waiver, share, fault):
    rig = Rows(waiver_share=share)
    rig.tick["waiver"] = waiver
    assert detectors.realtime_fault(rig.tick[0], rig.params[0]) == int(fault)


def follow(rig, measured, elapsed=1, skipped=0):
    rig.tick["motor_torque_nm"] = measured
    return Fault(int(detectors.follow_fault(rig.tick[0], rig.state[0], rig.params[0], 0, elapsed, skipped)))


def test_torques_are_remembered_by_their_age():
    rig = Rows()
    sent(rig, *[0.01 * k for k in range(100)])
    ages = [detectors.held_torque(rig.state[0], 0, ago) for ago in range(1, HELD + 1)]
    assert ages == pytest.approx([0.01 * (100 - ago) for ago in range(1, HELD + 1)])


def test_the_gap_is_measured_from_the_range_of_what_was_sent_lately():
    limit, lag, wrong = 2.0, 0.4, 1.0
    rig = Rows(follow_kind=1)
    sent(rig, 1.5, 0.5, -0.5, 0.25)
    assert follow(rig, 0.25 + lag) == 0
    assert rig["lag_ticks"] == 0
    for measured, elapsed, delay in (
        (0.25 + lag, 1, 0),
        (-0.5 - lag, 2, 0),
        (0.5 + lag, 3, 0),
        (0.5 + lag, 2, 1),
        (1.5, 1, 3),
    ):
        rig.params["follow_delay_ticks"] = delay
        assert follow(rig, measured, elapsed) == 0
        assert rig["lag_ticks"] == 0, "a fifth of the limit is no gap"
    rig.params["follow_delay_ticks"] = 0
    for age, measured in enumerate((0.25 + 1.01 * lag, 0.25 - 1.01 * lag, 0.25 + wrong, 0.25 - wrong), 1):
        assert follow(rig, measured) == 0
        assert rig["lag_ticks"] == age
    assert follow(rig, 0.25 + 1.01 * wrong) == Fault.ACTUATOR_WRONG
    assert follow(rig, 0.25 - 1.01 * wrong) == Fault.ACTUATOR_WRONG
    assert follow(rig, math.nan) == Fault.ACTUATOR_WRONG
    rig["lag_ticks"] = 18
    assert follow(rig, 0.75) == 0
    assert follow(rig, 0.75) == Fault.ACTUATOR_LAG
    assert follow(rig, 0.75) == Fault.ACTUATOR_LAG
    assert follow(rig, 0.25) == 0
    assert rig["lag_ticks"] == 0
    assert limit * 0.2 == lag


def test_a_device_that_let_go_during_skipped_slots_shows_zero():
    rig = Rows(follow_kind=1)
    sent(rig, *[1.2] * 40)
    assert follow(rig, 0.0) == Fault.ACTUATOR_WRONG
    assert follow(rig, 0.0, skipped=1) == 0
    assert follow(rig, 0.6, skipped=1) == 0
    assert follow(rig, -0.3, skipped=1) == 0
    assert follow(rig, -1.01, skipped=1) == Fault.ACTUATOR_WRONG
    late_riser = Rows(follow_kind=1)
    sent(late_riser, 0.0, 0.0, 1.2)
    assert follow(late_riser, 1.2, skipped=1) == 0, "or what was sent last"
    rig["ticks"] = 40
    assert follow(rig, 1.2, elapsed=1000) == 0


def test_without_a_sensor_or_a_sample_the_motor_is_not_judged():
    rig = Rows(follow_kind=0)
    assert follow(rig, 50.0) == 0
    rig = Rows(follow_kind=1)
    rig["lag_ticks"] = 5
    assert follow(rig, 50.0, elapsed=0) == 0
    assert rig["lag_ticks"] == 5
    assert follow(rig, 50.0) == Fault.ACTUATOR_WRONG


HEAT = {"temperature_kind": 1, "temperature_warn_c": 70.0, "temperature_trip_c": 90.0}


@pytest.mark.parametrize(
    ("temperature_c", "share", "fault"),
    [
        (-99.9, 1.0, 0), (70.0, 1.0, 0), (75.0, 0.75, 0), (89.0, 0.05, 0), (90.0, 0.0, Fault.OVERTEMPERATURE),
        (499.0, 0.0, Fault.OVERTEMPERATURE),
    ],
)  # fmt: skip
def test_heat_takes_its_share_and_trips(temperature_c, share, fault):
    rig = Rows(**HEAT)
    rig["cold_ticks"] = 2
    rig.tick["temperature_c"] = temperature_c
    assert detectors.temperature_share(rig.tick[0], rig.state[0], rig.params[0], 0) == pytest.approx(share)
    assert rig["cold_ticks"] == 0
    assert detectors.temperature_fault(rig.state[0], rig.params[0], 0) == int(fault)


@pytest.mark.parametrize("missing", [math.nan, math.inf, -math.inf, -100.0, 500.0])
def test_a_silent_sensor_keeps_the_share_and_trips_when_a_sample_would_be_stale(missing):
    rig = Rows(**HEAT)
    rig["heat_share"] = 0.25
    rig.tick["temperature_c"] = missing
    for silent in (1, 2, 3):
        assert detectors.temperature_share(rig.tick[0], rig.state[0], rig.params[0], 0) == 0.75
        assert rig["cold_ticks"] == silent
        fault = detectors.temperature_fault(rig.state[0], rig.params[0], 0)
        assert fault == (Fault.OVERTEMPERATURE if silent == 3 else 0)
    rig.params["temperature_kind"] = 0
    assert detectors.temperature_share(rig.tick[0], rig.state[0], rig.params[0], 0) == 1.0
    assert detectors.temperature_fault(rig.state[0], rig.params[0], 0) == 0
    rig.params["temperature_kind"], rig.state["cold_ticks"], rig.state["heat_share"] = 1, 0, math.nan
    assert detectors.temperature_fault(rig.state[0], rig.params[0], 0) == Fault.OVERTEMPERATURE


def test_a_mean_torque_above_eleven_tenths_of_the_continuous_limit_is_a_fault():
    rig = Rows(torque_continuous_nm=2.0)
    for mean, fault in ((2.2, 0), (2.2001, Fault.OVERTORQUE), (0.0, 0)):
        rig["window_mean_nm"] = mean
        assert detectors.window_fault(rig.state[0], rig.params[0], 0) == int(fault)
