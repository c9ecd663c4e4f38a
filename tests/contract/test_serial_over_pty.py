"""What only a real descriptor can show: hang-up, re-plug, full lines, other holders, leaks; through
`firmware_sim`.
"""

import contextlib
import errno
import gc
import os
import signal
import threading
from pathlib import Path

import numpy as np
import pytest
import serial_boards
from serial_bench import Bench, backend_of, replug

from hw import serial_port as port
from hw.interface import BackendError, LinkFault, LinkLost
from hw.serial.frame import Status


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    yield lambda which: serial_boards.board(1, tmp_path_factory.mktemp, which)
    serial_boards.close_all()


@pytest.fixture
def bench(shared):
    board = shared("first")
    made = Bench(board)
    yield made
    made.backend.close()
    board.order("identity SIM-0001")
    for damage in ("flip 0", "drop 0", "duplicate 0", "stall 0"):
        board.order(damage)


def test_the_torque_reaches_the_motor_and_a_stop_ends_it(bench):
    bench.drive()
    before = bench.board.observation.count
    bench.backend.stop()
    bench.board.wait_for(before + 1)
    assert bench.motor["enabled"] == 0
    assert bench.motor["current_a"] == 0
    assert Status(int(bench.motor["status"])) & Status.HELD


@pytest.mark.parametrize("when", ["before open", "after close"])
def test_a_stop_without_an_open_port_reaches_the_motor(bench, when):
    if when == "after close":
        bench.drive()
        bench.backend.close()
    before = bench.board.observation.count
    bench.backend.stop()
    bench.board.wait_for(before + 1)
    assert bench.motor["current_a"] == 0
    assert Status(int(bench.motor["status"])) & Status.HELD


def test_another_process_object_can_stop_a_port_in_use(bench):
    bench.drive()
    before = bench.board.observation.count
    backend_of(bench.board.port).stop()
    bench.board.wait_for(before + 1)
    assert bench.motor["current_a"] == 0


def test_a_stop_goes_ahead_of_a_full_line(bench):
    bench.drive()
    before = bench.board.observation.count
    os.kill(bench.board.process.pid, signal.SIGSTOP)
    try:
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(bench.backend.fileno(), b"\x01" * 1000)
        bench.backend.stop()
    finally:
        os.kill(bench.board.process.pid, signal.SIGCONT)
    bench.board.wait_for(before + 1)
    assert Status(int(bench.motor["status"])) & Status.HELD


def test_a_board_that_takes_no_commands_is_lost_in_bounded_cycles_without_blocking(bench):
    bench.drive()
    os.kill(bench.board.process.pid, signal.SIGSTOP)
    try:
        with pytest.raises(LinkLost, match="takes no more commands"):
            bench.flood()
    finally:
        os.kill(bench.board.process.pid, signal.SIGCONT)
    bench.backend.stop()


def test_stop_never_raises_whatever_the_port_is(tmp_path):
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "missing", tmp_path / "file", tmp_path, Path("/dev/null")):
        backend_of(str(path)).stop()
    assert (tmp_path / "file").read_text() == ""


def test_read_and_write_never_wait(bench):
    bench.in_step.open()
    assert not os.get_blocking(bench.backend.fileno())
    bench.in_step.read(bench.tick)
    for _ in range(50):
        bench.backend.read(bench.tick)
    assert bench.tick["sample_count"][0] == 1
    assert bench.tick["link_faults"][0] == 0


def test_damage_loss_and_duplicates_are_never_fresh(bench):
    bench.drive()
    bench.cycle()
    bench.in_step.wait()
    bench.backend.read(bench.tick)
    count, position = int(bench.tick["sample_count"][0]), bench.tick["position_rad"].copy()
    bench.board.order("flip 1")
    bench.in_step.write(bench.tick)
    bench.in_step.read(bench.tick)
    assert (bench.tick["sample_count"][0], bench.tick["link_faults"][0]) == (count, LinkFault.CHECKSUM)
    assert (bench.tick["position_rad"] == position).all()
    bench.board.order("drop 1")
    before = bench.board.observation.count
    bench.backend.write(bench.tick)
    bench.board.wait_for(before + 1)
    bench.backend.read(bench.tick)
    assert (bench.tick["sample_count"][0], bench.tick["link_faults"][0]) == (count, 0)
    bench.in_step.write(bench.tick)
    bench.in_step.read(bench.tick)
    assert (bench.tick["sample_count"][0], bench.tick["link_faults"][0]) == (count + 1, 0)


def test_unplugging_is_a_lost_link_within_two_cycles(bench):
    bench.drive()
    bench.board.order("unplug")
    with pytest.raises(LinkLost, match="unplugged"):
        bench.exchange(2)
    with pytest.raises(LinkLost):
        bench.backend.write(bench.tick)
    bench.backend.stop()
    bench.backend.close()
    with pytest.raises(BackendError, match="no such port"):
        bench.backend.open()


def test_a_closed_backend_is_lost_not_a_crash(bench):
    for call in (bench.backend.read, bench.backend.write):
        with pytest.raises(LinkLost, match="not open"):
            call(bench.tick)


def test_after_a_re_plug_the_same_board_goes_on_with_count_and_angle(bench):
    bench.drive()
    bench.cycles(5)
    bench.in_step.wait()
    count = int(bench.tick["sample_count"][0])
    replug(bench.board)
    bench.backend.close()
    bench.in_step.open()
    bench.in_step.read(bench.tick)
    assert bench.tick["sample_count"][0] == count + 1
    assert bench.tick["position_rad"][0, 0] == pytest.approx(float(bench.motor["position_rad"][0]), abs=1e-4)


def test_another_board_at_the_same_port_is_refused(bench):
    bench.in_step.open()
    assert bench.backend.identity == "SIM-0001"
    bench.backend.close()
    bench.board.order("identity OTHER")
    with pytest.raises(BackendError, match="'OTHER' answered, 'SIM-0001' is wanted"):
        bench.backend.open()
    assert bench.backend.fileno() == -1


def test_the_identity_of_the_rig_file_is_required_at_the_first_open(bench):
    with pytest.raises(BackendError, match="'SIM-0001' answered, 'ARM-7' is wanted"):
        backend_of(bench.board.port, identity="ARM-7").open()
    backend = backend_of(bench.board.port, identity="SIM-0001")
    backend.open()
    backend.close()


def test_a_board_that_starts_over_while_open_is_lost(bench):
    bench.in_step.open()
    bench.cycles(40, enabled=0)
    bench.board.order("reset")
    with pytest.raises(LinkLost, match="started over"):
        bench.cycles(30, enabled=0)


def test_a_second_holder_is_refused_by_name(bench):
    bench.in_step.open()
    with pytest.raises(BackendError, match=r"in use by .*\(pid \d+\)"):
        backend_of(bench.board.port).open()


def test_a_silent_port_is_refused_with_what_to_check():
    master, slave = os.openpty()
    try:
        with pytest.raises(BackendError, match="not a packet came"):
            backend_of(os.ttyname(slave), open_timeout_s=0.1).open()
    finally:
        os.close(master)
        os.close(slave)


@pytest.mark.parametrize(
    ("path", "remedy"), [("/dev/no-such-port", "no such port"), ("/dev/null", "not a serial port")]
)
def test_a_port_that_cannot_be_opened_is_refused_with_the_remedy(path, remedy):
    with pytest.raises(BackendError, match=remedy):
        backend_of(path).open()


def test_a_port_of_another_group_is_refused_with_the_group_to_join(monkeypatch):
    def refuse(*_arguments, **_more):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(port.serial, "Serial", refuse)
    with pytest.raises(BackendError, match="usermod -aG dialout"):
        backend_of("/dev/ttyUSB0").open()


def test_a_thousand_re_plugs_leak_no_descriptor_and_no_thread(bench):
    def held():
        gc.collect()  # what tests before this one left behind goes when it likes
        return len(list(Path("/proc/self/fd").iterdir())), threading.active_count()

    bench.in_step.open()
    bench.backend.close()
    before = held()
    for _ in range(1000):
        bench.backend.open()
        replug(bench.board)
        with pytest.raises(LinkLost):
            bench.exchange(2)
        bench.backend.close()
    assert held() == before
    assert len(list(Path(f"/proc/{bench.board.process.pid}/fd").iterdir())) < 20


def test_the_motor_is_torque_free_once_no_command_comes(bench):
    bench.drive()
    bench.board.order("cycles 12")
    rows = bench.board.observation.rows()
    last = int(np.flatnonzero(rows["current_a"][:, 0])[-1])
    since = rows["slot"][last] - rows["slot"][rows["command_age"] == 0][-1]
    assert since < 10
    assert not rows["current_a"][last + 1 :].any()
    assert Status(int(rows["status"][-1])) & Status.TTL_EXPIRED


def test_the_simulated_board_ends_cleanly_on_sigterm_and_leaves_no_link(tmp_path):
    with serial_boards.SimulatedBoard(tmp_path, "--rate-hz", "500") as board:
        board.wait_for(3)
        board.process.terminate()
        assert board.process.wait(60) == 0
    assert not Path(board.port).is_symlink()
    assert not board.observation.rows()["current_a"].any()
