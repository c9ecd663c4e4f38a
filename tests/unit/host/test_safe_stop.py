"""The safe stop: every actuator is told, then opened afresh and told again; sensors and simulations are left
alone.
"""

import json
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from hanging import Hang
from patience import PATIENCE_S

from hw import registry
from hw.can.health import BusHealth
from hw.can.stopping import NotedBus
from hw.interface import BackendError, BackendInfo
from hw.serial.frame_backend import SerialBackend
from rtctl.cli import stop_rig
from rtctl.errors import DeviceError
from rtctl.host.safe_stop import SafeStop
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"
MADE = []


class Fake:
    """Remembers what it was asked; opening it may fail."""

    provides = frozenset({"position"})
    consumes = frozenset({"current_command"})
    refuses = ""

    def __init__(self, options, rig):
        self.calls = []
        MADE.append(self)

    def open(self):
        self.calls.append("open")
        if self.refuses:
            raise BackendError(self.refuses)

    def stop(self):
        self.calls.append("stop")

    def close(self):
        self.calls.append("close")


def faked(name, monkeypatch):
    """A shipped rig whose devices are all `Fake`."""
    loaded = load(CONFIGS / name)
    MADE.clear()
    info = BackendInfo(f"{__name__}:Fake", "hw.serial.options:SerialOptions", simulated=False)
    monkeypatch.setattr(registry, "lookup", lambda _kind: info)
    monkeypatch.setattr(registry, "create", lambda _kind, options, rig: Fake(options, rig))
    return loaded


@pytest.fixture
def loaded(monkeypatch):
    made = faked("serial.toml", monkeypatch)
    monkeypatch.setattr(Fake, "refuses", "")
    return made


def test_an_actuator_is_told_before_it_is_opened_and_again_after(loaded):
    (one,) = SafeStop(loaded).now()
    assert MADE[-1].calls == ["stop", "open", "stop", "close"]
    assert one.confirmed
    assert "stopped" in one.text()


def test_one_that_cannot_be_opened_is_told_all_the_same_and_the_reason_is_given(loaded, monkeypatch):
    monkeypatch.setattr(Fake, "refuses", "the port is in use by pid 7")
    (one,) = SafeStop(loaded).now()
    assert MADE[-1].calls == ["stop", "open"]
    assert not one.confirmed
    assert "NOT CONFIRMED" in one.text()
    assert "pid 7" in one.text()


def test_whatever_the_code_of_one_device_does_the_others_are_opened_and_stopped(monkeypatch):
    loaded = faked("drive-and-force-sensor.toml", monkeypatch)
    stop = SafeStop(loaded)

    def broken():
        raise ModuleNotFoundError("No module named 'gone'")

    first, second = MADE[-2:]
    monkeypatch.setattr(first, "open", broken)
    monkeypatch.setattr(first, "stop", broken)
    bad, good = stop.now()
    assert second.calls == ["stop", "open", "stop", "close"]
    assert (bad.confirmed, good.confirmed) == (False, True)
    assert bad.detail == "ModuleNotFoundError: No module named 'gone'"


def test_what_a_stop_sends_is_made_before_a_loop_dies(monkeypatch):
    made = []
    monkeypatch.setattr(SerialBackend, "_stop_packet", lambda _self: made.append(1) or b"stop")
    sent = []
    monkeypatch.setattr("hw.serial.backend.send_once", lambda *packet: sent.append((len(made), packet[-1])))
    stop = SafeStop(load(CONFIGS / "serial.toml"))
    stop.know([])
    assert (made, sent) == ([1], []), "made, and nothing sent"
    stop.tell()
    assert (made, sent) == ([1], [(1, b"stop")])


@pytest.mark.parametrize("what", ["stop", "open"])
def test_an_actuator_that_hangs_is_named_and_the_others_are_stopped(what, monkeypatch):
    loaded = faked("drive-and-force-sensor.toml", monkeypatch)
    monkeypatch.setattr("rtctl.host.safe_stop.OPEN_TIMEOUT_S", 0.02)
    stop, hang = SafeStop(loaded), Hang(monkeypatch, 0.02)
    first, second = MADE[-2:]
    monkeypatch.setattr(first, what, hang)
    stop.tell()
    assert second.calls == ["stop"]
    assert not hang.came_back
    bad, good = stop.now()
    hang.end()
    assert second.calls == ["stop", "stop", "open", "stop", "close"]
    assert (bad.confirmed, good.confirmed) == (False, True)
    assert bad.detail == "has not come back after 0.02 s"


def test_actuators_are_opened_beside_each_other(monkeypatch):
    loaded = faked("drive-and-force-sensor.toml", monkeypatch)
    stop, both = SafeStop(loaded), threading.Barrier(2, timeout=PATIENCE_S)
    for one in MADE[-2:]:
        monkeypatch.setattr(one, "open", both.wait)  # neither is done before the other has begun
    assert [one.confirmed for one in stop.now()] == [True, True]


def frames_of(name, monkeypatch):
    """What the host sends to the drives of a rig whose loop has died, on a bus that it opens for a moment."""
    sent = []

    class Bus(NotedBus):
        def __init__(self, channel, *, fd):
            super().__init__(fd=fd)
            self.health = BusHealth()
            assert channel == "can0"

        def send(self, frame):
            sent.append(
                bytes(frame.buffer[:4])[::-1].hex() + " " + bytes(frame.buffer[8:])[: frame.length].hex()
            )
            return True

        def close(self):
            sent.append("closed")

    monkeypatch.setattr("hw.can.stopping.RawBus", Bus)
    stop = SafeStop(load(CONFIGS / name))
    stop.know([])
    assert sent == []
    stop.tell()
    return sent


@pytest.mark.parametrize(
    ("name", "frames"),
    [
        ("can-odrive.toml", ["0000002e 00000000", "00000027 01000000"]),
        ("can-cia402.toml", ["00000201 06000000", "00000080 "]),
        ("can-board.toml", [f"00000200 {count:08x}" for count in (1, 0, 0x40, 0x80, 0xC0)]),
    ],
)
def test_a_drive_on_a_bus_is_told_before_its_bus_is_opened_whole(name, frames, monkeypatch):
    assert frames_of(name, monkeypatch) == [*frames, "closed"]


def test_a_bus_of_one_holder_and_one_that_is_gone_are_left_alone():
    for changed in ({"channel": "gone0"}, {"interface": "virtual", "raw": False}):
        loaded = load(CONFIGS / "can-odrive.toml")
        loaded.options["bus"].update(changed)
        SafeStop(loaded).tell()


def test_a_driver_that_cannot_be_made_is_named_and_keeps_no_other_under_torque(monkeypatch):
    loaded = load(CONFIGS / "drive-and-force-sensor.toml")
    drive, sensor = loaded.members()
    other = replace(drive, label="other")
    MADE.clear()
    info = BackendInfo(f"{__name__}:Fake", "hw.serial.options:SerialOptions", simulated=False)
    monkeypatch.setattr(registry, "lookup", lambda _kind: info)
    rig = SimpleNamespace(config=loaded.config, members=lambda: [drive, sensor, other])

    def create(kind, options, rig):
        if len(MADE) or kind == sensor.kind:
            return Fake(options, rig)
        MADE.append(None)
        raise BackendError("needs the Python module 'gone'")

    monkeypatch.setattr(registry, "create", create)
    made = [(one.confirmed, one.detail) for one in SafeStop(rig).now() if one.device != sensor.label]
    assert made == [(False, "needs the Python module 'gone'"), (True, "")]
    assert MADE[-1].calls == ["stop", "open", "stop", "close"]


def test_making_it_opens_nothing_and_a_sensor_is_left_alone(loaded, monkeypatch):
    SafeStop(loaded)
    assert MADE[-1].calls == []
    monkeypatch.setattr(Fake, "consumes", frozenset())
    assert SafeStop(loaded).now() == []


def test_a_simulated_rig_has_nothing_to_stop():
    assert SafeStop(load(CONFIGS / "mock.toml")).now() == []


def test_the_command_says_what_it_did_and_fails_when_a_device_is_not_there():
    def run(name, *more):
        command = [sys.executable, "-m", "rtctl", "stop-rig", str(CONFIGS / name), *more]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    done = run("mock.toml")
    assert done.returncode == 0
    assert "nothing to stop" in done.stdout
    done = run("serial.toml", "--json")
    assert done.returncode == 6
    (device,) = json.loads(done.stdout)["devices"]
    assert device["confirmed"] is False
    assert "no such port" in device["detail"]


def test_the_command_says_what_is_not_confirmed_once(loaded, monkeypatch):
    monkeypatch.setattr(Fake, "refuses", "the port is in use by pid 7")
    monkeypatch.setattr("rtctl.rig_file.config.load", lambda _path: loaded)
    done = CliRunner().invoke(stop_rig.command, ["rig.toml"])
    assert isinstance(done.exception, DeviceError)
    assert (done.output + str(done.exception)).count("NOT CONFIRMED") == 1
