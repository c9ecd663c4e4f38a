"""Failures seen in daemons of this kind: those that no other test shows, and that the list of tests is true."""

import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from rtctl.control import detents
from rtctl.control.mailbox import publish
from rtctl.host.description import AxisDescription, RigDescription
from rtctl.host.messages import Refusal, decode
from rtctl.shm import Memory

ROOT = Path(__file__).parents[2]


def test_every_seen_failure_names_tests_that_exist():
    section = (ROOT / "docs" / "safety.md").read_text().split("## Ways in which a daemon")[1]
    rows = [line for line in section.splitlines() if line.startswith("| ")][1:]
    assert len(rows) == 15
    source = "\n".join(path.read_text() for path in (ROOT / "tests").rglob("test_*.py"))
    for row in rows:
        names = re.findall(r"`(test_\w+)`", row)
        assert names, row
        for name in names:
            assert f"def {name}(" in source, name


def test_43_bytes_that_claim_a_hundred_million_elements_cost_nothing():
    rig = RigDescription("mock", (AxisDescription("joint", {}),), 1000.0)
    payload = b"\xdd\x05\xf5\xe1\x00" + b"\x01" * 38
    decode(payload, rig)
    tracemalloc.start()
    try:
        outcome = decode(payload, rig)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert isinstance(outcome, Refusal)
    assert peak < 100_000


@pytest.mark.parametrize("pitch", [1e-6, 0.01, 10.0])
@pytest.mark.parametrize("stiffness", [1e-6, 60.0, 1e6])
def test_the_solver_of_the_stiffest_world_does_a_bounded_amount_of_work(monkeypatch, pitch, stiffness):
    solve = getattr(detents.detent_proxy, "py_func", detents.detent_proxy)
    force, calls = detents.detent_force, []

    def counted(*arguments):
        calls.append(1)
        return force(*arguments)

    monkeypatch.setattr(detents, "detent_force", counted)
    for k in (1e-9, 1.0, 1e4, 1e9):
        for drive in (-1e6, -1.0, 0.0, 1e-12, 3.0, 1e6):
            calls.clear()
            solve(drive, stiffness, k, 0.1, pitch, 0.3)
            assert len(calls) <= 1 + detents.MAX_STEPS


def test_ticks_are_kept_in_a_ring_that_never_grows():
    memory = Memory.create(1, 16, 1_000_000)
    try:
        place, size = memory.ring.__array_interface__["data"], memory.ring.nbytes
        tick = np.zeros(1, memory.ring.dtype)
        words = tick.view("<u8").reshape(1, -1)
        ring_words = memory.ring.view(np.ndarray).view("<u8").reshape(len(memory.ring), -1)
        publish(memory.header, ring_words, words)
        tracemalloc.start()
        try:
            before = tracemalloc.get_traced_memory()[0]
            for number in range(500):
                tick["tick"] = number
                publish(memory.header, ring_words, words)
            grown = tracemalloc.get_traced_memory()[0] - before
        finally:
            tracemalloc.stop()
        assert grown < 10_000
        assert int(memory.header[0]["head"]) == 501
        assert (memory.ring.__array_interface__["data"], memory.ring.nbytes) == (place, size)
    finally:
        memory.close()
