"""The band of a learned curve: it holds on sessions that nothing was learned from, is kept in the model file,
and no proof gets looser by it.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rtctl.errors import ModelError
from rtctl.friction import artefact
from rtctl.friction.band import Band
from rtctl.friction.document import checksum, render
from rtctl.friction.guarantee import guarantee
from rtctl.friction.learn import bands, certainty, fit, ladder
from rtctl.friction.learn.foretold import SESSIONS_MIN, Foretold
from rtctl.friction.learn.report_judge import faults, judge
from rtctl.friction.points import FrictionPoints
from rtctl.rig_file.config import load

SPEEDS = np.geomspace(0.02, 2.0, 16)


def sessions(factors: np.ndarray, noise_nm: float, seed: int) -> FrictionPoints:
    """Coulomb + viscous, times a factor of each session."""
    noise = np.random.default_rng(seed)
    rows, log = [], []
    for number, factor in enumerate(factors):
        for sign in (1, -1):
            for v in SPEEDS:
                f = factor * (0.3 + 0.05 * v) + noise.normal(0, noise_nm)
                rows.append((sign * v, f, sign, np.nan, np.nan))
                log.append(number)
    return FrictionPoints.from_rows(rows, "made", "0" * 64, {"log": np.array(log, dtype=float)})


def learned(points: FrictionPoints):
    found = ladder.ascend(
        points, ladder.Options(families=("coulomb_viscous",), folds="log", backend="sequential")
    )
    return ladder.learn(points, found, rig="mock")


def test_it_holds_on_sessions_that_were_not_learned_from():
    rng, shares = np.random.default_rng(3), []
    for seed in range(45):  # of 15 draws the share is known to 4 % only
        factors = 1 + 0.04 * rng.normal(size=9)
        model = learned(sessions(factors[:6], 0.002, seed))
        new = sessions(factors[6:], 0.002, 100 + seed)
        for branch, direction in zip(model.branches, (1, -1), strict=True):
            speed, friction_nm = new.branch(direction)
            inside = speed <= branch.speed_max_rad_s
            error = branch.magnitude(speed[inside]) - friction_nm[inside]
            shares.append(branch.band.holds(speed[inside], error).mean())
    assert 0.9 <= np.mean(shares) <= 0.99


@pytest.mark.parametrize("backward", [1.0, -1.0], ids=["by their friction", "by their zero"])
@pytest.mark.parametrize(("sessions_", "least"), [(2, 0.84), (3, 0.93), (4, 0.93), (8, 0.93)])
def test_few_sessions_that_differ_know_little_of_the_next(sessions_, least, backward):
    """What they differ by is in both directions the same, or, of a zero that moved, the other way round."""
    rng, shares = np.random.default_rng(7), []
    speed = np.tile(np.geomspace(0.02, 2.0, 20), 2)
    direction = np.repeat([1.0, -1.0], 20)
    for _ in range(300):
        level = rng.normal(0, 0.05, sessions_ + 1)[:, None] * np.where(direction > 0, 1, backward)
        points = level + rng.normal(0, 0.005, (sessions_ + 1, len(speed)))
        known = points[:sessions_]
        curve = np.stack([known[:, direction == one].mean(axis=1) for one in direction], axis=1)
        held_out = [known[k] - np.delete(curve, k, axis=0).mean(axis=0) for k in range(sessions_)]
        held = Foretold(
            np.tile(speed, sessions_), np.concatenate(held_out), np.repeat(np.arange(sessions_), len(speed))
        )
        band = bands.of_both(held, np.tile(direction, sessions_), None, "log")
        shares.append(band.holds(speed, points[-1] - curve.mean(axis=0)).mean())
    assert least <= np.mean(shares) <= 0.99


@pytest.mark.parametrize("wear", [0.0, 0.01, 0.02])
@pytest.mark.parametrize("known", [3, 4, 6, 8])
def test_it_holds_on_the_next_session_of_friction_that_wears(known, wear):
    """Days that differ by 3 %, and wear of 2 % a day, 1 %, or none: as `tests.bench.next_session`, drawn 200
    times.
    """
    rng, shares = np.random.default_rng(11), []
    speed = np.geomspace(0.02, 2.0, 20)
    for _ in range(200):
        level = rng.normal(0, 0.03, known + 1) - wear * np.arange(known + 1)
        points = level[:, None] + rng.normal(0, 0.004, (known + 1, len(speed)))
        every, late = np.arange(known), np.arange(known // 2, known)
        held_out = [points[k] - np.delete(points[:known], k, axis=0).mean() for k in every]
        ahead = [points[k] - points[:k].mean() for k in late]
        errors = [
            Foretold(np.tile(speed, len(at)), np.concatenate(off), np.repeat(at, len(speed)))
            for at, off in ((every, held_out), (late, ahead))
        ]
        band = bands.of_both(
            errors[0], np.ones(errors[0].block.shape), errors[1] if known >= SESSIONS_MIN else None, "log"
        )
        shares.append(band.holds(speed, points[known] - points[:known].mean()).mean())
    assert 0.9 <= np.mean(shares) <= 0.99


@pytest.mark.parametrize("freedom", [3, 5, np.inf])
def test_it_holds_on_the_next_of_days_with_heavy_tails_too(freedom):
    """Days of Student's numbers, and a session that warms, as in `tests.bench.next_session`: one table of
    twelve days has eight next sessions, and tells their share to an eighth.
    """
    rng, shares = np.random.default_rng(5), []
    speed, warming = np.geomspace(0.05, 2.0, 20), np.linspace(0.01, -0.01, 20)
    spread = 0.03 / np.sqrt(1.0 if freedom == np.inf else freedom / (freedom - 2))
    for _ in range(150):
        day = rng.normal(size=12) if freedom == np.inf else rng.standard_t(freedom, 12)
        points = spread * day[:, None] + warming + rng.normal(0, 0.004, (12, 20))
        for known in (4, 6, 9, 11):
            every, late = np.arange(known), np.arange(known // 2, known)
            held_out = [points[k] - np.delete(points[:known], k, axis=0).mean(axis=0) for k in every]
            ahead = [points[k] - points[:k].mean(axis=0) for k in late]
            errors = [
                Foretold(np.tile(speed, len(at)), np.concatenate(off), np.repeat(at, 20))
                for at, off in ((every, held_out), (late, ahead))
            ]
            band = bands.of_both(errors[0], np.ones(errors[0].block.shape), errors[1], "log")
            shares.append(band.holds(speed, points[known] - points[:known].mean(axis=0)).mean())
    assert 0.9 <= np.mean(shares) <= 0.99


def test_errors_of_one_point_each_share_nothing():
    assert certainty.another_session(np.full(8, 0.01), np.arange(8), np.ones(8), 0.95) == pytest.approx(
        0.0196, rel=0.01
    )
    assert certainty.another_session(np.full(8, 0.01), np.zeros(8), np.ones(8), 0.95) == 0.0


def test_each_region_of_speed_has_a_width_of_its_own():
    rng = np.random.default_rng(0)
    speed = np.tile(np.linspace(0.1, 3, 60), 4)
    error = rng.normal(size=len(speed)) * np.where(speed < 1, 0.03, 0.003)
    band = bands.of_errors(speed, error, np.arange(len(speed)), "speed")
    assert band.at(np.array([0.5]))[0] > 5 * band.at(np.array([2.9]))[0]
    assert 0.95 <= band.holds(speed, error).mean() <= 0.99


def test_few_errors_and_sessions_that_differ_widen_it():
    speed, error = np.linspace(0.1, 1, 8), np.full(8, 0.01)
    alone = bands.of_errors(speed, error, np.arange(8), "speed")
    assert alone.half_width_nm == pytest.approx([0.01 * (1 + 1 / 8)])
    assert bands.of_errors(speed[:0], error[:0], speed[:0], "speed") is None
    many = np.linspace(0.1, 1, 60)
    unlike = np.random.default_rng(1).normal(size=60) * np.repeat(
        [0.001, 0.001, 0.001, 0.001, 0.001, 0.02], 10
    )
    sessions_, each = np.repeat(np.arange(6), 10), np.arange(60)
    by_session = bands.of_errors(many, unlike, sessions_, "log")
    assert by_session.widest_nm > 1.3 * bands.of_errors(many, unlike, each, "log").widest_nm
    assert by_session.units == 6


def test_sessions_are_held_out_whatever_the_fit_holds_out():
    points = sessions(np.array([0.9, 1.0, 1.1]), 0.001, 1)
    model = fit.fit_points(points, rig="mock", c=100.0, epsilon_nm=0.002, folds="speed")
    band = model.branches[0].band
    assert (band.way, band.units) == ("log", 3)
    assert band.widest_nm > 0.03  # between sessions; held out by speed it errs a tenth of it
    assert model.branches[0].error_max_nm >= band.widest_nm


def wider(model, by_nm: float):
    band = Band((), (by_nm,), "log", 3, 90)
    return replace(model, branches=bands.with_band(model.branches, band))


def test_the_proofs_rest_on_it_and_none_gets_looser():
    loaded = load("configs/mock.toml")
    model = artefact.load("configs/friction/mock.json")
    without = replace(model, branches=bands.with_band(model.branches, None))
    before = guarantee(loaded.config.axis[0], without)
    assert guarantee(loaded.config.axis[0], wider(model, 1e-6)).floor_nm == before.floor_nm
    error = float(without.error_max_nm.max())
    after = guarantee(loaded.config.axis[0], wider(model, error + before.doubt_nm + 0.02))
    assert after.doubt_nm > before.doubt_nm
    assert after.floor_nm < before.floor_nm


def test_it_is_kept_in_the_model_file(tmp_path: Path):
    model = learned(sessions(np.array([0.97, 1.0, 1.03]), 0.002, 5))
    path = tmp_path / "model.json"
    artefact.save(model, path)
    assert artefact.load(path).branches[0].band == model.branches[0].band
    data = json.loads(path.read_text())
    data["branches"]["forward"]["band"]["half_width_nm"].append(0.1)
    data["sha256"] = checksum(data)
    path.write_text(render(data))
    with pytest.raises(ModelError, match=r"branches\.forward\.band: needs edges that rise"):
        artefact.load(path)


def test_a_session_outside_of_it_is_told():
    model = learned(sessions(np.linspace(0.99, 1.01, 6), 0.001, 7))
    same = judge(model, sessions(np.array([1.0]), 0.001, 8))
    assert max(one.outside_band_share for one in same) < 0.1
    other = judge(model, sessions(np.array([1.1]), 0.001, 9))
    assert min(one.outside_band_share for one in other) > 0.9
    assert any("outside the 95 % band" in said for said in faults(other))
