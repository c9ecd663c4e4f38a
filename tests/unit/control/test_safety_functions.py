"""The functions of machine, detectors and test pulse one by one, to the tick and to the last bit of their thresholds."""

import math

import numpy as np
import pytest

from rtctl.control import arming, detectors, states
from rtctl.control.jit import records
from rtctl.control.records import HELD, new_records
from rtctl.control.vocabulary import Fault, State
from rtctl.tick import new_ticks

STALE, LINK_LOST, OVERRUN = int(Fault.STALE), int(Fault.LINK_LOST), int(Fault.OVERRUN)
PER_S = 1000


class Rows:
    """One row each of tick, state and parameters, one axis."""

    def __init__(self, state=State.INIT, **params):
        made = new_records(1)
        self.params, self.state = records(made[0]), records(made[1])
        self.tick = records(new_ticks(1, 1))
        for name, value in {
            "period_s": 1e-3, "ready_ticks": 5, "soft_start_ticks": 4, "stop_ticks": 50, "stale_limit_ticks": 3,
            "late_limit_ticks": 3, "arming_ticks": 3, "torque_limit_nm": 2.0, "torque_continuous_nm": 1.0,
            "count_rad": 1e-4, "arming_travel_rad": 0.1, "arming_torque_nm": 0.08, **params,
        }.items():  # fmt: skip
            self.params[name] = value
        self.state["state"], self.state["fault_first"] = state, -1
        self.now = 0

    def advance(self, faults=0, requests=0, may_arm=False, tested=False, silent=False, after=1):
        self.now += after
        changed = states.advance(
            self.state[0], self.params[0], self.now, int(faults), requests, may_arm, tested, silent
        )
        assert bool(changed) == (self["ticks_in_state"] == 0)
        return self.mode

    @property
    def mode(self):
        return State(int(self["state"]))

    def __getitem__(self, name):
        return np.asarray(self.state[name]).reshape(-1)[0].item()

    def __setitem__(self, name, value):
        self.state[name] = value


# -- the machine


def test_a_rig_is_ready_after_enough_fresh_ticks_in_a_row_without_a_fault():
    rig = Rows()
    assert rig.advance() is State.IDLE
    for _ in range(4):
        rig.advance()
    assert (rig["good_ticks"], rig["clear_ticks"]) == (4, 4)
    assert rig.advance(requests=states.ARM, may_arm=True) is State.IDLE, "one short; but this one counted"
    assert rig.advance(requests=states.ARM, may_arm=False) is State.IDLE
    assert rig.advance(STALE, states.ARM, may_arm=True) is State.IDLE
    assert (rig["good_ticks"], rig["clear_ticks"]) == (0, 0)
    rig["sample_age_ticks"] = 1
    rig.advance()
    assert (rig["good_ticks"], rig["clear_ticks"]) == (0, 1)
    rig["sample_age_ticks"], rig["good_ticks"] = 0, 5
    assert rig.advance(requests=states.ARM, may_arm=True) is State.ARMING
    assert (rig["good_ticks"], rig["clear_ticks"], rig["authority"]) == (0, 0, 0.0)
    assert (rig["epoch"], rig["lease"], rig["fault_first"]) == (0, 0, -1)


def test_the_soft_start_rises_evenly_to_one_and_no_further():
    rig = Rows(State.ARMING)
    rig["authority"] = 0.7
    rig.advance()
    assert (rig["authority"], rig["ticks_in_state"]) == (0.7, 1)
    assert rig.advance(tested=True) is State.ACTIVE
    assert rig["authority"] == 0.0
    shares = []
    for _ in range(6):
        rig.advance()
        shares.append(rig["authority"])
    assert shares == [0.25, 0.5, 0.75, 1.0, 1.0, 1.0]
    assert rig["ticks_in_state"] == 6
    rig = Rows(State.ACTIVE, soft_start_ticks=0)
    rig.advance()
    assert rig["authority"] == 1.0


def test_a_silent_renderer_is_held_and_comes_back_softly_in_the_same_epoch():
    rig = Rows(State.ACTIVE)
    rig["authority"], rig["lease"], rig["epoch"] = 0.4, 7, 2
    assert rig.advance(silent=True) is State.HOLD
    assert rig["authority"] == 0.4
    assert rig.advance(silent=True) is State.HOLD
    assert rig["authority"] == 1.0
    assert rig.advance() is State.ACTIVE
    assert (rig["authority"], rig["lease"], rig["epoch"]) == (0.0, 7, 2)


@pytest.mark.parametrize("state", [State.ARMING, State.ACTIVE, State.HOLD])
@pytest.mark.parametrize(
    ("faults", "requests", "reached", "first", "target"),
    [
        (0, states.STOP, State.STOPPING, -1, State.IDLE),
        (0, states.TERMINATE, State.STOPPING, -1, State.SHUTDOWN),
        (OVERRUN, 0, State.STOPPING, 6, State.FAULT),
        (STALE | OVERRUN, states.STOP, State.FAULT, 0, None),
        (STALE | int(Fault.STALLED), 0, State.FAULT, 12, None),
        (int(Fault.ESTOP), 0, State.ESTOP, 10, None),
        (int(Fault.GATE), 0, State.LOCKOUT, 18, None),
    ],
)
def test_whatever_ends_motion_begins_an_epoch_ends_the_lease_and_keeps_its_cause(
    state, faults, requests, reached, first, target
):
    rig = Rows(state)
    rig["lease"], rig["epoch"], rig["authority"] = 7, 2, 0.5
    rig["stop_target"] = State.SHUTDOWN
    assert rig.advance(faults, requests) is reached
    assert (rig["lease"], rig["epoch"], rig["fault_first"], rig["authority"]) == (0, 3, first, 0.5)
    if target is not None:
        assert rig["stop_target"] == target


def test_a_stop_at_rest_voids_lease_and_epoch_and_one_in_motion_does_so_once():
    for state in (State.IDLE, State.FAULT, State.ESTOP):
        rig = Rows(state)
        rig["lease"] = 7
        assert rig.advance(requests=states.STOP) is state
        assert (rig["lease"], rig["epoch"]) == (0, 1)
        rig["lease"] = 7
        rig.advance(requests=states.RESET)
        assert (rig["lease"], rig["epoch"]) == (7, 1)


@pytest.mark.parametrize("torque", [0.5, -0.5, 1.0, -1.0])
def test_a_ramp_is_over_when_nothing_is_left_or_its_time_is(torque):
    rig = Rows(State.STOPPING)
    rig["torque_applied_nm"] = torque
    for tick in range(1, 50):
        assert rig.advance() is State.STOPPING
        assert rig["ticks_in_state"] == tick
    assert rig.advance() is State.IDLE
    rig = Rows(State.STOPPING)
    rig.advance(requests=states.TERMINATE)
    assert rig.mode is State.SHUTDOWN
    rig = Rows(State.STOPPING)
    assert rig.advance(OVERRUN) is State.FAULT


def test_what_comes_during_a_ramp_decides_where_it_leads_and_the_first_cause_stays():
    rig = Rows(State.STOPPING)
    rig["torque_applied_nm"] = 1.0
    rig.advance(OVERRUN)
    assert (rig["stop_target"], rig["fault_first"], rig["epoch"]) == (State.FAULT, 6, 0)
    rig.advance(int(Fault.TARGET_LOST))
    assert (rig["stop_target"], rig["fault_first"]) == (State.FAULT, 6)
    rig.advance(requests=states.TERMINATE)
    assert rig["stop_target"] == State.SHUTDOWN
    rig["fault_first"] = 0
    rig.advance(OVERRUN)
    assert (rig["stop_target"], rig["fault_first"]) == (State.SHUTDOWN, 0)
    rig["torque_applied_nm"] = 0.0
    assert rig.advance() is State.SHUTDOWN


def test_a_reset_needs_the_cause_to_be_gone_for_a_thousand_ticks_an_emergency_stop_only_its_release():
    rig = Rows(State.FAULT)
    rig["fault_first"], rig["clear_ticks"] = 3, 998
    assert rig.advance(requests=states.RESET) is State.FAULT
    assert rig.advance(requests=states.RESET) is State.IDLE
    assert rig["fault_first"] == -1
    rig = Rows(State.FAULT)
    rig["clear_ticks"] = 5000
    assert rig.advance(STALE, states.RESET) is State.FAULT
    rig = Rows(State.ESTOP)
    assert rig.advance(int(Fault.ESTOP), states.RESET) is State.ESTOP
    assert rig.advance(requests=states.RESET) is State.IDLE


def faults_at(*slots):
    """State after a rig was found to have lost its link at these slots, and was reset in between."""
    rig = Rows(State.IDLE)
    for slot in slots:
        rig["state"], rig["ticks_in_state"], rig.now = State.IDLE, 3, slot - 1
        rig.advance(LINK_LOST)
    return rig.mode


@pytest.mark.parametrize("start", [1, 12 * 60 * PER_S])
def test_three_faults_within_a_minute_to_the_tick_lock_the_rig_out(start):
    minute = 60 * PER_S
    assert faults_at(start) is State.FAULT
    assert faults_at(start, start + 1) is State.FAULT
    assert faults_at(start, start + 1, start + minute) is State.LOCKOUT
    assert faults_at(start, start + 1, start + minute + 1) is State.FAULT
    assert faults_at(start, start + minute - 1, start + minute + 1) is State.FAULT
    assert faults_at(start, start + 50 * PER_S, start + 70 * PER_S, start + 110 * PER_S) is State.LOCKOUT
    assert faults_at(start, start + 50 * PER_S, start + 70 * PER_S, start + 111 * PER_S) is State.FAULT


def test_the_lowest_bit_is_found_among_sixty_three():
    assert [states.lowest_bit(1 << bit | 1 << 62) for bit in range(63)] == list(range(63))
    assert states.lowest_bit(0) == -1
    assert states.lowest_bit(-(1 << 63)) == -1, "the sign is no fault"


# -- late ticks


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
        (3, 9, 2, 10, 0), (3, 10, 0, 0, Fault.STALLED), (3, 11, 3, 11, Fault.STALLED), (3, 0, 3, 0, Fault.OVERRUN),
        (3, 0, 0, 11, Fault.OVERRUN), (3, 0, 4, 0, Fault.OVERRUN), (0, 50, 50, 50, 0), (-1, 50, 50, 50, 0), (1, 0, 0, 0, 0),
        (1, 0, 1, 0, Fault.OVERRUN),
    ],
)  # fmt: skip
def test_late_ticks_become_faults_at_their_bounds(limit, skipped, in_a_row, count, fault):
    rig = Rows(late_limit_ticks=limit)
    rig["late_ticks"], rig["late_count"] = in_a_row, count
    assert detectors.late_fault(rig.state[0], rig.params[0], skipped) == int(fault)


@pytest.mark.parametrize(
    ("waiver", "share", "fault"),
    [(0, 0.0, 0), (1, 0.0, Fault.REALTIME), (1, -1.0, Fault.REALTIME), (1, math.nan, Fault.REALTIME), (1, 0.25, 0), (2, 0.0, Fault.REALTIME)],
)  # fmt: skip
def test_missing_rights_are_a_fault_unless_waived(waiver, share, fault):
    rig = Rows(waiver_share=share)
    rig.tick["waiver"] = waiver
    assert detectors.realtime_fault(rig.tick[0], rig.params[0]) == int(fault)


# -- the motor


def sent(rig, *torques):
    """Have these torques been sent, the last one in the tick before the present one."""
    for torque in torques:
        rig["torque_applied_nm"] = torque
        detectors.remember_torque(rig.state[0], 0)
        rig["ticks"] = rig["ticks"] + 1


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


# -- the test pulse


def pulse(rig, ticks):
    rig["ticks_in_state"] = ticks
    return arming.pulse_torque(rig.state[0], rig.params[0], 0)


def test_the_pulse_has_four_parts_and_at_most_a_twentieth_of_the_limit():
    rig = Rows(State.ARMING)
    assert [pulse(rig, k) for k in range(14)] == [0.0] * 3 + [0.08] * 3 + [-0.08] * 3 + [0.0] * 5
    rig.params["arming_torque_nm"] = 1.0
    assert pulse(rig, 3) == pytest.approx(0.1)
    rig.params["arming_ticks"] = 0
    assert [pulse(rig, k) for k in range(4)] == pytest.approx([0.0, 0.1, -0.1, 0.0])


def test_the_test_is_over_with_the_last_tick_of_the_last_part_of_arming_only():
    for state in State:
        rig = Rows(state)
        over = []
        for ticks in range(13):
            rig["ticks_in_state"] = ticks
            over.append(bool(arming.tested(rig.state[0], rig.params[0])))
        assert over == [state is State.ARMING and ticks >= 11 for ticks in range(13)]


def armed(
    moved=(0.0, 0.0, 0.0),
    current=1.0,
    hand=0.0,
    before=0.0,
    delay=0,
    kind=1,
    elapsed=1,
    travel=None,
    start=0.3,
    pulse_nm=0.08,
):
    """Faults of a test pulse, tick by tick: joint positions at the end of parts 1 to 3 relative to the start."""
    rig = Rows(State.IDLE, follow_kind=kind, follow_delay_ticks=delay, arming_torque_nm=pulse_nm)
    rig["test_product_nm2"] = rig["test_square_nm2"] = rig["test_hand_nm"] = rig["test_moved_rad"] = 9.0
    rig["position_rad"] = start
    faults = [step_of_test(rig, 0.0, before, 1)]
    rig["state"] = State.ARMING
    sent_ago = [0.0] * (delay + 1)
    for ticks in range(12):
        rig["ticks_in_state"] = ticks
        torque = pulse(rig, ticks)
        sent(rig, torque)
        sent_ago.append(torque)
        place = [0.0, *moved][min((ticks + 1) // 3, 3)]
        rig["position_rad"] = start + (travel if travel is not None else place)
        faults.append(step_of_test(rig, current * sent_ago[-1 - delay], hand, elapsed))
    return faults


def step_of_test(rig, motor_nm, hand_nm, elapsed):
    rig.tick["motor_torque_nm"], rig.tick["hand_torque_nm"] = motor_nm, hand_nm
    return Fault(int(arming.arming_faults(rig.tick[0], rig.state[0], rig.params[0], 0, elapsed, 0)))


QUIET = [Fault(0)] * 13
AT_THE_END = [Fault(0)] * 12 + [Fault.WIRING]
COUNTS = 4e-4
"""What still counts as no motion."""


@pytest.mark.parametrize(
    ("bench", "faults"),
    [
        ({}, QUIET),
        ({"current": 0.25}, QUIET),
        ({"current": 0.24}, AT_THE_END),
        ({"current": 0.0}, AT_THE_END),
        ({"current": -1.0}, AT_THE_END),
        ({"current": math.nan}, AT_THE_END),
        ({"current": -1.0, "kind": 0}, QUIET),
        ({"current": -1.0, "elapsed": 0}, QUIET),
        ({"delay": 2}, QUIET),
        ({"moved": (0.0, 0.01, 0.0)}, QUIET),
        ({"moved": (0.0, -0.01, 0.0)}, AT_THE_END),
        ({"moved": (0.0, -0.9 * COUNTS, 0.0)}, QUIET),
        ({"moved": (0.0, -1.1 * COUNTS, 0.0)}, AT_THE_END),
        ({"moved": (0.9 * COUNTS, -0.01, 0.0)}, AT_THE_END),
        ({"moved": (-0.9 * COUNTS, -0.01, 0.0)}, AT_THE_END),
        ({"moved": (1.1 * COUNTS, -0.01, 0.0)}, QUIET),
        ({"moved": (-1.1 * COUNTS, -0.01, 0.0)}, QUIET),
        ({"moved": (0.0, -0.01, 0.0), "hand": 0.04}, AT_THE_END),
        ({"moved": (0.0, -0.01, 0.0), "hand": 0.0401}, QUIET),
        ({"moved": (0.0, -0.01, 0.0), "hand": -0.0401}, QUIET),
        ({"moved": (0.0, -0.01, 0.0), "before": 5.0}, AT_THE_END),
        ({"delay": 2, "current": 0.0}, AT_THE_END),
        ({"pulse_nm": 0.0, "current": math.nan}, QUIET),
        ({"start": 0.0, "moved": (COUNTS, -0.01, 0.0)}, AT_THE_END),
        ({"start": 0.0, "moved": (0.0, -COUNTS, 0.0)}, QUIET),
        ({"start": 0.0, "travel": 0.1}, QUIET),
        ({"travel": 0.0999}, QUIET),
        ({"travel": -0.0999}, QUIET),
        ({"travel": 0.1001}, [Fault(0)] + [Fault.ARMING_MOVED] * 12),
        ({"travel": -0.1001}, [Fault(0)] + [Fault.ARMING_MOVED] * 12),
        ({"travel": math.nan}, [Fault(0)] + [Fault.ARMING_MOVED] * 12),
    ],
)
def test_the_pulse_is_judged_by_current_direction_and_travel(bench, faults):
    assert armed(**bench) == faults


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_the_current_expected_is_the_mean_of_what_was_sent_within_the_delay(delay):
    rig = Rows(follow_delay_ticks=delay)
    torques = [float(1 << k) for k in range(HELD + 2)]
    sent(rig, *torques)
    expected = arming._expected(rig.state[0], rig.params[0], 0)
    assert expected == pytest.approx(np.mean(torques[-1 - delay :]), rel=1e-12)


def test_without_parts_nothing_of_an_earlier_test_is_judged():
    rig = Rows(State.IDLE, arming_ticks=0)
    rig["test_moved_rad"] = -9.0
    assert step_of_test(rig, 0.0, 0.0, 1) == 0
    rig["state"] = State.ARMING
    assert step_of_test(rig, 0.0, 0.0, 1) == 0
