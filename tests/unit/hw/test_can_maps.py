"""Devices of other makers by their field maps: every shipped rig file run against its simulated device."""

import contextlib
import itertools
import math
from dataclasses import replace
from pathlib import Path

import can
import numpy as np
import pytest

from hw.rig import compose
from hw.simulators.can_device import DriveSim, make_drives
from hw.simulators.can_plant import Inertia
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config
from rtctl.tick import new_ticks

_numbers = itertools.count()


class Played:
    """A rig file's rig on an in-process bus, beside the devices it names."""

    def __init__(self, folder, name, kinds):
        channel = f"maps-{next(_numbers)}"
        text = Path(shipped_config(name)).read_text()
        text = text.replace('"socketcan"', '"virtual"').replace('"can0"', f'"{channel}"')
        (folder / "rig.toml").write_text(text)
        loaded = load(folder / "rig.toml")
        self.hardware = loaded.config.hardware()
        members = [replace(member, budget_ns=0) for member in loaded.members()]  # this machine may be busy
        self.backend = compose(members, self.hardware)
        constant = float(self.hardware.torque_constant_nm_a[0])
        self.drives = [drive for kind in kinds for drive in make_drives(kind, [1])]
        self.sim = DriveSim(
            can.Bus(interface="virtual", channel=channel, ignore_config=True),
            self.drives,
            Inertia(len(kinds), constant, inertia_kgm2=2e-4),
        )
        self.tick = new_ticks(1, 1)

    def open(self):
        self.sim.start()
        try:
            self.backend.open()
        finally:
            self.sim.stop()
        self.backend.warm_up(self.tick)
        self.pump()

    def pump(self, seconds=1e-3):
        self.sim.advance(seconds)
        while self.sim.handle():
            pass

    def cycles(self, n, *, enabled=1, torque_nm=0.0, current_a=0.0):
        for _ in range(n):
            self.backend.read(self.tick)
            self.tick["tick"] += 1
            self.tick["enabled"], self.tick["torque_applied_nm"] = enabled, torque_nm
            self.tick["current_command_a"] = current_a
            self.backend.write(self.tick)
            self.pump()
        return self.tick[0]

    def close(self):
        self.backend.close()
        self.sim.bus.shutdown()


@pytest.fixture
def play(tmp_path):
    with contextlib.ExitStack() as stack:

        def _play(name, *kinds):
            made = stack.enter_context(contextlib.closing(Played(tmp_path, name, kinds)))
            made.open()
            return made

        yield _play


def test_a_drive_in_mit_mode_is_switched_on_when_armed_and_off_when_not(play):
    rig = play("can-mit.toml", "mit")
    (drive,) = rig.drives
    tick = rig.cycles(3, enabled=0)
    assert (drive.on, tick["link_faults"]) == (False, 0)
    assert tick["sample_count"] >= 3, "it answers the frame that keeps it off"
    rig.cycles(1, torque_nm=1.0)
    assert (drive.on, drive.current_a) == (True, 0.0), "the first cycle switches on and commands nothing"
    tick = rig.cycles(40, torque_nm=1.0)
    ampere = 9.0 * 0.091
    assert drive.current_a * drive._ampere**-1 == pytest.approx(1.0, abs=36 / 4095)
    assert tick["position_rad"][0] == pytest.approx(drive._angle, abs=0.05) != 0
    assert tick["device_velocity_rad_s"][0] > 0
    assert tick["current_a"][0] * ampere == pytest.approx(drive._measured_a / drive._ampere, abs=0.02)
    rig.cycles(1, enabled=0)
    assert (drive.on, drive.current_a) == (False, 0.0)


def test_mit_mode_ends_with_the_stop_and_with_the_host(play):
    rig = play("can-mit.toml", "mit")
    (drive,) = rig.drives
    rig.cycles(5, torque_nm=1.0)
    rig.backend.stop()
    rig.pump()
    assert (drive.on, drive.current_a) == (False, 0.0)
    rig.cycles(5, torque_nm=1.0)
    assert drive.current_a != 0
    rig.pump(0.02)
    assert (drive.on, drive.current_a) == (False, 0.0)


def test_a_zero_in_mit_mode_is_the_smallest_torque_the_wire_has(play):
    rig = play("can-mit.toml", "mit")
    rig.cycles(4, torque_nm=0.0)
    assert abs(rig.drives[0].current_a / rig.drives[0]._ampere) < 36 / 4095


def test_an_angle_at_the_end_of_the_wires_range_is_no_sample(play):
    rig = play("can-mit.toml", "mit")
    before = int(rig.cycles(2, enabled=0)["sample_count"])
    rig.sim.plant._angle[0] = 13.0 * 9
    rig.cycles(1, enabled=0)
    assert rig.cycles(3, enabled=0)["sample_count"] <= before + 1


def test_the_fault_of_a_mit_drive_is_a_device_fault(play):
    rig = play("can-mit.toml", "mit")
    rig.drives[0].error = 3
    assert rig.cycles(3, enabled=0)["link_faults"] & 16


def test_another_drives_answer_on_the_same_identifier_is_passed_over(play):
    rig = play("can-mit.toml", "mit")
    count = int(rig.cycles(2, enabled=0)["sample_count"])
    rig.sim.muted = True
    for _ in range(3):
        rig.sim.bus.send(can.Message(arbitration_id=0, data=b"\2" + bytes(7), is_extended_id=False))
        tick = rig.cycles(1, enabled=0)
    assert tick["sample_count"] <= count + 1
    assert not tick["link_faults"]


def test_a_vesc_is_driven_over_many_turns_of_its_angle_and_lets_go(play):
    rig = play("can-vesc.toml", "vesc")
    seen = [float(rig.cycles(1, current_a=5.0)["position_rad"][0]) for _ in range(300)]
    assert rig.drives[0].current_a == 5.0
    turns = rig.sim.plant.motor_turns(0)
    assert turns > 3, "several wraps of 360 degrees"
    assert seen[-1] == pytest.approx(2 * math.pi * turns / 8, abs=0.2)
    assert (np.diff(seen) >= 0).all()
    assert rig.tick["current_a"][0, 0] == pytest.approx(5.0)
    assert rig.tick["temperature_c"][0, 0] == pytest.approx(28.7)
    speed = 2 * math.pi * rig.sim.plant.motor_turns_s(0) / 8
    assert rig.tick["device_velocity_rad_s"][0, 0] == pytest.approx(speed, rel=0.02)
    rig.cycles(1, enabled=0, current_a=1.0)
    assert rig.drives[0].current_a == 0.0
    rig.cycles(2, current_a=1.0)
    rig.pump(0.02)
    assert rig.drives[0].current_a == 0.0, "without a host the time-out"


def test_an_optoforce_on_can_is_started_read_and_silenced(play):
    rig = play("can-optoforce.toml", "odrive", "optoforce")
    sensor = rig.drives[1]
    assert sensor.period_s == 1e-3
    sensor.counts = (100, -250, 3000)
    tick = rig.cycles(3, enabled=0)
    assert tick["force_n"] == pytest.approx([1.0, -2.5, 15.0])
    assert not tick["link_faults"]
    sensor.status = 0x0200  # overload of x
    assert rig.cycles(3, enabled=0)["link_faults"] & 16
    rig.backend.stop()
    rig.pump()
    assert sensor.period_s == 0.0
