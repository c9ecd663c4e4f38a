"""What the simulated sensors show of the truth: grids, noise, bias, drift, cross-talk."""

import math

import numpy as np
import pytest

from hw.generator import seed_words, uniform
from hw.interface import Rig
from hw.simulators.jit import compiled, records
from hw.simulators.mock_backend import MockBackend
from hw.simulators.mock_noise import normal
from hw.simulators.mock_options import MockOptions
from hw.simulators.mock_records import state_dtype
from hw.simulators.mock_sensors import quantised, tip_force
from rtctl.tick import new_ticks

COUNT_RAD = 2 * math.pi / 2000


def make(lever=((0.0, 0.1, 0.0),), **options):
    n = len(lever)
    rig = Rig(n, 1e-3, *(np.full(n, x) for x in (80.0, 0.72, 0.0134, 2000.0)), lever_m=np.array(lever))
    return MockBackend(MockOptions.model_validate(options).model_dump(mode="json"), rig)


def read(backend, n=1, periods=0):
    """`n` readings of the rig as it stands: slots do not advance, noise does. `periods` since the one before
    each."""
    tick, out = (
        records(new_ticks(1, len(backend.state["position_rad"][0]))),
        new_ticks(n, len(backend.state["position_rad"][0])),
    )
    for k in range(n):
        backend.state["sensed_tick"] -= periods
        backend.read(tick)
        out[k] = tick[0]
    return out


@compiled
def draw(state, uniforms, normals):
    for k in range(len(uniforms)):
        uniforms[k] = uniform(state[0].rng)
    for k in range(len(normals)):
        normals[k] = normal(state[0])


@pytest.fixture(scope="module")
def drawn():
    state = records(np.zeros(1, state_dtype(1)))
    state["rng"] = seed_words(12345)
    uniforms, normals = np.zeros(400_000), np.zeros(400_000)
    draw(state, uniforms, normals)
    return uniforms, normals


def test_uniform_numbers_fill_the_unit_interval_evenly(drawn):
    uniforms, _ = drawn
    counts, _ = np.histogram(uniforms, bins=100, range=(0, 1))
    assert counts.sum() == len(uniforms), "all within [0, 1)"
    chi_square = float(np.sum((counts - 4000.0) ** 2 / 4000.0))
    assert 50 < chi_square < 160, "99 degrees of freedom: .01 % tails"
    assert abs(np.corrcoef(uniforms[:-1], uniforms[1:])[0, 1]) < 5 / math.sqrt(len(uniforms))


def test_normal_numbers_have_the_moments_and_tails_of_the_normal_law(drawn):
    _, x = drawn
    assert x.mean() == pytest.approx(0, abs=0.008)
    assert x.std() == pytest.approx(1, abs=0.006)
    assert np.mean(x**3) == pytest.approx(0, abs=0.04)
    assert np.mean(x**4) == pytest.approx(3, abs=0.08)
    assert np.mean(np.abs(x) > 3) == pytest.approx(0.0027, rel=0.15)
    assert abs(np.corrcoef(x[:-1], x[1:])[0, 1]) < 0.008


def test_neighbouring_seeds_give_unrelated_words():
    assert len({int(word) for seed in range(100) for word in seed_words(seed)}) == 400


def test_a_quantised_value_lies_on_the_grid_and_half_or_one_quantum_off():
    for x in np.linspace(-3, 3, 601):
        assert quantised(x, 0.25, 0.5) == pytest.approx(x, abs=0.125 + 1e-12)
        assert -1e-12 <= x - quantised(x, 0.25, 0.0) < 0.25 + 1e-12
        assert quantised(x, 0.25, 0.5) % 0.25 == 0
    assert quantised(0.1234, 0.0, 0.5) == 0.1234


@pytest.mark.parametrize(("rounds", "expected"), [(False, -3), (True, -2)])
def test_the_encoder_truncates_downward_or_rounds_as_asked(rounds, expected):
    backend = make(axis=[{"encoder_rounds": rounds, "start_position_rad": -2.3 * COUNT_RAD}])
    assert read(backend)["position_rad"][0, 0] / COUNT_RAD == pytest.approx(expected, abs=1e-9)


def test_the_hall_sensor_has_the_noise_bias_and_grid_it_was_given():
    backend = make(axis=[{"current_noise_a": 0.02, "current_bias_a": 0.1, "current_resolution_a": 0.004}])
    current_a = read(backend, 4000)["current_a"][:, 0]
    assert current_a.mean() == pytest.approx(0.1, abs=0.0015)
    assert current_a.std() == pytest.approx(0.02, rel=0.05)
    assert np.allclose(np.round(current_a / 0.004), current_a / 0.004, atol=1e-6)


def test_the_force_sensor_has_the_noise_and_bias_it_was_given():
    force_n = read(make(force={"noise_n": 0.05, "bias_n": [0.3, -0.2, 0.5]}), 4000)["force_n"]
    assert force_n.mean(axis=0) == pytest.approx([0.3, -0.2, 0.5], abs=0.004)
    assert force_n.std(axis=0) == pytest.approx([0.05] * 3, rel=0.05)
    assert np.allclose(np.round(force_n / 0.005), force_n / 0.005, atol=1e-6)
    assert np.max(np.abs(np.corrcoef(force_n.T) - np.eye(3))) < 0.08


def test_force_drift_is_a_random_walk_of_the_given_pace():
    ends = []
    for seed in range(60):
        backend = make(seed=seed, force={"drift_n_sqrt_s": 0.5, "resolution_n": 0.0})
        read(backend, 200, periods=1)
        ends.append(backend.state["force_drift_n"][0])
    assert np.std(ends) == pytest.approx(0.5 * math.sqrt(0.2), rel=0.2)
    assert abs(np.mean(ends)) < 4 * 0.5 * math.sqrt(0.2 / 180)


def test_the_force_sensor_saturates_at_its_range():
    assert read(make(force={"range_n": 2.0, "bias_n": [30.0, -30.0, 1.0]}))["force_n"][0].tolist() == [
        2.0,
        -2.0,
        1.0,
    ]


@pytest.mark.parametrize(
    "lever",
    [
        ((0.0, 0.1, 0.0),),
        ((0.03, -0.1, 0.02),),
        ((0.0, 0.1, 0.0), (0.05, 0.0, 0.1)),
        ((0.1, 0.0, 0.0), (0.0, 0.1, 0.02), (0.0, 0.0, 0.1)),
    ],
)
def test_the_tip_force_gives_the_hand_torque_back_through_the_levers(lever):
    """Asked of the force alone: all that three axes read would be compiled for this one question."""
    backend = make(lever)
    hand_nm = np.array([0.3, -0.7, 0.11])[: len(lever)]
    backend.state["hand_torque_nm"][0] = hand_nm
    force_n = [tip_force(k, backend.state[0], backend.params[0]) for k in range(3)]
    assert np.array(lever) @ force_n == pytest.approx(hand_nm, rel=1e-12)


def test_resolution_costs_at_most_half_a_quantum_of_torque():
    backend = make()
    read(backend)
    for hand_nm in np.linspace(-0.5, 0.5, 333):
        backend.state["hand_torque_nm"] = hand_nm
        assert 0.1 * read(backend)["force_n"][0, 1] == pytest.approx(hand_nm, abs=2.5e-4 + 1e-12)


def test_cross_talk_mixes_the_true_force_into_other_axes():
    crosstalk = [[1.0, 0.02, 0.0], [0.0, 0.97, 0.0], [0.0, -0.05, 1.0]]
    backend = make(force={"crosstalk": crosstalk, "resolution_n": 0.0})
    read(backend)
    backend.state["hand_torque_nm"] = 0.4  # 4 N along y
    assert read(backend)["force_n"][0] == pytest.approx([0.08, 3.88, -0.2], rel=1e-12)


def test_the_temperature_is_the_one_given():
    assert read(make(temperature_c=31.5))["temperature_c"][0, 0] == 31.5


def test_without_a_velocity_sensor_the_tick_is_left_alone_and_no_noise_is_drawn():
    backend, with_one = (
        make(axis=[{"current_noise_a": 0.1}]),
        make(axis=[{"current_noise_a": 0.1}], velocity={}),
    )
    tick = records(new_ticks())
    tick["device_velocity_rad_s"] = math.nan
    backend.read(tick)
    assert np.isnan(tick["device_velocity_rad_s"]).all()
    assert "velocity" not in backend.provides
    assert "velocity" in with_one.provides
    assert read(backend, 5)["current_a"].tobytes() == read(with_one, 6)[1:]["current_a"].tobytes()


def test_the_velocity_sensor_scales_offsets_and_rounds():
    backend = make(
        ((0.0, 0.1, 0.0), (0.0, 0.0, 0.1)),
        velocity={"scale": -2.0, "bias_rad_s": 0.1, "resolution_rad_s": 0.25},
    )
    read(backend)
    backend.state["velocity_rad_s"] = 0.5, -1.0
    assert read(backend)["device_velocity_rad_s"][0].tolist() == [-1.0, 2.0]


def test_the_velocity_sensors_noise_is_as_given():
    shown = read(make(velocity={"noise_rad_s": 0.02}), 20_000)["device_velocity_rad_s"]
    assert shown.mean() == pytest.approx(0.0, abs=6e-4)
    assert shown.std() == pytest.approx(0.02, rel=0.03)


@pytest.mark.parametrize("periods", [1, 3])
def test_the_velocity_sensors_filter_is_of_first_order(periods):
    backend = make(velocity={"lag_s": 0.01})
    read(backend)
    backend.state["velocity_rad_s"] = 1.0
    shown = read(backend, 30, periods)["device_velocity_rad_s"][:, 0]
    assert shown == pytest.approx(1 - np.exp(-0.1 * periods * np.arange(1, 31)), rel=1e-9)


def test_a_second_reading_of_a_slot_moves_neither_filter_nor_drift_and_late_ones_both():
    backend = make(velocity={"lag_s": 0.01}, force={"drift_n_sqrt_s": 0.5})
    read(backend)
    backend.state["velocity_rad_s"] = 1.0
    first = read(backend, periods=1)
    before = backend.state["force_drift_n"].copy()
    again = read(backend, 5)
    assert set(again["device_velocity_rad_s"][:, 0]) == set(first["device_velocity_rad_s"][:, 0])
    assert (backend.state["force_drift_n"] == before).all()
    steps = []
    for _ in range(200):
        before = backend.state["force_drift_n"].copy()
        read(backend, periods=9)
        steps.append(backend.state["force_drift_n"] - before)
    assert np.std(steps) == pytest.approx(0.5 * math.sqrt(9e-3), rel=0.15)
