"""What every CAN device promises beyond the backend contract, each preset against its simulated device."""

import gc
import math
import threading
from pathlib import Path

import can_rows
import numpy as np
import pytest
from hardware import rig

from hw import registry
from hw.interface import BackendError, LinkFault, LinkLost
from rtctl.control.jit import records
from rtctl.tick import new_ticks

REPLUGS = 5 if can_rows.WIRES else 100
"""Nothing may be left of any of them, so a leak of each, or of a few, shows. In a virtual machine they take
long."""


def on_a_wire(*values):
    """Of values that our own code makes one frame of, in the same way on every wire: the first in a virtual
    machine, where a test takes seconds of an emulated controller; all of them in `make test`."""
    return values[:1] if can_rows.WIRES else values


class Bench:
    """A backend, its device, and a tick that is written slot after slot."""

    def __init__(self, row, folder, **more):
        kind, self.n_axes, table, beside = can_rows.ROWS[row]
        self.kind = kind
        given = {**table(self.n_axes, folder), **more}
        valid = registry.options_model(kind).model_validate(given, context={"folder": folder})
        self.options = valid.model_dump(mode="json")
        backend = registry.create(kind, self.options, rig(self.n_axes))
        self.backend = beside(backend, self.options, self.n_axes)
        self.tick = records(new_ticks(1, self.n_axes))

    @property
    def sim(self):
        return self.backend.sim

    @property
    def faults(self):
        return LinkFault(int(self.tick["link_faults"][0]))

    def cycle(self, current_a=0.0, enabled=0, times=1):
        for _ in range(times):
            self.backend.read(self.tick)
            self.tick["enabled"], self.tick["current_command_a"] = enabled, current_a
            self.backend.write(self.tick)
            self.tick["tick"] += 1

    def arm(self):
        self.cycle(times=3)
        for _ in range(60):
            self.cycle(enabled=1)
        return self


@pytest.fixture(params=can_rows.ROWS)
def bench(request, tmp_path):
    made = Bench(request.param, tmp_path)
    made.backend.open()
    yield made
    made.backend.release()


def test_a_current_reaches_the_motor_only_while_enabled(bench):
    bench.cycle(current_a=2.0, enabled=0, times=20)
    assert all(drive.current_a == 0.0 for drive in bench.sim.drives)
    bench.arm()
    bench.cycle(current_a=2.0, enabled=1, times=3)
    assert [drive.current_a for drive in bench.sim.drives] == pytest.approx([2.0] * bench.n_axes, rel=1e-2)
    bench.cycle(current_a=2.0, enabled=0, times=2)
    assert all(drive.current_a == 0.0 for drive in bench.sim.drives)
    assert bench.faults == 0


def test_signs_and_units_agree_with_the_motor(bench):
    bench.arm()
    bench.cycle(current_a=1.5, enabled=1, times=30)
    bench.cycle(times=1)
    turns = [bench.sim.plant.motor_turns(axis) for axis in range(bench.n_axes)]
    assert min(turns) > 0
    shown = bench.tick["position_rad"][0]
    assert shown == pytest.approx(np.array(turns) * 2 * math.pi / 80, rel=0.2)
    assert bench.tick["current_a"][0] == pytest.approx(1.5, rel=2e-2)


def test_stop_makes_the_motor_torque_free(bench):
    bench.arm()
    bench.cycle(current_a=2.0, enabled=1, times=3)
    bench.backend.stop()
    for _ in range(20 if can_rows.WIRES else 1):  # an emulated controller takes its time
        bench.backend.settle()
    bench.sim.advance(1e-4)
    assert all(drive.current_a == 0.0 for drive in bench.sim.drives)


def test_the_device_stops_by_itself_when_commands_end(bench):
    bench.arm()
    bench.cycle(current_a=2.0, enabled=1, times=3)
    bench.backend.settle()
    for _ in range(12):
        bench.sim.advance(1e-3)
    assert all(drive.current_a == 0.0 for drive in bench.sim.drives)


def test_an_old_sample_is_never_fresh(bench):
    bench.cycle(times=5)
    count = int(bench.tick["sample_count"][0])
    bench.sim.muted = True
    bench.cycle(times=40)
    assert bench.tick["sample_count"][0] <= count + 1, "at most what was on its way"
    assert bench.faults & LinkFault.LOST
    bench.sim.muted = False
    bench.cycle(times=30)
    assert bench.tick["sample_count"][0] > count + 20


def test_after_a_long_pause_what_waited_is_not_shown_as_fresh(bench):
    bench.cycle(times=5)
    count = int(bench.tick["sample_count"][0])
    bench.tick["tick"] += 50
    bench.cycle()
    assert bench.tick["sample_count"][0] == count
    bench.cycle(times=2)
    assert bench.tick["sample_count"][0] >= count + 1


@pytest.mark.parametrize("value", on_a_wire(math.nan, math.inf, -math.inf))
def test_a_command_that_is_not_finite_moves_nothing(bench, value):
    bench.arm()
    bench.cycle(current_a=value, enabled=1, times=3)
    assert all(drive.current_a == 0.0 for drive in bench.sim.drives)


@pytest.mark.parametrize("value", on_a_wire(-1e308, 1e3, -1e3, 1e308))
def test_a_command_beyond_the_wire_saturates_and_never_wraps(bench, value):
    bench.arm()
    bench.cycle(current_a=value, enabled=1, times=3)
    for drive in bench.sim.drives:
        assert math.copysign(1.0, drive.current_a) == math.copysign(1.0, value)
        assert 5.0 <= abs(drive.current_a) <= 32.8


def test_the_parts_of_a_sample_must_all_be_new(bench):
    if len(bench.sim.drives) < 2:
        pytest.skip("one frame or one drive is the whole sample")
    bench.cycle(times=3)
    count = int(bench.tick["sample_count"][0])
    silent = bench.sim.drives[1]
    bench.sim.drives[1:] = []
    bench.cycle(times=20)
    assert bench.tick["sample_count"][0] <= count + 1
    bench.sim.drives.append(silent)
    bench.cycle(times=5)
    assert bench.tick["sample_count"][0] > count + 1


def test_a_closed_bus_is_a_lost_link_and_stop_still_never_raises(bench):
    bench.backend.close()
    with pytest.raises(LinkLost):
        bench.backend.backend.read(bench.tick)
    with pytest.raises(LinkLost):
        bench.backend.backend.write(bench.tick)
    bench.backend.stop()


TORQUE_WANTED = 40 if can_rows.WIRES else 1200
"""Cycles in which torque is wanted of a drive that has let go; in a virtual machine few, as replugs are."""

LET_GO = {"odrive": {"state": 1}, "moteus": {"mode": 11}, "cia402": {"state": 0x40}}
"""What each simulated drive shows when it has left its enabled state on its own account, without an error."""


def test_a_drive_that_lets_go_is_a_fault_at_once_and_takes_no_torque_until_it_is_armed_anew(bench):
    if bench.kind not in LET_GO:
        pytest.skip("a board tells by its field `fault`")
    bench.arm()
    bench.cycle(current_a=2.0, enabled=1, times=3)
    drive = bench.sim.drives[-1]
    for name, value in LET_GO[bench.kind].items():
        setattr(drive, name, value)
    bench.cycle(current_a=2.0, enabled=1, times=12)  # an ODrive tells by its heartbeat, every 10 cycles
    assert bench.faults & LinkFault.DEVICE
    if bench.kind == "odrive":
        drive.state = 8
    for _ in range(TORQUE_WANTED):
        bench.cycle(current_a=2.0, enabled=1)
        assert drive.current_a == 0.0, "walked back into it"
        assert bench.faults & LinkFault.DEVICE
    bench.cycle(times=20)
    assert bench.faults == 0
    bench.arm().cycle(current_a=2.0, enabled=1, times=3)
    assert drive.current_a == pytest.approx(2.0, rel=1e-2)
    assert bench.faults == 0


@pytest.mark.parametrize("row", can_rows.ROWS)
def test_replugging_leaks_no_descriptor_and_no_thread(row, tmp_path):
    bench = Bench(row, tmp_path)
    bench.backend.open()
    bench.backend.close()
    gc.collect()
    before = len(list(Path("/proc/self/fd").iterdir())), threading.active_count()
    for _ in range(REPLUGS):
        bench.backend.open()
        bench.backend.close()
    gc.collect()
    assert (len(list(Path("/proc/self/fd").iterdir())), threading.active_count()) == before
    bench.backend.release()


@pytest.mark.parametrize("row", [name for name in can_rows.ROWS if "board" not in name])
def test_another_device_in_its_place_is_refused(row, tmp_path):
    bench = Bench(row, tmp_path)
    bench.backend.open()
    bench.backend.close()
    drive = bench.sim.drives[0]
    if row.startswith("odrive"):
        drive.serial = b"others"
    elif row.startswith("moteus"):
        drive._serial = (9, 9, 9)
    else:
        drive.objects[0x1018, 4] = 4711
    with pytest.raises(BackendError, match="others than before"):
        bench.backend.open()
    bench.backend.release()


@pytest.mark.parametrize("row", can_rows.ROWS)
def test_a_silent_device_is_named_with_what_to_check(row, tmp_path):
    bench = Bench(row, tmp_path, **({"sdo_timeout_s": 0.05} if row.startswith("cia402") else {}))
    bench.sim.muted = True
    with pytest.raises(BackendError, match=r"check power|check that"):
        bench.backend.open()
    assert bench.backend.bus is not None
    bench.backend.release()
