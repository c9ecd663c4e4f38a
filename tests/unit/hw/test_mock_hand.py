"""The scripted hand: where it wants the joint, when it holds, what it does to the joint."""

import math

import numpy as np
import pytest

from hw.interface import Rig
from hw.simulators import mock_hand
from hw.simulators.jit import compiled, records
from hw.simulators.mock_backend import MockBackend
from hw.simulators.mock_options import MockOptions
from rtctl.tick import new_ticks

RIG = Rig(
    1, 1e-3, *(np.full(1, x) for x in (80.0, 0.72, 0.0134, 160_000.0)), lever_m=np.array([[0.0, 0.1, 0.0]])
)


def make(**table):
    return MockBackend(MockOptions.model_validate({"hand": [table]}).model_dump(mode="json"), RIG)


@compiled
def _path(params, times_s):
    out = np.zeros((2, len(times_s)))
    for k in range(len(times_s)):
        out[0, k], out[1, k] = mock_hand.wanted(times_s[k], params[0], 0)
    return out


def path(times_s, **table):
    return _path(make(**table).params, np.array(times_s, dtype=float))


KINDS = [
    {"kind": "sine", "amplitude_rad": 0.3, "frequency_hz": 0.5},
    {"kind": "sines", "sines": [[0.2, 0.4], [-0.05, 1.7], [0.01, 9.0]]},
    {"kind": "triangle", "amplitude_rad": 0.15, "speed_rad_s": 0.1},
    {"kind": "push", "amplitude_rad": -0.2, "speed_rad_s": 0.3, "hold_s": 0.5, "rest_s": 0.25},
]


@pytest.mark.parametrize("table", KINDS)
def test_the_hand_rests_at_its_centre_until_it_starts_and_starts_there(table):
    x, v = path([0.0, 0.5, 0.999999, 1.0], center_rad=0.7, start_s=1.0, **table)
    assert x == pytest.approx([0.7] * 4, abs=1e-12)
    assert v[:3].tolist() == [0, 0, 0]


@pytest.mark.parametrize("table", KINDS)
def test_the_velocity_is_the_slope_of_the_position(table):
    times = np.linspace(1.0, 9.0, 80_001)
    x, v = path(times, start_s=1.0, **table)
    slope = np.diff(x) / np.diff(times)
    apart = np.abs(slope - 0.5 * (v[1:] + v[:-1]))
    assert np.median(apart) < 1e-5
    assert np.mean(apart > 1e-3) < 1e-3, "corners only"


def test_the_sine_is_the_sine():
    x, v = path([1.25], kind="sine", amplitude_rad=0.3, frequency_hz=0.5, start_s=1.0, center_rad=0.1)
    assert x[0] == pytest.approx(0.1 + 0.3 * math.sin(math.pi * 0.25), rel=1e-14)
    assert v[0] == pytest.approx(0.3 * math.pi * math.cos(math.pi * 0.25), rel=1e-14)


def test_the_triangle_turns_at_its_amplitude_with_one_speed():
    x, v = path(np.linspace(0, 60, 60_001), kind="triangle", amplitude_rad=0.15, speed_rad_s=0.1, start_s=0.0)
    assert x.max() == pytest.approx(0.15, abs=1e-4)
    assert x.min() == pytest.approx(-0.15, abs=1e-4)
    assert set(np.round(v, 12)) == {0.1, -0.1}
    assert v[0] == 0.1


def test_a_push_approaches_holds_and_lets_come_back():
    x, _ = path(
        [0.0, 0.5, 1.0, 1.9, 2.5, 3.1, 3.9, 4.5],
        kind="push",
        amplitude_rad=0.2,
        speed_rad_s=0.2,
        hold_s=1.0,
        rest_s=1.0,
        start_s=0.0,
    )
    assert x == pytest.approx([0.0, 0.1, 0.2, 0.2, 0.1, 0.0, 0.0, 0.1], abs=1e-12)


def test_the_grip_follows_its_intervals():
    p = make(kind="rest", grips_s=[[0.0, 2.0], [5.0, 6.0]]).params[0]
    assert [mock_hand.grips(t, p, 0) for t in (0.0, 1.99, 2.0, 4.9, 5.0, 5.99, 6.0)] == [
        True,
        True,
        False,
        False,
        True,
        True,
        False,
    ]
    assert mock_hand.grips(1e6, make(kind="rest").params[0], 0)
    assert not mock_hand.grips(0.0, make(kind="none").params[0], 0)


def step(backend, n, first=0):
    tick, force = records(new_ticks()), []
    for k in range(first, first + n):
        tick["tick"] = k
        backend.read(tick)
        force.append(tick["force_n"][0, 1])
        backend.write(tick)
    return np.array(force)


def test_a_hand_that_lets_go_feels_nothing_and_the_joint_coasts():
    backend = make(kind="sine", start_s=0.0, grips_s=[[0.0, 0.1]])
    force = step(backend, 101)
    assert abs(force[100]) > 0.1
    moving = backend.state["velocity_rad_s"][0, 0]
    assert abs(moving) > 0.1
    force = step(backend, 20, first=101)
    assert np.all(force[1:] == 0)
    assert 0 < abs(backend.state["velocity_rad_s"][0, 0]) < abs(moving)


def test_a_resting_hand_is_a_spring_and_damper_at_its_centre():
    backend = make(kind="rest", center_rad=0.05, stiffness_nm_rad=5.0)  # .25 N m: below break-away
    step(backend, 2000)
    expected = 5.0 * (0.05 - backend.state["position_rad"][0, 0])
    assert backend.state["hand_torque_nm"][0, 0] == pytest.approx(expected, abs=1e-3)
    assert backend.state["friction_torque_nm"][0, 0] == pytest.approx(expected, abs=1e-3)


def test_the_mass_of_the_hand_slows_the_joint():
    quick, slow = make(kind="sine", start_s=0.0), make(kind="sine", start_s=0.0, inertia_kgm2=0.1)
    for backend in (quick, slow):
        step(backend, 150)
    assert slow.state["velocity_rad_s"][0, 0] < 0.9 * quick.state["velocity_rad_s"][0, 0]
