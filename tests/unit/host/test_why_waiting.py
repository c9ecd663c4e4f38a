"""A person who waits for the start is told what for, and "the first start" only where it is one."""

import subprocess
import sys
from types import SimpleNamespace

import pytest
from patience import until

from hw import code_cache
from hw.jit import JIT_DISABLED
from rtctl.errors import LoopDiedError
from rtctl.host import preparation, supervisor
from rtctl.host.loop_process import Compiling, LoopProcess
from rtctl.host.supervisor import _why_waiting
from rtctl.rt import process as loop


def test_only_what_compiles_is_called_a_first_start():
    first = _why_waiting(Compiling(3, 314, first=True), 0)
    assert "first start" in first
    assert "3 functions of the loop so far, of at most 314" in first
    later = _why_waiting(Compiling(3, 314, first=False), 0)
    assert "first start" not in later
    assert "3 functions of the loop so far, of at most 314" in later
    assert "first start" not in _why_waiting(None, 0)
    assert "devices" in _why_waiting(None, 0)


def test_a_host_that_compiles_beside_a_loop_that_has_all_says_so():
    said = _why_waiting(None, 2)
    assert "first start" not in said
    assert "2 of the host" in said
    assert "of the loop" not in said


def test_a_start_that_goes_on_compiling_is_given_up_only_when_it_stops(monkeypatch):
    now_s = [0.0]
    monkeypatch.setattr(supervisor.time, "monotonic", lambda: now_s[0])
    loop = SimpleNamespace(poll=lambda: True, compiling=None)
    host = SimpleNamespace(
        loop=loop, began=0.0, _tell_at_s=1e9, signals=SimpleNamespace(ends=0),
        preparation=SimpleNamespace(compiled=lambda: 0)
    )  # fmt: skip

    def later(_s):
        now_s[0] += 100.0
        if now_s[0] < 1000.0:
            loop.compiling = Compiling(int(now_s[0]), 1000, first=True)

    monkeypatch.setattr(supervisor.time, "sleep", later)
    with pytest.raises(LoopDiedError, match=r"not ready after 1300 s.*start again"):
        supervisor.Host._wait_for(host, lambda: False)


@pytest.mark.compiled
@pytest.mark.skipif(JIT_DISABLED, reason="nothing is compiled")
def test_where_only_the_mark_is_missing_nothing_is_said_to_be_compiled(monkeypatch, tmp_path):
    """The mark is beside compiled code that is all there."""
    preparation.compile_for(1)
    there = preparation.mark
    monkeypatch.setattr(preparation, "mark", lambda n_axes: tmp_path / there(n_axes).name)
    again = preparation.Preparation(1)
    try:
        until(again.done, "the end of a preparation that has nothing to do")
        assert again.compiled() == 0
    finally:
        again.close()


def test_functions_that_a_preparation_has_compiled_are_counted(monkeypatch, tmp_path):
    monkeypatch.setattr(preparation, "JIT_DISABLED", False)
    monkeypatch.setattr(preparation, "mark", lambda _n_axes: tmp_path / "never")
    program = tmp_path / "python"
    program.write_text("#!/bin/sh\nprintf ...; exec cat\n")
    program.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(program))
    preparation_of = preparation.Preparation(1)
    try:
        until(lambda: preparation_of.compiled() == 3, "three functions")
    finally:
        preparation_of.close()
    preparation_of.close()
    assert preparation_of.done()


def test_what_a_loop_found_when_it_began_says_whether_this_is_a_first_start(monkeypatch):
    """Later it loads what the host's own process has compiled meanwhile."""
    said = []
    monkeypatch.setattr(loop, "_mention", lambda kind, **body: said.append({"message": kind, **body}))
    monkeypatch.setattr(code_cache, "made_here", ["a", "b", "a"])
    monkeypatch.setattr(code_cache, "may_be_made", ["a", "b", "c"])
    monkeypatch.setattr(code_cache, "loaded_here", [])
    loop._compiled(3)
    code_cache.loaded_here.append("c")
    loop._compiled(3)
    heard = SimpleNamespace(compiling=None)
    for message in said:
        LoopProcess._hear(heard, message)
    assert heard.compiling == Compiling(2, 3, first=True)


PROGRAM = """
import numpy as np
from hw import code_cache
from hw.encoder import ENCODER_STATE, unwrap
heard = []
code_cache.on_compiled.append(heard.append)
unwrap(1, 32, np.zeros(ENCODER_STATE, np.int64))
print(len(code_cache.made_here), heard == list(range(1, len(heard) + 1)))
"""


@pytest.mark.compiled
@pytest.mark.skipif(JIT_DISABLED, reason="nothing is compiled")
def test_what_is_compiled_is_counted_and_what_is_kept_is_not(tmp_path):
    counted = []
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM],
            env={"RTCTL_CACHE_DIR": str(tmp_path), "PYTHONPATH": ":".join(sys.path)},
            capture_output=True,
            text=True,
            check=True,
        )
        number, in_order = done.stdout.split()
        assert in_order == "True"
        counted.append(int(number))
    assert counted[0] >= 1
    assert counted[1] == 0
    assert isinstance(code_cache.made_here, list)
