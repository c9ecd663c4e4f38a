"""`rtctl run configs/serial.toml` against a simulated board in another process: armed, driven, killed,
unplugged.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from nursery import Program
from patience import PATIENCE_S
from rtctl_process import greet
from simulated_board import SimulatedBoard

from hw.interface import LinkFault
from hw.serial.frame import Status
from rtctl.client import RigClient
from rtctl.control.vocabulary import State
from rtctl.errors import ClientError

CONFIGS = Path(__file__).parents[2] / "configs"
TIME_TO_LIVE = 20


@pytest.fixture
def board(tmp_path):
    with SimulatedBoard(
        tmp_path, "--rig", str(CONFIGS / "mock.toml"), "--rate-hz", "200", "--realtime"
    ) as made:
        yield made


@pytest.fixture
def daemon(board, folder, tmp_path):
    text = (CONFIGS / "serial.toml").read_text()
    for shipped, here in (
        ('"/tmp/rtctl-board"', f'"{board.port}"'),
        ("rate_hz = 1000.0", "rate_hz = 100.0"),  # on a busy machine cycles of 1 ms are late too often to arm
        ("stiffness_nm_rad = 10.0", "stiffness_nm_rad = 1.0"),
    ):
        assert text.count(shipped) == 1, shipped
        text = text.replace(shipped, here)
    config = tmp_path / "serial.toml"
    config.write_text(text)
    command = [sys.executable, "-m", "rtctl", "run", str(config), "--for", "280", "--json"]
    process = Program(
        [*command, "--runtime-dir", str(folder)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    yield process
    process.kill()
    sys.stderr.write(str(process.communicate()))  # shown when the test fails


@pytest.fixture
def client(daemon, folder):
    made = RigClient("serial", runtime_dir=str(folder))
    greet(made, daemon, 250.0)
    yield made
    made.close()


def arm(client):
    """ACTIVE; tried again while the board is late, or when a late cycle of a busy machine stopped the rig."""
    end = time.monotonic() + 90
    while True:
        try:
            client.arm(timeout_s=20)
        except ClientError:
            if time.monotonic() > end:
                raise
            with contextlib.suppress(ClientError):
                client.reset(timeout_s=10)
            time.sleep(0.2)
        else:
            return


def armed(client, board):
    """Rows of the board up to a torque at work; armed again when a late cycle of a busy machine stopped the
    rig.
    """
    while True:
        arm(client)
        while client.latest_state().state in (State.ACTIVE, State.HOLD):
            rows = board.observation.rows()
            if rows["current_a"][-1, 0] != 0:
                return rows
            time.sleep(0.01)


def loop_of(daemon):
    (loop,) = (
        int(child) for child in Path(f"/proc/{daemon.pid}/task/{daemon.pid}/children").read_text().split()
    )
    return loop


def test_the_rig_arms_moves_the_board_and_ends_in_order(daemon, client, board):
    rows = armed(client, board)
    assert rows["enabled"][-1] == 1
    with client.ticks() as ticks:
        batch = next(iter(ticks))
    assert np.isfinite(batch["position_rad"]).all()
    assert (np.diff(batch["sample_count"]) <= 1).all()
    daemon.send_signal(signal.SIGTERM)
    out, err = daemon.communicate(timeout=PATIENCE_S)
    assert daemon.returncode in (0, 11), err
    assert json.loads(out.splitlines()[-1])["ticks"] > 0
    board.wait_for(board.observation.count + 3)
    last = board.observation.rows()[-1]
    assert last["current_a"] == 0
    assert Status(int(last["status"])) & Status.HELD


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_loop_that_is_gone_leaves_a_torque_free_motor_within_the_time_to_live(
    daemon, client, board, number
):
    armed(client, board)
    os.kill(loop_of(daemon), number)
    board.wait_for(board.observation.count + 4 * TIME_TO_LIVE)
    rows = board.observation.rows()
    heard = rows["slot"][np.flatnonzero(rows["command_age"] == 0)[-1]]
    driven = rows["slot"][np.flatnonzero(rows["current_a"][:, 0])[-1]]
    assert driven - heard <= TIME_TO_LIVE + 1
    assert not rows["current_a"][-1].any()
    if number == signal.SIGSTOP:
        daemon.communicate(timeout=PATIENCE_S)


def test_an_unplugged_board_is_a_latched_fault_and_is_found_again_without_torque(client, board):
    armed(client, board)
    board.order("unplug")
    with client.ticks() as ticks:
        batch = next(rows for rows in ticks if LinkFault(int(rows["link_faults"][-1])) & LinkFault.LOST)
        assert batch["enabled"][-1] == 0
        board.order("plug")
        batch = next(rows for rows in ticks if not rows["link_faults"].any())
    assert batch["state"][-1] in (State.FAULT, State.LOCKOUT)
    assert not batch["enabled"].any()
    assert board.observation.rows()[-1]["current_a"] == 0
