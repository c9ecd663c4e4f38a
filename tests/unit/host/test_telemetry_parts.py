import math
from dataclasses import replace

import msgpack
import numpy as np
import pytest

from rtctl.control.vocabulary import Fault, State
from rtctl.host.exchange.events import EventDetector
from rtctl.host.exchange.fault_book import FaultBook
from rtctl.host.exchange.health import HealthWindow
from rtctl.host.exchange.motor_temperature import temperature_warnings
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.host.exchange.samples import Decimator, state_samples, tick_columns
from rtctl.tick import FIELDS, new_ticks
from rtctl.wire.fault_names import FAULT_TEXT, fault_entries

RIG = RigDescription(
    "mock", (AxisDescription("a", {}), AxisDescription("b", {})), 1000.0, start_wall_ns=10**18, session=7
)

BOOK = FaultBook(RIG)


def rows(n=10, first=0):
    out = new_ticks(n, 2)
    out["tick"] = np.arange(first, first + n)
    out["time_ns"] = 5_000_000_000 + out["tick"] * 1_000_000
    out["state"], out["fault_first"] = State.IDLE, -1
    return out


def test_decimation_follows_the_time_grid_across_batches():
    pick = Decimator(1000.0, 100.0).pick
    ticks = np.arange(0, 100)
    chosen = [int(batch[i]) for batch in np.split(ticks, [3, 17, 18, 60]) for i in pick(batch)]
    assert chosen == list(range(0, 100, 10))


def test_decimation_keeps_one_sample_per_slot_when_ticks_are_missed():
    assert Decimator(1000.0, 100.0).pick(np.array([0, 1, 12, 13, 47])).tolist() == [0, 2, 4]
    assert len(Decimator(1000.0, 100.0).pick(np.zeros(0, int))) == 0


def test_a_state_rate_above_the_loop_rate_shows_every_tick():
    assert len(Decimator(100.0, 1000.0).pick(np.arange(20))) == 20


def test_a_state_sample_starts_with_its_time_stamp_and_every_number_is_a_float():
    some = rows(2)
    some["temperature_c"] = math.nan
    samples = msgpack.unpackb(msgpack.packb(state_samples(some, RIG, 4, 5_010_000_000)))
    assert [sample["sequence"] for sample in samples] == [4.0, 5.0]
    assert next(iter(samples[0])) == "timestamp"
    assert abs(samples[1]["timestamp"] - (1e9 + 5.001)) < 1e-6
    assert abs(samples[1]["age_s"] - 0.009) < 1e-9
    assert math.isnan(samples[0]["temperature_c"][1])
    for value in samples[0].values():
        for leaf in value if isinstance(value, list) else [value]:
            assert type(leaf) is float
    assert set(samples[0]) >= {field.name for field in FIELDS} - {"seal"}
    assert "seal" not in samples[0]


def test_a_sample_of_a_virtual_clock_has_no_age():
    virtual = RigDescription("mock", RIG.axes, 1000.0, virtual=True)
    assert math.isnan(state_samples(rows(1), virtual, 0, 0)[0]["age_s"])


def test_columns_rebuild_the_rows_bit_for_bit():
    some = rows(5)
    some["position_rad"] = np.random.default_rng(1).normal(size=(5, 2))
    some["velocity_rad_s"][2] = np.nan
    some["faults"] = 1 << 63
    again = np.zeros(5, some.dtype)
    for name, column in tick_columns(some).items():
        again[name] = np.frombuffer(column["data"], column["dtype"]).reshape(column["shape"])
    assert again.tobytes() == some.tobytes()


@pytest.mark.parametrize(
    "record",
    [
        [("a", "u1"), ("b", "<f8")],
        [("a", "<f8"), ("b", "<i4"), ("c", "<i4")],
        [("a", "<f8", (2, 3)), ("b", "<u8", (1, 1))],
        [("a", ">f8")],
    ],
)
def test_columns_of_any_record_are_its_fields(record):
    some = np.frombuffer(np.random.default_rng(2).bytes(4 * np.dtype(record).itemsize), record)
    for part in (some, some[::2], some[:0]):
        for name, column in tick_columns(part).items():
            assert column == {"dtype": some.dtype[name].base.str, "shape": list(part[name].shape),
                              "data": part[name].tobytes()}  # fmt: skip


def test_one_event_per_transition_across_batches():
    some = rows(9)
    some["state"][3:] = State.ARMING
    some["state"][6:] = State.ACTIVE
    some["arming_delay_ticks"] = np.nan  # the pulse measured nothing
    detector = EventDetector(RIG)
    events = [event for batch in np.split(some, [3, 5]) for event in detector.detect(batch)]
    assert [(e["from"], e["to"], e["tick"]) for e in events] == [
        ("INIT", "IDLE", 0),
        ("IDLE", "ARMING", 3),
        ("ARMING", "ACTIVE", 6),
    ]
    assert [e["sequence"] for e in events] == [0, 1, 2]


def test_faults_come_before_the_state_they_cause_and_are_told_when_they_go():
    some = rows(6)
    some["faults"][2:4] = Fault.STALE | Fault.OVERSPEED
    some["state"][2:], some["fault_first"][2:] = State.FAULT, 5
    detector = EventDetector(RIG)
    detector.detect(some[:2])
    told = [(e["event"], e.get("name", e.get("to"))) for e in detector.detect(some[2:])]
    assert told == [
        ("fault", "STALE"),
        ("fault", "OVERSPEED"),
        ("state", "FAULT"),
        ("fault_cleared", "STALE"),
        ("fault_cleared", "OVERSPEED"),
    ]


def test_the_first_cause_is_marked():
    some = rows(1)
    some["faults"], some["fault_first"] = Fault.STALE | Fault.OVERSPEED, 5
    assert [e.get("first_cause") for e in EventDetector(RIG).detect(some)] == [False, True, None]


def warm(*temperatures_c, first=0):
    some = rows(3, first)
    some["temperature_c"] = temperatures_c
    return some


TRAINED = replace(RIG, axes=(AxisDescription("a", {}, (22.0, 31.0)), AxisDescription("b", {})))


def test_a_motor_outside_the_learned_temperatures_is_one_event_until_it_is_back():
    detector = EventDetector(TRAINED)
    detector.detect(rows(1))
    assert detector.detect(warm(36.0, 90.0)) == []
    (event,) = detector.detect(warm(47.2, 90.0, first=10))
    assert (event["event"], event["name"], event["axis"], event["tick"]) == (
        "warning",
        "TEMPERATURE",
        "a",
        12,
    )
    assert event["text"] == (
        "axis a: friction was learned at 22-31 degC, the motor is at 47: expect the compensation to be off"
    )
    assert detector.detect(warm(48.0, 0.0, first=20)) == []
    assert detector.detect(warm(35.5, 0.0, first=30)) == [], "within the margin, but only just"
    (gone,) = detector.detect(warm(34.9, 0.0, first=40))
    assert (gone["event"], gone["axis"], gone["sequence"]) == ("warning_cleared", "a", event["sequence"] + 1)
    (cold,) = detector.detect(warm(16.9, 0.0, first=50))
    assert "the motor is at 17" in cold["text"]


def test_no_sensor_no_range_and_no_number_are_no_warning():
    for value in (0.0, math.nan):
        assert temperature_warnings(TRAINED, warm(value, value)[-1]) == []
    assert temperature_warnings(RIG, warm(90.0, 90.0)[-1]) == []
    assert temperature_warnings(TRAINED, new_ticks(1, 2)[0]) == [], "before the first tick"


def test_every_fault_has_a_text_and_unknown_bits_a_name():
    assert set(FAULT_TEXT) == set(Fault)
    assert [entry["name"] for entry in fault_entries(1 << 40 | 1)] == ["STALE", "BIT_40"]
    assert fault_entries(0) == []


def test_health_gives_percentiles_of_its_own_second_and_counts_of_the_whole_run():
    window = HealthWindow()
    slow, fast = rows(100), rows(100, 100)
    slow["wakeup_ns"], fast["wakeup_ns"], fast["missed_ticks"] = 9000, np.arange(100) * 1000, 4
    window.add(slow)
    assert window.take(BOOK)["wakeup_us"] == {"p50": 9.0, "p99": 9.0, "p99.9": 9.0, "max": 9.0}
    window.add(fast)
    second = window.take(BOOK)
    assert (second["ticks"], second["missed_ticks"], second["wakeup_us"]["max"]) == (200, 4, 99.0)
    assert abs(second["measured_rate_hz"] - 1000.0) < 1e-6
    assert window.take(BOOK)["wakeup_us"] is None


def test_missed_slots_lower_the_measured_rate():
    window = HealthWindow()
    window.add(rows(100)[::2])
    assert abs(window.take(BOOK)["measured_rate_hz"] - 500.0) < 1e-6


def test_health_keeps_bounded_memory_when_ticks_flood_in():
    window = HealthWindow()
    for _ in range(30):
        window.add(rows(10_000))
    assert window._rows <= 110_000
    assert window.take(BOOK)["ticks"] == 300_000
