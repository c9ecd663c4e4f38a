"""A board by its field map, on a bus that only remembers: which frames are taken, and what is sent."""

import math
import struct

import pytest
from board_frames import FORCE, RIG, SENSED, SENT, opened, sensed
from hardware import rig

from hw.can import board_backend as board
from hw.can.board_backend import BoardBackend
from hw.can.board_options import BoardOptions
from hw.can.bus import EXTENDED
from hw.interface import BackendError, LinkFault


def test_a_frame_becomes_a_sample_with_units_and_the_counter_unwrapped(monkeypatch):
    backend, bus, tick = opened(monkeypatch)
    told = [sensed(10, counts=65_535, milliamps=-1500, estop=3)]
    bus.answer = lambda n: told
    backend.read(tick)
    assert tick["current_a"][0, 0] == pytest.approx(-1.5)
    assert tick["estop"][0] == 1
    assert tick["position_rad"][0, 0] == pytest.approx(-2 * math.pi / 4096), "one count back, not 65535 on"
    assert (tick["sample_count"][0], tick["link_faults"][0]) == (1, 0)


@pytest.mark.parametrize(
    ("frame", "fault", "counted"),
    [
        (lambda: (0x101, sensed(11)[1][:7]), LinkFault.CHECKSUM, "damaged"),
        (lambda: (0x101, sensed(11)[1][:7] + b"\xff"), LinkFault.CHECKSUM, "damaged"),
        (lambda: sensed(9), LinkFault.SEQUENCE, "not_newer"),
    ],
)
def test_a_bad_frame_is_counted_and_changes_nothing(monkeypatch, frame, fault, counted):
    backend, bus, tick = opened(monkeypatch)
    bus.answer = lambda n: [sensed(10)]
    backend.read(tick)
    before = tick.copy()
    bus.answer = lambda n: [frame()]
    backend.read(tick)
    assert tick["link_faults"][0] == fault
    assert backend.counts()[counted] == 1
    tick["link_faults"] = before["link_faults"]
    assert tick.tobytes() == before.tobytes()


SPEEDS = {
    "rad/s": 1.0,
    "deg/s": math.pi / 180,
    "turn/s": 2 * math.pi,
    "rpm": math.pi / 30,
    "count/s": 2 * math.pi / 4096,
}


@pytest.mark.parametrize("unit", SPEEDS)
def test_a_velocity_has_the_unit_and_sign_the_map_says(monkeypatch, unit):
    speed = {"channel": "velocity", "byte": 0, "bits": 16, "type": "int", "unit": unit, "scale": -0.5}
    frames = [SENSED, {"id": 0x102, "length": 2, "field": [speed]}]
    backend, bus, tick = opened(monkeypatch, lambda n: [sensed(n), (0x102, bytes(2))], receive=frames)
    bus.answer = lambda n: [sensed(100), (0x102, struct.pack("<h", -300))]
    backend.read(tick)
    assert "velocity" in backend.provides
    assert tick["device_velocity_rad_s"][0, 0] == pytest.approx(150 * SPEEDS[unit])
    bus.answer = lambda n: [sensed(101)]
    backend.read(tick)
    assert tick["sample_count"][0] == 1, "a required frame is missing: nothing of the sample is fresh"


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_number_that_is_not_finite_is_not_shown(monkeypatch, value):
    backend, bus, tick = opened(monkeypatch)
    bus.answer = lambda n: [(0x1FFF0 | EXTENDED, struct.pack("<f", 2.5)), sensed(n)]
    backend.read(tick)
    bus.answer = lambda n: [(0x1FFF0 | EXTENDED, struct.pack("<f", value)), sensed(n + 1)]
    backend.read(tick)
    assert tick["force_n"][0].tolist() == [0.0, 0.0, 2.5]
    assert backend.counts()["not_finite"] == 1


def test_a_fault_of_the_board_lasts_as_long_as_it_says(monkeypatch):
    backend, bus, tick = opened(monkeypatch)
    bus.answer = lambda n: [sensed(10, fault=1)]
    backend.read(tick)
    assert tick["link_faults"][0] == LinkFault.DEVICE
    bus.answer = lambda n: [sensed(11)]
    backend.read(tick)
    assert tick["link_faults"][0] == 0


SLOW = {"id": 0x103, "length": 3, "required": False, "period_ms": 10.0}
STOP_INPUT, HEAT = (
    {"channel": "estop", "byte": 0, "bits": 8},
    {"channel": "temperature", "byte": 1, "bits": 16},
)
HEAT["unit"] = "degC"
SOFT = {key: value for key, value in SENSED.items() if key != "field"}
SOFT["field"] = [field for field in SENSED["field"] if field["channel"] != "estop"]


@pytest.mark.parametrize(("fields", "faults"), [([STOP_INPUT, HEAT], LinkFault.LOST), ([HEAT], 0)])
def test_a_slow_frame_that_comes_no_more_tells_nothing_any_more(monkeypatch, fields, faults):
    backend, bus, tick = opened(monkeypatch, receive=[SOFT, {**SLOW, "field": fields}])

    def cycle(count, *frames):
        bus.answer = lambda _n: [sensed(count), *frames]
        backend.read(tick)
        backend.write(tick)
        return int(tick["link_faults"][0]), float(tick["temperature_c"][0, 0])

    assert cycle(100, (0x103, struct.pack("<BH", 0, 40))) == (0, 40.0)
    for k in range(50):  # five of its periods
        assert cycle(101 + k) == (0, 40.0)
    found, celsius = cycle(152)
    assert (found, math.isnan(celsius)) == (faults, True)
    assert backend.words()[0].text == ("frame 0x103 does not come" if faults else "")
    assert cycle(153, (0x103, struct.pack("<BH", 0, 41))) == (0, 41.0)
    assert backend._alike() == 49, "the last cycle was one of them"
    # whenever it comes it is Python's: compiled cycles would not know that it came
    assert [bool(frame.numbers) for frame in backend.steady_frames()] == [True, False]
    backend._received[1].fault = True
    assert backend._lasting_faults() == LinkFault.DEVICE


def test_a_slow_frame_without_a_period_may_come_when_it_likes(monkeypatch):
    backend, _, _ = opened(monkeypatch)
    backend.pass_by(10_000_000)
    assert backend._device_faults() == 0


@pytest.mark.parametrize(
    ("current_a", "torque_nm", "enabled", "sent"),
    [
        (1.5, -0.25, 1, (1500, -250, 1)),
        (99.0, -99.0, 1, (5000, -2000, 1)),
        (1.5, 0.25, 0, (0, 0, 0)),
        (math.nan, 0.25, 1, (0, 0, 0)),
        (1.5, -math.inf, 1, (0, 0, 0)),
    ],
)
def test_commands_are_scaled_cut_and_disabled_when_not_finite(
    monkeypatch, current_a, torque_nm, enabled, sent
):
    backend, bus, tick = opened(monkeypatch)
    tick["current_command_a"], tick["torque_applied_nm"], tick["enabled"] = current_a, torque_nm, enabled
    backend.write(tick)
    frame = bus.sent[-1]
    assert struct.unpack_from("<hhB", frame) == sent
    assert frame[6] == 0x5A
    assert frame[7] == sum(frame[:7]) & 0xFF
    assert [one[5] for one in bus.sent[-3:]] == [(frame[5] - back) % 4 for back in (2, 1, 0)]


def test_a_board_that_lost_the_first_question_is_asked_again(monkeypatch):
    _backend, bus, _tick = opened(monkeypatch, lambda n: [sensed(n)] if n >= 15 else [])
    assert 15 <= len(bus.sent) <= 25


def test_a_board_without_checksum_or_counter_that_only_measures(monkeypatch):
    bare = {key: value for key, value in SENSED.items() if key not in ("counter", "checksum")}
    backend, bus, tick = opened(monkeypatch, receive=[bare], send=[])
    bus.answer = lambda n: [(0x101, bytes(8)), (0x101, bytes(8))]
    backend.read(tick)
    assert (tick["sample_count"][0], tick["link_faults"][0], backend.consumes) == (1, 0, frozenset())
    backend.write(tick)
    assert bus.sent == []


def test_a_command_without_checksum_or_counter(monkeypatch):
    bare = {"id": 0x200, "length": 2, "field": SENT["field"][:1]}
    backend, bus, tick = opened(monkeypatch, send=[bare])
    tick["current_command_a"], tick["enabled"] = -0.5, 1
    backend.write(tick)
    assert bus.sent[-1] == struct.pack("<h", -500)


def test_a_silent_board_is_named_with_what_to_check(monkeypatch):
    monkeypatch.setattr(board, "wait_for", lambda bus, done, seconds: done())
    with pytest.raises(BackendError, match=r"frames 0x101 came within 1 s: check power"):
        opened(monkeypatch, lambda n: [])


def test_all_frames_of_the_board_are_in_the_load_of_its_bus():
    options = BoardOptions.model_validate(
        {"bus": {"channel": "can0"}, "receive": [{**SENSED, "period_ms": 0.5}, FORCE], "send": [SENT]}
    )
    per_s = {one.name: one.per_s for one in options.frames(1000.0)}
    assert per_s == {"frame 0x101": 2000.0, "frame 0x1fff0": 1000.0, "frame 0x200": 1000.0}


def test_an_axis_that_is_not_there_is_refused():
    field = {"channel": "current", "axis": 1, "byte": 0, "bits": 16, "unit": "mA"}
    options = BoardOptions.model_validate(
        {"bus": {"channel": "can0"}, "receive": [{"id": 1, "field": [field]}]}
    )
    with pytest.raises(BackendError, match="names axis 1"):
        BoardBackend(options.model_dump(mode="json"), RIG)


def test_frames_that_do_not_come_are_named_also_where_select_tells_them_apart(monkeypatch):
    def part(value, channel):
        chosen = {"byte": 0, "bits": 8, "value": value}
        return {
            "id": 5,
            "length": 2,
            "select": [chosen],
            "field": [{"channel": channel, "byte": 1, "bits": 8}],
        }

    frames = [(5, b"\1\0"), (5, b"\2\0")]
    receive = [part(1, "estop"), part(2, "fault")]
    backend, bus, tick = opened(monkeypatch, lambda n: frames, receive=receive)
    backend.read(tick)
    bus.answer = lambda n: frames[:1]
    for _ in range(3):
        backend.read(tick)
    (said,) = backend.words()
    assert (said.text, said.silent) == ("frame 0x5 (select 2) does not come", True)
    bus.answer = lambda n: [frames[0], (5, b"\2\1")]
    backend.read(tick)
    assert backend.words()[0] == ("frame 0x5 (select 2) sets its fault flag", LinkFault.DEVICE, False)


POSITION = {"channel": "position", "byte": 0, "bits": 16, "unit": "count"}
CURRENT = {"channel": "current", "byte": 2, "bits": 16, "unit": "mA"}
TORQUE = {"channel": "torque", "byte": 0, "bits": 16, "type": "int", "unit": "mNm"}
AMPERES = {"channel": "current_command", "axis": 1, "byte": 2, "bits": 16, "type": "int", "unit": "mA"}


def of_two_axes(fields, commands=()):
    receive, send = [{"id": 1, "field": fields}], [{"id": 2, "field": [*commands]}] if commands else []
    options = BoardOptions.model_validate({"bus": {"channel": "can0"}, "receive": receive, "send": send})
    return BoardBackend(options.model_dump(mode="json"), rig(2))


@pytest.mark.parametrize(
    ("fields", "commands", "said"),
    [
        ([POSITION], (), r"position is given for axes \[0\]; each of axes 0 to 1 needs it"),
        ([{**CURRENT, "axis": 1}], (), r"current is given for axes \[1\]"),
        ([CURRENT, {**CURRENT, "axis": 1}], [TORQUE], r"torque or current_command is given for axes \[0\]"),
    ],
)
def test_an_axis_that_is_left_out_is_not_taken_for_one_that_stands_at_zero(fields, commands, said):
    with pytest.raises(BackendError, match=said):
        of_two_axes(fields, commands)


def test_a_board_may_measure_what_not_every_axis_has():
    force = {"channel": "force", "byte": 0, "bits": 16, "unit": "mN"}
    warm = {"channel": "temperature", "axis": 1, "byte": 2, "bits": 8, "unit": "degC"}
    backend = of_two_axes([force, warm], [TORQUE, AMPERES])
    assert (backend.provides, backend.consumes) == ({"force", "temperature"}, {"torque", "current_command"})
    assert math.isnan(backend.sample.of["temperature"][0]), "no thermometer is not 0 degrees"
    assert math.isnan(backend.taken.of["velocity"][1])
