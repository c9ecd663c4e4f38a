"""The axes of ODrives and moteus on a bus that only remembers: what they say about damage, silence, faults,
and how they go off.
"""

import math
import struct
from dataclasses import replace

import numpy as np
import pytest
from hardware import rig
from remembering_bus import AXIS, DEVICE, LOST, OPTIONS, RIG, Bus, three_looks

from hw.can import cia402, drive_backend, moteus, moteus_codec, odrive, odrive_codec
from hw.can.sample import Sample, Shaft
from hw.interface import BackendError, LinkFault
from hw.motion import of_coordinate


@pytest.fixture
def no_waiting(monkeypatch):
    for module in (odrive, moteus):
        monkeypatch.setattr(module, "wait_for", three_looks)


def odrive_axis(**options):
    sample = Sample(1)
    axis = odrive.OdriveAxis(AXIS, {**OPTIONS, **options}, RIG, 0, sample)
    return axis, sample, axis.handlers()


def test_an_odrive_counts_frames_of_a_wrong_length_as_damaged_and_keeps_what_it_knew():
    axis, sample, on = odrive_axis()
    for command in (odrive_codec.GET_ENCODER, odrive_codec.GET_IQ):
        on[odrive_codec.can_id(5, command)](bytes(7), 0, 7)
    assert sample.counts["damaged"] == 2
    assert sample.faults == int(LinkFault.CHECKSUM)
    on[odrive_codec.can_id(5, odrive_codec.GET_TEMPERATURE)](bytes(7), 0, 7)
    on[odrive_codec.can_id(5, odrive_codec.HEARTBEAT)](struct.pack("<IBB", 7, 8, 0), 0, 6)
    on[odrive_codec.can_id(5, odrive_codec.ADDRESS)](bytes(6), 0, 6)
    assert math.isnan(sample.temperature_c[0])
    assert (axis.error, axis.state, axis.identity) == (0, 0, b"")
    on[odrive_codec.can_id(5, odrive_codec.GET_TEMPERATURE)](struct.pack("<ff", 30.0, 41.0), 0, 8)
    on[odrive_codec.can_id(5, odrive_codec.GET_TEMPERATURE)](struct.pack("<ff", 30.0, math.nan), 0, 8)
    on[odrive_codec.can_id(5, odrive_codec.ADDRESS)](bytes([5, 1, 2, 3, 4, 5, 6, 0]), 0, 8)
    assert (sample.temperature_c[0], axis.identity) == (41.0, bytes([1, 2, 3, 4, 5, 6]))
    assert odrive_codec.error_names(1 << 31) == "0x80000000"


def test_an_odrive_that_is_not_heard_is_refused_with_what_to_check(no_waiting):
    axis, _sample, on = odrive_axis()
    with pytest.raises(BackendError, match="no heartbeat"):
        axis.set_up(Bus())

    def beat():
        on[odrive_codec.can_id(5, odrive_codec.HEARTBEAT)](struct.pack("<IBBBB", 0, 1, 0, 0, 0), 0, 8)

    with pytest.raises(BackendError, match=r"firmware older than 0\.6 sends no temperature"):
        axis.set_up(Bus(beat))

    def versed():
        beat()
        on[odrive_codec.can_id(5, odrive_codec.GET_VERSION)](bytes([2, 4, 4, 58, 0, 6, 11, 0]), 0, 8)

    with pytest.raises(BackendError, match="no encoder estimates"):
        axis.set_up(Bus(versed))

    def everything():
        versed()
        for command in (odrive_codec.GET_ENCODER, odrive_codec.GET_IQ):
            on[odrive_codec.can_id(5, command)](struct.pack("<ff", 0.5, 0.5), 0, 8)

    bus = Bus(everything)
    axis.set_up(bus)
    asked = [can_id & 0x1F for can_id, _ in bus.sent]
    assert asked[:2] == [odrive_codec.SET_INPUT_TORQUE, odrive_codec.SET_AXIS_STATE], "torque-free first"
    assert {odrive_codec.GET_ENCODER, odrive_codec.GET_IQ} <= set(asked)


def test_an_odrive_gets_torque_only_while_armed_and_is_told_again_while_it_should_not_be(no_waiting):
    axis, _sample, on = odrive_axis()
    axis.make_frames(bus := Bus())
    axis.write(bus, 2.0, True)
    kinds = [can_id & 0x1F for can_id, _ in bus.sent]
    assert kinds[:4] == [
        odrive_codec.SET_CONTROLLER_MODE,
        odrive_codec.CLEAR_ERRORS,
        odrive_codec.SET_AXIS_STATE,
        odrive_codec.SET_INPUT_TORQUE,
    ]
    assert struct.unpack("<f", bus.sent[3][1]) == (0.0,), "not in closed loop yet"
    on[odrive_codec.can_id(5, odrive_codec.HEARTBEAT)](struct.pack("<IBBBB", 0, 8, 0, 0, 0), 0, 8)
    bus.sent.clear()
    axis.write(bus, 2.0, True)
    assert struct.unpack("<f", bus.sent[0][1])[0] == pytest.approx(2.0 * 0.05)
    bus.sent.clear()
    axis.error = 0x20
    for _ in range(101):
        axis.write(bus, 2.0, False)
    torques = [data for can_id, data in bus.sent if can_id & 0x1F == odrive_codec.SET_INPUT_TORQUE]
    assert set(torques) == {bytes(4)}
    states = [data for can_id, data in bus.sent if can_id & 0x1F == odrive_codec.SET_AXIS_STATE]
    assert states == [struct.pack("<I", odrive_codec.IDLE)] * 2
    assert [can_id & 0x1F for can_id, _ in bus.sent].count(odrive_codec.CLEAR_ERRORS) == 1
    assert axis.link_faults() == DEVICE | LOST, "no heartbeat for 101 cycles"
    assert "DRV_FAULT" in axis.status()
    axis.error = axis.state = 0
    bus.sent.clear()
    for _ in range(100):
        axis.write(bus, 0.0, False)
    assert not [
        1
        for can_id, _ in bus.sent
        if can_id & 0x1F in (odrive_codec.SET_AXIS_STATE, odrive_codec.CLEAR_ERRORS)
    ]
    assert axis.status() == "node 5: state UNDEFINED (0)"


def test_an_odrive_that_does_not_arm_or_falls_silent_is_a_fault():
    axis, _, _ = odrive_axis(feedback="cyclic")
    axis.make_frames(bus := Bus())
    axis.write(bus, 0.0, True)
    assert axis.link_faults() == 0
    for _ in range(521):
        axis.write(bus, 0.0, True)
    assert axis.link_faults() == DEVICE | LOST
    axis.prime(bus)
    axis.stop(bus)
    assert [data for _, data in bus.sent[-2:]] == [bytes(4), struct.pack("<I", odrive_codec.IDLE)]
    assert not [1 for can_id, _ in bus.sent if can_id & 0x1F == odrive_codec.GET_ENCODER]


def test_the_traffic_of_each_kind_is_named():
    assert [frame.name for frame in cia402.traffic(OPTIONS, 1000.0)][:3] == [
        "SYNC",
        "host heartbeat",
        "node 5 RPDO1",
    ]
    assert [frame.name for frame in cia402.traffic(OPTIONS, 1000.0)][3:] == [
        "node 5 TPDO1",
        "node 5 heartbeat",
    ]
    fast = {**OPTIONS, "axis": [{**AXIS, "velocity_units": 4096.0}]}
    last = cia402.traffic(fast, 1000.0)[-1]
    assert (last.name, last.length, last.per_s) == ("node 5 TPDO2", 4, 1000.0)
    assert [frame.length for frame in moteus_codec.traffic(OPTIONS, 1000.0)] == [48, 32]


def moteus_axis():
    sample = Sample(1)
    axis = moteus.MoteusAxis(AXIS, OPTIONS, RIG, 0, sample)
    return axis, sample, axis.handlers()[moteus_codec.reply_ids(5, 0)[0]]


def reply(mode=10, position=0.25, velocity=-0.5, current=1.5, temperature=40.0, fault=0):
    return (
        bytes([0x21, 0x00, mode]) + b"\x2f\x01" + struct.pack("<fff", position, velocity, 0.1)
        + b"\x2d\x04" + struct.pack("<f", current) + b"\x2d\x0e" + struct.pack("<f", temperature)
        + bytes([0x21, 0x0F, fault])
    )  # fmt: skip


@pytest.mark.parametrize(
    "bad",
    [
        b"\x30\x00", b"\x21", b"\x24\x00", b"\x20\x50\x00" + bytes(100), b"\x21\x80\x80\x00\x00", b"\x21\x80",
        b"\x2f\x01\x00",
        b"\x51\x00\x00", b"\x20",
    ],
)  # fmt: skip
def test_what_is_no_reply_of_a_moteus_is_damage(bad):
    _, sample, on = moteus_axis()
    on(bad, 0, len(bad))
    assert sample.counts["damaged"] == 1
    assert sample.fresh == 0


def test_registers_of_two_bytes_and_of_other_types_are_read_as_what_they_are():
    assert moteus_codec.parse_reply(b"\x21\x80\x02\x07") == {0x100: 7}
    assert moteus_codec.parse_reply(b"\x20\x02\x03\x05\x06") == {3: 5, 4: 6}
    integers = b"\x21\x00\x0a" + b"\x22\x01\x01\x02" + b"\x21\x04\x01" + b"\x21\x0e\x28" + b"\x21\x0f\x00"
    assert moteus_codec.decode_reply(integers, 0, len(integers)) is None, "an angle is asked for as a float"
    floats = b"\x2d\x00" + struct.pack("<f", 10.0) + reply()[3:]
    assert moteus_codec.decode_reply(floats, 0, len(floats)) is None, "a mode is asked for as an integer"


@pytest.mark.parametrize("field", ["position", "velocity", "current", "temperature"])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_moteus_value_that_is_not_finite_has_not_arrived(field, value):
    _, sample, on = moteus_axis()
    on(reply(**{field: value}), 0, 32)
    assert sample.counts["not_finite"] == 1
    assert sample.fresh == 0
    on(reply(), 0, 32)
    assert sample.fresh == sample.needed
    assert sample.position_rad[0] == pytest.approx(0.25 * 2 * math.pi / 10)
    assert sample.velocity_rad_s[0] == pytest.approx(-0.5 * 2 * math.pi / 10)
    assert (sample.current_a[0], sample.temperature_c[0]) == (1.5, 40.0)


def test_a_moteus_is_stopped_learned_and_refused_when_it_is_silent(no_waiting):
    axis, _sample, on = moteus_axis()
    bus = Bus()
    with pytest.raises(BackendError, match="moteus id 5: no reply"):
        axis.set_up(bus)
    assert bus.sent[1][1][:3] == moteus_codec.STOP
    number = b"\x2b\xa0\x02" + struct.pack("<3i", 1, -2, 3)

    def answer():
        on(number, 0, len(number))
        on(reply(mode=0), 0, 32)

    axis.set_up(Bus(answer))
    assert axis.identity == struct.pack("<3I", 1, 0xFFFFFFFE, 3)


@pytest.mark.parametrize("kind", ["odrive", "moteus"])
def test_every_drive_of_a_bus_is_stopped_before_the_first_one_is_learned(kind, no_waiting):
    """The second of two was driven on, as another program had left it, while the first did not answer."""
    backend = object.__new__(drive_backend.OdriveBackend if kind == "odrive" else drive_backend.MoteusBackend)
    made = [backend.kind({**AXIS, "node": node}, OPTIONS, RIG, 0, Sample(1)) for node in (5, 6)]
    backend.drives, bus = made, Bus()
    bus.subscribe = lambda _handlers: None
    with pytest.raises(BackendError, match=f"{kind} (node|id) 5"):
        backend._set_up(bus)
    stops = Bus()
    for one in made:
        one.make_frames(stops)
        one.stop(stops)
    assert len(stops.sent) == (4 if kind == "odrive" else 2)
    assert bus.sent[: len(stops.sent)] == stops.sent


def test_a_moteus_in_fault_or_not_armed_is_a_fault_of_the_device():
    axis, _, on = moteus_axis()
    axis._command, axis._stop = (Bus().outgoing(1, 48), Bus().outgoing(2, 16))
    axis._command.buffer[:] = moteus_codec.command_frame()
    bus = Bus()
    on(reply(mode=moteus_codec.FAULT, fault=33), 0, 32)
    assert axis.link_faults() == DEVICE
    assert axis.status() == "id 5: mode fault (1), fault motor driver fault (33)"
    on(reply(mode=0), 0, 32)
    assert axis.link_faults() == 0
    for _ in range(201):
        axis.write(bus, 100.0, True)
    assert struct.unpack_from("<f", bus.sent[-1][1], 14)[0] == pytest.approx(20.0 * 0.05)
    assert axis.link_faults() == DEVICE
    on(reply(mode=10), 0, 32)
    assert axis.link_faults() == 0
    axis.write(bus, 1.0, False)
    assert bus.sent[-1][0] == 2
    axis.prime(bus)
    axis.stop(bus)
    assert [can_id for can_id, _ in bus.sent[-2:]] == [2, 2]
    assert axis.status() == "id 5: mode position (10)"


def test_an_odrive_shows_its_velocity_at_the_joint_and_one_that_is_not_finite_has_not_arrived():
    _, sample, on = odrive_axis()
    encoder = on[odrive_codec.can_id(5, odrive_codec.GET_ENCODER)]
    for speed in (math.nan, math.inf, -math.inf):
        encoder(struct.pack("<ff", 1.0, speed), 0, 8)
    assert (sample.counts["not_finite"], sample.fresh) == (3, 0)
    encoder(struct.pack("<ff", 1.0, -2.5), 0, 8)
    assert sample.velocity_rad_s[0] == pytest.approx(-2.5 * 2 * math.pi / 10)


def test_a_sample_counts_what_is_not_newer():
    sample = Sample(2)
    sample.not_newer()
    assert sample.counts == {"damaged": 0, "not_newer": 1, "not_finite": 0}
    assert sample.faults == int(LinkFault.SEQUENCE)


@pytest.mark.parametrize(("shaft", "m_per_turn", "nm_per_a"), [("motor", 1e-3, 0.02), ("link", 5e-3, 0.1)])
def test_a_turn_of_a_screw_is_its_lead_and_torque_on_it_is_that_of_the_gear(shaft, m_per_turn, nm_per_a):
    lead_m, gear = 5e-3, 5.0
    of_motion, _ = of_coordinate("linear", lead_m)
    carriage = replace(rig(gear_ratio=gear * of_motion, torque_constant_nm_a=0.02), lead_m=np.full(1, lead_m))
    table = {"shaft": shaft, "direction": -1, "offset_rad": 0.0, "current_max_a": 5.0}
    found = Shaft(table, carriage, 0)
    assert found.rad_per_turn == pytest.approx(-m_per_turn)
    assert found.torque_per_ampere == pytest.approx(-nm_per_a)


@pytest.mark.parametrize("shaft", ["motor", "link"])
def test_a_linear_motor_on_a_drive_that_speaks_of_turns_is_refused_with_what_to_give(shaft):
    table = {"shaft": shaft, "direction": 1, "offset_rad": 0.0, "current_max_a": 5.0}
    with pytest.raises(BackendError, match="lead_m the travel that the drive counts as one turn"):
        Shaft(table, replace(rig(), lead_m=np.zeros(1)), 0)
