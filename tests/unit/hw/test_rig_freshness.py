"""When a tick of several devices is fresh: counts, rates, skipped cycles, held samples, ages."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_fakes import DRIVE, MADE, drive_and_finger, known, member, read, rig

from hw.rig import compose
from rtctl.tick import new_ticks


@pytest.fixture(autouse=True)
def fakes():
    with known():
        yield


def test_the_count_advances_only_when_every_device_is_fresh():
    backend, drive, finger = drive_and_finger()
    counts = []
    for drive_fresh, finger_fresh in [(1, 1), (1, 1), (0, 1), (1, 0), (0, 0), (1, 1)]:
        drive.fresh, finger.fresh = drive_fresh, finger_fresh
        counts.append(int(read(backend)["sample_count"][0]))
    assert counts == [1, 2, 2, 2, 2, 3]


def test_a_sensor_at_half_the_rate_is_fresh_until_it_really_stops():
    backend, _, finger = drive_and_finger(max_age_ticks=2)
    counts = []
    for slot in range(12):
        finger.fresh = slot % 2 == 0 and slot <= 4
        counts.append(int(read(backend)["sample_count"][0]))
    assert counts == [1, 2, 3, 4, 5, 6, 7, 7, 7, 7, 7, 7], "fresh through tick 6, two ticks after the last"


def test_cycles_that_were_skipped_count_as_age():
    backend, _drive, finger = drive_and_finger(max_age_ticks=2)
    tick = new_ticks()
    shown = []
    for slot, fresh in [(0, True), (1, False), (2, False), (5, True), (8, False), (9, True)]:
        tick["tick"], finger.fresh = slot, fresh
        shown.append(int(read(backend, tick)["sample_count"][0]))
    assert shown == [1, 2, 3, 4, 4, 5]


def test_after_opening_again_nothing_from_before_is_fresh():
    backend, _drive, finger = drive_and_finger(max_age_ticks=2)
    tick = new_ticks()
    assert read(backend, tick)["sample_count"][0] == 1
    backend.close()
    backend.open()
    finger.fresh = False
    assert read(backend, tick)["sample_count"][0] == 1
    finger.fresh = True
    assert read(backend, tick)["sample_count"][0] == 2


def test_a_held_sample_is_shown_again_whatever_tick_it_is_asked_for():
    backend, _, finger = drive_and_finger(max_age_ticks=2)
    finger.values = {"force_n": [1, 2, 3]}
    read(backend)
    finger.fresh = False
    assert read(backend)["force_n"][0].tolist() == [1, 2, 3]


def test_nothing_is_fresh_before_every_device_has_shown_a_sample():
    backend, _, finger = drive_and_finger(max_age_ticks=2)
    finger.fresh = False
    assert read(backend)["sample_count"][0] == 0


def test_the_position_alone_makes_no_tick_fresh_when_no_device_has_anything_new():
    backend = compose(
        [member("a", ["position"], ["torque"], max_age_ticks=5), member("b", ["force"], max_age_ticks=5)],
        rig(),
    )
    read(backend)
    MADE["a"].fresh = MADE["b"].fresh = False
    assert read(backend)["sample_count"][0] == 1


def test_a_count_that_falls_back_is_no_fresh_sample():
    backend, drive, _ = drive_and_finger()
    tick = new_ticks()
    read(backend, tick)
    read(backend, tick)
    drive.count = 0
    assert read(backend, tick)["sample_count"][0] == 2


@settings(max_examples=100, deadline=None)
@given(
    arrivals=st.lists(st.tuples(st.booleans(), st.booleans(), st.booleans()), max_size=60),
    ages=st.tuples(st.integers(0, 4), st.integers(0, 6)),
)
def test_whatever_arrives_when_a_fresh_tick_holds_nothing_too_old(arrivals, ages):
    backend = compose(
        [
            member("drive", DRIVE, ["torque"]),
            member("finger", ["force"], max_age_ticks=ages[0]),
            member("warmth", ["temperature"], max_age_ticks=ages[1]),
        ],
        rig(),
    )
    allowed = {"drive": 0, "finger": ages[0], "warmth": ages[1]}
    last, count = dict.fromkeys(allowed, -(10**6)), 0
    tick = new_ticks()
    for cycle, fresh in enumerate(arrivals):
        for name, arrived in zip(allowed, fresh, strict=True):
            MADE[name].fresh = arrived
            MADE[name].values = {"force_n": [cycle, 0, 0]} if name == "finger" else {}
            if arrived:
                last[name] = cycle
        backend.read(tick)
        due = all(cycle - last[name] <= age for name, age in allowed.items())
        count += due
        assert tick["sample_count"][0] == count
        if due:
            assert tick["force_n"][0, 0] == last["finger"]
