"""Renderers against the real daemon: the lease as the loop keeps it, halted clients, floods, a silent
journal.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import msgpack
import pytest
import zmq
from nursery import Program
from patience import PATIENCE_S, until
from rtctl_process import greet
from standstill import undisturbed

from rtctl.client import RigClient, State
from rtctl.errors import NoReplyError, RefusedError

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def config(tmp_path):
    """The mock rig with a hand that rests, five times slower: a renderer may be silent five times longer."""
    text = (CONFIGS / "mock.toml").read_text()
    for shipped, here in (
        ("amplitude_rad = 0.3", "amplitude_rad = 0.0"),
        ('"friction/', f'"{CONFIGS}/friction/'),
        ("rate_hz = 1000.0", "rate_hz = 200.0"),
        ("stiffness_nm_rad = 60.0", "stiffness_nm_rad = 12.0"),
    ):
        assert shipped in text
        text = text.replace(shipped, here)
    path = tmp_path / "rig.toml"
    path.write_text(text)
    return path


@pytest.fixture
def daemon(config, folder):
    command = [sys.executable, "-m", "rtctl", "run", str(config), "--runtime-dir", str(folder)]
    process = Program([*command, "--for", "170", "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    yield process
    process.kill()
    sys.stderr.write(str(process.communicate()))  # shown when the test fails


@pytest.fixture
def rig(daemon, folder):
    with RigClient("mock", runtime_dir=folder) as client:
        greet(client, daemon, 120.0)  # the first start compiles
        client.timeout_s = PATIENCE_S
        yield client


def follow(rig, folder, lease):
    """Arm, and move the joint a little; meanwhile a second renderer is refused."""
    here = lease.start_rad[0]
    rig.arm(meanwhile=lambda: lease.set_target([here]))
    began = rig.latest_state().position_rad[0]
    steps = iter(range(10**6))

    def on():
        lease.set_target([here + 0.1 * min(1.0, next(steps) / 200)])
        return rig.latest_state()

    with RigClient("mock", runtime_dir=folder, timeout_s=PATIENCE_S) as second:
        second.status()
        until(
            lambda: (moved := on()).position_rad[0] > began + 0.015 and moved.lease_held and not moved.stale
        )
        if second_has_it(second):  # where this machine stood still: only then the first one has lost it
            until(lambda: lease.lost)
            lease.set_target([here])


def second_has_it(second):
    """Whether a renderer that does not wait is given the lease."""
    try:
        second.lease(wait_s=0)
    except RefusedError as refused:
        if refused.code != "lease_taken":
            raise
        return False
    return True


def test_a_renderer_moves_the_joint_and_a_stop_ends_its_lease_in_the_loop_too(rig, folder):
    rig.set_environment(0, "remote")

    def renders():
        rig.status()
        lease = rig.lease(wait_s=PATIENCE_S)
        follow(rig, folder, lease)
        return lease

    lease = undisturbed(rig, renders)
    rig.stop()
    until(lambda: rig.latest_state().state == State.IDLE)
    assert not rig.latest_state().lease_held
    until(lambda: lease.lost)
    with pytest.raises(RefusedError, match="lease_lost"):
        lease.set_target([0.0])
    target = rig.status()["axes"][0]["target_position_rad"]
    assert target < 0.2
    with rig._connection.socket(zmq.DEALER, rig.endpoints.targets, {}) as raw:
        for epoch in (lease.epoch, rig.status()["epoch"]):
            raw.send(msgpack.packb({"lease": lease.text, "epoch": epoch, "position_rad": [1.0]}))
        before = rig.latest_state().tick
        until(lambda: rig.latest_state().tick > before + 50)
    assert rig.status()["axes"][0]["target_position_rad"] == target
    assert not rig.latest_state().lease_held


def test_health_tells_how_long_targets_take_into_the_law(rig):
    rig.set_environment(0, "remote")
    with rig.health() as heard:

        def latency():
            """A machine that stands still for a second ends a lease."""
            refused = rig.latest_state().fields["targets_refused"]
            with contextlib.suppress(RefusedError), rig.lease(wait_s=PATIENCE_S) as lease:
                while True:
                    lease.set_target(lease.start_rad)
                    told = heard.receive(0.005)
                    if told and told["commands"]["targets"]["latency_us"]:
                        # while it is held: a target under way when it is given back is refused, rightly
                        return rig.latest_state().fields["targets_refused"] - refused + 1

        assert until(latency) == 1, "none was refused"


RENDERER = """
import sys, time
from rtctl.client import RigClient
from rtctl.errors import RefusedError
with RigClient("mock", runtime_dir=sys.argv[1], timeout_s=60.0) as rig:
    with rig.lease(wait_s=60.0) as lease:
        print("holding", flush=True)
        try:
            while True:
                lease.set_target(lease.start_rad)
                time.sleep(0.005)
        except RefusedError as refused:
            print(refused, flush=True)
"""


def test_a_halted_renderer_stops_the_rig_and_is_told_when_it_goes_on(rig, folder):
    rig.set_environment(0, "remote")
    begun = []

    def renders():
        command = [sys.executable, "-c", RENDERER, str(folder)]
        begun.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        assert begun[-1].stdout.readline() == "holding\n"
        until(lambda: rig.latest_state().lease_held)
        rig.arm()
        return begun[-1]

    try:
        renderer = undisturbed(rig, renders)
        os.kill(renderer.pid, signal.SIGSTOP)
        until(lambda: rig.latest_state().state in (State.STOPPING, State.IDLE, State.FAULT))
        until(lambda: rig.status()["lease_holder"] is None)
        state, count = rig.status()["state"], rig.latest_state().fields["targets_refused"]
        os.kill(renderer.pid, signal.SIGCONT)
        assert "lease_lost" in renderer.stdout.readline()
        assert renderer.wait(PATIENCE_S) == 0
        assert rig.status()["state"] in (state, "IDLE", "FAULT"), "it must not move again by itself"
        assert rig.latest_state().fields["targets_refused"] >= count
    finally:
        for one in begun:
            one.kill()
            one.communicate()


def test_junk_with_nobody_reading_the_journal_hinders_neither_a_stop_nor_the_end(daemon, rig, folder):
    """Its stderr is a pipe that nobody reads; once such a pipe filled up, and the daemon hung for good."""
    junk = rig._connection.context.socket(zmq.DEALER)
    junk.setsockopt(zmq.LINGER, 0)
    junk.setsockopt(zmq.SNDHWM, 1000)
    junk.connect(rig.endpoints.command)
    heard = rig.health()
    sent, end = 0, time.monotonic() + 3.0
    while time.monotonic() < end or sent <= 1000:
        try:
            junk.send(b"\xdd\x05\xf5\xe1\x00" + b"\x01" * 38, zmq.NOBLOCK)
            sent += 1
        except zmq.Again:
            if sent % 7 == 0:
                rig.stop()
            time.sleep(0.0005)
    rig.stop()
    until(lambda: next(heard)["commands"]["malformed"] > 1000)
    junk.close()
    daemon.send_signal(signal.SIGTERM)
    out, _err = daemon.communicate(timeout=PATIENCE_S)
    assert daemon.returncode == 0
    assert json.loads(out.splitlines()[-1])["state"] == "SHUTDOWN"


def test_a_client_whose_daemon_ended_says_so_and_the_lease_is_not_taken_again(daemon, rig):
    rig.set_environment(0, "remote")
    lease = rig.lease()
    lease.set_target(lease.start_rad)
    daemon.send_signal(signal.SIGTERM)
    daemon.communicate(timeout=PATIENCE_S)
    rig.timeout_s = 0.3
    with pytest.raises(NoReplyError):
        rig.status()
    with pytest.raises(NoReplyError):
        rig.latest_state()
    lease.release()
    assert lease.lost == "released"
