"""Joints that are hard to turn evenly: one speed that does not become steady ends nothing, and a ripple
averages out.
"""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identified import CONFIG, SMALL, Kept, run, variant

from rtctl.errors import DataError
from rtctl.identify import points as module
from rtctl.identify import session as module_of_session
from rtctl.identify import settings as settings_of
from rtctl.identify.collected import IN_VAIN
from rtctl.identify.dataset import Dataset
from rtctl.identify.dataset_files import read_document
from rtctl.identify.measurement_order import Known, remaining, tasks
from rtctl.identify.ripple import Ripple, measured
from rtctl.identify.settings import Settings
from rtctl.identify.tick_readings import is_even, is_steady
from rtctl.rig_file.config import load
from rtctl.simulation.friction_truth import true_friction_nm

pytestmark = pytest.mark.compiled  # some take minutes as plain Python

HARD = replace(
    SMALL, train_levels=6, test_levels=0, measurements=20, spots=20, speed_min_rad_s=0.0079, lower_levels=2
)
STRIBECK = (
    ("stribeck_rad_s = 0.06 ", "stribeck_rad_s = 0.01 "),
    ("second_share = 0.5 ", "second_share = 0.0 "),
)
STICTION = (("coulomb_nm = 0.25 ", "coulomb_nm = 0.35 "), ("breakaway_nm = 0.35 ", "breakaway_nm = 0.6 "))
RIPPLE = ("ripple_nm = 0.003 ", "ripple_nm = 0.03 ")
ELASTO_PLASTIC = (
    ('model = "lugre" ', 'model = "elasto_plastic" '),
    ("bristle_stiffness_nm_rad = 250.0", "bristle_stiffness_nm_rad = 2000.0"),
)


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    """The rig file with these changes, and what a hard identification kept of it: one for all tests that only
    look at it.
    """

    @cache
    def with_changes(*changes):
        path = variant(tmp_path_factory.mktemp("rig"), *changes)
        return path, run(path, HARD)

    return with_changes


def _moving_errors(path, points):
    loaded = load(path)
    moving = [point for point in points if point.target_rad_s]
    true_nm = true_friction_nm(loaded, 0, np.array([point.velocity_rad_s for point in moving]))
    return np.abs([point.friction_torque_nm for point in moving]) / true_nm - 1.0


def test_break_away_of_a_joint_with_much_damping_is_its_dry_friction(tmp_path):
    path = variant(
        tmp_path,
        ("viscous_nms_rad = 0.05              # b_v", "viscous_nms_rad = 1.0               # b_v"),
        ("second_share = 0.5 ", "second_share = 0.0 "),
        ("coulomb_nm = 0.25 ", "coulomb_nm = 0.35 "),
    )
    settings = replace(SMALL, measurements=12)
    moving = [task.name for task in tasks(settings) if task.speed_rad_s]
    found = [one.friction_torque_nm for one in run(path, settings, Kept(moving)).points]
    assert found == pytest.approx([0.35, -0.371], rel=0.02), ".03 more where its slide is seen"


@pytest.mark.parametrize(
    "changes",
    [
        STRIBECK,
        pytest.param(STICTION, marks=pytest.mark.volume),
        (RIPPLE,),
        pytest.param(ELASTO_PLASTIC, marks=pytest.mark.volume),
        pytest.param((*STRIBECK, *STICTION), marks=pytest.mark.volume),
    ],
    ids=[
        "Stribeck peak at .01 rad/s",
        "F_s / F_c 1.7",
        "ripple",
        "stiff bristles",
        "steep peak, strong stiction",
    ],
)
def test_a_joint_that_is_hard_to_turn_evenly_is_identified_within_two_percent(identified, changes):
    path, kept = identified(*changes)
    assert all(task.speed_rad_s < 0.3 * HARD.speed_min_rad_s for task, _ in kept.skipped), (
        "one that followed a peak"
    )
    assert np.abs(_moving_errors(path, kept.points)).max() < 0.02
    assert np.sqrt(np.mean(_moving_errors(path, kept.points) ** 2)) < 0.01


def test_a_peak_below_the_lowest_speed_is_followed(identified):
    _, kept = identified(*STRIBECK)
    lowest = min(abs(point.target_rad_s) for point in kept.points if point.target_rad_s)
    assert lowest == pytest.approx(0.0079 / 4)
    shallow = run(settings=replace(HARD, train_levels=4))
    assert min(abs(point.target_rad_s) for point in shallow.points if point.target_rad_s) == 0.0079


def _never_at(speed_rad_s):
    """A motion that is never steady at one speed."""
    real = module.is_steady

    def judge(position, torque, period_s, speed, count, **how):
        near = abs(abs(speed) - speed_rad_s) < 1e-9
        return False if near else real(position, torque, period_s, speed, count, **how)

    return judge


def test_a_speed_that_never_becomes_steady_is_left_out_and_the_rest_goes_on(tmp_path, monkeypatch):
    middle = sorted({task.speed_rad_s for task in tasks(SMALL)})[3]
    monkeypatch.setattr(module, "is_steady", _never_at(middle))
    store = Dataset.create(tmp_path / "set", load(CONFIG), SMALL, simulated=True)
    notices = run(store=store).notices
    document = read_document(tmp_path / "set")
    assert document["complete"]
    assert [f"{middle:.5f}" in one["name"] for one in document["skipped"]] == [True, True]
    assert all("never becomes steady" in one["why"] for one in document["skipped"])
    assert [f"{len(settings_of.SERVOS) * IN_VAIN} tries" in one["why"] for one in document["skipped"]] == [
        True,
        True,
    ]
    assert len(document["points"]) == len(tasks(SMALL)) - 2
    assert sum(text.startswith("left out: ") for text in notices) == 2
    monkeypatch.undo()
    run(store=Dataset.resume(tmp_path / "set", load(CONFIG), SMALL, simulated=True))
    again = read_document(tmp_path / "set")
    assert (again["complete"], again["skipped"], len(again["points"])) == (True, [], len(tasks(SMALL)))


def test_a_joint_on_which_no_speed_becomes_steady_is_an_error_that_says_so(monkeypatch):
    monkeypatch.setattr(module, "is_steady", lambda *_, **__: False)
    with pytest.raises(DataError, match="none of 10 points became steady"):
        run(settings=SMALL, store=(kept := Kept()))
    assert {point.target_rad_s for point in kept.points} == {0.0}
    assert len(kept.skipped) == 8
    assert max(task.speed_rad_s for task, _ in kept.skipped) == SMALL.speed_max_rad_s


def test_where_only_quick_speeds_become_steady_no_order_of_the_speeds_ends_it(monkeypatch):
    real = module.is_steady
    monkeypatch.setattr(
        module,
        "is_steady",
        lambda x, y, T, speed, *a, **b: abs(speed) > 1.0 and real(x, y, T, speed, *a, **b),
    )
    monkeypatch.setattr(settings_of, "SERVOS", settings_of.SERVOS[:1])
    settings = replace(SMALL, train_levels=8, test_levels=0)
    at = [abs(task.speed_rad_s) for task in tasks(settings)]
    assert max(at[: module_of_session.HOPELESS]) < 1.0, "the order asks the slow ones first"
    kept = run(settings=settings)
    assert {round(abs(point.target_rad_s), 6) for point in kept.points} >= {0.0, 2.0}


def test_the_servo_is_as_soft_as_before_after_a_speed_that_needed_a_stiffer_one(tmp_path, monkeypatch):
    seen = set()
    real = module.measure

    def measure(rows, *rest):
        found = real(rows, *rest)
        seen.add(stiffening[-1])
        return found

    stiffening = [1.0]
    real_settle = module.settle

    def settle(motion, velocity):
        stiffening.append(motion.rig.stiffer)
        return (yield from real_settle(motion, velocity))

    monkeypatch.setattr(module, "measure", measure)
    monkeypatch.setattr(module, "settle", settle)
    run(variant(tmp_path, *STRIBECK), replace(HARD, lower_levels=0))
    assert seen == {1.0, settings_of.SERVOS[1][0]}
    assert stiffening[-1] == 1.0 or 1.0 in stiffening[stiffening.index(settings_of.SERVOS[1][0]) :]


def test_lower_speeds_are_asked_for_only_while_friction_rises_towards_them():
    settings = Settings(train_levels=2, test_levels=0, speed_min_rad_s=0.01, speed_max_rad_s=1.0)

    def left(frictions, over):
        known = [Known(sign, speed, friction) for speed, friction in frictions.items() for sign in (1, -1)]
        return [(task.direction, task.speed_rad_s) for task in remaining(settings, over, known)]

    steep, flat = {0.01: 0.35, 0.02: 0.30, 1.0: 0.25}, {0.01: 0.30, 0.02: 0.298, 1.0: 0.25}
    planned = {task.name for task in tasks(settings)}
    assert left(flat, lambda task: task.name in planned) == []
    assert left(steep, lambda task: task.name in planned) == [(1, 0.005), (-1, 0.005)]
    assert left({0.005: 0.351, **steep}, lambda task: task.speed_rad_s in (0.0, 0.005, 0.01, 1.0)) == []
    assert left(steep, lambda _task: True) == [], "a lower speed that was given up is not asked for again"
    assert left({0.01: math.nan, 0.02: 0.3}, lambda task: task.name in planned) == []


def test_a_ripple_is_found_with_its_slope_and_a_small_one_counts_as_none():
    position = np.linspace(0.0, 0.4, 2000)
    noise = 0.004 * np.random.default_rng(1).standard_normal(2000)
    wave = np.sin(80 * position) + 0.5 * np.cos(160 * position)
    found = measured(position, 0.3 + 0.03 * wave + noise, 2 * math.pi / 80)
    assert found.amplitude_nm == pytest.approx(0.03 + 2 * 0.015, rel=0.1)
    assert found.change_nm(1e-4) >= 0.03 * np.ptp(np.sin(80 * np.array([0.0, 1e-4])))
    assert measured(position, 0.3 + 0.0015 * wave + noise, 2 * math.pi / 80).amplitude_nm == 0.0
    assert measured(position, np.full(2000, math.nan), 2 * math.pi / 80).amplitude_nm == 0.0


def test_windows_of_one_place_are_whole_periods_of_the_ripple_where_they_are_long_enough():
    ripple = Ripple(0.08, 0.02)
    for speed in (0.15, 0.5, 2.0):
        window = ripple.whole_window_s(0.1, 5, speed)
        periods = 5 * window * speed / 0.08
        assert periods == pytest.approx(round(periods))
        assert 0.05 < window < 0.2
    assert ripple.whole_window_s(0.1, 5, 0.01) == 0.1
    assert Ripple().whole_window_s(0.1, 5, 0.5) == 0.1


def test_a_ripple_is_no_drift_over_whole_periods_and_a_drift_is_one_all_the_same():
    time = np.arange(1600) * 1e-3
    position, wave = 0.1 * time, 0.03 * np.sin(2 * math.pi * time / 0.8)
    count = 2 * math.pi / 160_000
    assert not is_steady(position[:900], 0.3 + wave[:900], 1e-3, 0.1, count)
    assert is_steady(position, 0.3 + wave, 1e-3, 0.1, count, pairs=True)
    assert not is_steady(position, 0.3 + wave + 0.02 * time, 1e-3, 0.1, count, pairs=True)


def test_stick_slip_is_not_steady_whatever_the_mean():
    time = np.arange(800) * 1e-3
    slipping = 0.01 * (np.floor(time / 0.2) * 0.2 + np.clip(4 * (time % 0.2) - 0.6, 0, 0.2))
    assert is_even(0.01 * time, 1e-3, 0.01, 4e-5)
    assert not is_even(slipping, 1e-3, 0.01, 4e-5)
    once = 0.01 * np.interp(time, [0.0, 0.4, 0.5, 0.6, 0.8], [0.0, 0.4, 0.4, 0.6, 0.8])
    assert not is_even(once, 1e-3, 0.01, 4e-5), "one stick is enough"
    assert not is_even(0.012 * time, 1e-3, 0.01, 4e-5)
    assert not is_even(np.full(800, math.nan), 1e-3, 0.01, 4e-5)
