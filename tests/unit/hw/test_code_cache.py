"""Compiled code of one function on the disk: who may write when, and what is never kept."""

import fcntl
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from numba.core.caching import NullCache
from patience import until

from hw import compile_turns, jit
from hw.private_cache import OwnFiles

pytestmark = pytest.mark.compiled


def double(x):
    return 2 * x


@pytest.fixture
def compiled(monkeypatch, tmp_path):
    monkeypatch.setenv("RTCTL_CACHE_DIR", str(tmp_path))
    return jit.compiled


def test_processes_that_add_code_for_other_types_do_so_one_after_the_other(monkeypatch, compiled):
    """Numba names a file by counting those of the index: two at once would take the same name for different code."""
    function, alone = compiled(double), []
    saves = OwnFiles.save

    def save(files, key, data):
        descriptor = os.open(files._cache_path, os.O_RDONLY)
        with pytest.raises(BlockingIOError):
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.close(descriptor)
        alone.append(key)
        saves(files, key, data)

    monkeypatch.setattr(OwnFiles, "save", save)
    assert (function(1), function(1.5)) == (2, 3.0)
    assert len(alone) == 2
    again = compiled(double)
    assert (again(1.5), again(1)) == (3.0, 2)
    assert sum(again.stats.cache_hits.values()) == 2


def test_what_a_function_closes_over_is_not_in_its_source_so_it_is_not_kept(compiled, tmp_path):
    def scaled_by(share):
        return compiled(lambda x: share * x)

    assert (scaled_by(2.0)(1.0), scaled_by(3.0)(1.0)) == (2.0, 3.0)
    assert isinstance(scaled_by(4.0)._cache, NullCache)
    assert not list(tmp_path.rglob("*.nbc"))


SLOW = """
import sys
from numba.extending import overload
from hw.jit import compiled

def wait(): pass

@overload(wait)
def _wait():
    print("compiling", flush=True)
    sys.stdin.readline()
    return lambda: 1

@compiled
def inner(x):
    return x + wait()

@compiled
def outer(x):
    return inner(x)

print(outer(1), sum(inner.stats.cache_hits.values()), flush=True)
"""


def test_what_another_process_compiles_is_waited_for_and_loaded(tmp_path):
    program = tmp_path / "slow.py"
    program.write_text(SLOW)
    root = Path(__file__).resolve().parents[3]
    env = {**os.environ, "PYTHONPATH": str(root), "RTCTL_CACHE_DIR": str(tmp_path / "cache")}

    def start():
        pipe = subprocess.PIPE
        return subprocess.Popen([sys.executable, str(program)], env=env, stdin=pipe, stdout=pipe, text=True)

    with start() as first, start() as second:
        said = []
        for process in (first, second):
            threading.Thread(target=lambda p=process: said.append((p, p.stdout.readline()))).start()
        until(lambda: said, "one of them compiles")
        (compiler, word), other = said[0], second if said[0][0] is first else first
        assert word == "compiling\n"
        compiler.stdin.write("\n")
        compiler.stdin.flush()
        assert compiler.stdout.readline() == "2 0\n"
        until(lambda: len(said) == 2, "the other is done")
        assert said[1] == (other, "2 0\n")  # it found `outer`, with `inner` in it


def test_who_does_not_get_a_turn_in_time_goes_on_without(monkeypatch, tmp_path):
    monkeypatch.setattr(compile_turns, "PATIENCE_S", 0.0)
    monkeypatch.setattr(compile_turns, "_given_up", set())
    lock = tmp_path / "lock"
    descriptor = os.open(lock, os.O_RDWR | os.O_CREAT)
    fcntl.flock(descriptor, fcntl.LOCK_EX)
    with compile_turns.turn(lock):
        assert compile_turns._given_up
    os.close(descriptor)
