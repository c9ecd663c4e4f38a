"""`rtctl run --faults` as a process: the schedule reaches the device of the real loop."""

import signal
import subprocess
import sys

import pytest
from nursery import Program
from patience import PATIENCE_S, until
from rtctl_process import CONFIGS, finish, start

from rtctl.client import RigClient
from rtctl.errors import FaultError, RecordingError, RefusedError

STALL = "[[fault]]\nchannel = 'loop'\nkind = 'stall'\nvalue = 3.0\nat_s = 0.3\nfor_s = 0.1\n"
PRESSED = "[[fault]]\nchannel = 'estop'\nkind = 'pressed'\nat_s = 0.6\nfor_s = 0.0\n"
UNPLUGGED = "[[fault]]\nchannel = 'link'\nkind = 'raise_read'\nat_s = 0.3\nfor_s = 0.4\n"
"""None is due in a single slot, which a loaded machine may miss. The device is asked for again half a second
after it was lost."""


def run(folder, schedule, *more):
    path = folder.parent / "faults.toml"
    path.write_text(schedule)
    return finish(start(CONFIGS / "mock.toml", folder, "--faults", str(path), *more))


def test_the_loop_misses_slots_and_sees_the_emergency_stop_as_scripted(folder):
    code, summary, _ = run(folder, STALL + PRESSED, "--for", "2")
    assert code == 11, summary
    assert summary["fault_first"] == "ESTOP"
    assert summary["missed_ticks"] >= 3


def test_a_link_that_raises_is_a_latched_fault_with_its_name_and_the_device_is_found_again(folder):
    code, summary, stderr = run(folder, UNPLUGGED, "--for", "3")
    assert code == 11, summary
    assert summary["fault_first"] == "LINK_LOST"
    assert "device lost: scripted fault: the link was lost in read" in stderr
    assert "device found again" in stderr


def test_a_bad_schedule_starts_nothing(folder):
    code, error, _ = run(folder, PRESSED + "axes = 1\n", "--for", "5")
    assert code == 3
    assert "faults.toml: fault[0].axes: unknown key; did you mean axis?" in error["faults"][0]
    assert not any(folder.iterdir())


NO_FORCE = "[[fault]]\nchannel = 'force'\nkind = 'nan'\nat_s = 0.0\nfor_s = 0\n"


def test_a_sensor_that_is_bad_from_the_first_tick_on_is_said_and_is_why_the_rig_is_not_armed(folder):
    path = folder.parent / "faults.toml"
    path.write_text(NO_FORCE)
    process = start(CONFIGS / "mock.toml", folder, "--faults", str(path))
    try:
        with RigClient("mock", runtime_dir=str(folder), timeout_s=PATIENCE_S) as rig:
            (fault,) = until(lambda: rig.status()["faults"], "the fault")
            assert (fault["name"], fault["channel"], fault["device"]) == (
                "BAD_SAMPLE",
                "force",
                "device[0] 'mock'",
            )
            with pytest.raises(
                RefusedError, match=r"BAD_SAMPLE \(force, device\[0\] 'mock'\): force x nan N"
            ):
                rig.arm()
            assert rig.hello()["axes"][0]["coupling"]["stiffness_nm_rad"] > 0
            assert rig.hello()["not_proved"] == ["joint: help in the hand that moves the joint"]
        process.send_signal(signal.SIGTERM)
        code, summary, stderr = finish(process)
    finally:
        process.kill()
    assert (code, summary["state"], summary["faults"]) == (0, "SHUTDOWN", ["BAD_SAMPLE"])
    beside = ("compiling", "warning", "stood still")  # of this machine
    said = [line for line in stderr.splitlines() if not any(word in line for word in beside)]
    lines = [line.split(": ")[:2] for line in said]
    # the client that is refused may have seen the fault a moment before the host told it
    (refused,) = [line for line in lines if " refused" in line[1]]
    assert lines.index(refused) in (1, 2)
    lines.remove(refused)
    assert lines == [
        ["rtctl", "INIT -> IDLE"],
        ["rtctl", "fault BAD_SAMPLE (force, device[0] 'mock')"],
        ["rtctl", "IDLE -> SHUTDOWN"],
    ]
    assert refused[1].startswith("arm of ipc:"), "then user, group and process"
    (told,) = [line for line in said if line.startswith("rtctl: fault")]
    assert "check sensor range and wiring" in told


def test_a_recording_that_the_disk_refuses_is_said_and_is_no_success(folder):
    blocked = folder.parent / "blocked"
    blocked.write_text("a file where a folder should be")
    config = folder.parent / "recorded.toml"
    text = (CONFIGS / "mock.toml").read_text().replace('"friction/', f'"{CONFIGS}/friction/')
    config.write_text(f'{text}\n[record]\nfolder = "{blocked}/x"\n')
    code, summary, stderr = finish(start(config, folder, "--for", "1"))
    assert code == (FaultError if summary["fault_first"] else RecordingError).exit_code, stderr
    assert str(blocked) in summary["recording"]["broken"]
    assert f"rtctl: RECORDING BROKEN: {blocked}" in stderr


def test_a_monitor_says_no_data_when_the_rig_is_killed_and_goes_on_when_it_is_back(folder):
    command = [sys.executable, "-m", "rtctl", "monitor", "--rig", "mock", "--runtime-dir", str(folder)]
    first = start(CONFIGS / "mock.toml", folder)
    second = watching = None
    try:
        with RigClient("mock", runtime_dir=str(folder), timeout_s=PATIENCE_S) as rig:
            rig.hello()
        watching = Program(command, stdout=subprocess.PIPE, text=True)
        assert any(" IDLE " in line for line in watching.stdout)
        first.kill()
        first.wait()
        gone = next(line for line in watching.stdout if " IDLE " not in line)
        assert gone.split()[1] == "NO_DATA"
        assert "was=IDLE" in gone
        second = start(CONFIGS / "mock.toml", folder)
        assert next(line for line in watching.stdout if " NO_DATA " not in line).split()[1] in (
            "INIT",
            "IDLE",
        )
    finally:
        for process in (first, second, watching):
            if process is not None:
                process.kill()
                process.communicate()
