"""What a points file says beside the points reaches the model, and a model without it says so."""

import dataclasses

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction import artefact
from rtctl.friction.learn import fit
from rtctl.friction.learn.point_evidence import with_evidence
from rtctl.friction.point_reader import read_points

COLUMNS = ("weakest_place_nm", "presliding_rad", "presliding_spread_rad", "presliding_ramps")
SPEEDS = [0.0, *np.geomspace(0.01, 2, 29)]


def _file(tmp_path, columns=COLUMNS, *, length="0.0014", weaker=0.02):
    """Points of a smooth curve; backwards it is weaker at one place, by `weaker` at .01 rad/s."""
    lines = [",".join(("velocity_rad_s", "friction_torque_nm", "direction", *columns))]
    for sign in (1, -1):
        for speed in SPEEDS:
            friction = 0.25 + 0.1 * np.exp(-((speed / 0.1) ** 2)) + 0.05 * speed
            missing = weaker if sign < 0 and speed == 0.01 else 0.005
            cells = {"weakest_place_nm": f"{sign * (friction - missing):.6f}"}
            if speed == 0:
                cells |= dict(
                    zip(COLUMNS[1:], (length if sign > 0 else "0.0014", "0.0001", "20"), strict=True)
                )
            row = [f"{sign * speed:.6g}", f"{sign * friction:.6f}", str(sign)]
            lines.append(",".join([*row, *(cells.get(name, "") for name in columns)]))
    path = tmp_path / "points.csv"
    path.write_text("\n".join(lines) + "\n")
    return read_points(path)


def _learned(points, *by_hand):
    return with_evidence(fit.fit_points(points, rig="mock", c=1e3, epsilon_nm=0.001), points, *by_hand)


def test_length_and_places_reach_the_model_and_come_back_from_its_file(tmp_path):
    artefact.save(_learned(_file(tmp_path)), tmp_path / "m.json")
    model = artefact.load(tmp_path / "m.json")
    assert (model.presliding_rad, model.presliding_ramps) == (pytest.approx(1.4e-3), 40)
    assert model.presliding_spread_rad == pytest.approx(1e-4, rel=0.05)
    assert model.place_spread_nm == pytest.approx([0.005, 0.02], abs=0.002)


def test_what_is_off_where_the_joint_may_stick_is_no_doubt_of_its_sliding(tmp_path):
    """It is weaker by .02 at .01 rad/s; .03 rad/s and more surely slide."""
    model = _learned(_file(tmp_path))
    assert max(model.place_spread_nm) == pytest.approx(0.02, abs=0.002)
    assert model.sliding_doubt_nm == pytest.approx(0.005, abs=0.002)
    artefact.save(model, tmp_path / "m.json")
    assert artefact.load(tmp_path / "m.json").sliding_doubt_nm == model.sliding_doubt_nm
    points = _file(tmp_path)
    stronger = points.friction_nm + 0.05 * (np.abs(points.velocity_rad_s) > 1.0)
    found = with_evidence(model, dataclasses.replace(points, friction_nm=stronger))
    assert found.sliding_doubt_nm == pytest.approx(0.05, abs=0.002), "off either way"


def test_without_the_weakest_places_sliding_is_as_doubtful_as_all_of_it(tmp_path):
    assert _learned(_file(tmp_path, columns=())).sliding_doubt_nm is None


def test_a_length_by_hand_goes_first_and_has_no_spread(tmp_path):
    model = _learned(_file(tmp_path), 0.002)
    assert (model.presliding_rad, model.presliding_spread_rad, model.presliding_ramps) == (0.002, None, 0)
    artefact.save(model, tmp_path / "m.json")
    assert artefact.load(tmp_path / "m.json").presliding_rad == 0.002


def test_points_that_do_not_say_leave_it_unknown(tmp_path):
    model = _learned(_file(tmp_path, columns=()))
    assert (model.presliding_rad, model.presliding_spread_rad, model.presliding_ramps) == (None, None, 0)
    assert model.place_spread_nm is None


def test_friction_that_is_nowhere_below_the_curve_has_no_spread_below_zero(tmp_path):
    model = _learned(_file(tmp_path, weaker=-0.5))
    assert min(model.place_spread_nm) >= 0


@pytest.mark.parametrize("length", ["-0.001", "0", "1.5", "inf"])
def test_a_length_out_of_bounds_is_refused_with_its_column(tmp_path, length):
    with pytest.raises(DataError, match="column presliding_rad"):
        _learned(_file(tmp_path, length=length))


def test_a_point_that_is_left_out_has_no_weakest_place(tmp_path):
    points = _file(tmp_path)
    weakest = points.columns["weakest_place_nm"].copy()
    mistyped = int(np.flatnonzero((points.direction > 0) & (points.velocity_rad_s > 1.0))[0])
    weakest[mistyped] = 0.01
    left_out = np.arange(len(weakest)) == mistyped
    columns = {**points.columns, "weakest_place_nm": weakest}
    model = _learned(dataclasses.replace(points, columns=columns, left_out=left_out))
    assert model.place_spread_nm == pytest.approx([0.005, 0.02], abs=0.002)
