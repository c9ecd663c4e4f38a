"""The contract (`rtctl.backend_contract`) on every backend that comes with rtctl.

A new backend adds a row to `cases`: its kind, its axes, a function that makes its options, and the device
that is played beside it.
"""

import math
from functools import partial

import can_rows
import force_devices
import numpy as np
import pytest
import serial_boards

from hw import registry
from hw.member import Member
from hw.rig import compose
from rtctl.backend_contract import Case, Contract, Device, Received

pytest_plugins = ("rtctl.backend_contract.plugin",)

SAMPLES = 60
PATIENT = {"open_timeout_s": 30.0, "reopen_timeout_s": 10.0}
"""For a simulated board on a busy machine; nothing is judged by it."""


def mock(n_axes, folder):
    hands = [{"kind": "sine", "start_s": 0.0}, {"kind": "triangle", "start_s": 0.0}][:n_axes]
    return {"hand": hands, "force": {"noise_n": 0.01}, "axis": [{"current_noise_a": 0.01}], "velocity": {}}


def playback(n_axes, folder):
    lines = [
        f"{k / 1000!r},{0.01 * k!r},{0.1 * math.sin(k)!r},{0.05 * math.cos(k)!r}" for k in range(SAMPLES)
    ]
    (folder / "log.csv").write_text("t,x,q,h\n" + "\n".join(lines) + "\n")
    axis = {"position": {"column": "x"}, "motor_torque": {"column": "q"}, "hand_torque": {"column": "h"}}
    return {"file": "log.csv", "time": {"column": "t"}, "axis": [axis]}


def serial(n_axes, folder, which):
    board = serial_boards.board(n_axes, lambda name: folder_of_boards(folder, which), which)
    return {"port": board.port, **PATIENT}


def serial_with_velocity(n_axes, folder, which):
    board = serial_boards.board(n_axes, lambda name: folder_of_boards(folder, which), which, velocity=True)
    return {"port": board.port, "channels": ["current", "force", "velocity", "temperature", "estop"]}


def described(n_axes, folder, which):
    board = serial_boards.described_board(n_axes, lambda name: folder_of_boards(folder, which), which)
    return {"port": board.port, **PATIENT, **serial_boards.described(n_axes)}


def lines(n_axes, folder, which):
    board = serial_boards.lines_board(n_axes, lambda name: folder_of_boards(folder, which), which)
    return {"port": board.port, **PATIENT, **serial_boards.lines(n_axes)}


class Board(Device):
    """A board that answers a command each, in a process of its own."""

    def __init__(self, backend, options, n_axes):
        super().__init__(backend, options, n_axes)
        self.lockstep = self.beside(backend, n_axes)

    def beside(self, backend, n_axes):
        per_axis = 14 if "velocity" in backend.provides else 10
        return serial_boards.InLockstep(backend, 35 + per_axis * n_axes)

    def open(self):
        self.lockstep.open()

    def step(self):
        self.lockstep.wait_if_asked()

    def write(self, tick):
        self.lockstep.write(tick)


class DescribedBoard(Board):
    def beside(self, backend, n_axes):
        board = serial_boards.at_port(backend._path)
        return serial_boards.InLockstep(backend, serial_boards.described_bytes(n_axes), board)


class LinesBoard(Board):
    def beside(self, backend, n_axes):
        board = serial_boards.at_port(backend._path)
        # two: the first may be the rest of a line
        return serial_boards.InLockstep(backend, serial_boards.lines_bytes(n_axes), board, samples=2)


class Sensor(Device):
    """A force sensor that sends on time."""

    def __init__(self, backend, options, n_axes):
        super().__init__(backend, options, n_axes)
        self.played = force_devices.newest()

    def step(self):
        self.played.emit(self.backend)

    def show(self, channel, values):
        self.played.shown = tuple(values)
        return channel == "force"


class OnCan(Device):
    """Drives or a board on a bus."""

    def __init__(self, backend, options, n_axes, wired):
        super().__init__(backend, options, n_axes)
        self.wired = wired(backend, options, n_axes)

    def open(self):
        self.wired.open()

    def step(self):
        self.wired.step()

    def show(self, channel, values):
        sim = self.wired.sim
        if channel == "temperature":
            for drive, value in zip(sim.drives, values, strict=True):
                drive.temperature_c = value
            return True
        if not isinstance(sim.plant, Shown):
            sim.plant = Shown(self.n_axes)
        return sim.plant.show(channel, values)

    def received(self):
        drives = self.wired.sim.drives
        return Received([drive.current_a for drive in drives], all(map(is_enabled, drives)))

    def close(self):
        self.wired.release()


class Shown:
    """A plant that stands as a test wants it; the joint's numbers as those of the motor before the gear."""

    def __init__(self, n_axes):
        self.of = {channel: [0.0] * n_axes for channel in ("position", "velocity", "current")}

    def show(self, channel, values):
        self.of[channel] = values
        return True

    def advance(self, seconds, currents_a):
        pass

    def motor_turns(self, axis):
        return self.of["position"][axis] * 80 / (2 * math.pi)

    def motor_turns_s(self, axis):
        return self.of["velocity"][axis] * 80 / (2 * math.pi)

    def motor_current_a(self, axis):
        return self.of["current"][axis]


def is_enabled(drive):
    """Whether a simulated drive lets torque through."""
    states = {"OdriveSim": ("state", 8), "MoteusSim": ("mode", 10), "Cia402Sim": ("state", 0x27)}
    name, enabled = states[type(drive).__name__]
    return getattr(drive, name) == enabled


def folder_of_boards(folder, which):
    made = folder / f"board-{which}"
    made.mkdir()
    return made


@pytest.fixture(scope="module", autouse=True)
def _boards_end_with_the_module():
    yield
    serial_boards.close_all()
    force_devices.close_all()


def split(kind, options, rig):
    """The backend's motor and its force sensor as two devices of one rig."""
    drive = ("position", "velocity", "current", "temperature", "current_command")
    members = [
        Member(kind, options, label, tuple(range(rig.n_axes)), channels, budget_ns=0)
        for label, channels in (("finger", ("force", "estop")), ("drive", drive))
    ]
    return compose(members, rig)


def simulated(kind, n_axes, table, **more):
    return Case(kind, lambda folder, which: table(n_axes, folder), n_axes=n_axes, **more)


def on_board(kind, n_axes, table, device):
    return Case(kind, partial(table, n_axes), device, n_axes, hears=False, shows=False)


def on_can(kind, n_axes, table, wired):
    """One bus, one backend, where the bus is a real wire."""
    device = partial(OnCan, wired=wired)
    # a board by a field map has no state of its own to look at
    return Case(
        kind,
        lambda folder, which: table(n_axes, folder),
        device,
        n_axes,
        twins=not can_rows.WIRES,
        hears=kind != "can",
    )


def sensor(kind):
    def options(_folder, _which):
        device = force_devices.play(kind)
        return {**device.options, **device.where}

    return Case(kind, options, Sensor)


class TestEveryBackend(Contract):
    cases = {
        "mock": simulated("mock", 1, mock),
        "mock, two axes": simulated("mock", 2, mock),
        "playback": simulated("playback", 1, playback),
        "a rig of two devices": simulated("mock", 2, mock, make=split),
        "serial over pty": on_board("serial", 1, serial, Board),
        "serial over pty, two axes": on_board("serial", 2, serial, Board),
        "serial with velocity over pty, two axes": on_board("serial", 2, serial_with_velocity, Board),
        "described frame over pty": on_board("serial-described", 1, described, DescribedBoard),
        "described frame over pty, two axes": on_board("serial-described", 2, described, DescribedBoard),
        "lines of text over pty, two axes": on_board("serial-lines", 2, lines, LinesBoard),
        **{kind: sensor(kind) for kind in force_devices.SENSORS},
        **{name: on_can(*row) for name, row in can_rows.ROWS.items()},
    }

    def test_a_measured_velocity_adds_up_to_the_travel(self, running):
        """Sign and unit at the joint: over a push of the motor its sum is the change of position."""
        if not {"position", "velocity"} <= running.backend.provides:
            pytest.skip("measures no velocity")
        tick, positions, velocities = running.tick(), [], []
        for slot in range(SAMPLES):
            tick["tick"] = slot
            running.read(tick)
            positions.append(tick["position_rad"][0].copy())
            velocities.append(tick["device_velocity_rad_s"][0].copy())
            tick["enabled"], tick["current_command_a"] = 1, 1.0
            tick["torque_applied_nm"] = 1.0 * 80 * 0.72 * 0.0134
            running.write(tick)
        travel = positions[-1] - positions[0]
        steps = 1e-3 * (np.array(velocities)[1:] + np.array(velocities)[:-1]) / 2
        count = 2 * math.pi / 4096 / 80  # of the coarsest encoder among the cases
        assert (np.abs(travel) > 20 * count).all()
        assert steps.sum(axis=0) == pytest.approx(travel, rel=0.05, abs=2 * count)


def test_every_built_in_backend_is_in_this_suite():
    assert set(registry.BUILT_IN) == {case.kind for case in TestEveryBackend.cases.values()}
