"""What is born in a nursery is, to who asked for it, what `subprocess` would have started."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import nursery
import pytest
from patience import PATIENCE_S, until

TOLD = """
import json, os, random, signal, sys
print(json.dumps({
    "arguments": sys.argv[1:], "folder": os.getcwd(), "parent": os.getppid(), "name": __name__,
    "session": os.getsid(0) == os.getpid(), "group": os.getpgid(0) == os.getpid(),
    "environment": dict(os.environ), "threads": len(os.listdir("/proc/self/task")),
    "open": sorted(fd for fd in os.listdir("/proc/self/fd") if os.path.exists(f"/proc/self/fd/{fd}")),
    "signals": {n: str(signal.getsignal(n)) for n in signal.valid_signals() if n != signal.SIGINT},
    "interrupt": signal.getsignal(signal.SIGINT) is signal.default_int_handler,
    "masked": sorted(signal.pthread_sigmask(signal.SIG_BLOCK, ())), "cores": sorted(os.sched_getaffinity(0)),
    "random": random.random(), "path": sys.path[0], "errors": [sys.stdout.errors, sys.stderr.errors],
    "by_line": [sys.stdout.line_buffering, sys.stderr.line_buffering], "encoding": sys.stdout.encoding,
    "at_once": [sys.stdout.write_through, sys.stderr.write_through], "heard": sys.stdin.read(),
    "nice": os.nice(0), "policy": os.sched_getscheduler(0),
}))
sys.exit(len(sys.argv) - 1)
"""
ENDS = {
    "pass": 0,
    "raise SystemExit": 0,
    "raise SystemExit('why')": 1,
    "raise SystemExit(300)": 300 & 0xFF,
    "raise ValueError('why')": 1,
    "import os; os._exit(7)": 7,
    "import os; os.kill(os.getpid(), 9)": -9,
    "import atexit; atexit.register(print, 'last'); print('first')": 0,
    "import threading, time; threading.Thread(target=lambda: (time.sleep(.1), print('it'))).start()": 0,
}


def program(folder, text, *arguments):
    (folder / "said_here.py").write_text(text)
    return [sys.executable, "-m", "said_here", *arguments]


def both(command, **more):
    """Started, and born."""
    more |= {"text": True, "capture_output": True, "timeout": PATIENCE_S}
    return [run(command, check=False, **more) for run in (subprocess.run, nursery.run)]


def test_it_has_all_that_its_parent_gives_to_a_program_and_nothing_else(tmp_path):
    command = program(tmp_path, TOLD, "one", "two three")
    environment = {**os.environ, "RTCTL_SAID": "so"}
    given = {"cwd": tmp_path, "env": environment, "start_new_session": True, "input": "a word"}
    with (tmp_path / "open").open("w"), (tmp_path / "for it").open("w") as its:  # the first is not
        started, born = both(command, pass_fds=(its.fileno(),), **given)
    assert started.returncode == born.returncode == 2
    assert born.stderr == started.stderr == ""
    started, born = json.loads(started.stdout), json.loads(born.stdout)
    assert born.pop("random") != started.pop("random")
    # NumPy is imported there, and the command line makes it keep to one thread
    born["environment"].pop("OPENBLAS_NUM_THREADS"), started["environment"].pop("OPENBLAS_NUM_THREADS")
    assert born == started
    assert born["parent"] == os.getpid()


def test_it_holds_back_the_signals_that_its_parent_does_and_no_others(tmp_path):
    command = program(tmp_path, TOLD)
    held = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGHUP, signal.SIGINT})
    try:
        made = nursery.Nursery()  # as for the first host of a session
        beside = both(command, cwd=tmp_path)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, held)
    masked = [json.loads(done.stdout)["masked"] for done in beside]
    assert masked == [[signal.SIGHUP, signal.SIGINT]] * 2
    after = nursery.run(command, cwd=tmp_path, capture_output=True, nursery=made)
    made.close()
    assert json.loads(after.stdout)["masked"] == sorted(held)


def test_it_has_each_descriptor_by_the_number_that_it_has_here(tmp_path):
    command = program(tmp_path, "import os, sys; [os.write(int(fd), fd.encode()) for fd in sys.argv[1:]]")
    with (tmp_path / "one").open("w") as one, (tmp_path / "other").open("w") as other:
        own = one.fileno(), other.fileno()
        nursery.run([*command, *map(str, own)], cwd=tmp_path, pass_fds=own[::-1], check=True)
    assert ((tmp_path / "one").read_text(), (tmp_path / "other").read_text()) == tuple(map(str, own))


def test_children_draw_different_random_numbers(tmp_path):
    command = program(tmp_path, "import random; print(random.random())")
    drawn = [nursery.run(command, cwd=tmp_path, capture_output=True).stdout for _ in range(2)]
    assert drawn[0] != drawn[1]


@pytest.mark.parametrize("text", ENDS)
def test_it_ends_as_a_program_does(tmp_path, text):
    started, born = both(program(tmp_path, text), cwd=tmp_path)
    assert started.returncode == born.returncode == ENDS[text]
    assert started.stdout == born.stdout
    assert started.stderr.splitlines()[-1:] == born.stderr.splitlines()[-1:]


def test_it_is_killed_waited_for_and_charged_as_a_child(tmp_path):
    sleeps = program(tmp_path, "import time; print('here', flush=True); time.sleep(600)")
    with nursery.Program(sleeps, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "here\n"
        assert process.poll() is None
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(0.01)
        process.terminate()
        assert process.wait(PATIENCE_S) == -signal.SIGTERM
        process.kill()  # it has gone: nobody else is hit
    before_s = sum(os.times()[2:4])
    busy = program(tmp_path, "import time\nwhile time.process_time() < 0.3: pass")
    assert nursery.run(busy, cwd=tmp_path, check=True).returncode == 0
    assert sum(os.times()[2:4]) - before_s > 0.25


@pytest.mark.parametrize(
    "name", ["NUMBA_DISABLE_JIT", "RTCTL_CACHE_DIR", "PYTHONHASHSEED", "HOME", "LD_PRELOAD"]
)
def test_what_is_read_at_import_is_not_for_it(tmp_path, name):
    with pytest.raises(ValueError, match=name):
        nursery.run(program(tmp_path, "pass"), env={**os.environ, name: "1"})


@pytest.mark.parametrize(
    "more", [{"preexec_fn": os.getpid}, {"shell": True}, {"user": os.getuid()}, {"umask": 0}]
)
def test_what_it_cannot_be_given_is_refused(tmp_path, more):
    with pytest.raises(ValueError, match="use subprocess"):
        nursery.run(program(tmp_path, "pass"), **more)


def test_no_other_program_is_born(tmp_path):
    with pytest.raises(ValueError, match="only `python -m`"):
        nursery.run(["true"])


def test_a_nursery_ends_with_who_made_it(tmp_path):
    code = f"import sys; sys.path.insert(1, {str(nursery.TESTS)!r}); import nursery, os; " + (
        "nursery.run([sys.executable, '-m', 'said_here']);"
        "print(nursery.shared()._process.pid, flush=True); os.kill(os.getpid(), 9)"
    )
    program(tmp_path, "pass")
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, check=False, text=True
    )
    assert done.returncode == -signal.SIGKILL, done.stderr
    stat = Path(f"/proc/{int(done.stdout)}/stat")
    until(lambda: not stat.exists() or stat.read_text().rpartition(")")[2].split()[0] in "ZX", "its end")
