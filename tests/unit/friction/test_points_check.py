"""Points in wrong units are refused against the rig file; copies are refused by themselves."""

from dataclasses import replace
from pathlib import Path

import pytest

from rtctl.errors import DataError
from rtctl.friction.logs.points_check import require_held_out, require_plausible_points
from rtctl.friction.points.reader import read_points
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"
POINTS = CONFIGS / "friction" / "mock_points.csv"


@pytest.fixture(scope="module")
def loaded():
    return load(CONFIGS / "mock.toml")


@pytest.fixture(scope="module")
def points():
    return read_points(POINTS)


def test_points_of_the_rig_are_plausible(points, loaded):
    require_plausible_points(points, loaded)


@pytest.mark.parametrize(
    ("column", "factor", "said"),
    [
        ("velocity_rad_s", 57.3, r"velocity_rad_s: 114\.6 rad/s is not plausible \(at most 7\.5 .*degrees"),
        ("friction_nm", 1e3, r"friction_torque_nm: 39\d\.?\d* N m is not plausible \(at most 2\.5 .*mN m"),
        ("friction_nm", 1e-3, r"no friction above 0\.00039\d N m.*motor's side"),
    ],
)
def test_a_wrong_unit_is_named_with_the_bound(points, loaded, column, factor, said):
    with pytest.raises(DataError, match=said):
        require_plausible_points(replace(points, **{column: factor * getattr(points, column)}), loaded)


def test_points_need_to_fit_one_axis_only(points, loaded):
    small = loaded.config.axis[0].model_copy(update={"torque_limit_nm": 0.01})
    config = loaded.config.model_copy(update={"axis": (small, loaded.config.axis[0])})
    require_plausible_points(points, loaded.model_copy(update={"config": config}))


def test_the_order_of_the_rows_does_not_matter(points, tmp_path):
    header, *rows = POINTS.read_text().splitlines()
    path = tmp_path / "p.csv"
    path.write_text("\n".join([header, *reversed(rows)]))
    for direction in (1, -1):
        for one, other in zip(read_points(path).branch(direction), points.branch(direction), strict=True):
            assert (one == other).all()


def test_a_file_that_holds_its_rows_twice_is_refused_and_a_chance_repeat_is_not(tmp_path):
    header, *rows = POINTS.read_text().splitlines()
    path = tmp_path / "p.csv"
    path.write_text("\n".join([header, *rows, *rows]))
    with pytest.raises(
        DataError, match=r"row 112 repeats row 2 to the last digit, and 109 more.*remove the copies"
    ):
        read_points(path)
    path.write_text("\n".join([header, *rows, rows[3]]))
    read_points(path)


def test_a_fit_is_not_judged_by_the_points_it_was_made_of(points):
    require_held_out(replace(points, sha256="another"), points)
    with pytest.raises(DataError, match="points not trained on"):
        require_held_out(points, points)
