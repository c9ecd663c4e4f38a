"""Models of a linear axis: the spline says the same of a motion in m/s as in rad/s, over place too, and the
file keeps its unit.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from rtctl.errors import ModelError
from rtctl.friction import artefact
from rtctl.friction.document import checksum, render
from rtctl.friction.kind_curve import Curve
from rtctl.friction.kind_spline import UNIT, compile_spline
from rtctl.friction.learn import grids
from rtctl.friction.learn.ladder import Options, ascend, learn
from rtctl.friction.learn.machines import train
from rtctl.friction.learn.places import fit_places
from rtctl.friction.points import FrictionPoints

LEAD_M = 0.005
LENGTH, FORCE = 0.1, 25.0
"""What a radian and a N m of the rotary points are on the carriage."""


def measured(motion, places=1, noise=0.002):
    """The same points in rad/s and N m, or in m/s and N; over a turn of 2 pi, or of the lead."""
    rng = np.random.default_rng(3)
    along, by = (LENGTH, FORCE) if motion == "linear" else (1.0, 1.0)
    turn = LEAD_M if motion == "linear" else 2 * math.pi
    rows, where = [], []
    for way in (1, -1):
        for v in np.geomspace(0.01, 2.0, 12):
            for k in range(places):
                share = (k + rng.uniform()) / places
                wave = 0.3 * math.sin(2 * math.pi * share) if places > 1 else 0.0
                dry = (0.25 + 0.1 * math.exp(-((v / 0.1) ** 2))) * (1 + wave)
                f = dry + 0.05 * v + noise * rng.normal()
                rows.append((way * v * along, f * by, way, noise * by, 5))
                where.append(share * turn)
    columns = {"position_rad": np.array(where), "travel_rad": np.zeros(len(where))}
    return replace(FrictionPoints.from_rows(rows, "points.csv", "0" * 64, columns), motion=motion)


def climbed(motion, **more):
    points = measured(motion, **more)
    ladder = ascend(
        points, Options(families=("epsilon-spline",), symmetric="no", backend="sequential", n_jobs=1)
    )
    return points, ladder, learn(points, ladder, rig="slide")


@pytest.fixture(scope="module")
def pair():
    return climbed("rotary"), climbed("linear")


def test_the_spline_says_the_same_in_either_unit(pair):
    (_, by_rad, rotary), (_, by_m, linear) = pair
    assert by_m.choice.chosen.rmse_nm == pytest.approx(FORCE * by_rad.choice.chosen.rmse_nm, rel=1e-3)
    v = np.linspace(0.0, 2.0, 200)
    for one, other in zip(rotary.branches, linear.branches, strict=True):
        assert other.parameters == {UNIT: pytest.approx(LENGTH)}
        assert one.parameters == {}
        assert other.magnitude(LENGTH * v) == pytest.approx(FORCE * one.magnitude(v), rel=2e-3)
        assert len(other.support_vectors) == len(one.support_vectors)


def test_a_unit_that_is_not_one_would_have_lost_the_peak():
    """In m/s the kernel itself is nearly a constant and a line: that is why it has a unit."""
    points, _, _ = climbed("linear")
    speed, friction = points.branch(1)
    own, bare = (
        max(grids.candidates("epsilon-spline", speed, friction, unit), key=lambda one: (one.c, -one.tube))
        for unit in (LENGTH, 1.0)
    )
    assert own.parameters == {UNIT: LENGTH}
    assert bare.parameters == {}
    peak = 0.1 * FORCE
    for one, least, most in ((own, 0.0, 0.1 * peak), (bare, 0.2 * peak, math.inf)):
        curve = train(one, speed, friction, np.ones(len(speed))).curve
        assert least <= np.abs(curve(speed) - friction).max() <= most


@pytest.mark.parametrize("unit", [1.0, 0.1, 3e-4])
def test_the_cubic_is_the_kernel_sum_in_any_unit(unit):
    rng = np.random.default_rng(5)
    v, beta = unit * np.sort(rng.uniform(0, 2, 9)), rng.normal(size=9)
    curve = Curve("spline", {UNIT: unit}, v, beta, 0.7)
    at = unit * np.linspace(0, 3, 400)
    cubic = compile_spline(v, beta, 0.7, unit)
    assert cubic(at) == pytest.approx(curve(at), rel=1e-9, abs=1e-9)
    assert set(cubic.knots) == {0.0, *v}
    # slope over v, not over v / unit
    step = 1e-6 * unit
    assert cubic.derivative(at, 1) == pytest.approx(
        (cubic(at + step) - cubic(at)) / step, rel=1e-3, abs=1e-2 / unit
    )


def test_the_model_file_keeps_the_unit_and_refuses_none(pair, tmp_path):
    _, (_, _, model) = pair
    path = tmp_path / "m.json"
    artefact.save(model, path)
    v = LENGTH * np.linspace(-2, 2, 99)
    assert np.array_equal(artefact.load(path).magnitude(v), model.magnitude(v))
    for spoilt in ({"unit_rad_s": 0.0}, {"unit_rad_s": -1.0}, {"unit_rad_s": 0.1, "degree": 2.0}):
        document = json.loads(path.read_text())
        document["branches"]["forward"]["parameters"] = spoilt
        document["sha256"] = checksum(document)
        other = tmp_path / "spoilt.json"
        other.write_text(render(document))
        with pytest.raises(ModelError, match="parameters"):
            artefact.load(other)


def test_friction_over_the_turn_of_a_screw_is_that_over_a_turn(tmp_path):
    found = {}
    for motion, turn in (("rotary", 2 * math.pi), ("linear", LEAD_M)):
        points, _, model = climbed(motion, places=10)
        found[motion] = fit_places(model, points, turn)
    rotary, linear = found["rotary"], found["linear"]
    assert linear.chosen.kernel.orders == rotary.chosen.kernel.orders >= 1
    assert linear.chosen.rmse_nm == pytest.approx(FORCE * rotary.chosen.rmse_nm, rel=0.2)
    assert linear.chosen.rmse_nm < 0.2 * linear.rungs[0].rmse_nm
    path = tmp_path / "place.json"
    artefact.save(linear.model, path)
    v, x = np.full(50, 0.02), np.linspace(-LEAD_M, LEAD_M, 50)
    loaded = artefact.load(path)
    assert loaded.place.unit_rad_s == linear.chosen.kernel.unit_rad_s == pytest.approx(LENGTH)
    assert np.array_equal(loaded.place_magnitude(v, x), linear.model.place_magnitude(v, x))
    document = json.loads(path.read_text())
    document["branches"]["backward"]["parameters"] = {"unit_rad_s": 0.2}
    document["sha256"] = checksum(document)
    path.write_text(render(document))
    with pytest.raises(ModelError):
        artefact.load(path)
