"""What `hw.interface.Backend` promises, run against every backend there is.

A new backend adds one row to `ROWS`: its kind, its axes, a function that makes its options, and for a device
one that puts the simulated device beside it.
"""

import inspect
import json
import math
import subprocess
import sys

import can_rows
import example_package
import force_devices
import numpy as np
import pytest
import serial_boards
from hardware import rig

from hw import registry
from hw.interface import CHANNEL_FIELDS
from hw.rig import Member, compose
from rtctl.control.jit import records
from rtctl.tick import FIELDS, new_ticks

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


def in_step_with_lines(backend, n_axes):
    board = serial_boards.at_port(backend._path)
    # two: the first may be the rest of a line
    return serial_boards.InLockstep(backend, serial_boards.lines_bytes(n_axes), board, samples=2)


def in_step_with_described(backend, n_axes):
    board = serial_boards.at_port(backend._path)
    return serial_boards.InLockstep(backend, serial_boards.described_bytes(n_axes), board)


def folder_of_boards(folder, which):
    made = folder / f"board-{which}"
    made.mkdir()
    return made


def sensor(kind):
    def _table(_n_axes, _folder, _which):
        device = force_devices.play(kind)
        return {**device.options, **device.where}

    return _table


def example(n_axes, folder, which):
    host, port = example_package.board().socket.getsockname()
    return {"host": host, "port": port, "lost_after_s": 1.0}


ROWS = {
    "mock": ("mock", 1, mock),
    "mock, two axes": ("mock", 2, mock),
    "playback": ("playback", 1, playback),
    "a rig of two devices": ("mock", 2, mock),
    "serial over pty": ("serial", 1, serial),
    "serial over pty, two axes": ("serial", 2, serial),
    "serial with velocity over pty, two axes": ("serial", 2, serial_with_velocity),
    "described frame over pty": ("serial-described", 1, described),
    "described frame over pty, two axes": ("serial-described", 2, described),
    "lines of text over pty, two axes": ("serial-lines", 2, lines),
    **{kind: (kind, 1, sensor(kind)) for kind in force_devices.SENSORS},
    **can_rows.ROWS,
    "a third party's": (example_package.KIND, 1, example),
}

WRAPPERS = {
    "serial": lambda backend, n_axes: serial_boards.InLockstep(
        backend, 35 + (14 if "velocity" in backend.provides else 10) * n_axes
    ),
    "serial-described": in_step_with_described,
    "serial-lines": in_step_with_lines,
    example_package.KIND: lambda backend, _: example_package.InStep(backend, example_package.newest_board()),
    **{kind: lambda backend, _: force_devices.Fed(backend) for kind in force_devices.SENSORS},
}
"""Kinds whose device answers in its own time: the wrapper waits for it before a read."""


@pytest.fixture(scope="module", autouse=True)
def _boards_end_with_the_module(tmp_path_factory):
    with example_package.installed(tmp_path_factory.mktemp("site")):
        yield
    serial_boards.close_all()
    force_devices.close_all()
    example_package.close_all()


def split(kind, options, n_axes):
    """The backend's motor and its force sensor as two devices of one rig."""
    drive = ("position", "velocity", "current", "temperature", "current_command")
    members = [
        Member(kind, options, label, tuple(range(n_axes)), channels, budget_ns=0)
        for label, channels in (("finger", ("force", "estop")), ("drive", drive))
    ]
    return compose(members, rig(n_axes))


class Subject:
    """A backend under test, and ticks of its size."""

    def __init__(self, row, folder, which="first"):
        self.row, self.folder = row, folder
        self.kind, self.n_axes, table, *beside = ROWS[row]
        given = table(self.n_axes, folder, which) if self.kind in WRAPPERS else table(self.n_axes, folder)
        valid = registry.options_model(self.kind).model_validate(given, context={"folder": folder})
        self.options = valid.model_dump(mode="json")
        self.split = row == "a rig of two devices"
        self.backend = self.make()
        if beside:
            self.backend = beside[0](self.backend, self.options, self.n_axes)

    def make(self):
        if self.split:
            return split(self.kind, self.options, self.n_axes)
        made = registry.create(self.kind, self.options, rig(self.n_axes))
        return WRAPPERS.get(self.kind, lambda backend, _: backend)(made, self.n_axes)

    def twin(self):
        """Another one with the same options and an equal device of its own."""
        return Subject(self.row, self.folder, "second")

    def release(self):
        getattr(self.backend, "release", self.backend.close)()

    def tick(self, slot=0):
        tick = records(new_ticks(1, self.n_axes))
        tick["tick"] = slot
        return tick


@pytest.fixture(params=ROWS)
def subject(request, tmp_path):
    made = Subject(request.param, tmp_path)
    yield made
    made.release()


@pytest.fixture
def running(subject):
    subject.backend.open()
    return subject


def test_channels_are_known_and_none_is_both_given_and_taken(subject):
    provides, consumes = subject.backend.provides, subject.backend.consumes
    assert isinstance(provides, frozenset)
    assert isinstance(consumes, frozenset)
    assert provides | consumes <= set(CHANNEL_FIELDS)
    assert not provides & consumes
    assert provides
    declared = registry.lookup(subject.kind).channels
    assert declared is None or declared.provides >= provides


def test_a_new_backend_shows_its_channels_before_it_is_opened(subject):
    found = registry.channels(subject.kind, subject.options, rig(subject.n_axes))
    assert found.provides >= subject.backend.provides
    assert found.consumes >= subject.backend.consumes


def test_the_methods_are_those_of_the_interface(subject):
    for name, arguments in {"open": [], "read": ["tick"], "write": ["tick"], "stop": [], "close": []}.items():
        assert list(inspect.signature(getattr(subject.backend, name)).parameters) == arguments


def test_stop_is_safe_before_open_and_after_close_and_often(subject):
    subject.backend.stop()
    subject.backend.open()
    subject.backend.stop()
    subject.backend.stop()
    subject.backend.close()
    subject.backend.stop()


def test_open_and_close_may_be_repeated(subject):
    subject.backend.close()
    subject.backend.open()
    subject.backend.open()
    subject.backend.read(subject.tick())
    subject.backend.close()
    subject.backend.close()


def test_every_fresh_sample_advances_the_count_by_one(running):
    for slot in range(SAMPLES):
        tick = running.tick(slot)
        running.backend.read(tick)
        assert tick["sample_count"][0] == slot + 1
        running.backend.write(tick)


def test_reading_writes_the_given_channels_and_nothing_else(running):
    allowed = {CHANNEL_FIELDS[channel] for channel in running.backend.provides} | {
        "sample_count",
        "link_faults",
    }
    for sentinel in (77, -55):
        tick = running.tick()
        for field in FIELDS:
            tick[field.name] = sentinel if field.kind != "bits" else 77
        tick["tick"] = 0
        before = tick.copy()
        running.backend.read(tick)
        changed = {field.name for field in FIELDS if not np.array_equal(tick[field.name], before[field.name])}
        assert changed <= allowed
        assert "sample_count" in changed
        assert changed & {CHANNEL_FIELDS[channel] for channel in running.backend.provides}
        assert tick["link_faults"][0] == 0, "a good sample clears what an earlier one left"


def test_writing_changes_nothing_in_the_tick(running):
    tick = running.tick()
    running.backend.read(tick)
    tick["enabled"], tick["current_command_a"], tick["torque_applied_nm"] = 1, 0.3, 0.2
    before = tick.tobytes()
    running.backend.write(tick)
    assert tick.tobytes() == before


def test_measurements_are_finite_whatever_is_sent(running):
    for slot, value in enumerate([0.0, math.nan, math.inf, -math.inf, 1e308, -1e308, 0.5]):
        tick = running.tick(slot)
        running.backend.read(tick)
        for channel in running.backend.provides:
            assert np.isfinite(tick[CHANNEL_FIELDS[channel]]).all(), channel
        tick["enabled"], tick["current_command_a"], tick["torque_applied_nm"] = 1, value, value
        running.backend.write(tick)


def test_a_measured_velocity_adds_up_to_the_travel(running):
    """Sign and unit at the joint: over a push of the motor its sum is the change of position."""
    if not {"position", "velocity"} <= running.backend.provides:
        pytest.skip("measures no velocity")
    tick, positions, velocities = running.tick(), [], []
    for slot in range(SAMPLES):
        tick["tick"] = slot
        running.backend.read(tick)
        positions.append(tick["position_rad"][0].copy())
        velocities.append(tick["device_velocity_rad_s"][0].copy())
        tick["enabled"], tick["current_command_a"], tick["torque_applied_nm"] = (
            1,
            1.0,
            1.0 * 80 * 0.72 * 0.0134,
        )
        running.backend.write(tick)
    travel = positions[-1] - positions[0]
    steps = 1e-3 * (np.array(velocities)[1:] + np.array(velocities)[:-1]) / 2
    count = 2 * math.pi / 4096 / 80  # of the coarsest encoder among the rows
    assert (np.abs(travel) > 20 * count).all()
    assert steps.sum(axis=0) == pytest.approx(travel, rel=0.05, abs=2 * count)


def test_missed_slots_are_no_error(running):
    for slot in (0, 1, 5, 6, 40):
        tick = running.tick(slot)
        running.backend.read(tick)
        running.backend.write(tick)
    assert tick["sample_count"][0] > 0


def test_ticks_may_be_rows_of_a_ring(running):
    ring = records(new_ticks(4, running.n_axes))
    for slot in range(4):
        ring["tick"][slot] = slot
        running.backend.read(ring[slot : slot + 1])
        running.backend.write(ring[slot : slot + 1])
    assert ring["sample_count"].tolist() == [1, 2, 3, 4]


def test_two_backends_with_the_same_options_show_the_same(running, tmp_path):
    if can_rows.WIRES and running.kind in can_rows.KINDS:
        pytest.skip("one bus, one backend")
    twin = running.twin()
    other = twin.backend
    other.open()
    for slot in range(20):
        a, b = running.tick(slot), running.tick(slot)
        running.backend.read(a)
        other.read(b)
        assert a.tobytes() == b.tobytes()
        running.backend.write(a)
        other.write(b)
    twin.release()


def test_the_options_are_plain_data_and_refuse_unknown_keys(subject, tmp_path):
    model = registry.options_model(subject.kind)
    dump = json.loads(json.dumps(subject.options))
    assert model.model_validate(dump, context={"folder": tmp_path}).model_dump(mode="json") == subject.options
    with pytest.raises(ValueError, match="no_such_key"):
        model.model_validate({**dump, "no_such_key": 1}, context={"folder": tmp_path})


@pytest.mark.parametrize("kind", sorted({row[0] for row in ROWS.values()}))
def test_the_loop_process_gets_a_backend_without_the_config_library(kind):
    module = registry.lookup(kind).factory.partition(":")[0]
    heavy = "{'pydantic', 'zmq', 'sklearn', 'asyncio', 'rtctl'}"
    code = f"import sys, {module}; bad = {heavy} & set(sys.modules); sys.exit(', '.join(bad) if bad else 0)"
    shown = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=170
    )
    assert shown.returncode == 0, shown.stderr


def test_every_built_in_backend_is_in_this_suite():
    assert set(registry.BUILT_IN) | {example_package.KIND} == {row[0] for row in ROWS.values()}
