"""A lost device is shown to the law, left alone, and found again."""

import numpy as np
import pytest

from hw.claims import Claims
from hw.interface import BackendError, CompiledBackend, LinkFault, LinkLost
from hw.refusals import DeviceMistakeError, raised_by, story_of
from rtctl.rt import process
from rtctl.rt.replug import REOPEN_TICKS, Replug
from rtctl.rt.shared_memory import Memory
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


@pytest.mark.parametrize(
    ("error", "left"), [(TypeError("no"), ["open", "stop"]), (OSError(5, "no"), ["open"])]
)
def test_a_mistake_at_opening_again_is_stopped_as_one_at_the_start(plugged, error, left):
    device, replug, _, tick = plugged
    device.there, device.absent, device.refusal = False, 1, error
    cycles(replug, tick, REOPEN_TICKS + 1)
    assert device.calls == ["stop", "close", *left]


@pytest.mark.parametrize("method", ["read", "write"])
def test_a_mistake_of_the_backend_is_not_caught(plugged, method):
    device, replug, _, tick = plugged
    setattr(device, method, lambda _tick: 1 / 0)
    with pytest.raises(
        DeviceMistakeError, match=f"^the device: {method}: ZeroDivisionError: division by zero$"
    ):
        getattr(replug, method)(tick)


def raising(error):
    def call(*_):
        raise error

    return call


@pytest.mark.parametrize("method", ["read", "write"])
def test_what_the_system_refuses_a_driver_without_words_is_a_loss(plugged, method):
    device, replug, said, tick = plugged
    setattr(device, method, raising(OSError(5, "Input/output error")))
    assert cycles(replug, tick, 2)[-1]
    assert device.calls[-1] == "stop"
    assert said == ["lost: [Errno 5] Input/output error"]


ERRORS = [ValueError("bad"), OSError("bad"), MemoryError()]


@pytest.mark.parametrize("error", ERRORS, ids=repr)
def test_whatever_stop_and_close_and_open_raise_at_a_loss_is_told_and_ends_nothing(plugged, error):
    device, replug, said, tick = plugged
    words = {OSError: "bad", ValueError: "ValueError: bad", MemoryError: "MemoryError"}[type(error)]
    device.there, device.absent, device.refusal = False, 1, error
    device.stop = device.close = raising(error)
    assert all(cycles(replug, tick, REOPEN_TICKS + 1))
    assert said == [f"lost: read: unplugged; not stopped: {words}", f"not found again: {words}, then {words}"]
    assert not cycles(replug, tick, REOPEN_TICKS)[-1]
    assert said[2:] == [f"found again, though closing it failed: {words}"]


def test_a_stop_that_fails_does_not_hide_why_there_was_one():
    def run():
        try:
            raise ValueError("first")
        finally:
            raising(OSError("second"))()

    assert story_of(raised_by(run)) == "ValueError: first; then second"
    assert raised_by(lambda: 0) is None


def test_a_device_whose_opening_the_system_refuses_is_told_at_the_start(monkeypatch):
    device, said = Device(), []
    device.absent, device.refusal = 1, PermissionError(13, "Permission denied", "/dev/ttyUSB0")
    monkeypatch.setattr(process, "_say", lambda what, **more: said.append((what, more)))
    assert process._open(device, [], Claims()) is None
    assert said == [("ended", {"reason": "device", "detail": "[Errno 13] Permission denied: '/dev/ttyUSB0'"})]


@pytest.mark.parametrize("error", [ValueError("bad"), MemoryError()], ids=repr)
def test_a_device_whose_opening_fails_by_a_mistake_is_stopped_and_told_at_the_start(monkeypatch, error):
    device, said = Device(), []
    device.absent, device.refusal = 1, error
    monkeypatch.setattr(process, "_say", lambda what, **more: said.append((what, more)))
    assert process._open(device, [], Claims()) is None
    assert device.calls == ["open", "stop"]
    assert said == [
        ("ended", {"reason": "device", "detail": f": open: {type(error).__name__}: {error}".rstrip(": ")})
    ]


@pytest.mark.parametrize("stops", [True, False])
def test_a_device_whose_warm_up_raises_is_stopped_closed_and_told(monkeypatch, stops):
    device, said = Device(), []
    device.warm_up = raising(TypeError("no such type"))
    if not stops:
        device.stop = raising(ValueError("bad"))
    monkeypatch.setattr(process, "_say", lambda what, **more: said.append((what, more)))
    memory = Memory.create(1, 8, 1_000_000)
    assert not process._warmed_up(Replug(device, place="device[0] 'mine' (axis[0])"), memory)
    memory.close()
    assert device.calls == (["stop", "close"] if stops else ["close"])
    detail = "device[0] 'mine' (axis[0]): warm_up: TypeError: no such type"
    more = "" if stops else "; not stopped: device[0] 'mine' (axis[0]): stop: ValueError: bad"
    assert said == [("ended", {"reason": "device" if stops else "error", "detail": detail + more})]


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
