"""`rtctl identify --log`: from recordings to a table and to points that `rtctl fit` reads."""

import json
import sys

import numpy as np
import pytest

from rtctl.__main__ import main
from rtctl.friction.points import read_points


@pytest.fixture
def log(tmp_path):
    t = np.arange(12_500) / 500.0
    w = [(a, 2 * np.pi * f) for a, f in ((0.4, 0.4), (0.15, 1.1), (0.06, 2.3))]
    x, v, acceleration = (
        sum(f(a, k) for a, k in w)
        for f in (
            lambda a, k: a * np.sin(k * t),
            lambda a, k: a * k * np.cos(k * t),
            lambda a, k: -a * k**2 * np.sin(k * t),
        )
    )
    noise = np.random.default_rng(3).normal(0, 0.01, len(t))
    torque = 0.012 * acceleration + 0.05 * v + 0.25 * np.sign(v) + 0.02 + noise
    path = tmp_path / "log.csv"
    rows = "\n".join(
        f"{a:.4f},{np.degrees(b):.9g},{1e3 * c:.9g}" for a, b, c in zip(t, x, torque, strict=True)
    )
    path.write_text(f"time_s,angle,milli\n{rows}\n")
    return path


def run(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["rtctl", "identify", *map(str, arguments)])
    code = 0
    try:
        main()
    except SystemExit as ended:
        code = ended.code or 0
    captured = capsys.readouterr()
    return code, captured.out, captured.err


MAPPED = ("--column", "position=angle:deg", "--column", "torque=milli:mN m", "--torque-delay", "0")


def test_a_log_in_degrees_and_millinewtonmetres_gives_the_parameters_and_points(
    monkeypatch, capsys, log, tmp_path
):
    out = tmp_path / "out"
    code, text, _ = run(monkeypatch, capsys, "--log", log, *MAPPED, "--out", out, "--json")
    assert code == 0
    found = json.loads(text)["symmetric"]["parameters"]
    for name, truth in (("inertia_kgm2", 0.012), ("viscous_nms_rad", 0.05), ("coulomb_nm", 0.25)):
        assert found[name]["value"] == pytest.approx(truth, rel=0.02)
    speed, friction = read_points(out / "points.csv").branch(1)
    np.testing.assert_allclose(friction, 0.25 + 0.05 * speed, rtol=0.05)


def test_a_map_in_a_file_does_as_well_and_the_table_shows_intervals(monkeypatch, capsys, log, tmp_path):
    table = tmp_path / "map.toml"
    table.write_text(
        '[position]\ncolumn = "angle"\nunit = "deg"\n[torque]\ncolumn = "milli"\nunit = "mN m"\n'
    )
    code, text, _ = run(monkeypatch, capsys, "--log", log, "--map", table)
    assert code == 0
    assert "95 % interval" in text
    assert "condition number" in text


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("--column", "position=angle:deg"), 3, "a torque"),
        (("--column", "position=angle:deg", "--column", "twist=milli"), 3, "unknown role"),
        (("--column", "position=angle:deg", "--column", "torque=gone"), 10, "no column 'gone'"),
    ],
)
def test_a_wrong_map_is_refused_and_leaves_nothing(
    monkeypatch, capsys, log, tmp_path, arguments, code, message
):
    out = tmp_path / "out"
    ended, _, error = run(monkeypatch, capsys, "--log", log, *arguments, "--out", out)
    assert ended == code
    assert message in error
    assert not out.exists()
