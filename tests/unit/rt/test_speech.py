"""Devices' words reach the host: at rest only, before the tick is recorded, and again when they change."""

import json
from select import PIPE_BUF

import numpy as np
import pytest

from hw.interface import LinkFault, Words
from hw.member import Member
from hw.rig import Said
from rtctl.control.vocabulary import Fault
from rtctl.rt import process, speech
from rtctl.rt.replug import Replug
from rtctl.rt.speech import EVERY_TICKS, Speech
from rtctl.tick import new_ticks

MEMBER = Member("fake", {}, "device[0] 'drive'", (0,), ("position",))


class Drive:
    provides, consumes = frozenset({"position"}), frozenset({"torque"})

    def __init__(self):
        self.text, self.faults, self.asked = "ready", 0, 0

    def write(self, tick):
        pass

    def read(self, tick):
        tick["link_faults"] = self.faults

    def words(self):
        self.asked += 1
        return [Words(self.text, self.faults)]


@pytest.fixture
def rig():
    return Rig()


class Rig:
    def __init__(self):
        self.drive, self.told, self.room = Drive(), [], True
        self.tick = new_ticks(1, 1)
        listen = Speech(self.drive, [MEMBER], self.tell).listen
        self.device = Replug(self.drive, listen=listen)

    def tell(self, message):
        if self.room:
            self.told.append(json.loads(json.dumps(message)))
        return self.room

    def cycle(self, n=1, enabled=0, faults=0):
        for _ in range(n):
            self.device.read(self.tick)
            self.tick["enabled"], self.tick["faults"] = enabled, faults
            self.device.write(self.tick)


def test_while_torque_may_flow_nobody_makes_words(rig):
    rig.cycle(500, enabled=1)
    assert (rig.drive.asked, rig.told) == (0, [])


def test_the_tick_that_cuts_carries_the_words_and_later_ones_are_told_when_they_change(rig):
    rig.cycle(20, enabled=1)
    rig.drive.text, rig.drive.faults = "short circuit", int(LinkFault.DEVICE)
    rig.cycle(1, enabled=0, faults=Fault.DEVICE)
    (told,) = rig.told
    assert told == {
        "tick": 0, "device": "device[0] 'drive'", "axes": [0], "faults": int(LinkFault.DEVICE),
        "stale": False,
        "words": [["short circuit", int(LinkFault.DEVICE), False]],
    }  # fmt: skip
    rig.drive.text = "short circuit, emergency 0x2320"
    rig.cycle(EVERY_TICKS + 1, faults=Fault.DEVICE)
    assert rig.told[-1]["words"][0][0] == "short circuit, emergency 0x2320"
    asked = rig.drive.asked
    rig.cycle(10 * EVERY_TICKS, faults=Fault.DEVICE)
    assert len(rig.told) == 2, "nothing new: nothing said"
    assert rig.drive.asked - asked <= 11, "and seldom asked for"


@pytest.mark.parametrize("ticks", [1, 5, EVERY_TICKS - 1, EVERY_TICKS])
def test_a_fault_at_rest_is_told_in_the_words_of_its_own_tick_however_soon_after_a_look(rig, ticks):
    rig.cycle(ticks)
    rig.drive.text = "IDLE, DC_BUS_UNDER_VOLTAGE"
    rig.cycle(faults=Fault.DEVICE)
    rig.drive.text = "IDLE"
    rig.cycle(2 * EVERY_TICKS, faults=Fault.DEVICE)
    assert [one["words"][0][0] for one in rig.told] == ["ready", "IDLE, DC_BUS_UNDER_VOLTAGE", "IDLE"]


def test_a_fault_that_flickers_at_rest_does_not_fill_the_pipe(rig):
    for tick in range(1000):
        rig.drive.text = str(tick)
        rig.cycle(faults=Fault.DEVICE if tick % 2 else 0)
    assert 50 <= len(rig.told) <= 100


def test_a_new_fault_is_told_in_its_own_words_although_others_have_flickered_before_it(rig):
    for tick in range(9):  # late cycles of a busy machine
        rig.cycle(faults=Fault.STALE if tick % 2 else 0)
    rig.drive.text = "IDLE, DC_BUS_UNDER_VOLTAGE"
    rig.cycle(faults=Fault.DEVICE)
    assert rig.told[-1]["words"][0][0] == "IDLE, DC_BUS_UNDER_VOLTAGE"


def test_what_the_host_did_not_take_is_said_again(rig):
    rig.room = False
    rig.cycle(3)
    rig.room = True
    rig.cycle(EVERY_TICKS + 1)
    assert [one["words"][0][0] for one in rig.told] == ["ready"]


@pytest.mark.parametrize("letter", ["x", "°", "🤖", '"'])
def test_a_message_of_eight_axes_fits_into_a_pipe_whole(letter):
    told = tuple(Words(letter * 10_000, 63, True) for _ in range(8))
    said = Said("device[7] 'a drive of a long name'", tuple(range(8)), 63, True, told)
    whole = {"message": "words", **speech.message(said, 10**12)}
    assert len(json.dumps(whole)) < PIPE_BUF
    assert whole["words"][0][0][:30] == letter * 30


def test_a_note_fits_into_a_pipe_whole(monkeypatch):
    lines = []
    monkeypatch.setattr(process.os, "write", lambda _fd, line: lines.append(line))
    process._note("lost: " + "°" * 10_000)
    assert len(lines[0]) < PIPE_BUF
    assert json.loads(lines[0])["text"].startswith("lost: °")


def test_a_single_device_is_silent_when_the_law_calls_its_sample_stale(rig):
    rig.cycle(1, faults=Fault.STALE)
    assert rig.told[0]["stale"] is True


def test_it_speaks_while_its_device_is_lost_too():
    rig = Rig()
    rig.device._wait = 100
    rig.cycle(faults=Fault.LINK_LOST)
    assert len(rig.told) == 1
    assert speech.MOST_LETTERS < 1000
    assert np.all(rig.tick["link_faults"] == int(LinkFault.LOST))
