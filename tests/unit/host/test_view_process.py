"""The daemon's own view: ordered, looked after, started again, never waited for."""

import errno
import os
import socket
import sys
from contextlib import closing

import pytest
from patience import PATIENCE_S, until
from ports import free_ports

from rtctl.host import view_process
from rtctl.host.view_process import RETRY_S, SETTLED_S, ViewProcess


class Clock:
    def __init__(self):
        self.now_s = 100.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def program(tmp_path, monkeypatch):
    """Stands for the interpreter that runs the view: a script the test writes."""
    path = tmp_path / "python"

    def write(text):
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o700)

    write("exec sleep 60")
    monkeypatch.setattr(view_process.sys, "executable", str(path))
    return write


def ends(view, clock):
    """Wait for its end, without the clock of the view moving; what is said then."""
    return until(view.news, "its end")


def test_the_operators_address_is_for_this_user_alone_and_goes_with_the_view(tmp_path, program):
    port = free_ports()
    view = ViewProcess(tmp_path, port)
    file = tmp_path / "view"
    assert file.stat().st_mode & 0o777 == 0o600
    address = file.read_text()
    assert address.startswith(f"http://127.0.0.1:{port}/#key=")
    key = address.strip().partition("#key=")[2]
    assert len(key) >= 16
    assert not any(key in line for line in view.describe())
    assert view.news() == []
    pid = view._process.pid
    view.close()
    view.close()
    assert not file.exists()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_one_that_dies_is_told_of_and_started_again_ever_more_rarely(tmp_path, program):
    program("read order; echo cannot listen; exit 3")
    clock = Clock()
    view = ViewProcess(tmp_path, free_ports(), clock_s=clock)
    waits = []
    for _ in range(8):
        (said,) = ends(view, clock)
        assert "ended with status 3: cannot listen" in said
        assert "the rig runs on" in said
        began = clock.now_s
        while view._process is None:
            clock.now_s += 0.5
            assert view.news() == []
        waits.append(clock.now_s - began)
    assert waits[:4] == [1.0, 2.0, 4.0, 8.0]
    assert waits[-1] == RETRY_S[1]
    view.close()


def test_of_two_rigs_with_one_port_the_second_tells_no_address_until_it_is_its_own(tmp_path, program):
    port, clock = free_ports(), Clock()
    first = ViewProcess(tmp_path, port)
    (tmp_path / "second").mkdir()
    second = ViewProcess(tmp_path / "second", port, clock_s=clock)
    assert f"http://127.0.0.1:{port}/" in first.describe()[0]
    assert second.describe() == []
    (said,) = second.news()
    assert "not this rig" in said
    first.close()
    clock.now_s += RETRY_S[0]
    assert second.news() == second.describe() != []
    second.close()


def test_a_machine_without_room_or_descriptors_costs_the_page_and_not_the_rig(tmp_path, program, monkeypatch):
    def none_left(*_given):
        raise OSError(errno.EMFILE, "Too many open files")

    clock, port = Clock(), free_ports()
    with monkeypatch.context() as full:
        full.setattr(view_process.socket, "socket", none_left)
        view = ViewProcess(tmp_path / "gone", port, clock_s=clock)
        address, listening = view.news()
    assert "No such file" in address
    assert "Too many open files" in listening
    clock.now_s += RETRY_S[0]
    assert view.news() == view.describe() != []
    view.close()


def test_where_no_page_answers_nobody_waits(tmp_path, program):
    port = free_ports()
    with closing(ViewProcess(tmp_path, port)) as view, socket.socket() as early, socket.socket() as late:
        early.connect(("127.0.0.1", port))
        view._process.kill()
        until(view.news, "its end")
        with pytest.raises(ConnectionRefusedError):
            late.connect(("127.0.0.1", port))


def test_one_that_has_lived_long_is_started_again_at_once(tmp_path, program):
    program("read order; exit 0")
    clock = Clock()
    view = ViewProcess(tmp_path, free_ports(), clock_s=clock)
    ends(view, clock)
    ends_again = []
    for life_s in (0.0, SETTLED_S + 1):
        clock.now_s += RETRY_S[1]
        program("exec sleep 60")
        view.news()
        clock.now_s += life_s
        view._process.kill()
        (said,) = ends(view, clock)
        ends_again.append(said.rpartition("in ")[2])
    assert ends_again == ["2 s", "1 s"]
    view.close()


def test_an_interpreter_that_is_gone_is_no_error(tmp_path, monkeypatch):
    monkeypatch.setattr(view_process.sys, "executable", str(tmp_path / "nothing"))
    view = ViewProcess(tmp_path, free_ports())
    (said,) = view.news()
    assert "cannot be started" in said
    view.close()


def test_it_never_outlives_the_daemon_and_keeps_off_the_loops_core(tmp_path):
    view = ViewProcess(tmp_path, free_ports(), avoid_core=max(os.sched_getaffinity(0)))
    process = view._process
    process.stdin.close()  # as when the daemon is killed
    try:
        process.wait(PATIENCE_S)
    finally:
        view.close()
    assert process.returncode == 0


def test_the_view_steps_back(monkeypatch):
    from rtctl.client.view import step_back

    done = {}
    monkeypatch.setattr(os, "nice", lambda by: done.update(nice=by))
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: {0, 1, 2})
    monkeypatch.setattr(os, "sched_setaffinity", lambda _pid, cores: done.update(cores=cores))
    monkeypatch.setattr("pathlib.Path.write_text", lambda path, text: done.update({str(path): text}))
    step_back(2)
    assert done == {"nice": 5, "cores": {0, 1}, "/proc/self/oom_score_adj": "500"}
    done.clear()
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: {2})
    step_back(2)
    assert "cores" not in done


def test_the_view_needs_no_config_library_and_no_compiler():
    import subprocess

    code = (
        "import sys, rtctl.client.view; print([m for m in ('pydantic', 'numba', 'scipy', 'sklearn', "
        "'click') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
