"""A CAN board by its field map that lets go by itself, is plugged in again, or never says what the map
promises.
"""

import math
import struct

import pytest
from board_frames import SENSED, opened, sensed
from test_can_select import PARTS, feed, parts, receiving

from hw.interface import LinkFault


def test_a_counter_and_an_angle_are_followed_on_over_a_re_plug(monkeypatch):
    turn = {"channel": "position", "byte": 0, "bits": 16, "unit": "deg", "wrap_at": 360.0}
    frame = {"id": 1, "length": 2, "field": [turn]}
    for receive, told, step in [
        ([SENSED], [sensed(9, counts=65_000), sensed(10, counts=500)], 1036 * 2 * math.pi / 4096),
        ([frame], [(1, struct.pack("<H", 350)), (1, struct.pack("<H", 10))], math.radians(20)),
    ]:
        backend, bus, tick = opened(monkeypatch, lambda n, first=told[0]: [first], receive=receive)
        bus.answer = lambda n, first=told[0]: [first if first[0] == 1 else sensed(20, counts=65_000)]
        backend.read(tick)
        before = float(tick["position_rad"][0, 0])
        backend.close()
        bus.answer = lambda n, last=told[1]: [last]
        backend.open()
        backend.warm_up(tick)
        bus.answer = lambda n, last=told[1]: [last if last[0] == 1 else sensed(11, counts=500)]
        backend.read(tick)
        assert tick["position_rad"][0, 0] - before == pytest.approx(step)


def test_a_board_that_tells_that_it_drives_stays_down_once_it_has_let_go(monkeypatch):
    sensed_too = {**SENSED, "field": [*SENSED["field"][:3], {"channel": "enabled", "byte": 5, "bits": 8}]}
    backend, bus, tick = opened(monkeypatch, receive=[sensed_too])
    held = []

    def exchange(enabled, times=1):
        for _ in range(times):
            tick["enabled"], tick["current_command_a"] = enabled, 1.0
            backend.write(tick)
            drives = bus.sent[-1][4] and not held
            bus.answer = lambda n, on=drives: [sensed(n, fault=int(on))]
            backend.read(tick)
            tick["tick"] += 1
        return LinkFault(int(tick["link_faults"][0]))

    assert "enabled" not in backend.provides
    assert exchange(0, 3) == 0
    assert exchange(1, 3) == 0
    held.append("it lets go")
    assert exchange(1) == LinkFault.DEVICE
    held.clear()
    assert exchange(1, 600) == LinkFault.DEVICE
    assert (bus.sent[-1][4], bus.sent[-1][:2]) == (0, b"\0\0"), "disabled, no current"
    assert exchange(0) == 0
    assert exchange(1, 600) == 0
    assert bus.sent[-1][4] == 1
    assert exchange(0) == 0
    held.append("it never comes up")
    assert exchange(1, 400) == 0
    assert exchange(1, 150) == LinkFault.DEVICE


def test_a_board_that_had_let_go_is_as_new_after_a_re_plug(monkeypatch):
    told = {**SENSED, "field": [*SENSED["field"][:3], {"channel": "enabled", "byte": 5, "bits": 8}]}
    backend, bus, tick = opened(monkeypatch, receive=[told])
    for on in (1, 1, 0):  # it comes up, and lets go
        tick["enabled"] = 1
        backend.write(tick)
        bus.answer = lambda n, on=on: [sensed(n, fault=on)]
        backend.read(tick)
    assert LinkFault(int(tick["link_faults"][0])) == LinkFault.DEVICE
    backend.close()
    tick["enabled"] = 0
    backend.open()
    backend.warm_up(tick)
    backend.read(tick)
    assert int(tick["link_faults"][0]) == 0


def test_a_fault_in_a_frame_of_parts_lasts_where_compiled_cycles_do_not_see_it():
    fault = {"channel": "fault", "byte": 10, "bits": 8}
    _, (frame,), by_id = receiving([{**PARTS, "field": [*PARTS["field"], fault]}])
    assert not frame.steady().numbers
    feed(by_id[0x100], *parts(1, 10))
    assert not frame.lasting_fault
    body = parts(2, 10)[0] + bytes([0, 10, 1, 0, 0, 0])
    feed(by_id[0x100], body[:8], body[8:] + (sum(body) & 0xFFFF).to_bytes(2, "big"))
    assert frame.lasting_fault
