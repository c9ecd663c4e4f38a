"""Failures seen in daemons of this kind: those that no other test shows, and that the list of tests is
true.
"""

import ast
import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from rtctl.control.environments import detents
from rtctl.control.jit import plain
from rtctl.control.mailbox import publish
from rtctl.host.exchange.messages import Refusal, decode
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.rt.shared_memory import Memory

ROOT = Path(__file__).parents[2]


SEEN = "## Ways in which a daemon"


def seen(document):
    """Rows of the list in this text of docs/safety.md."""
    return [line for line in document.split(SEEN)[1].splitlines() if line.startswith("| ")][1:]


def judges(function, inside):
    """Whether a function can fail by what it sees: it asserts, expects an error, waits for a fact, or has one
    `inside` do so.
    """
    for node in ast.walk(function):
        if isinstance(node, ast.Assert):
            return True
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func).rpartition(".")[2]
            if called in ("raises", "until") or (called in inside and judges(inside[called], {})):
                return True
    return False


def is_left_out(function):
    return any(
        re.search(r"\b(skip|xfail|slow)\b", ast.unparse(decorator)) for decorator in function.decorator_list
    )


def names_of_tests(source):
    """Those in this text that pytest would collect and that can fail."""
    functions = {node.name: node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)}
    return {
        name
        for name, function in functions.items()
        if name.startswith("test_") and judges(function, functions) and not is_left_out(function)
    }


def unproved(rows, tests):
    """Rows that name no test, and names of which there is no such test."""
    named = {row: re.findall(r"`(test_\w+)`", row) for row in rows}
    return [row for row, names in named.items() if not names or not set(names) <= tests]


def test_every_seen_failure_is_shown_by_tests_that_run_and_can_fail():
    rows = seen((ROOT / "docs" / "safety.md").read_text())
    assert len(rows) >= 14, "a failure that was seen is never taken off the list"
    texts = [path.read_text() for path in (ROOT / "tests").rglob("test_*.py")]
    named = re.findall(r"`(test_\w+)`", "".join(rows))
    tests = set().union(*(names_of_tests(text) for text in texts if any(name in text for name in named)))
    assert not unproved(rows, tests)


LIST = f"{SEEN} fails\n\n| seen | test |\n|---|---|\n| it hung | `test_it_ends` |\n"


@pytest.mark.parametrize(
    ("source", "document"),
    [
        ("def test_it_ends():\n    assert run()", LIST.replace("`test_it_ends`", "somebody looked")),
        ("def test_it_ends_soon():\n    assert run()", LIST),
        ("# def test_it_ends():\n#    assert run()", LIST),
        ("def outer():\n    def test_it_ends():\n        assert run()", LIST),
        ("def test_it_ends():\n    run()", LIST),
        ("@pytest.mark.skip(reason='hangs')\ndef test_it_ends():\n    assert run()", LIST),
    ],
    ids=["names none", "another name", "commented out", "never collected", "asks nothing", "skipped"],
)
def test_a_row_that_nothing_shows_is_found(source, document):
    assert not unproved(seen(LIST), names_of_tests("def test_it_ends():\n    assert run()"))
    assert len(unproved(seen(document), names_of_tests(source))) == 1


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
    solve = plain(detents.solve)
    force, calls = detents.force, []

    def counted(*arguments):
        calls.append(1)
        return force(*arguments)

    monkeypatch.setattr(detents, "force", counted)
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
