"""Where a fault comes from: axis, channel, device, and the device's own words."""

import math

import numpy as np
import pytest

from hw.interface import LinkFault
from rtctl.control.records import params_dtype
from rtctl.control.vocabulary import Fault, GateFlag, State
from rtctl.host.exchange.device_words import DeviceWords
from rtctl.host.exchange.events import EventDetector
from rtctl.host.exchange.fault_book import FaultBook
from rtctl.host.exchange.rig_description import AxisDescription, DeviceDescription, RigDescription
from rtctl.tick import new_ticks
from rtctl.wire.fault_words import sentence

DRIVE, FINGER = "device[0] 'drive'", "device[1] 'finger'"


def limits():
    p = np.zeros(1, params_dtype(2))
    for name, value in {
        "period_s": 1e-3, "position_min_rad": -1.0, "position_max_rad": 1.0, "force_limit_n": 50.0,
        "current_limit_a": 20.0, "torque_limit_nm": 3.0, "torque_continuous_nm": 1.0,
        "velocity_limit_rad_s": 10.0,
        "energy_budget_j": 0.02, "follow_kind": 1, "temperature_kind": 1, "temperature_trip_c": 90.0,
        "device_velocity_kind": 1, "device_tolerance_rad_s": 0.5, "arming_travel_rad": 0.1,
        "proof_delay_s": 2e-3, "declared_delay_s": 5e-4, "proof_age_ticks": 1,
        "follow_delay_ticks": 2, "current_gain_error": 0.3, "current_offset_nm": 0.3,
        "current_overshoot_limit": 0.05,
        "force_offset_limit_nm": 0.3,
        "moment_used": 1, "moment_limit_nm": 2.0,
    }.items():  # fmt: skip
        p[name] = value
    return p


RIG = RigDescription(
    "mock",
    (AxisDescription("base", {}), AxisDescription("tip", {})),
    1000.0,
    devices=(
        DeviceDescription(DRIVE, (0, 1), ("current", "current_command", "position", "temperature")),
        DeviceDescription(FINGER, (0, 1), ("force",)),
    ),
    params=limits(),
)


def rows(n=5, **last):
    out = new_ticks(n, 2)
    out["tick"] = np.arange(n)
    out["state"], out["fault_first"] = State.ACTIVE, -1
    out["device_velocity_rad_s"], out["temperature_c"] = 0.0, 20.0
    for name in (
        "arming_delay_ticks",
        "running_delay_ticks",
        "arming_gain",
        "running_gain",
        "force_offset_nm",
    ):
        out[name] = math.nan
    for name, value in last.items():
        out[name][-1] = value
    return out


def place(fault, some, words=None):
    some["faults"][-1] = fault
    book = FaultBook(RIG, words)
    book.follow(some[:2])  # over batches
    book.follow(some[2:])
    (entry,) = book.entries(int(fault))
    return entry


@pytest.mark.parametrize(
    ("fault", "seen", "where"),
    [
        (Fault.BAD_SAMPLE, {"position_rad": [0.0, math.nan]}, ("tip", "position", DRIVE)),
        (Fault.BAD_SAMPLE, {"current_a": [0.0, 21.0]}, ("tip", "current", DRIVE)),
        (Fault.BAD_SAMPLE, {"force_n": [0.0, math.inf, 0.0]}, (None, "force", FINGER)),
        (Fault.JUMP, {"position_rad": [0.001, 0.4]}, ("tip", "position", DRIVE)),
        (Fault.OVERSPEED, {"velocity_rad_s": [1.0, -13.0]}, ("tip", None, None)),
        (Fault.VELOCITY, {"device_velocity_rad_s": [0.1, math.nan]}, ("tip", "velocity", None)),
        (Fault.OVERTEMPERATURE, {"temperature_c": [30.0, 91.0]}, ("tip", "temperature", DRIVE)),
        (Fault.OVERTEMPERATURE, {"temperature_c": [30.0, math.nan]}, ("tip", "temperature", DRIVE)),
        (Fault.ACTUATOR_WRONG, {"motor_torque_nm": [0.1, -1.6]}, ("tip", "current", DRIVE)),
        (Fault.PASSIVITY, {"energy_port_j": [0.01, -0.03]}, ("tip", None, None)),
        (Fault.GATE, {"gate_flags": [0, GateFlag.VIOLATION]}, ("tip", None, None)),
        (Fault.LAW_NOT_FINITE, {"torque_wanted_nm": [0.0, math.nan]}, ("tip", None, None)),
        (Fault.CURRENT, {"arming_gain": [1.0, 0.4]}, ("tip", "current", DRIVE)),
        (Fault.CURRENT, {"arming_gain": [1.0, 1.0], "running_gain": [1.0, 0.4]}, ("tip", "current", DRIVE)),
        (Fault.BAD_SAMPLE, {"moment_nm": [0.0, math.nan, 0.0]}, (None, "moment", None)),
        (Fault.FORCE_CLIPPED, {"force_n": [0.0, 0.0, -50.0]}, (None, "force", FINGER)),
        (Fault.FORCE_CLIPPED, {"moment_nm": [2.0, 0.0, 0.0]}, (None, "moment", None)),
        (Fault.FORCE_FROZEN, {"force_n": [0.1, 0.2, 0.3]}, (None, "force", FINGER)),
        (Fault.FORCE_OFFSET, {"force_offset_nm": [math.nan, -0.4]}, ("tip", "force", FINGER)),
        (Fault.OFF_AXIS, {"force_tared_n": [30.0, 0.0, 0.0]}, (None, "force", FINGER)),
        (Fault.DELAY, {"running_delay_ticks": [1.0, 3.0]}, ("tip", "current", DRIVE)),
        (Fault.TARGET_LOST, {}, (None, None, None)),
    ],
)
def test_a_fault_is_laid_at_the_axis_and_channel_that_the_tick_shows(fault, seen, where):
    entry = place(fault, rows(**seen))
    assert (entry["axis"], entry["channel"], entry["device"]) == where


def test_a_torque_that_comes_late_is_told_with_what_measured_it_what_is_declared_and_what_is_proven():
    late = {"arming_delay_ticks": [0.0, 2.5], "running_delay_ticks": [1.0, math.nan]}
    told = "2.5 ms by the test pulse; declared 0.5, proven 2"
    assert place(Fault.DELAY, rows(**late))["detail"] == told
    told = "4 ms by motion, 1 of them the samples' age; declared 0.5, proven 2"
    assert place(Fault.DELAY, rows(**late | {"running_delay_ticks": [1.0, 3.0]}))["detail"] == told


def test_a_tick_that_is_newer_than_those_followed_has_its_place_already():
    book = FaultBook(RIG)
    book.follow(rows())
    newer = rows(faults=Fault.BAD_SAMPLE)
    newer["force_n"][-1] = math.nan
    assert book.entries(Fault.BAD_SAMPLE)[0]["channel"] is None
    book.glance(newer[-1])
    assert book.entries(Fault.BAD_SAMPLE)[0]["channel"] == "force"
    assert book.entries(Fault.BAD_SAMPLE)[0]["device"] == FINGER
    newer["force_n"][-1], newer["position_rad"][-1] = 0.0, 7.0
    book.follow(newer)
    assert book.entries(Fault.BAD_SAMPLE)[0]["channel"] == "position", "what is followed has the last word"


@pytest.mark.parametrize(("gain", "axis"), [([1.0, 1.1], None), ([math.nan, 1.0], "tip")])
def test_a_test_pulse_whose_steps_are_exceeded_is_told_of_an_axis_without_current_beside_it(gain, axis):
    offset = [0.01 if math.isfinite(one) else math.nan for one in gain]
    entry = place(Fault.CURRENT, rows(arming_gain=gain, arming_offset_nm=offset))
    assert (entry["axis"], entry["channel"]) == (axis, "current")
    assert "current_overshoot" in entry["detail"]


def test_where_no_axis_is_beyond_its_limit_none_is_named():
    assert place(Fault.OVERSPEED, rows(velocity_rad_s=[1.0, 2.0]))["axis"] is None


def test_the_test_pulse_that_finds_no_current_names_the_axis():
    some = rows(40)
    some["state"] = State.ARMING
    some["torque_applied_nm"][10:30] = 0.1
    some["motor_torque_nm"][11:31, 0] = 0.1
    some["state"][-1] = State.FAULT
    entry = place(Fault.WIRING, some)
    assert (entry["axis"], entry["channel"], entry["device"]) == ("tip", "current", DRIVE)


def said(device, axes, words, faults=0, stale=False, tick=0):
    return {"tick": tick, "device": device, "axes": axes, "faults": faults, "stale": stale, "words": words}


DEVICE, LOST = int(LinkFault.DEVICE), int(LinkFault.LOST)


def test_a_drive_that_reports_a_fault_is_named_with_its_axis_and_its_own_words():
    words = DeviceWords(RIG)
    words.hear(said(FINGER, [0, 1], [["", 0, False]]))
    node_2 = "node 2: state IDLE (1), DC_BUS_UNDER_VOLTAGE"
    words.hear(said(DRIVE, [0, 1], [["node 1: state IDLE (1)", 0, False], [node_2, DEVICE, False]], DEVICE))
    entry = place(Fault.DEVICE, rows(), words)
    assert (entry["axis"], entry["device"], entry["detail"]) == ("tip", DRIVE, node_2)
    assert sentence(entry).startswith(f"DEVICE (axis tip, {DRIVE}): {node_2}: the drive or sensor reports")


def test_words_that_come_after_the_fault_join_it_while_it_lasts_and_stay_when_it_is_gone():
    words, book = DeviceWords(RIG), None
    words.hear(said(DRIVE, [0, 1], [["a", 0, False], ["node 2: fault", DEVICE, False]], DEVICE))
    book, some = FaultBook(RIG, words), rows(4)
    some["faults"] = Fault.DEVICE
    book.follow(some)
    words.hear(
        said(DRIVE, [0, 1], [["a", 0, False], ["node 2: fault, emergency 0x3220", DEVICE, False]], DEVICE)
    )
    assert book.entries(int(Fault.DEVICE))[0]["detail"] == "node 2: fault, emergency 0x3220"
    some["faults"] = 0
    book.follow(some)
    words.hear(said(DRIVE, [0, 1], [["a", 0, False], ["node 2: ready", 0, False]]))
    assert book.entries(int(Fault.DEVICE))[0]["detail"] == "node 2: fault, emergency 0x3220"


def test_of_several_devices_the_one_that_is_silent_or_lost_is_named():
    words = DeviceWords(RIG)
    words.hear(said(DRIVE, [0, 1], [["node 1", 0, False], ["node 2", 0, True]]))
    entry = place(Fault.STALE, rows(), words)
    assert (entry["axis"], entry["device"]) == ("tip", DRIVE)
    assert "do not come" in entry["detail"]
    words = DeviceWords(RIG)
    words.hear(said(FINGER, [0, 1], [["", 0, False]], LOST, stale=True))
    entry = place(Fault.LINK_LOST, rows(), words)
    assert (entry["axis"], entry["channel"], entry["device"]) == (None, "force", FINGER)


def test_a_fault_that_was_over_before_anybody_looked_is_laid_at_what_was_said_in_its_tick():
    words, some = DeviceWords(RIG), rows(6)
    words.hear(said(DRIVE, [0, 1], [["a", 0, False], ["node 2: idle", 0, False]]))
    words.hear(said(DRIVE, [0, 1], [["a", 0, False], ["node 2: short", DEVICE, False]], DEVICE, tick=3))
    words.hear(said(DRIVE, [0, 1], [["a", 0, False], ["node 2: idle", 0, False]], tick=4))
    some["faults"][3] = Fault.DEVICE
    events = EventDetector(RIG, words).detect(some)
    (fault,) = [event for event in events if event["event"] == "fault"]
    assert (fault["axis"], fault["detail"]) == ("tip", "node 2: short")
    assert [e["text"] for e in events if e["event"] == "device"] == ["node 2: short", "node 2: idle"]


@pytest.mark.parametrize(("spoken", "detail"), [(2, ""), (4, "; node 2: current limit")])
def test_a_motor_that_does_not_follow_is_explained_by_what_its_drive_says_then_not_by_what_it_said_at_rest(
    spoken, detail
):
    words = DeviceWords(RIG)
    words.hear(said(DRIVE, [0, 1], [["a", 0, False], ["node 2: current limit", 0, False]], tick=spoken))
    entry = place(Fault.ACTUATOR_WRONG, rows(motor_torque_nm=[0.1, -1.6]), words)
    assert entry["detail"] == f"sent 0 N m, measured -1.6{detail}"


def test_events_tell_the_place_and_what_a_device_says_once():
    words = DeviceWords(RIG)
    detector, some = EventDetector(RIG, words), rows(4)
    detector.detect(some)
    words.hear(said(DRIVE, [0, 1], [["node 1", 0, False], ["node 2: short circuit", DEVICE, False]], DEVICE))
    some["faults"][1:], some["fault_first"][1:], some["state"][1:] = Fault.DEVICE, 22, State.FAULT
    events = {event["event"]: event for event in detector.detect(some)}
    assert events["fault"]["axis"] == "tip"
    assert (events["device"]["axis"], events["device"]["text"]) == ("tip", "node 2: short circuit")
    assert events["device"]["faults"] == ["DEVICE"]
    assert all(event["event"] != "device" for event in detector.detect(some))
    words.hear(said(DRIVE, [0, 1], [["node 1", 0, False], ["node 2", 0, False]]))
    (well,) = [event for event in detector.detect(some) if event["event"] == "device"]
    assert (well["text"], well["faults"]) == ("node 2", [])


def test_a_rig_of_one_axis_and_one_device_has_no_doubt():
    device = DeviceDescription("device[0] 'board'", (0,), ("position",))
    rig = RigDescription("mock", (AxisDescription("joint", {}),), 1000.0, devices=(device,))
    book, some = FaultBook(rig), new_ticks(1, 1)
    some["faults"] = Fault.STALE
    book.follow(some)
    (entry,) = book.entries(int(Fault.STALE))
    assert (entry["axis"], entry["device"]) == ("joint", "device[0] 'board'")


def test_the_emergency_stop_is_the_cause_of_its_state_whatever_was_latched_before():
    book, some = FaultBook(RIG), rows(1, state=State.ESTOP, fault_first=0)
    assert book.cause(some[0])["name"] == "ESTOP"
    some["state"] = State.FAULT
    assert book.cause(some[0])["name"] == "STALE"
    some["fault_first"] = -1
    assert book.cause(some[0]) is None


@pytest.mark.parametrize(
    ("before", "position", "own"),
    [(0.999, 1.01, True), (-0.999, -1.003, True), (0.5, 1.01, False), (0.999, math.nan, False)],
)
def test_a_joint_that_was_moved_past_its_travel_is_no_fault_of_the_wiring(before, position, own):
    some = rows(position_rad=[0.0, position])
    some["position_rad"][:-1, 1] = before
    some["sample_age_ticks"][-1] = 1
    some["faults"][-1] = Fault.BAD_SAMPLE
    book = FaultBook(RIG)
    book.follow(some)
    (entry,) = book.entries(int(Fault.BAD_SAMPLE))
    assert ("past its travel (position_min_rad" in entry["text"]) is own
    assert ("wiring" in entry["text"]) is not own
    assert entry["axis"] == "tip"
    assert ("then reset" in sentence(entry)) is own
