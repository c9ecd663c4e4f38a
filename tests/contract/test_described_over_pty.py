"""A board whose frames the rig file describes, over a real descriptor: drive, stop, re-plug, damage, leaks;
through `firmware_sim`.
"""

import gc
import os
import threading
from pathlib import Path

import pytest
import serial_boards
from serial_bench import RIG, Bench, replug, with_chatter

from hw import registry
from hw.interface import BackendError, LinkLost
from rtctl.control.jit import records
from rtctl.tick import new_ticks


class DescribedBench(Bench):
    """The same with a described frame."""

    def __init__(self, board):
        self.board = board
        model = registry.options_model("serial-described")
        valid = model.model_validate(
            {
                "port": board.port,
                "open_timeout_s": 30.0,
                "reopen_timeout_s": 10.0,
                **serial_boards.described(1),
            }
        )
        self.backend = registry.create("serial-described", valid.model_dump(mode="json"), RIG)
        self.in_step = serial_boards.InLockstep(self.backend, serial_boards.described_bytes(1), board)
        self.tick = records(new_ticks(1, 1))


@pytest.fixture(scope="module", autouse=True)
def closed():
    yield
    serial_boards.close_all()


@pytest.fixture
def described(tmp_path_factory):
    made = DescribedBench(serial_boards.described_board(1, tmp_path_factory.mktemp))
    yield made
    made.backend.close()


def test_a_described_board_is_driven_and_stopped(described):
    described.drive()
    before = described.board.observation.count
    described.backend.stop()
    described.board.wait_for(before + 1)
    assert described.motor["current_a"] == 0
    described.backend.close()
    described.in_step.open()
    described.cycles(2)
    described.in_step.wait()
    before = described.board.observation.count
    described.backend.close()
    described.backend.stop()
    described.board.wait_for(before + 1)
    assert described.motor["current_a"] == 0


def test_an_unplugged_described_board_is_lost_and_only_the_same_one_comes_back(described):
    described.drive()
    described.board.order("unplug")
    with pytest.raises(LinkLost, match="unplugged"):
        described.exchange(2)
    described.backend.close()
    described.board.order("plug")
    described.in_step.open()
    described.cycles(2)
    described.backend.close()
    described.board.order("identity 2")
    with pytest.raises(BackendError, match="another board than before"):
        described.in_step.open()
    assert described.backend.fileno() == -1


def test_damage_to_a_described_frame_is_never_fresh(described):
    described.in_step.open()
    described.cycles(3, enabled=0)
    described.in_step.wait()
    described.backend.read(described.tick)
    count = int(described.tick["sample_count"][0])
    described.board.order("flip 1")
    described.backend.write(described.tick)
    described.in_step.wait()
    described.backend.read(described.tick)
    assert described.tick["sample_count"][0] == count
    described.in_step.write(described.tick)
    described.cycles(2, enabled=0)
    assert described.tick["sample_count"][0] >= count + 1


def test_re_plugs_of_a_described_board_leak_nothing(described):
    def held():
        gc.collect()  # what tests before this one left behind goes when it likes
        return len(list(Path("/proc/self/fd").iterdir())), threading.active_count()

    described.in_step.open()
    described.backend.close()
    before = held()
    for _ in range(1000):
        described.in_step.open()
        replug(described.board)
        with pytest.raises(LinkLost):
            described.exchange(2)
        described.backend.close()
    assert held() == before


def test_a_described_port_that_talks_otherwise_is_refused_with_what_to_compare(described):
    master, slave = os.openpty()
    try:
        model = registry.options_model("serial-described")
        valid = model.model_validate(
            {"port": os.ttyname(slave), "open_timeout_s": 0.2, **serial_boards.described(1)}
        )
        backend = registry.create("serial-described", valid.model_dump(mode="json"), RIG)
        with pytest.raises(BackendError, match="not a byte came"):
            backend.open()
        backend = with_chatter(backend, master)
        with pytest.raises(BackendError, match=r"bytes came, none of them a frame"):
            backend.open()
    finally:
        os.close(master)
        os.close(slave)
