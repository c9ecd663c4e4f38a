"""The line to the service manager: what is sent, when, and that it never holds anybody up."""

import socket

import pytest

from rtctl.control.vocabulary import Fault, State
from rtctl.errors import ConfigError, DeviceError
from rtctl.host.notify import Notifier


@pytest.fixture
def notifying():
    made = []

    def make(address):
        made.append(Notifier(address))
        return made[-1]

    yield make
    for notifier in made:
        notifier.close()


@pytest.fixture(params=["path", "abstract"])
def manager(request, tmp_path):
    receiver = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    address = str(tmp_path / "notify") if request.param == "path" else f"@rtctl-test-{tmp_path.name}"
    receiver.bind("\0" + address[1:] if address[0] == "@" else address)
    receiver.setblocking(False)
    yield address, receiver
    receiver.close()


def heard(receiver):
    out = []
    while True:
        try:
            out.append(receiver.recv(4096).decode())
        except BlockingIOError:
            return out


def test_each_message_is_what_systemd_expects(manager, notifying):
    address, receiver = manager
    notifier = notifying(address)
    notifier.ready()
    notifier.stopping()
    notifier.reloading()
    ready, stopping, reloading = heard(receiver)
    assert ready == "READY=1"
    assert stopping == "STOPPING=1\nWATCHDOG_USEC=30000000"
    assert reloading.startswith("RELOADING=1\nMONOTONIC_USEC=")
    assert int(reloading.rpartition("=")[2]) > 0
    notifier.close()
    notifier.ready()
    assert heard(receiver) == []


def test_what_ended_the_daemon_is_its_last_status_in_one_line(manager, notifying):
    address, receiver = manager
    notifier = notifying(address)
    notifier.ended(ConfigError("rig.toml: 2 fault(s)", ("rig.toml:3: loop.rate_hz", "another")))
    notifier.ended(DeviceError("no such port \udcff"))
    assert heard(receiver) == [
        "STATUS=rig.toml: 2 fault(s) rig.toml:3: loop.rate_hz",
        "STATUS=no such port \\udcff",
    ]


def test_the_watchdog_is_fed_only_while_ticks_advance(manager, notifying):
    address, receiver = manager
    notifier = notifying(address)
    for head in (1, 2, 2, 2, 3):
        notifier.alive(head)
    assert heard(receiver) == ["WATCHDOG=1"] * 3


def test_the_status_names_state_and_faults_and_is_sent_once_per_change(manager, notifying):
    address, receiver = manager
    notifier = notifying(address)
    for _ in range(3):
        notifier.status(State.ACTIVE, 0, -1)
    notifier.status(State.FAULT, int(Fault.STALE | Fault.JUMP), 0)
    notifier.status(State.ESTOP, 0, 0)
    assert heard(receiver) == [
        "STATUS=ACTIVE",
        "STATUS=FAULT, first cause STALE, present: STALE, JUMP",
        "STATUS=ESTOP, first cause ESTOP",
    ]


def test_without_a_manager_nothing_happens(monkeypatch, tmp_path, notifying):
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    notifying(None).ready()
    gone = notifying(str(tmp_path / "nobody"))
    gone.ready()
    assert gone.dropped == 1


def test_a_manager_that_does_not_read_holds_nobody_up(manager, notifying):
    address, _ = manager
    notifier = notifying(address)
    for head in range(10_000):
        notifier.alive(head)
    assert notifier.dropped > 0
