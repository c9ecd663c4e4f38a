"""A lost device is shown to the law, left alone, and found again."""

import numpy as np
import pytest

from hw.claims import Claims
from hw.interface import BackendError, CompiledBackend, LinkFault, LinkLost
from rtctl.rt import process
from rtctl.rt.replug import REOPEN_TICKS, Replug
from rtctl.tick import new_ticks


class Device:
    """Gives samples until it is unplugged; opens again after `absent` attempts."""

    provides = frozenset({"position"})
    consumes = frozenset({"torque"})

    def __init__(self):
        self.calls, self.there, self.absent, self.count = [], True, 0, 0
        self.refusal = BackendError("port is gone: plug it in")

    def open(self):
        self.calls.append("open")
        if self.absent:
            self.absent -= 1
            raise self.refusal
        self.there = True

    def read(self, tick):
        if not self.there:
            raise LinkLost("read: unplugged")
        self.count += 1
        tick["sample_count"], tick["link_faults"] = self.count, 0

    def write(self, tick):
        if not self.there:
            raise LinkLost("write: unplugged")
        self.calls.append("write")

    def stop(self):
        self.calls.append("stop")

    def close(self):
        self.calls.append("close")


@pytest.fixture
def plugged():
    device, said = Device(), []
    return device, Replug(device, said.append), said, new_ticks(1, 1)


def cycles(replug, tick, n):
    lost = []
    for _ in range(n):
        replug.read(tick)
        replug.write(tick)
        lost.append(bool(int(tick["link_faults"][0]) & LinkFault.LOST))
    return lost


def test_a_device_that_is_there_is_passed_through(plugged):
    device, replug, said, tick = plugged
    assert cycles(replug, tick, 10) == [False] * 10
    assert device.calls == ["write"] * 10
    assert int(tick["sample_count"][0]) == 10
    assert replug.provides == device.provides
    assert replug.consumes == device.consumes
    assert said == []


def test_a_loss_in_read_is_seen_at_once_and_nothing_is_sent(plugged):
    device, replug, said, tick = plugged
    device.there = False
    assert cycles(replug, tick, 5) == [True] * 5
    assert device.calls == ["stop"]
    assert said == ["lost: read: unplugged"]


def test_a_loss_in_write_is_seen_in_the_next_tick(plugged):
    device, replug, said, tick = plugged
    replug.read(tick)
    device.there = False
    replug.write(tick)
    assert not int(tick["link_faults"][0])
    assert cycles(replug, tick, 1) == [True]
    assert said == ["lost: write: unplugged"]


@pytest.mark.parametrize("kind", [BackendError, OSError])
def test_it_is_looked_for_now_and_then_and_found(plugged, kind):
    device, replug, said, tick = plugged
    device.there, device.absent = False, 2
    device.refusal = kind("port is gone: plug it in")
    lost = cycles(replug, tick, 3 * REOPEN_TICKS + 10)
    assert device.calls.count("open") == 3
    assert device.calls.count("close") == 3
    assert lost.index(False) == 3 * REOPEN_TICKS
    assert not any(lost[3 * REOPEN_TICKS :])
    assert said == ["lost: read: unplugged", "not found again: port is gone: plug it in", "found again"]


def test_only_a_lost_link_is_caught(plugged):
    device, replug, _, tick = plugged
    device.read = lambda _tick: 1 / 0
    with pytest.raises(ZeroDivisionError):
        replug.read(tick)


def test_a_device_whose_opening_the_system_refuses_is_told_at_the_start(monkeypatch):
    device, said = Device(), []
    device.absent, device.refusal = 1, PermissionError(13, "Permission denied", "/dev/ttyUSB0")
    monkeypatch.setattr(process, "_say", lambda what, **more: said.append((what, more)))
    assert process._open(device, [], Claims()) is None
    assert said == [("ended", {"reason": "device", "detail": "[Errno 13] Permission denied: '/dev/ttyUSB0'"})]


def test_it_compiles_what_the_device_has_to_compile():
    class Compiled(Device):
        def warm_up(self, tick):
            self.calls.append("warm_up")

    device = Compiled()
    assert isinstance(Replug(device), CompiledBackend)
    Replug(device).warm_up(np.zeros(1))
    assert device.calls == ["warm_up"]
    Replug(Device()).warm_up(np.zeros(1))


def test_every_attempt_to_open_is_announced_before_and_after(plugged):
    device, said = plugged[0], []
    replug = Replug(device, opening=lambda begun: said.append((begun, device.calls.count("open"))))
    device.there, device.absent = False, 1
    cycles(replug, plugged[3], 2 * REOPEN_TICKS + 2)
    assert said == [(True, 0), (False, 1), (True, 1), (False, 2)]
