"""`rtctl run` as a process: it starts, runs, ends and fails as promised."""

import itertools
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from patience import PATIENCE_S, until
from rtctl_process import CONFIGS, children, finish, greet, start

from rtctl.client import RigClient
from rtctl.control.vocabulary import State
from rtctl.errors import LoopDiedError, RefusedError
from rtctl.host import waiting_loop
from rtctl.host.auto_arm import AutoArm
from rtctl.host.exchange.gateway import GIVEN_UP_S
from rtctl.host.supervisor import MOST_TICKS, Host
from rtctl.rig_file.config import load


@pytest.fixture
def running(folder, tmp_path):
    """The mock rig with a hand that rests: a client of a loaded machine arms late, and a joint that swings
    moves too far.
    """
    text = (CONFIGS / "mock.toml").read_text().replace('"friction/', f'"{CONFIGS}/friction/')
    config = tmp_path / "rests.toml"
    config.write_text(text.replace("amplitude_rad = 0.3", "amplitude_rad = 0.0"))
    process = start(config, folder, "--for", "150")
    client = RigClient("mock", runtime_dir=str(folder))
    greet(client, process)
    yield process, client
    client.close()
    process.kill()
    process.communicate()


def test_a_run_for_some_seconds_ends_with_the_promised_summary(folder):
    code, summary, err = finish(start(CONFIGS / "mock.toml", folder, "--arm", "--for", "2"))
    assert code == 0, err
    assert "warning: not proved (rtctl check says what that means): joint: help in the hand" in err
    assert set(summary) >= {
        "state", "ticks", "missed_ticks", "rate_hz", "wakeup_us", "cycle_us", "telemetry", "energy_j",
        "faults",
    }  # fmt: skip
    for latency in ("wakeup_us", "cycle_us"):
        assert set(summary[latency]) == {"p50", "p99", "p99.9", "max"}
    assert set(summary["telemetry"]) == {"published", "dropped"}
    assert summary["state"] == "SHUTDOWN"
    assert summary["ticks"] > 500
    assert summary["faults"] == []
    assert {grant["right"] for grant in summary["realtime"]} >= {
        "sched-fifo",
        "mlockall",
        "affinity",
        "gc-freeze",
    }


def test_a_virtual_clock_runs_ahead_of_time_and_loses_no_tick(folder, tmp_path):
    text = (CONFIGS / "mock.toml").read_text().replace('clock = "wall"', 'clock = "virtual"')
    text = text.replace('"friction/', f'"{CONFIGS}/friction/')
    config = tmp_path / "virtual.toml"
    config.write_text(text)
    code, summary, err = finish(start(config, folder, "--arm", "--for", "2"))
    assert code == 0, err
    assert summary["overwritten"] == 0
    assert summary["missed_ticks"] == 0
    assert summary["ticks"] > 4000


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_active_ramps_the_torque_down_and_exits_0(running, number):
    process, client = running
    # comes to rest with 0.38 N m held, however late the signal
    client.set_environment("joint", "spring", stiffness_nm_rad=5.0, center_rad=0.3)
    client.arm(timeout_s=PATIENCE_S)
    ticks = client.ticks()
    while abs(next(ticks)["torque_applied_nm"][-1, 0]) < 0.3:
        pass
    process.send_signal(number)
    rows = []
    while (batch := ticks.receive(1.0)) is not None or process.poll() is None:
        rows += [] if batch is None else [batch]
    code, summary, err = finish(process)
    assert code == 0, err
    assert summary["state"] == "SHUTDOWN"
    states = [State(int(s)) for batch in rows for s in batch["state"]]
    assert State.STOPPING in states
    torque = [
        float(t)
        for batch in rows
        for t, s in zip(batch["torque_applied_nm"][:, 0], batch["state"], strict=True)
        if s == State.STOPPING
    ]
    assert max(map(abs, torque)) > 0.2
    assert all(abs(b) <= abs(a) + 1e-12 for a, b in itertools.pairwise(torque))


LATE = "[[fault]]\nchannel = 'loop'\nkind = 'stall'\nvalue = 2\nat_s = 2.0\nfor_s = 0.0\n"


def test_a_second_signal_cuts_a_ramp_short(folder, tmp_path):
    """At 100 Hz and with every cycle 3.5 periods long the ramp takes 1.75 s: time for a second signal in the
    middle.
    """
    text = (CONFIGS / "mock.toml").read_text().replace('"friction/', f'"{CONFIGS}/friction/')
    text = text.replace("rate_hz = 1000.0", "rate_hz = 100.0").replace(
        "stiffness_nm_rad = 60.0", "stiffness_nm_rad = 5.0"
    )
    config, faults = tmp_path / "slow.toml", tmp_path / "faults.toml"
    config.write_text(text)
    faults.write_text(LATE)
    process = start(config, folder, "--arm", "--for", "120", "--faults", str(faults))
    try:
        with RigClient("mock", runtime_dir=str(folder), timeout_s=PATIENCE_S) as client:
            ticks = client.ticks()
            batch = next(ticks)
            while not _is_slow(batch) or abs(batch["torque_applied_nm"][-1, 0]) < 0.05:
                batch = next(ticks)  # a torque that takes time to ramp down
            process.send_signal(signal.SIGINT)
            while not (next(ticks)["state"] == State.STOPPING).any():
                pass
            process.send_signal(signal.SIGINT)
            code, summary, err = finish(process)
    finally:
        process.kill()
        process.communicate()
    assert code == 0, err
    assert summary["state"] == "STOPPING", "cut in the middle of the ramp, not at its end"


def _is_slow(batch):
    """Whether the cycles are by now as slow as scripted: 20 slots are left out."""
    return batch["missed_ticks"][-1] > 20


def test_a_second_daemon_is_refused_and_one_after_a_killed_host_finds_no_obstacle(running, folder):
    process, client = running
    code, body, _ = finish(start(CONFIGS / "mock.toml", folder, "--for", "1"))
    assert code == 8
    assert str(process.pid) in body["message"]
    assert client.status()["state"] is not None, "the first runs on"
    (loop,) = children(process.pid)
    client.close()
    process.kill()
    process.communicate()
    until(lambda: not Path(f"/proc/{loop}").exists(), "the end of the loop")
    code, summary, err = finish(start(CONFIGS / "mock.toml", folder, "--for", "0.5"))
    assert code == 0, err
    assert summary["ticks"] > 0


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV])
def test_a_dead_loop_is_reported_as_such(running, number):
    process, _ = running
    (loop,) = children(process.pid)
    os.kill(loop, number)
    code, body, _ = finish(process)
    assert code == 9
    assert body["error"] == "LoopDiedError"


def test_a_stalled_loop_is_noticed_and_killed(running):
    process, _ = running
    (loop,) = children(process.pid)
    os.kill(loop, signal.SIGSTOP)
    code, body, _ = finish(process)
    assert code == 9
    assert "stopped advancing" in body["message"]
    assert not Path(f"/proc/{loop}").exists()


def test_an_arm_that_waited_for_a_host_that_stood_still_arms_nothing(running):
    """Whoever asked has been told that nobody answers, and may have gone to look, with a hand on the rig."""
    process, client = running
    epoch = client.status()["epoch"]
    os.kill(process.pid, signal.SIGSTOP)
    with ThreadPoolExecutor(1) as waiting:
        asked = waiting.submit(client._call, "arm", epoch=epoch)
        time.sleep(1.5 * GIVEN_UP_S)
        os.kill(process.pid, signal.SIGCONT)
        with pytest.raises(RefusedError, match=r"a stop (is on its way|came between)"):
            asked.result(PATIENCE_S)
    until(lambda: client.status()["epoch"] > epoch)
    assert client.status()["state"] == "IDLE"
    client.arm()
    process.send_signal(signal.SIGINT)
    code, _, err = finish(process)
    assert code == 0, err
    assert "stood still for" in err


@pytest.mark.parametrize("then", ["goes on", "loop dies"])
def test_a_host_that_stood_still_takes_what_waits_in_parts_and_all_of_it(folder, then):
    """Its memory would keep the size of the largest part; nothing is left in the ring, not even by a loop
    that died.
    """
    batches = []

    def stand_still_once(host, rows):
        batches.append(rows["tick"].tolist())
        if len(batches) == 10:
            head = int(host.memory.header[0]["head"])
            assert until(lambda: int(host.memory.header[0]["head"]) >= head + 1000)
            if then == "loop dies":
                os.kill(host.loop.pid, signal.SIGKILL)

    with Host(load(CONFIGS / "mock.toml"), observers=[stand_still_once], runtime_dir=str(folder)) as host:
        if then == "loop dies":
            with pytest.raises(LoopDiedError):
                host.run(10.0)
        else:
            host.run(3.0)
        head, lost = int(host.memory.header[0]["head"]), host.reader.overwritten
    ticks = list(itertools.chain.from_iterable(batches))
    assert max(map(len, batches)) == MOST_TICKS
    assert ticks == sorted(set(ticks))
    assert len(ticks) + lost == head


def test_the_loop_process_has_no_network_learner_or_config_library(folder, monkeypatch):
    """What the real process has mapped while it runs, and its modules as it reports them at its end."""
    monkeypatch.setattr(waiting_loop, "subprocess", subprocess)  # one that is forked has what its maker had
    seen = []

    def look(host, rows):
        if len(rows) and not seen:
            seen.append(Path(f"/proc/{host.loop.pid}/maps").read_text())

    with Host(load(CONFIGS / "mock.toml"), observers=[AutoArm(), look], runtime_dir=str(folder)) as host:
        host.run(1.5)
        modules = set(host.loop.ended["modules"])
    for library in ("zmq", "sklearn", "pydantic_core"):
        assert library not in seen[0]
    assert not modules & {
        "zmq",
        "sklearn",
        "asyncio",
        "pydantic",
        "msgpack",
        "matplotlib",
        "click",
        "scipy",
        "yaml",
    }
    assert {"numpy", "numba", "rtctl", "hw"} <= modules


def test_without_real_time_rights_a_simulated_rig_warns_and_runs(folder):
    command = [sys.executable, "-m", "rtctl", "run", str(CONFIGS / "mock.toml"), "--runtime-dir", str(folder)]
    command += ["--for", "1", "--json"]
    limited = (
        "import resource, os, ctypes, sys;"
        "resource.setrlimit(resource.RLIMIT_MEMLOCK, (65536, 65536));"
        "resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0));"
        # drop CAP_IPC_LOCK, CAP_SYS_NICE for children
        "[ctypes.CDLL(None).prctl(24, c, 0, 0, 0) for c in (14, 23)];"
        "ctypes.CDLL(None).prctl(38, 1, 0, 0, 0);"
        "os.execv(sys.argv[1], sys.argv[1:])"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", limited, *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    code, summary, err = finish(process)
    assert code == 0, err
    assert summary["ticks"] > 0
    granted = {grant["right"]: grant["granted"] for grant in summary["realtime"]}
    assert granted["sched-fifo"] is False
    assert granted["mlockall"] is False
    assert summary["waiver"] is True
    assert "LimitRTPRIO" in err


def test_a_daemon_looks_for_garbage_once_its_rig_runs(folder):
    """Its start does without; it lives for months."""
    look = (
        "import gc, sys, rtctl.cli as cli\n"
        "cli._leave_at_once = lambda code: print(gc.isenabled(), gc.get_freeze_count() > 1000)\n"
        "cli.main()"
    )
    command = [sys.executable, "-c", look, "run", str(CONFIGS / "mock.toml"), "--for", "0.1"]
    ran = subprocess.run([*command, "--runtime-dir", str(folder)], capture_output=True, text=True, check=True)
    assert ran.stdout.splitlines()[-1] == "True True"
