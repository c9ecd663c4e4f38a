"""Compiled cycles of CAN devices do what Python's do, to the bit, and leave to Python whatever is more than a sample, losing nothing."""

import math
import struct

import numpy as np
import pytest
from can_pair import Paired, identifiers, noise

from hw.interface import LinkFault, LinkLost

pytestmark = pytest.mark.compiled

KINDS = [
    ("can-odrive.toml", "odrive"),
    ("can-cia402.toml", "cia402"),
    ("can-moteus.toml", "moteus"),
    ("can-board.toml", "can"),
    ("can-mit.toml", "mit"),
    ("can-vesc.toml", "vesc"),
]


@pytest.fixture
def pair(monkeypatch):
    made = []

    def _pair(*names, compiled_half=True, **more):
        made.append(Paired(monkeypatch, *names, compiled_half=compiled_half, **more))
        return made[-1]

    yield _pair
    for one in made:
        one.close()


def story(device, cycles, noisy):
    """Armed and disarmed, commands that are no numbers, damage and foreign frames: what was seen and sent in every cycle."""
    rng, told = np.random.default_rng(5), []
    known = identifiers(device.bus)
    for k in range(cycles):
        enabled = int(100 <= k < 400 or k >= 450)
        command = math.nan if k in (200, 201, 300) else 40.0 * math.sin(0.1 * k)
        more = noise(rng, known) if noisy else []
        seen, sent = device.cycle(enabled=enabled, current_a=command, torque_nm=0.1 * command, more=more)
        told.append((seen.tobytes(), sent))
    return told


@pytest.mark.parametrize("noisy", [False, True], ids=["quiet", "noisy"])
@pytest.mark.parametrize(("rig_file", "kind"), KINDS)
def test_both_ways_see_and_send_the_same(pair, rig_file, kind, noisy):
    one, other = (pair(rig_file, kind, compiled_half=half) for half in (False, True))
    plain, quick = story(one, 600, noisy), story(other, 600, noisy)
    for k, (a, b) in enumerate(zip(plain, quick, strict=True)):
        assert a == b, k
    assert one.backend.counts() == other.backend.counts()
    assert [word.text for word in one.backend.words()] == [word.text for word in other.backend.words()]
    assert one.backend.counts()["samples"] > 400
    assert other.left["write"] < (500 if noisy else 250), other.left
