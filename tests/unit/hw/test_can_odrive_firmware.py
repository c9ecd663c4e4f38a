"""ODrives of every firmware: the version is asked first, and nothing is sent that another one reads
otherwise.
"""

import itertools
import struct
from contextlib import contextmanager
from types import SimpleNamespace

import can
import numpy as np
import pytest

from hw import registry
from hw.can import odrive, odrive_codec
from hw.can.odrive_firmware import decode_version
from hw.can.options import OdriveOptions
from hw.can.sample import Sample
from hw.interface import BackendError, Rig
from hw.simulators.can_device import TORQUE_CONSTANT_NM_A, DriveSim
from hw.simulators.can_drives import REMOTE, OdriveSim
from hw.simulators.can_plant import Inertia
from rtctl.control.jit import records
from rtctl.tick import new_ticks

RIG = Rig(
    1, 1e-3, np.full(1, 80.0), np.full(1, 0.72), np.full(1, 0.0134), np.full(1, 160_000.0), np.eye(3)[:1]
)
ALIKE = {0x07, 0x0B, 0x0E, 0x18, REMOTE | 0x00, REMOTE | 0x09, REMOTE | 0x14}
"""Commands that firmware 0.5 (can_simple.cpp) and 0.6 (its DBC) read alike; 0.5 ignores a remote frame of
0."""

_channels = (f"firmware-{k}" for k in itertools.count())


class Heard(OdriveSim):
    """Remembers the commands it was sent, in order."""

    def __init__(self, firmware, heartbeat_every=1):
        super().__init__(1, TORQUE_CONSTANT_NM_A, None, 0.01, firmware)
        self.heard, self._every, self._beats = [], heartbeat_every, 0

    def frame(self, can_id, data):
        self.heard.append(can_id & (REMOTE | 0x1F))
        return self._thinned(super().frame(can_id, data))

    def pass_time(self, *arguments):
        return self._thinned(super().pass_time(*arguments))

    def _thinned(self, frames):
        return [frame for frame in frames if frame[0] & 0x1F != 0x01 or self._keep()]

    def _keep(self):
        self._beats += 1
        return self._beats % self._every == 1 or self._every == 1


@contextmanager
def opened(drive, **options):
    """The backend, opened beside its drive; then the drive is served by hand."""
    channel = next(_channels)
    table = {
        "bus": {"interface": "virtual", "channel": channel},
        "feedback": "request",
        "axis": [{"node": 1}],
    }
    valid = OdriveOptions.model_validate({**table, **options}, context={"rate_hz": 1000.0})
    backend = registry.create("odrive", valid.model_dump(mode="json"), RIG)
    with can.Bus(interface="virtual", channel=channel, ignore_config=True) as bus:
        sim = DriveSim(bus, [drive], Inertia(1, TORQUE_CONSTANT_NM_A))
        sim.start()
        try:
            backend.open()
        finally:
            sim.stop()
        try:
            yield backend, sim
        finally:
            backend.close()


def cycles(backend, sim, tick, times, current_a=0.0, enabled=0):
    for _ in range(times):
        sim.pump(1e-3)
        backend.read(tick)
        tick["enabled"], tick["current_command_a"] = enabled, current_a
        backend.write(tick)
        tick["tick"] += 1


@pytest.mark.parametrize("firmware", [(0, 5, 1), (0, 5, 6), (0, 6, 0), (0, 6, 8)])
def test_a_drive_whose_command_6_sets_its_node_keeps_it(firmware):
    drive = Heard(firmware)
    with opened(drive) as (backend, _):
        assert drive.node == 1, "not renumbered"
        assert set(drive.heard) <= ALIKE
        assert backend.drives[0].identity == b""


@pytest.mark.parametrize("firmware", [(0, 6, 9), (0, 6, 11), (1, 0, 0)])
def test_a_drive_that_tells_its_serial_number_is_asked_for_it_after_its_version(firmware):
    drive = Heard(firmware)
    with opened(drive) as (backend, _):
        (axis,) = backend.drives
        assert (axis.version, axis.identity) == (firmware, drive.serial)
    first = drive.heard.index(REMOTE | 0x06)
    assert set(drive.heard[:first]) <= ALIKE
    assert REMOTE | 0x00 in drive.heard[:first]


def test_firmware_0_5_is_driven_and_says_its_own_errors():
    drive = Heard((0, 5, 6))
    tick = records(new_ticks(1, 1))
    with opened(drive) as (backend, sim):
        cycles(backend, sim, tick, 3)
        cycles(backend, sim, tick, 60, enabled=1)
        cycles(backend, sim, tick, 3, current_a=2.0, enabled=1)
        assert drive.current_a == pytest.approx(2.0, rel=1e-3)
        assert tick["link_faults"][0] == 0
        drive.error, drive.state = 0x20000 | 0x800, 1
        cycles(backend, sim, tick, 20, current_a=2.0, enabled=1)
        assert backend.status() == ["node 1: state IDLE (1), WATCHDOG_TIMER_EXPIRED, HOMING_WITHOUT_ENDSTOP"]
    assert set(drive.heard) <= ALIKE


@pytest.mark.parametrize("fd", [False, True])
def test_a_question_is_a_remote_frame_where_there_are_any_and_an_empty_one_on_can_fd(fd):
    options = {"feedback": "cyclic", "heartbeat_ms": 10.0, "bus": {"fd": fd}}
    table = {"node": 5, "direction": 1, "shaft": "motor", "offset_rad": 0.0, "current_max_a": 20.0}
    axis = odrive.OdriveAxis(table, options, RIG, 0, Sample(1))
    made = []
    axis.make_frames(SimpleNamespace(outgoing=lambda can_id, n: made.append((can_id, n)) or _frame(n)))
    asked = [can_id for can_id, n in made if n == 0]
    assert [can_id & 0x1F for can_id in asked] == [0x09, 0x14, 0x06, 0x00]
    assert all(bool(can_id & REMOTE) != fd for can_id in asked)


def _frame(length):
    return SimpleNamespace(buffer=bytearray(length), offset=0, length=length)


def test_firmware_0_5_has_no_temperature():
    with (
        pytest.raises(
            BackendError, match=r"firmware older than 0\.6 sends no temperature.*temperature_ms = 0"
        ),
        opened(Heard((0, 5, 6)), temperature_ms=100.0),
    ):
        pass


def test_every_error_bit_has_its_word_or_its_number():
    assert odrive_codec.error_names(0x20000) == "REQUESTED_CURRENT_TOO_HIGH"
    assert odrive_codec.error_names(0x20000, (0, 5, 6)) == "HOMING_WITHOUT_ENDSTOP"
    assert odrive_codec.error_names(0x20 | 0x80) == "DRV_FAULT, 0x80", "no bit is left out"


def test_a_drive_whose_heartbeat_is_slower_than_the_rig_file_says_is_refused_with_the_setting():
    with (
        pytest.raises(
            BackendError,
            match=r"no two heartbeats within 50 ms, but heartbeat_ms is 10.*heartbeat_msg_rate_ms",
        ),
        opened(Heard((0, 6, 11), heartbeat_every=10_000)),
    ):
        pass


def test_a_heartbeat_too_slow_to_tell_that_the_drive_has_let_go_is_no_option():
    table = {"bus": {"channel": "can0"}, "axis": [{"node": 1}]}
    assert OdriveOptions.model_validate(table, context={"rate_hz": 1000.0}).heartbeat_ms == 10.0
    with pytest.raises(ValueError, match=r"heartbeat_ms 100 must be at most 20 \(20 periods\)"):
        OdriveOptions.model_validate({**table, "heartbeat_ms": 100.0}, context={"rate_hz": 1000.0})
    assert OdriveOptions.model_validate({**table, "heartbeat_ms": 100.0}, context={"rate_hz": 200.0})


@pytest.mark.parametrize("length", range(8))
def test_a_version_of_another_length_is_none(length):
    assert decode_version(struct.pack("8B", 2, 4, 4, 58, 0, 6, 9, 0), 0, length) is None
