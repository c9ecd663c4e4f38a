"""`rtctl fit --judge`: the verdict follows from the points."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from rtctl.cli.fit import command
from rtctl.friction.points import POINTS_MAX


def _points(path: Path, *, factor: float = 1.0, fastest: float = 5.0) -> Path:
    rows = ["velocity_rad_s,friction_torque_nm"]
    for v in np.linspace(0.1, fastest, 24):
        friction = factor * (0.2 + 0.02 * v + 0.1 * np.exp(-v))
        rows += [f"{v},{friction}", f"{-v},{-friction}"]
    path.write_text("\n".join(rows) + "\n")
    return path


def _run(*words: object) -> Result:
    return CliRunner().invoke(command, [str(word) for word in words])


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("judge")
    done = _run(_points(folder / "p.csv"), "--out", folder / "m.json", "--C", "100")
    assert done.exit_code == 0, done.output
    return folder / "m.json"


def test_its_own_points_are_held(model: Path) -> None:
    done = _run(model.parent / "p.csv", "--judge", model)
    assert done.exit_code == 0, done.output
    assert "the model holds" in done.output


def test_more_points_than_are_learned_from_are_judged(model: Path, tmp_path: Path) -> None:
    """They were refused, and `--test` took them."""
    speeds = np.linspace(0.1, 5.0, 2 * POINTS_MAX + 2)
    speeds[1::2] *= -1
    friction = np.sign(speeds) * (0.2 + 0.1 * np.exp(-np.abs(speeds))) + 0.02 * speeds
    path, header = tmp_path / "many.csv", "velocity_rad_s,friction_torque_nm"
    np.savetxt(path, np.column_stack([speeds, friction]), delimiter=",", header=header, comments="")
    assert "at most 2000; average them" in str(_run(path, "--out", tmp_path / "m.json").exception)
    done = _run(path, "--judge", model, "--json")
    assert json.loads(done.output)["directions"][0]["points"] == POINTS_MAX + 1


def test_weaker_friction_breaks_the_bound_with_its_sign(model: Path, tmp_path: Path) -> None:
    done = _run(_points(tmp_path / "w.csv", factor=0.7), "--judge", model, "--json")
    body = json.loads(done.output)
    assert done.exit_code == 1
    assert not body["holds"]
    assert all(row["bias_nm"] > 0 and row["over_bound"] for row in body["directions"])
    assert any("Coulomb + viscous" in fault for fault in body["faults"])


def _read(path: Path, speed: float = 1.0, friction: float = 1.0, zero: float = 0.0, dry: float = 0.0) -> Path:
    """Points of the same joint, read with another factor of speed or friction, another zero of the torque, or
    of more dry friction.
    """
    v, f = np.loadtxt(_points(path, fastest=4.0), delimiter=",", skiprows=1).T
    table = np.column_stack([speed * v, friction * f + zero])
    np.savetxt(path, table, delimiter=",", header="velocity_rad_s,friction_torque_nm", comments="")
    return path


@pytest.mark.parametrize(
    ("reading", "said"),
    [
        ({"friction": 1e3}, "1e+03 times the model's at all speeds: is it in mN m?"),
        ({"friction": 1.3}, "times the model's at all speeds: a unit"),
        ({"speed": 30 / np.pi}, "as if it were in rpm"),
        ({"speed": 180 / np.pi}, "as if it were in deg/s"),
        ({"speed": 0.5 / np.pi}, "as if it were in rev/s"),
        ({"speed": 1e3}, "as if it were in mrad/s: read so"),
        ({"zero": 0.05}, "0.05 N m off at all speeds and in both directions"),
    ],
)
def test_the_one_reading_under_which_the_model_fits_is_named(
    model: Path, tmp_path: Path, reading: dict[str, float], said: str
) -> None:
    done = _run(_read(tmp_path / "r.csv", **reading), "--judge", model, "--json")
    assert done.exit_code == 1
    assert said in json.loads(done.stdout)["faults"][-1]


def test_points_warmer_than_any_before_are_told_so(tmp_path: Path) -> None:
    def warm(name: str, factor: float, degrees: float) -> Path:
        lines = _points(tmp_path / name, factor=factor).read_text().split()
        rows = [
            lines[0] + ",temperature_c",
            *(f"{line},{degrees + k % 3}" for k, line in enumerate(lines[1:])),
        ]
        (tmp_path / name).write_text("\n".join(rows))
        return tmp_path / name

    done = _run(warm("p.csv", 1.0, 20), "--out", tmp_path / "m.json", "--C", "100")
    assert done.exit_code == 0, done.output
    done = _run(warm("w.csv", 0.8, 50), "--judge", tmp_path / "m.json", "--json")
    assert done.exit_code == 1
    said = json.loads(done.stdout)["faults"][-1]
    assert "of 51 degC, 29 K warmer than any the model was learned from (20 to 22 degC)" in said
    for points in (warm("near.csv", 0.8, 24), warm("held.csv", 1.0, 50)):
        done = _run(points, "--judge", tmp_path / "m.json", "--json")
        assert not any("K warmer" in one for one in json.loads(done.stdout)["faults"])


def test_a_point_a_little_beyond_the_largest_error_before_is_no_fault_and_one_far_off_is(
    model: Path, tmp_path: Path
) -> None:
    points = np.loadtxt(_points(tmp_path / "n.csv"), delimiter=",", skiprows=1)
    bound = json.loads(_run(tmp_path / "n.csv", "--judge", model, "--json").output)["directions"][0][
        "bound_nm"
    ]
    for times, code in ((1.3, 0), (20.0, 1)):
        off = points.copy()
        off[20, 1] += times * bound
        np.savetxt(
            tmp_path / "o.csv", off, delimiter=",", header="velocity_rad_s,friction_torque_nm", comments=""
        )
        done = _run(tmp_path / "o.csv", "--judge", model)
        assert done.exit_code == code, done.output
        assert ("1 points break the stated bound" in done.output) == bool(code)


def test_a_session_that_is_a_little_quicker_holds_and_one_of_other_speeds_does_not(
    model: Path, tmp_path: Path
) -> None:
    done = _run(_points(tmp_path / "q.csv", fastest=6.0), "--judge", model)
    assert done.exit_code == 0, done.output
    assert "the model holds on these points, as far as it was trained:" in done.output
    assert "points are faster than the trained range: not judged" in done.output
    done = _run(_points(tmp_path / "o.csv", fastest=40.0), "--judge", model)
    assert done.exit_code == 1
    assert "most points, " in done.output


def test_speeds_beyond_the_range_are_counted_and_left_out(model: Path, tmp_path: Path) -> None:
    done = _run(_points(tmp_path / "f.csv", fastest=8.0), "--judge", model, "--json")
    assert all(
        0 < row["outside"] < 24 and not row["over_bound"] for row in json.loads(done.output)["directions"]
    )


def _line(path: Path, coulomb: float, viscous: float = 8e-4) -> Path:
    v = np.linspace(0.1, 4.0, 24)
    rows = [(way * u, way * (coulomb + viscous * u)) for u in v for way in (1, -1)]
    np.savetxt(path, rows, delimiter=",", header="velocity_rad_s,friction_torque_nm", comments="")
    return path


def test_a_fit_says_what_its_own_points_say_against_it(tmp_path: Path) -> None:
    """A tube of the friction's size holds a constant, which a straight line beats on every point that it was
    learned from.
    """
    points = _line(tmp_path / "p.csv", 0.004)
    done = _run(points, "--out", tmp_path / "m.json", "--epsilon", "0.005")
    assert "warning: the model does not hold on the points it was learned from: direction +1" in done.output
    assert "(--ladder), or give a smaller --epsilon" in done.output
    done = _run(points, "--out", tmp_path / "m.json", "--json")
    assert json.loads(done.output)["faults"] == []
    _run(points, "--out", tmp_path / "m.json", "--epsilon", "1e-5")
    for other, cause in (
        (_line(tmp_path / "d.csv", 0.0052), "the dry friction is +0.0012 N m off at all speeds"),
        (_line(tmp_path / "k.csv", 0.0052, 1.04e-3), "the friction is 1.3 times the model's at all speeds"),
    ):
        judged = _run(other, "--judge", tmp_path / "m.json", "--json")
        assert cause in json.loads(judged.output)["faults"][-1]


def test_options_of_a_fit_are_refused(model: Path) -> None:
    done = _run(model.parent / "p.csv", "--judge", model, "--C", "3")
    assert done.exit_code == 2
    assert "--C" in done.output


def test_columns_of_a_screw_are_judged_as_they_were_learned(tmp_path: Path) -> None:
    rows = ["speed,torque"]
    for v in np.linspace(5.0, 300.0, 24):
        rows += [f"{v},{0.2 + 5e-4 * v}", f"{-v},{-0.2 - 5e-4 * v}"]
    (tmp_path / "screw.csv").write_text("\n".join(rows) + "\n")
    said = (tmp_path / "screw.csv", "--column", "velocity=speed:deg/s", "--column", "torque=torque:N m")
    model, lead = tmp_path / "m.json", ("--lead-m", "0.005")
    learned = _run(*said, *lead, "--out", model, "--kernel", "formula", "--jobs", "1")
    assert learned.exit_code == 0, learned.output
    done = _run(*said, *lead, "--judge", model)
    assert done.exit_code == 0, done.output
    assert "the model holds" in done.output
