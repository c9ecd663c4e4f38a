"""The daemon on a CAN bus: `rtctl run` with an slcan adapter on a pty, the drive in a process of its own."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from nursery import Program
from rtctl_process import finish, greet, start

from hw.interface import LinkFault
from rtctl.client import RigClient
from rtctl.control.vocabulary import State
from rtctl.errors import ClientError, DeviceError
from rtctl.simulation.shipped_files import shipped_config

WIRE = Path(__file__).parents[1] / "contract" / "slcan_wire.py"
RATE_HZ = 100  # a shared machine; the ratio of the rates does not matter here


def be_punctual(process):
    """A wire and a drive are; nothing is judged by it."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(process.pid, os.SCHED_FIFO, os.sched_param(5))


class Wire:
    """Two adapters on one bus, in a process of their own; the drive is on the second one."""

    def __init__(self):
        self.process = subprocess.Popen(
            [sys.executable, str(WIRE)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.ports = self.process.stdout.readline().split()
        be_punctual(self.process)

    def close(self):
        self.process.kill()
        self.process.communicate()


@pytest.fixture
def wire():
    made = Wire()
    yield made
    made.close()


@contextlib.contextmanager
def drive(kind, port):
    command = [
        sys.executable,
        "-m",
        "hw.simulators.can_device",
        kind,
        "--interface",
        "slcan",
        "--channel",
        port,
    ]
    more = ["--node", "1", "--plant", "inertia", "--time-to-live-ms", "200", "--for", "400"]
    process = Program([*command, *more], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "ready\n"
        be_punctual(process)
        yield process
    finally:
        process.kill()
        process.communicate()


def rig_file(folder, name, port):
    text = Path(shipped_config(f"can-{name}.toml")).read_text()
    for before, after in (
        ('interface = "socketcan"', 'interface = "slcan"'),
        ('channel = "can0"', f'channel = "{port}"'),
        ('realtime = "require"', 'realtime = "prefer"'),
        ("rate_hz = 1000.0", f"rate_hz = {RATE_HZ}.0"),
        ("stiffness_nm_rad = 20.0", "stiffness_nm_rad = 1.5"),
        ("time_to_live_ms = 10", "time_to_live_ms = 100"),
        ("heartbeat_ms = 5 ", "heartbeat_ms = 40 "),
        (
            "source = 126 ",
            "sdo_timeout_s = 10.0\nsource = 126 ",
        ),  # of the CiA 402 drive, which has no time while others compile
    ):
        text = text.replace(before, after)
    path = folder.parent / "rig.toml"
    path.write_text(text)
    return path


@contextlib.contextmanager
def daemon(folder, name, port):
    process = start(rig_file(folder, name, port), folder, "--for", "280")
    try:
        yield process
    finally:
        process.kill()
        sys.stderr.write(str(process.communicate()))  # shown when the test fails


@contextlib.contextmanager
def client(rig, folder, process):
    with RigClient(rig, runtime_dir=str(folder)) as made:
        greet(made, process, 250.0)
        yield made


def arm(made):
    """ACTIVE; tried again when a late cycle of a busy machine stopped the rig."""
    end = time.monotonic() + 120
    while True:
        try:
            made.arm(timeout_s=20)
        except ClientError:
            if time.monotonic() > end:
                raise
            with contextlib.suppress(ClientError):
                made.reset(timeout_s=10)
            time.sleep(0.2)
        else:
            return


def test_a_drive_that_is_not_there_is_a_device_error_with_what_to_check(folder, wire):
    code, error, stderr = finish(
        start(rig_file(folder, "odrive", wire.ports[0]), folder, "--for", "1"), timeout=150
    )
    assert code == DeviceError.exit_code
    assert "no heartbeat within 1 s: check power, wiring and termination" in error["message"] + stderr


@pytest.mark.parametrize(
    ("name", "kind", "rig"),
    [("odrive", "odrive", "odrive"), ("cia402", "cia402", "cia402"), ("board", "can", "canboard")],
)
def test_a_rig_arms_is_active_shows_its_samples_and_ends_in_order(folder, wire, name, kind, rig):
    with (
        drive(kind, wire.ports[1]),
        daemon(folder, name, wire.ports[0]) as process,
        client(rig, folder, process) as made,
    ):
        with made.ticks() as ticks:
            next(ticks)
            arm(made)
            while State.ACTIVE not in (batch := next(ticks))["state"]:
                pass
            batch = next(ticks)
        assert np.isfinite(batch["position_rad"]).all()
        assert np.isfinite(batch["current_a"]).all()
        assert (np.diff(batch["sample_count"]) <= 1).all()
        process.send_signal(signal.SIGTERM)
        code, summary, stderr = finish(process)
    assert summary["state"] == "SHUTDOWN", stderr
    assert summary["ticks"] > 0
    assert code == (11 if summary["fault_first"] else 0), stderr  # a late cycle of a busy machine is a fault


def heard(process, text):
    """Wait until the daemon says something."""
    for line in process.stderr:
        if text in line:
            return
    raise AssertionError(f"the daemon ended without {text!r}")


def test_an_adapter_that_is_back_without_its_drive_is_waited_for_and_not_taken_for_a_stalled_loop(
    folder, wire, tmp_path
):
    adapter, second = tmp_path / "adapter", Wire()
    adapter.symlink_to(wire.ports[0])
    with (
        contextlib.closing(second),
        drive("odrive", wire.ports[1]),
        daemon(folder, "odrive", adapter) as process,
        client("odrive", folder, process) as made,
    ):
        (tmp_path / "new").symlink_to(second.ports[0])
        (tmp_path / "new").replace(adapter)
        late = made.status()["fault_first"]  # of a machine that stood still
        wire.close()
        heard(process, "device lost")
        heard(process, "not found again: odrive node 1: no heartbeat within 1 s")
        with drive("odrive", second.ports[1]):
            heard(process, "device found again")
            with made.ticks() as ticks:
                batch = next(rows for rows in ticks if not LinkFault(int(rows["link_faults"][-1])))
            assert not batch["enabled"].any()
            process.send_signal(signal.SIGTERM)
            code, summary, stderr = finish(process)
    assert (code, summary["fault_first"]) == (11, late["name"] if late else "LINK_LOST"), stderr


def test_a_request_to_end_while_a_device_is_being_opened_is_an_orderly_end(folder, wire, tmp_path):
    adapter, second = tmp_path / "adapter", Wire()
    adapter.symlink_to(wire.ports[0])
    with (
        contextlib.closing(second),
        drive("odrive", wire.ports[1]),
        daemon(folder, "odrive", adapter) as process,
        client("odrive", folder, process),
    ):
        (tmp_path / "new").symlink_to(second.ports[0])
        (tmp_path / "new").replace(adapter)
        wire.close()
        heard(process, "not found again: odrive node 1: no heartbeat within 1 s")
        process.send_signal(signal.SIGTERM)
        code, summary, stderr = finish(process)
    assert (code, summary["state"]) == (11, "SHUTDOWN"), stderr


UNDER_VOLTAGE = b"t02180002000001000000\r"
"""An ODrive's heartbeat of node 1: DC_BUS_UNDER_VOLTAGE, state IDLE."""


def test_an_error_of_the_drive_reaches_events_and_status_in_its_own_words_with_axis_and_device(folder, wire):
    port = os.open(wire.ports[1], os.O_WRONLY | os.O_NOCTTY)
    with (
        drive("odrive", wire.ports[1]),
        daemon(folder, "odrive", wire.ports[0]) as process,
        client("odrive", folder, process) as made,
        made.events() as events,
    ):
        axis, heard = made.hello()["axes"][0]["name"], {}
        while not {"fault", "device"} <= set(heard):  # the drive's next heartbeat is without the error
            os.write(port, UNDER_VOLTAGE)
            # the same fault again within half a second (EVERY_TICKS of rtctl.rt.speech) has no words of its
            # own: where the subscription came after the first, the next comes later than that
            until_s = time.monotonic() + 0.7
            while (event := events.receive(max(0.0, until_s - time.monotonic()))) is not None:
                if event.get("name") == "DEVICE" or "DEVICE" in event.get("faults", ()):
                    heard.setdefault(event["event"], event)
        os.close(port)
        fault, said = heard["fault"], heard["device"]
        assert (fault["axis"], fault["device"]) == (axis, "device[0] 'odrive'")
        assert fault["detail"] == "node 1: state IDLE (1), DC_BUS_UNDER_VOLTAGE"
        assert (said["axis"], said["text"], said["faults"]) == (axis, fault["detail"], ["DEVICE"])
        (voice,) = made.status()["devices"]
        assert voice["text"].startswith("node 1: state IDLE")
