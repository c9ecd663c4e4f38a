"""The CiA 402 backend with drives that refuse whatever CiA 301 and 402-2 let them refuse."""

import itertools
import time

import numpy as np
import pytest
from strict_cia402 import NO_REMOTE, OFF, StrictDrive

from hw import registry
from hw.can.cia402_setup import interpolation_time
from hw.can.options import Cia402Options
from hw.interface import BackendError, Rig
from rtctl.control.jit import records
from rtctl.tick import new_ticks

K_T, RATED_NM, RATED_A = 0.0134, 0.067, 5.0
PATIENCE_S = 30.0

_channels = (f"strict-{k}" for k in itertools.count())


def rig(period_s):
    one = np.full(1, 1.0)
    return Rig(1, period_s, 80 * one, 0.72 * one, K_T * one, 160_000 * one, np.eye(3)[:1])


class Bench:
    """A backend on the drive's bus, and a tick that is written again and again until something is so."""

    def __init__(self, period_s=1e-3, axis=None, **drive):
        channel = next(_channels)
        self.drive = StrictDrive(channel, **drive)
        table = {
            "bus": {"interface": "virtual", "channel": channel},
            "axis": [{"node": 1, **(axis or {})}],
            "sdo_timeout_s": 5.0,
        }
        valid = Cia402Options.model_validate(table, context={"rate_hz": 1 / period_s})
        self.backend = registry.create("cia402", valid.model_dump(mode="json"), rig(period_s))
        self.tick = records(new_ticks(1, 1))

    def until(self, done, current_a=0.0, enabled=0):
        end = time.monotonic() + PATIENCE_S
        while not done():
            assert time.monotonic() < end, (self.drive[0x6041, 0], self.tick)
            self.backend.read(self.tick)
            self.tick["enabled"], self.tick["current_command_a"] = enabled, current_a
            self.backend.write(self.tick)
            self.tick["tick"] += 1
            time.sleep(1e-3)
        return self


@pytest.fixture
def bench():
    made = []

    def make(**more):
        made.append(Bench(**more))
        return made[-1]

    yield make
    for one in made:
        one.backend.close()
        one.drive.close()


@pytest.mark.parametrize("bit_30", [NO_REMOTE, 0])
def test_a_strict_drive_is_set_up_without_one_refusal_and_driven(bench, bit_30):
    one = bench(bit_30=bit_30, axis={"velocity_units": 65536.0})
    one.backend.open()
    drive = one.drive
    assert drive.refusals == []
    assert drive[0x1800, 1] == bit_30 | 0x181
    assert drive[0x1801, 1] == bit_30 | 0x281
    assert drive[0x1400, 1] == 0x201
    assert (drive[0x60C2, 1], drive[0x60C2, 2]) == (1, -3)
    one.until(lambda: drive[0x6041, 0] == 0x27, enabled=1)
    one.until(lambda: one.tick["current_a"][0, 0] > 0.5, current_a=1.5, enabled=1)
    one.until(lambda: one.tick["current_a"][0, 0] == pytest.approx(1.5, rel=1e-2), current_a=1.5, enabled=1)
    one.until(lambda: drive[0x6041, 0] == 0x21, enabled=0)
    assert drive[0x6078, 0] == 0


@pytest.mark.parametrize("bit_30", [NO_REMOTE, 0])
def test_a_pdo_that_had_another_identifier_gets_its_own_while_it_is_off(bench, bit_30):
    one = bench(bit_30=bit_30)
    one.drive[0x1800, 1] = bit_30 | 0x1FF
    one.drive[0x1400, 1] = OFF | 0x2FF
    one.backend.open()
    assert (one.drive.refusals, one.drive[0x1800, 1]) == ([], bit_30 | 0x181)
    assert one.drive[0x1400, 1] == 0x201


@pytest.mark.parametrize("direction", [1, -1])
def test_a_drive_that_shows_its_torque_in_place_of_its_current_is_driven_all_the_same(bench, direction):
    one = bench(lacks=(0x6078, 0x6075), axis={"direction": direction})
    one.backend.open()
    drive = one.drive
    assert drive[0x1A00, 3] == 0x6077_0010
    one.until(lambda: drive[0x6041, 0] == 0x27, enabled=1)
    one.until(lambda: one.tick["current_a"][0, 0] == pytest.approx(1.5, rel=1e-2), current_a=1.5, enabled=1)
    assert drive[0x6077, 0] == direction * round(1000 * 1.5 * K_T / RATED_NM)


def test_a_drive_that_shows_neither_is_refused(bench):
    with pytest.raises(
        BackendError, match=r"1A00:03.*cannot be mapped.*with the current \(6078\) in its place"
    ):
        bench(lacks=(0x6077, 0x6078)).backend.open()


def test_a_drive_that_tells_its_maker_alone_is_known_by_that(bench):
    one = bench(lacks=((0x1018, 2), (0x1018, 4)))
    one.backend.open()
    assert one.backend._identities() == (b"\x2a" + bytes(11),)


def test_a_drive_in_another_mode_is_not_armed_but_refused(bench):
    with pytest.raises(BackendError, match=r"6060 = 10\), it shows mode 9 \(6061\).*supports mode 10"):
        bench(shown_mode=9).backend.open()


@pytest.mark.parametrize(
    ("period_s", "wanted"),
    [
        (1e-3, (1, -3)),
        (2e-3, (2, -3)),
        (5e-4, (5, -4)),
        (1.25e-3, (125, -5)),
        (1 / 300, (33, -4)),
        (4e-4, (4, -4)),
    ],
)
def test_the_drive_is_told_the_period_of_the_loop(bench, period_s, wanted):
    assert interpolation_time(period_s) == wanted
    one = bench(period_s=period_s)
    one.backend.open()
    assert (one.drive[0x60C2, 1], one.drive[0x60C2, 2]) == wanted


def test_a_drive_of_another_period_is_refused_and_one_that_has_no_such_object_is_not(bench):
    with pytest.raises(BackendError, match=r"wants a torque every 4 ms \(object 60C2\).*to 1 ms"):
        bench(fixed_period=True).backend.open()
    bench(lacks=(0x60C2,)).backend.open()


def test_a_drive_that_would_go_on_without_its_host_is_refused(bench):
    with pytest.raises(BackendError, match=r"object 6007 is 0.*set 6007 to 1"):
        bench(no_action=True).backend.open()
    bench(lacks=(0x6007,)).backend.open()


def test_a_drive_that_was_left_enabled_is_taken_down_first(bench):
    one = bench()
    one.drive[0x6041, 0], one.drive[0x6071, 0] = 0x27, 300
    one.backend.open()
    assert one.drive.refusals == []
    assert (one.drive[0x6041, 0], one.drive[0x6071, 0]) == (0x21, 0)


def test_an_answer_that_comes_late_is_not_taken_for_one_to_the_next_request(bench):
    """Refusals too: without a supervised host (6007) and without a period (60C2) the drive aborts, and is
    asked on.
    """
    one = bench(late_answers=True, lacks=(0x6007, 0x60C2))
    one.backend.open()
    assert one.drive.refusals == []
    assert (one.drive[0x1400, 1], one.drive[0x6060, 0]) == (0x201, 10)
