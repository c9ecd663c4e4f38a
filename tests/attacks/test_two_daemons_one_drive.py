"""A bus that many can open, and a second process that would command the same drive: refused by name, freed by
any death.
"""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from ports import free_ports

from hw.claims import Claims, claims_on
from hw.interface import BackendError
from rtctl.errors import DeviceError
from rtctl.host import probe_device_readings as probe
from rtctl.host.safe_stop import SafeStop
from rtctl.host.supervisor import Host
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config

ROOT = Path(__file__).parents[2]
HOLDER = """
import os, signal, sys
sys.path.insert(0, sys.argv[1])
from hw.claims import Claims
if len(sys.argv) > 3:
    os.setuid(int(sys.argv[3]))
mine = Claims()
mine.take("theirs", sys.argv[2].split(","))
print("held", flush=True)
signal.pause()
"""


@pytest.fixture
def wire():
    """A channel of this test's own."""
    return f"rtctl-test-{os.getpid()}-{free_ports()}"


@pytest.fixture
def other():
    """Starts another process that holds claims; all of them end with the test."""
    started = []

    def begin(names, *user):
        source = [sys.executable, "-c", HOLDER, str(ROOT), ",".join(names), *map(str, user)]
        started.append(subprocess.Popen(source, stdout=subprocess.PIPE, text=True))
        assert started[-1].stdout.readline() == "held\n"
        return started[-1]

    yield begin
    for process in started:
        process.kill()
        process.communicate()


def refused(names):
    with pytest.raises(BackendError) as error:
        Claims().take("device[0] 'odrive'", names, patience_s=0.0)
    return str(error.value)


def test_who_comes_second_is_told_who_was_first(wire, other):
    process = other(claims_on("socketcan", wire, [0x20, 0x21]))
    words = refused(claims_on("socketcan", wire, [0x1F, 0x21]))
    assert f"device[0] 'odrive': socketcan {wire} 0x21 is driven by process {process.pid} of user" in words
    assert sys.executable.rpartition("/")[2] in words
    for _ in range(20):
        assert f"process {process.pid} " in refused(claims_on("socketcan", wire, [0x20]))


def test_of_a_refused_device_nothing_stays_claimed(wire, other):
    other(claims_on("socketcan", wire, [0x21]))
    refused(claims_on("socketcan", wire, [0x1F, 0x20, 0x21]))
    other(claims_on("socketcan", wire, [0x1F, 0x20]))


def test_other_drives_wires_and_kinds_of_identifier_are_nobodys_business(wire, other):
    other(claims_on("socketcan", wire, [0x21]))
    mine = Claims()
    mine.take("b", claims_on("socketcan", wire, [0x22, 0x8000_0021]))
    mine.take("b", claims_on("socketcan", f"{wire}x", [0x21]))
    mine.take("b", claims_on("socketcan", wire, [0x22]))  # its own already
    mine.release()
    assert claims_on("virtual", wire, [0x21]) == ()


def test_two_names_of_one_port_are_one_port(tmp_path):
    (tmp_path / "by-id").symlink_to("/dev/null")
    assert claims_on("slcan", str(tmp_path / "by-id"), [1]) == claims_on("slcan", "/dev/null", [1])


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV, signal.SIGTERM])
def test_any_death_frees_what_was_claimed(wire, other, number):
    names = claims_on("socketcan", wire, [0x21])
    process = other(names)
    assert refused(names)
    process.send_signal(number)
    mine = Claims()
    mine.take("mine", names, patience_s=60.0)
    mine.release()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can be two users")
def test_a_claim_of_another_user_counts_and_is_named(wire, other):
    process = other(claims_on("socketcan", wire, [0x21]), 12345)
    assert f"process {process.pid} of user 12345" in refused(claims_on("socketcan", wire, [0x21]))


@pytest.fixture
def loaded(tmp_path):
    """An ODrive on this machine's multicast bus, whose node somebody may drive already."""
    text = shipped_config("can-odrive.toml").read_text()
    channel = f"239.74.{os.getpid() % 200}.{free_ports() % 200}"
    for before, after in (
        ('interface = "socketcan"', 'interface = "udp_multicast"'),
        ('channel = "can0"', f'channel = "{channel}"'),
        ('realtime = "require"', 'realtime = "prefer"'),
    ):
        assert before in text
        text = text.replace(before, after)
    text = re.sub('"friction/', f'"{shipped_config("friction")}/', text)
    path = tmp_path / "rig.toml"
    path.write_text(text)
    return load(path)


def test_neither_a_second_daemon_nor_a_probe_touches_a_drive_that_is_driven(loaded, other, tmp_path):
    (member,) = loaded.members()
    assert member.claims
    driven = f"is driven by process {other(member.claims[-1:]).pid} "
    folder = tmp_path / "run"
    folder.mkdir(mode=0o700)
    with pytest.raises(DeviceError, match=driven), Host(loaded, runtime_dir=str(folder)):
        pass
    (device,) = probe.devices(loaded)
    device.open()
    assert driven in device.error
    device.close()


def test_a_stop_from_outside_asks_for_no_claim(loaded, other):
    """`rtctl stop-rig` reaches a drive whose daemon hangs, as it always did."""
    (member,) = loaded.members()
    other(member.claims)
    (stopped,) = SafeStop(loaded).now()
    assert "is driven by" not in stopped.detail
