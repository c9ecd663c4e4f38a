"""Several devices as one backend: time budgets, lost links, and a stop that reaches all."""

import re
import threading

import numpy as np
import pytest
from hanging import Hang
from rig_fakes import DRIVE, MADE, Fake, drive_and_finger, known, member, read, rig

from hw.interface import BackendError, LinkFault, LinkLost, Words
from hw.refusals import DeviceMistakeError
from hw.rig import compose
from rtctl.tick import new_ticks


@pytest.fixture(autouse=True)
def fakes():
    with known():
        yield


class Hands:
    """Time that passes only when a device takes it."""

    def __init__(self, monkeypatch):
        self.ns = 0
        monkeypatch.setattr("hw.rig.time.monotonic_ns", lambda: self.ns)

    def take(self, ns):
        self.ns += ns


def test_a_device_over_its_budget_delays_nobody_and_rests(monkeypatch):
    hands = Hands(monkeypatch)
    backend = compose(
        [
            member("drive", DRIVE, ["torque"], budget_ns=1000),
            member("finger", ["force"], budget_ns=1000, max_age_ticks=2),
            member("warmth", ["temperature"], max_age_ticks=5),
        ],
        rig(),
    )
    drive, finger, warmth = MADE["drive"], MADE["finger"], MADE["warmth"]
    read(backend)
    finger.on = {"read": lambda: hands.take(5000)}
    tick = read(backend)
    assert tick["link_faults"][0] == LinkFault.OVER_BUDGET
    assert warmth.calls.count("read") == 1, "left out after the slow one"
    assert tick["sample_count"][0] == 2
    for _ in range(2):
        assert read(backend)["link_faults"][0] == 0
    assert finger.calls.count("read") == 2, "rests two cycles"
    assert drive.calls.count("read") == 4
    assert warmth.calls.count("read") == 3
    read(backend)
    assert finger.calls.count("read") == 3
    assert backend.counts()["device 'finger' over_budget"] == 2


def test_a_slow_position_makes_the_tick_stale_not_fresh(monkeypatch):
    hands = Hands(monkeypatch)
    backend = compose(
        [member("drive", DRIVE, ["torque"], budget_ns=1000), member("finger", ["force"], max_age_ticks=1)],
        rig(),
    )
    MADE["drive"].on = {"read": lambda: hands.take(9000)}
    counts = [int(read(backend)["sample_count"][0]) for _ in range(18)]
    assert counts[:7] == [0, 0, 0, 1, 1, 1, 2], "a lone hiccup costs two cycles"
    assert counts[7:17] == [2] * 10, "three in a row: stale for long enough to stop the rig"


@pytest.mark.parametrize("kind", [LinkLost, OSError])
@pytest.mark.parametrize("what", ["read", "write", "open"])
def test_a_lost_link_names_the_device(what, kind):
    backend, drive, _ = drive_and_finger()

    def lose():
        raise kind("unplugged")

    drive.on = {what: lose}
    with pytest.raises(LinkLost, match="device 'drive': unplugged"):
        backend.open() if what == "open" else getattr(backend, what)(new_ticks())


@pytest.mark.parametrize("what", ["read", "write", "open", "warm_up"])
def test_a_mistake_names_the_device_its_axes_and_what_it_was_doing(what, monkeypatch):
    monkeypatch.setattr(Fake, "warm_up", lambda self, _tick: self._called("warm_up"), raising=False)
    backend = compose([member("drive", DRIVE, ["torque"]), member("tip", ["force"], axes=(1,))], rig(2))
    MADE["drive"].on = {what: lambda: np.zeros(2) + np.zeros(3)}
    told = re.escape(f"device 'drive' (axis[0]): {what}: ValueError: operands could not be broadcast")
    with pytest.raises(DeviceMistakeError, match=told):
        backend.open() if what == "open" else getattr(backend, what)(new_ticks(1, 2))


def test_words_that_raise_are_words():
    backend, drive, _ = drive_and_finger()
    drive.words = lambda: 1 / 0
    assert backend.said()[0].words == (Words("words: ZeroDivisionError: division by zero"),)


@pytest.mark.parametrize("kind", [BackendError, ValueError])
def test_when_one_cannot_be_opened_the_others_are_closed_again(kind):
    backend, drive, finger = drive_and_finger()

    def _refuse():
        raise kind("no such port")

    finger.on = {"open": _refuse}
    named = DeviceMistakeError if kind is ValueError else kind
    with pytest.raises(named, match=r"'finger'.*: no such port"):
        backend.open()
    assert drive.calls == ["open", "close"]
    drive.on = {"close": lambda: 1 / 0}
    both = r"no such port; closing the others: device 'drive': ZeroDivisionError: division by zero$"
    with pytest.raises(BackendError, match=both):
        backend.open()


_UNTOLD_NO_MORE = (
    r"^device 'a': has not come back after 0\.02 s; device 'b': ZeroDivisionError: division by zero$"
)


@pytest.mark.parametrize("what", ["stop", "close"])
def test_stop_and_close_reach_every_device_though_one_raises_and_one_hangs(what, monkeypatch):
    backend = compose(
        [member("a", ["force"]), member("b", ["estop"]), member("drive", ["position"], ["torque"])], rig()
    )
    reached, hang = threading.Event(), Hang(monkeypatch, 0.02)
    MADE["a"].on = {what: hang}
    MADE["b"].on = {what: lambda: 1 / 0}
    MADE["drive"].on = {what: reached.set}
    with pytest.raises(BackendError, match=_UNTOLD_NO_MORE):
        getattr(backend, what)()
    assert reached.is_set()
    assert not hang.came_back
    hang.end()


def test_stop_works_without_threads(monkeypatch):
    backend, drive, finger = drive_and_finger()

    def _none_left(self):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", _none_left)
    backend.stop()
    assert drive.calls == finger.calls == ["stop"]


def test_a_thousand_stops_leave_no_thread():
    backend, drive, _ = drive_and_finger()
    before = threading.active_count()
    for _ in range(1000):
        backend.stop()
    assert threading.active_count() <= before
    assert drive.calls.count("stop") == 1000
