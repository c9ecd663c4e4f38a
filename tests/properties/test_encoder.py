"""Counters of finite width, followed over any walk of less than half their range a step."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hw.encoder import ENCODER_STATE, unwrap, wrap
from hw.interface import Rig
from hw.simulators.jit import records
from hw.simulators.mock_backend import MockBackend
from hw.simulators.mock_options import MockOptions
from rtctl.tick import new_ticks

WIDTHS = (8, 12, 14, 16, 24, 32)
STEPS = st.lists(st.floats(-1, 1, exclude_min=True, exclude_max=True), min_size=1, max_size=80)


def followed(counts, bits, signed):
    state = np.zeros(ENCODER_STATE, np.int64)
    raws = [wrap(c, bits) if signed else c % 2**bits for c in counts]
    return raws, [unwrap(raw, bits, state) for raw in raws]


@pytest.mark.parametrize("bits", WIDTHS)
@settings(max_examples=60, deadline=None)
@given(steps=STEPS, start=st.integers(-(2**40), 2**40), signed=st.booleans())
def test_the_count_follows_every_walk_of_less_than_half_a_range_a_step(bits, steps, start, signed):
    half = 2 ** (bits - 1)
    walk = [start]
    for step in steps:
        walk.append(walk[-1] + max(-half + 1, min(half - 1, round(step * half))))
    raws, seen = followed(walk, bits, signed)
    low = -half if signed else 0
    assert all(low <= raw < low + 2 * half for raw in raws)
    assert [count - raws[0] for count in seen] == [count - start for count in walk]


@pytest.mark.parametrize("bits", WIDTHS)
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("signed", [True, False])
def test_many_turns_one_way_make_no_step(bits, direction, signed):
    pace = 2 ** (bits - 1) - 1
    walk = [direction * pace * k for k in range(100)]
    raws, seen = followed(walk, bits, signed)
    assert seen == walk
    assert any(abs(b - a) > pace for a, b in itertools.pairwise(raws)), "it did wrap"


@pytest.mark.parametrize("bits", WIDTHS)
@given(count=st.integers(-(2**60), 2**60))
def test_a_wrapped_count_shows_the_same_bits_and_wraps_to_itself(bits, count):
    shown = wrap(count, bits)
    assert (shown - count) % 2**bits == 0
    assert wrap(shown, bits) == shown


@pytest.mark.parametrize("bits", WIDTHS)
def test_exactly_half_a_range_is_taken_downward(bits):
    half = 2 ** (bits - 1)
    assert followed([0, half], bits, True)[1] == [0, -half]
    assert followed([0, -half], bits, True)[1] == [0, -half]


def test_counts_are_64_bit_whatever_the_counter_is():
    pace = 2**31 - 1
    assert followed([pace * k for k in range(3000)], 32, True)[1][-1] == pace * 2999 > 2**42


def mock(start_rad, speed_rad_s, **axis):
    options = {
        "axis": [{"start_position_rad": start_rad, "inertia_kgm2": 1e-3, **axis}],
        "hand": [
            {
                "kind": "triangle",
                "start_s": 0.0,
                "amplitude_rad": 1.5,
                "speed_rad_s": speed_rad_s,
                "center_rad": start_rad,
                "stiffness_nm_rad": 500.0,
            }
        ],
    }
    rig = Rig(
        n_axes=2,
        period_s=1e-3,
        gear_ratio=np.full(2, 80.0),
        gear_efficiency=np.full(2, 0.72),
        torque_constant_nm_a=np.full(2, 0.0134),
        encoder_counts_per_rev=np.full(2, 160_000.0),
        lever_m=np.array([[0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]),
    )
    return MockBackend(MockOptions.model_validate(options).model_dump(mode="json"), rig)


def positions(backend, ticks=1500):
    tick, shown = records(new_ticks(1, 2)), np.zeros(ticks)
    for k in range(ticks):
        tick["tick"] = k
        backend.read(tick)
        shown[k] = tick["position_rad"][0, 0]
        backend.write(tick)
    return shown


@pytest.mark.compiled
@pytest.mark.parametrize("bits", [12, 14, 16, 32])
def test_a_mock_with_a_counter_of_finite_width_shows_the_same_angles(bits):
    speed = 6.0  # at most 152 counts a tick
    endless = positions(mock(0.01, speed))
    wrapped = positions(mock(0.01, speed, encoder_bits=bits))
    assert wrapped.tobytes() == endless.tobytes()
    reach = np.ptp(endless) / (2 * math.pi / 160_000)
    assert reach > 70_000, "further than 16 bits, there and back"


def test_the_turn_a_counter_started_in_is_unknown_but_a_whole_number_of_ranges():
    endless, wrapped = positions(mock(40.0, 6.0), 200), positions(mock(40.0, 6.0, encoder_bits=16), 200)
    ranges = (endless - wrapped) / (2**16 * 2 * math.pi / 160_000)
    assert np.allclose(ranges, round(ranges[0]), atol=1e-9)
    assert round(ranges[0]) != 0
