"""The conservative part: told apart from friction, found again after its index has moved, or not used."""

import gzip
import math
from pathlib import Path

import numpy as np
import pytest

from rtctl.control.jit import records
from rtctl.control.place_friction import conservative_torque
from rtctl.control.records import CONSERVATIVE_CELLS, MODEL
from rtctl.errors import DataError
from rtctl.friction.kind_harmonics import ORDER_MAX, Harmonics
from rtctl.friction.learn.cogging import CHANCE_MOST, Sweep, changed_since, find_shift, fit_cogging

PART = Harmonics(0.8, np.array([1.0, 3.0, 6.0]), np.array([0.02, 0.0, -0.01]), np.array([0.01, 0.03, 0.005]))
UNEVEN = 0.2
"""Places that are even over a period are nowhere further from it than this share of their distance."""
DATA = Path(__file__).parents[4] / "shared" / "data" / "odrive_cogging"


def two_way(part=PART, noise=0.002, shift=0.0, ways=(1, -1), n=250):
    rng = np.random.default_rng(4)
    x = np.concatenate([rng.uniform(0, 6.28, n) for _ in ways])
    d = np.repeat(ways, n).astype(float)
    friction = np.where(d > 0, 0.30, 0.26) * (1 + 0.2 * np.sin(x))
    return Sweep(x, d * friction - part(x - shift) + noise * rng.normal(size=len(x)), d)


def test_friction_and_conservative_part_are_told_apart():
    found = fit_cogging(two_way(), 0.8, friction_period_rad=2 * math.pi)
    x = np.linspace(0, 0.8, 200)
    assert np.abs(found.part(x) - PART(x)).max() < 0.0015
    assert found.friction_nm == (pytest.approx(0.30, abs=0.002), pytest.approx(0.26, abs=0.002))
    assert found.part(x[:-1]).mean() == pytest.approx(0, abs=1e-3)
    assert found.rmse_nm < 0.01


def test_three_waves_are_not_told_as_four():
    found = fit_cogging(two_way(n=1000), 0.8, friction_period_rad=2 * math.pi)
    assert found.part.orders.tolist() == [1, 3, 6]


def test_means_over_a_sixteenth_of_a_period_see_no_wave_that_is_shorter():
    """Their places scatter from lap to lap, so that they look like many; three periods and a wave more at a
    row fit such rows as well.
    """
    rng = np.random.default_rng(5)
    part = Harmonics(0.08, np.array([1.0, 2.0]), np.array([0.0, 0.006]), np.array([0.013, 0.003]))
    x = np.tile(np.arange(800) * 0.005, 2) + 0.00002 * rng.normal(size=1600)
    d = np.repeat((1.0, -1.0), 800)
    found = fit_cogging(Sweep(x, 0.25 * d - part(x) + 0.002 * rng.normal(size=1600), d), 0.08).part
    assert found.orders.max() <= 4
    there = np.linspace(0, 0.08, 200)
    assert np.abs(found(there) - part(there)).max() < 0.0015


def test_a_joint_without_cogging_gets_no_harmonic():
    none = Harmonics(0.8, np.zeros(0), np.zeros(0), np.zeros(0))
    assert len(fit_cogging(two_way(none), 0.8, friction_period_rad=2 * math.pi).part.orders) == 0
    assert none.most_nm == none.steepest_nm_rad == none.swing_j == 0


def test_a_shift_is_found_and_another_joints_part_does_not_fit():
    moved = find_shift(PART, two_way(shift=0.31), 2 * math.pi)
    assert moved.shift_rad == pytest.approx(0.31, abs=2e-3)
    assert moved.fits
    other = Harmonics(0.8, np.array([2.0, 5.0]), np.array([0.03, 0.01]), np.array([0.0, 0.02]))
    assert not find_shift(other, two_way(shift=0.31), 2 * math.pi).fits
    with pytest.raises(DataError, match="too few"):
        find_shift(PART, two_way(n=3))


def drawn(phases, sizes=1.0, shift=0.0, noise=0.002, stronger=1.0):
    """A sweep of waves 1, 2 and 3 of given phases whose friction is so many times as strong."""
    rng = np.random.default_rng(6)
    size = 0.03 * np.array([1.0, 0.8, 0.6]) * sizes
    part = Harmonics(0.8, np.arange(1.0, 4.0), size * np.cos(phases), size * np.sin(phases))
    x = np.tile(np.linspace(0, 6.28, 400), 2)
    d = np.repeat((1.0, -1.0), 400)
    tau = stronger * d * (0.3 + 0.05 * np.sin(x)) - part(x - shift) + noise * rng.normal(size=800)
    return part, Sweep(x, tau, d)


@pytest.mark.parametrize(("phases", "explained"), [((0.8, -1.4, -2.8), 0.70), ((-1.0, 2.9, -1.1), 0.94)])
def test_waves_of_the_same_orders_and_other_phases_are_another_joint(phases, explained):
    part, _ = drawn(np.array([0.4, -1.1, 2.0]))
    _, swept = drawn(np.array(phases))
    found = find_shift(part, swept, 2 * math.pi)
    assert found.explained == pytest.approx(explained, abs=0.01)  # half of it was enough
    assert found.chance > 0.03
    assert not found.fits


def test_the_same_joint_fits_with_friction_and_waves_that_have_drifted():
    phases = np.array([0.4, -1.1, 2.0])
    part, _ = drawn(phases)
    _, swept = drawn(phases, np.array([1.1, 0.9, 1.1]), shift=0.31, stronger=1.15)
    found = find_shift(part, swept, 2 * math.pi)
    assert found.shift_rad == pytest.approx(0.31, abs=2e-3)
    assert found.fits
    assert found.chance <= CHANCE_MOST
    # noise hides a wave's phase, not that it has moved; what noise leaves is no wave that is wrong
    _, noisy = drawn(phases, shift=0.31, noise=0.03)
    assert find_shift(part, noisy, 2 * math.pi).fits


def test_a_single_wave_fits_wherever_it_is_and_not_if_it_is_of_another_size():
    part = Harmonics(0.8, np.array([3.0]), np.array([0.03]), np.array([0.0]))
    found = find_shift(part, two_way(part, shift=0.11), 2 * math.pi)
    assert found.fits
    assert found.chance > 0.1  # any phase does
    larger = Harmonics(0.8, np.array([3.0]), np.array([0.04]), np.array([0.0]))
    assert not find_shift(larger, two_way(part), 2 * math.pi).fits


def test_bounds_hold_and_the_laws_table_is_the_sum_within_its_bound():
    x = np.linspace(-1, 3, 20001)
    assert np.abs(PART(x)).max() <= PART.most_nm <= 1.02 * np.abs(PART(x)).max()
    slopes = np.abs(np.gradient(PART(x), x)).max()
    assert slopes <= PART.steepest_nm_rad * (1 + 1e-6) <= 1.02 * slopes
    energy = np.cumsum(PART(x)) * (x[1] - x[0])
    assert np.ptp(energy) <= PART.swing_j
    made = np.zeros(1, MODEL)
    made["conservative_per_rad"], made["conservative"] = 1 / 0.8, PART.table()
    record = records(made)[0]
    in_law = np.array([conservative_torque(record, one) for one in x[::37]])
    assert np.abs(in_law - PART(x[::37])).max() < 1e-5
    assert len(PART.table()) == CONSERVATIVE_CELLS
    assert math.isnan(conservative_torque(record, math.inf))


def odrive(name):
    with gzip.open(DATA / name, "rt") as file:
        table = np.genfromtxt(file, delimiter=",", names=True)
    way = -1.0 if "reverse" in name else 1.0
    return Sweep(table["count"] * (2 * math.pi / 8192), table["iq_a"], np.full(len(table), way))


@pytest.mark.skipif(not DATA.is_dir(), reason="the measured maps are not there")
def test_measured_maps_of_a_motor_are_found_half_a_turn_off():
    count = 2 * math.pi / 8192
    learned = fit_cogging(odrive("map_a.csv.gz"), 2 * math.pi)
    assert learned.rmse_nm < 0.06  # A: the maps are currents
    trap, back = (find_shift(learned.part, odrive(f"map_{n}.csv.gz")) for n in ("c_half_turn_off", "reverse"))
    for found, within in ((trap, 1), (back, 4)):
        assert abs(abs(found.shift_rad / count) - 4096) < within
        assert found.fits
    assert (
        np.std(
            odrive("map_c_half_turn_off.csv.gz").torque_nm + learned.part(odrive("map_a.csv.gz").position_rad)
        )
        > 1
    )
    assert trap.rmse_nm < 0.15  # .12 A between index searches; .06 between maps without one
    anew = changed_since(learned.part, odrive("map_c_half_turn_off.csv.gz"), trap)
    # at held-out places, with the waves of the restart told anew
    assert anew.tried[len(anew.part.orders)] <= 0.06
    forward, backward = trap.level_nm[0], back.level_nm[0]
    assert forward > 0 > backward  # friction, told apart: it has the sign of the motion


def test_a_wave_that_a_restart_has_changed_is_told_beside_the_shift():
    swept = two_way()
    learned = fit_cogging(swept, 0.8, friction_period_rad=2 * math.pi).part
    same = Sweep(swept.position_rad + 0.11, swept.torque_nm, swept.direction)
    found = find_shift(learned, same, 2 * math.pi)
    assert len(changed_since(learned, same, found, 2 * math.pi).part.orders) == 0
    extra = 0.01 * np.cos(2 * math.pi * 3 * same.position_rad / 0.8)
    other = Sweep(same.position_rad, same.torque_nm - extra, same.direction)
    found = find_shift(learned, other, 2 * math.pi)
    more = changed_since(learned, other, found, 2 * math.pi)
    assert 3 in more.part.orders
    assert more.tried[len(more.part.orders)] < 0.7 * more.tried[0]  # the noise of the rows is half of it
    x = np.linspace(0, 0.8, 100)
    whole = learned.shifted(found.shift_rad)(x) + more.part(x)
    wanted = learned.shifted(0.11)(x) + 0.01 * np.cos(2 * math.pi * 3 * x / 0.8)
    assert np.sqrt(np.mean((whole - wanted) ** 2)) < 0.3 * 0.01


def scatter_nm(sweep, period_rad):
    """Scatter of a row of a sweep about any map, N m: the mean square of the waves above those that a part
    may have.

    What varies from one place to the next is no cogging. 0 where the places are too few, or not even over the
    period, so that nothing is told.
    """
    places, where, count = np.unique(
        np.round((sweep.position_rad / period_rad) % 1.0, 4), return_inverse=True, return_counts=True
    )
    cells = len(places)
    if cells // 2 <= ORDER_MAX + 1 or np.abs(np.diff(places) * cells - 1.0).max() > UNEVEN:
        return 0.0
    mean = np.bincount(where, sweep.torque_nm - float(np.mean(sweep.torque_nm))) / count
    power = np.abs(np.fft.rfft(mean) / cells) ** 2
    above = power[ORDER_MAX + 1 :]
    return math.sqrt(2.0 * float(np.mean(above)) * (cells // 2) * float(np.mean(count)))


def test_the_scatter_of_a_map_is_that_of_its_rows():
    x = np.arange(512) * 2 * math.pi / 512
    rng = np.random.default_rng(4)
    tau = 0.8 * np.cos(12 * x) + 0.3 * np.sin(98 * x) + 0.2 + rng.normal(0, 0.05, 512)
    assert scatter_nm(Sweep(x, tau, np.ones(512)), 2 * math.pi) == pytest.approx(0.05, rel=0.15)
    few = Sweep(x[::4], tau[::4], np.ones(128))
    assert scatter_nm(few, 2 * math.pi) == 0.0  # its waves cannot be told from noise


@pytest.mark.skipif(not DATA.is_dir(), reason="the measured maps are not there")
def test_what_a_shifted_map_leaves_is_waves_of_the_restart_or_scatter_of_the_rows():
    a, trap, back = (odrive(f"map_{n}.csv.gz") for n in ("a", "c_half_turn_off", "reverse"))
    learned = fit_cogging(a, 2 * math.pi).part
    more = changed_since(learned, trap, find_shift(learned, trap))
    assert 7 in more.part.orders  # the pole pairs: the drive's own
    assert more.tried[8] < 0.06 < 0.14 < more.tried[0]  # A
    # the map of the next day scatters from row to row by more than any model of places can leave
    assert scatter_nm(a, 2 * math.pi) < 0.05
    assert 0.35 < scatter_nm(back, 2 * math.pi) < 0.45
    assert fit_cogging(back, 2 * math.pi).rmse_nm > 0.4


@pytest.mark.parametrize("places", [16, 32, 64])
def test_few_even_places_are_held_out_in_turn_and_not_all_at_once(places):
    """They are in every twentieth, tenth and fifth of 320 stretches, all in one fold: nothing trained."""
    x = np.tile(np.arange(places) / places * 2 * math.pi, 6)
    d = np.repeat((1.0, -1.0), 3 * places)
    rng = np.random.default_rng(0)
    tau = 0.3 * d - 0.05 * np.cos(3 * x) + 0.002 * rng.normal(size=len(x))
    found = fit_cogging(Sweep(x, tau, d), 2 * math.pi)
    assert found.part.orders.tolist() == [3]
    assert found.tried[1] < 0.003  # N m; it was .27, .22 and .19
