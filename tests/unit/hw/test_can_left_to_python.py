"""Compiled cycles of CAN devices leave to Python whatever is more than a sample, and lose nothing by it."""

import socket
import struct

import pytest
from can_pair import KINDS, Talker, settled

from hw.can.board_backend import BoardBackend
from hw.interface import LinkFault, LinkLost


def test_frames_behind_one_for_python_are_kept_and_decoded_once(pair):
    device = settled(pair, "can-odrive.toml", "odrive")
    before = device.tick["sample_count"][0]
    drive = device.backend.drives[0]
    node, beats = drive.node << 5, drive._beats
    beat = node | 0x01, struct.pack("<IBBBB", 0, 8, 0, 0, 0)
    late = [(node | 0x09, struct.pack("<ff", 2.0, 0.0)), (node | 0x14, struct.pack("<ff", 0.0, 0.5))]
    device.sim.pass_time = lambda *_: []
    seen, _ = device.cycle(enabled=1, more=[late[0], beat, late[1]])
    assert device.left == {"read": 1, "write": 1}
    assert (seen["sample_count"][0], seen["current_a"][0, 0]) == (before + 1, drive._shaft.direction * 0.5)
    assert drive._beats == beats + 1
    seen, _ = device.cycle(enabled=1, more=late)
    assert device.left == {"read": 1, "write": 1}, "compiled again"
    assert seen["sample_count"][0] == before + 2


def test_damage_before_a_frame_for_python_is_a_fault_of_that_cycle(pair):
    device = settled(pair, "can-odrive.toml", "odrive")
    node = device.backend.drives[0].node << 5
    beat = node | 0x01, struct.pack("<IBBBB", 0, 8, 0, 0, 0)
    device.sim.pass_time = lambda *_: []
    seen, _ = device.cycle(enabled=1, more=[(node | 0x09, bytes(7)), beat])
    assert LinkFault(int(seen["link_faults"][0])) == LinkFault.CHECKSUM
    seen, _ = device.cycle(enabled=1)
    assert seen["link_faults"][0] == 0
    assert device.backend.counts()["damaged"] == 1


@pytest.mark.parametrize("names", KINDS[:2])
def test_a_drive_that_falls_silent_is_lost_in_the_same_cycle_both_ways(pair, names):
    told = []
    for half in (False, True):
        device = pair(*names, compiled_half=half)
        for _ in range(20):
            device.cycle(enabled=1)
        device.sim.pass_time = lambda *_: []
        told.append([device.cycle(enabled=1)[0]["link_faults"][0] for _ in range(900)])
    assert told[0] == told[1]
    assert {LinkFault(int(one)) for one in told[0]} >= {LinkFault(0), LinkFault.LOST}


def test_a_command_that_finds_no_room_is_told_in_the_next_cycle_and_counted_once(pair):
    device = settled(pair, "can-odrive.toml", "odrive")
    device.answer = list  # nobody takes what is sent
    device.sim.pass_time = lambda *_: []
    device.bus.near.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4608)
    device.bus.sent()
    for _ in range(40):
        device.cycle(enabled=1)
    counts, health = device.backend.counts(), device.bus.health
    assert counts["bus_tx_refused"] == health.refused_in_a_row > 20
    assert health.link_faults == LinkFault.LOST
    assert len(device.bus.sent()) + counts["bus_tx_refused"] == 40
    del device.answer
    device.cycle(enabled=1)
    assert (health.refused_in_a_row, health.link_faults) == (0, 0)


def test_a_socket_that_breaks_is_a_lost_link_though_the_kernel_says_so_once(pair):
    device = settled(pair, "can-odrive.toml", "odrive")
    device.step("read")
    device.backend._steady.bus["error"] = 100  # ENETDOWN, as a compiled cycle keeps it
    for name in ("read", "read"):
        with pytest.raises(LinkLost, match="the interface is down"):
            getattr(device.backend, name)(device.tick)
    with pytest.raises(LinkLost, match="the interface is down"):
        device.backend.write(device.tick)


def test_a_closed_socket_is_left_to_python(pair):
    device = settled(pair, "can-odrive.toml", "odrive")
    device.backend._steady.bus["fd"] = -1
    with pytest.raises(LinkLost):
        device.step("read")


def test_after_a_re_plug_compiled_code_works_on_the_new_bus(pair, monkeypatch):
    device = settled(pair, "can-odrive.toml", "odrive")
    before = device.tick["sample_count"][0]
    device.backend.close()
    device.bus = type(device.bus)(False)
    device.bus.pump = device.answer
    monkeypatch.setattr("hw.can.backend.open_bus", lambda _options: device.bus)
    device.backend.open()
    device.answer()
    device.bus.pump = None
    for _ in range(20):
        device.cycle(enabled=1)
    assert device.left["write"] < 15
    assert device.tick["sample_count"][0] > 10
    assert before > 0


def test_whoever_asks_takes_the_device_back_and_sees_what_it_knows(pair):
    device = settled(pair, "can-board.toml", "can")
    steady = device.backend._steady
    for ask in (device.backend.counts, device.backend.words, device.backend.stop):
        device.cycle(enabled=1)
        assert steady.bus["on"][0] != 0
        ask()
        assert steady.bus["on"][0] == 0
        device.cycle(enabled=1)
    assert device.backend.counts()["samples"] == device.tick["sample_count"][0]


class Odd(Talker):
    """A board that compiled code leaves to Python."""

    def __init__(self, change):
        super().__init__("xor8")
        self.change = change

    def options(self):
        found = super().options()
        self.change(found)
        return found


def in_parts(options):
    one = options["receive"][0]
    one["parts"], one["length"] = (4, 8), 12


def too_wide(options):
    options["receive"][0]["select"][0].update(start_bit=0, bits=56, value=7)


def by_fraction(options):
    options["receive"][0]["select"][0].update(start_bit=0, bits=32, type="float")


def too_many(options):
    options["receive"] += [{**options["receive"][1], "id": 0x100 + k} for k in range(80)]


@pytest.mark.parametrize("change", [in_parts, too_wide, by_fraction, too_many])
def test_what_the_tables_cannot_say_stays_with_python(pair, monkeypatch, change):
    monkeypatch.setattr(BoardBackend, "_heard", lambda *_: True)
    device = pair("can-board.toml", "can", talker=Odd(change))
    assert device.parts is None


def test_a_command_too_wide_for_a_float_is_written_by_python(pair):
    def wide(options):
        options["send"][1]["field"][0].update(start_bit=0, bits=60)

    device = pair("can-board.toml", "can", talker=Odd(wide))
    for _ in range(10):
        device.cycle(enabled=1)
    assert device.left == {"read": 10, "write": 10}
