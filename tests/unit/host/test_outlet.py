import contextlib
import io
import os
import pty
import socket
import sys
import threading

import pytest
from patience import until

from rtctl.host.outlet import Outlet, streams_that_never_wait


@pytest.fixture
def pipe():
    ends = os.pipe()
    yield ends
    for fd in ends:
        with contextlib.suppress(OSError):
            os.close(fd)


def does_not_wait(act):
    thread = threading.Thread(target=act, daemon=True)
    thread.start()
    thread.join(120)
    assert not thread.is_alive(), "it waited for its reader"


def test_a_pipe_gets_every_text_whole_and_the_descriptor_stays_as_it_was(pipe):
    outlet = Outlet(pipe[1])
    assert outlet.write(b"one\n")
    assert outlet.write(b"two\n")
    assert os.read(pipe[0], 100) == b"one\ntwo\n"
    assert os.get_blocking(pipe[1])
    outlet.close()
    assert os.write(pipe[1], b"still ours") == 10


def test_a_pipe_that_nobody_reads_loses_texts_and_never_parts_of_them(pipe):
    outlet = Outlet(pipe[1])
    lines = [b"%05d " % k + b"x" * 95 + b"\n" for k in range(5000)]
    does_not_wait(lambda: [outlet.write(line) for line in lines])
    assert outlet.lost > 1000
    got = os.read(pipe[0], 1 << 20).splitlines(keepends=True)
    assert got == lines[: len(got)]
    assert outlet.write(b"again\n"), "there is room again"
    assert os.read(pipe[0], 100) == b"again\n"
    outlet.close()


def test_a_text_longer_than_the_room_is_ended_before_the_next_begins(pipe):
    outlet = Outlet(pipe[1])
    long = b"a" * 200_000 + b"\n"
    assert outlet.write(long)
    assert not outlet.write(b"next\n")
    got = b""
    while len(got) < len(long):
        got += os.read(pipe[0], 1 << 20)
        outlet.write(b"|\n")
    assert got.startswith(long)
    outlet.close()


def test_a_terminal_that_was_stopped_by_ctrl_s_never_makes_it_wait():
    master, slave = pty.openpty()
    outlet = Outlet(slave)
    outlet.write(b"before\n")
    until(lambda: b"before" in os.read(master, 1000))
    os.write(master, b"\x13")
    does_not_wait(lambda: [outlet.write(b"unheard " * 8 + b"\n") for _ in range(2000)])
    assert outlet.lost > 1000
    os.write(master, b"\x11")
    until(lambda: outlet.write(b"after\n"))
    seen = b""
    while b"after" not in seen:
        seen += os.read(master, 65536)
    outlet.close()
    os.close(master)
    os.close(slave)


def test_who_is_patient_waits_for_a_slow_reader_but_not_for_ever(pipe):
    outlet = Outlet(pipe[1])
    while outlet.write(b"x" * 4096):
        pass
    assert not outlet.write(b"in vain\n", 0.05)
    reader = threading.Timer(0.1, lambda: os.read(pipe[0], 1 << 20))
    reader.start()
    assert outlet.write(b"heard\n", 60.0)
    reader.join()
    assert os.read(pipe[0], 1 << 20).endswith(b"heard\n")
    outlet.close()


def test_a_socket_as_the_journal_gives_one_never_makes_it_wait():
    ours, theirs = socket.socketpair()
    with ours, theirs:
        outlet = Outlet(ours.fileno())
        assert outlet.write(b"line\n")
        assert theirs.recv(100) == b"line\n"
        does_not_wait(lambda: [outlet.write(b"x" * 1000) for _ in range(5000)])
        assert outlet.lost > 100
        outlet.close()


def test_a_file_is_appended_to_where_its_descriptor_is(tmp_path):
    with (tmp_path / "log").open("wb", buffering=0) as file:
        file.write(b"head\n")
        outlet = Outlet(file.fileno())
        assert outlet.write(b"line\n")
        outlet.close()
        file.write(b"tail\n")
    assert (tmp_path / "log").read_bytes() == b"head\nline\ntail\n"


def test_a_reader_that_has_gone_and_a_closed_descriptor_are_no_errors(pipe):
    outlet = Outlet(pipe[1])
    os.close(pipe[0])
    assert not outlet.write(b"x\n")
    late = Outlet(pipe[1])
    assert not late.write(b"x\n")
    os.close(pipe[1])
    assert not late.write(b"x\n")
    assert not Outlet(pipe[1]).write(b"x\n")


def test_prints_of_the_process_go_through_it_for_as_long_as_it_lasts(pipe, monkeypatch):
    with os.fdopen(os.dup(pipe[1]), "w") as plain:
        monkeypatch.setattr(sys, "stderr", plain)
        monkeypatch.setattr(sys, "__stderr__", plain)
        with streams_that_never_wait():
            assert sys.stderr is not plain
            does_not_wait(lambda: [sys.stderr.write("x" * 100) for _ in range(5000)])
            with pytest.raises(TypeError):
                sys.stderr.write(b"bytes")
        assert sys.stderr is plain


def test_streams_that_somebody_replaced_stay(monkeypatch):
    replaced = io.StringIO()
    monkeypatch.setattr(sys, "stdout", replaced)
    with streams_that_never_wait():
        assert sys.stdout is replaced
