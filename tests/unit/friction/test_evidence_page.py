"""The page of evidence: every set and every rung, and formulas first where they are as good."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from rtctl.cli.evidence import command
from rtctl.errors import ConfigError, DataError
from rtctl.friction.kind_table import FORMULAS
from rtctl.friction.learn import ladder, report_evidence_sets
from rtctl.friction.learn.nested import NextSession
from rtctl.friction.learn.over_best import OverBest
from rtctl.friction.learn.report_evidence_page import page
from rtctl.friction.learn.report_evidence_sets import Found, Line, judge_set
from rtctl.friction.logs.data_sets import read_description, read_set
from rtctl.friction.point_reader import read_points

ROOT = Path(__file__).parents[3]
DATA = ROOT.parent / "shared" / "data"


def line(family, held_out, nested, refused=""):
    return Line(
        family, held_out, 0.9 * held_out, 1.1 * held_out, "4 + 4", nested, 0.05 * (nested or 0), refused
    )


def found(name, *lines, **more):
    figures = {
        "chosen": lines[0].family,
        "chosen_nm": 1e-3,
        "chosen_held_out_nm": 1e-3,
        "floor_nm": 5e-4,
        "over_best": OverBest(1.0, 0.9, 1.1, 0.98),
    } | more
    return Found(
        name=name,
        source="Made up",
        points=80,
        way="log",
        units=4,
        friction_nm=0.1,
        lines=lines,
        notes=(),
        **figures,
    )


MACHINE_WINS = found("machine's", line("epsilon-spline", 1e-3, 1e-3), line("gaussian", 3e-3, 3e-3))
FORMULA_WINS = found("formula's", line("gaussian", 1e-3, 1e-3), line("epsilon-spline", 1e-3, 2e-3))


def test_sets_that_a_formula_is_as_good_on_stand_first():
    text = page([MACHINE_WINS, FORMULA_WINS], "rtctl evidence X")
    short = text[text.index("## In short") : text.index("## How to read")]
    assert short.index("formula's") < short.index("machine's")
    assert "**formula's**: a formula is the best: gaussian beats epsilon-spline, 1 against 2 mN m" in short
    assert "**machine's**: no formula is as good: the best, gaussian, errs 3 times as much" in short
    section = text[text.index("## Formula's") :]
    assert section.index("**A formula is the best") < section.index("| model |")
    assert "made by `rtctl evidence X`" in text


def test_every_rung_has_its_row_with_interval_floor_and_verdict():
    one = found(
        "set",
        line("epsilon-spline", 1e-3, 1e-3), line("nu-spline", 1e-3, 1.05e-3), line("coulomb", 4e-3, 4e-3),
        line("tustin", 1e-3, None), Line("gaussian", None, 0, 0, "", 1e-4, 0, "the points cannot tell"),
    )  # fmt: skip
    text = page([one], "x")
    assert "floor 0.5 mN m" in text
    for row in (
        "| `epsilon-spline` | 1 | 0.9 to 1.1 | 1 | 4 + 4 | chosen; the least error, by a machine |",
        "| `nu-spline` | 1 | 0.9 to 1.1 | 1.05 | 4 + 4 | as good as the best |",
        "| `coulomb` | 4 | 3.6 to 4.4 | 4 | 4 + 4 | 4 times the best |",
        "| `tustin` | 1 | 0.9 to 1.1 | - | 4 + 4 | cannot be told without some fold |",
        "| `gaussian` | - | - | - | - | refused: the points cannot tell |",
    ):
        assert row in text


def test_what_the_bands_were_worth_is_told():
    covered = replace(MACHINE_WINS.lines[0], covered=0.956)
    one = replace(MACHINE_WINS, lines=(covered, *MACHINE_WINS.lines[1:]), chosen_covered=0.956)
    text = page([one, FORMULA_WINS], "x")
    assert "Its 95 % band holds 95.6 % of that." in text
    assert "the least error, by a machine | 95.6 |" in text
    assert "It has no band." in text
    assert "4 + 4 | 3 times the best | - |" in text


def test_what_is_wanted_on_every_set_is_a_table_that_says_what_is_out():
    good = replace(MACHINE_WINS, chosen_covered=0.95)
    wide = replace(good, name="wide", way="speed", chosen_covered=0.995)
    worse = replace(good, name="worse", chosen_nm=1.6e-3, over_best=OverBest(1.6, 1.2, 2.1, 1.5))
    luck = replace(good, name="luck", over_best=OverBest(1.12, 0.96, 1.31, 1.0))
    text = page([good, wide, worse, luck], "x")
    assert "| machine's | next sessions | 1.00 | - | 1.00 (0.90 to 1.10) | 0.98 | 95.0 | nothing |" in text
    assert (
        "| wide | speeds of the same session | 1.00 | - | 1.00 (0.90 to 1.10) | 0.98 | 99.5 | band |" in text
    )
    assert "| 1.60 (1.20 to 2.10) | 1.50 | 95.0 | error foretold, choice |" in text
    assert "| 1.12 (0.96 to 1.31) | 1.00 | 95.0 | choice, not surely |" in text


def test_each_next_session_is_held_against_what_was_expected_and_told_of_it():
    sessions = (
        NextSession(1.4e-3, 1e-3, (0.5e-3, 2e-3)),
        NextSession(1.6e-3, 1e-3, (0.5e-3, 2e-3)),
        NextSession(0.6e-3, 1e-3, (0.7e-3, 2e-3)),
        NextSession(1e-3, 1e-3, None),
    )
    text = page([replace(MACHINE_WINS, sessions=sessions)], "x")
    assert "| machine's | next sessions | 1.00 | 2 of 4, 2 |" in text
    assert "errs 1 mN m on what it did not see (next sessions), as its held-out error said" in text


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({}, "as its held-out error said (1 mN m; 1.00 times), and is as good as the best rung"),
        ({"chosen_nm": 2e-3, "over_best": OverBest(2.0, 1.5, 2.7, 1.9)},
            "which its held-out error did not say (1 mN m; 2.00 times), and is 2.00 (1.50 to 2.70) times"),
        ({"floor_nm": 1e-3}, "chosen; at the floor; the least error, by a machine"),
    ],
)  # fmt: skip
def test_what_is_said_follows_from_the_figures(more, said):
    assert said in page([replace(MACHINE_WINS, **more)], "x")
    if more:
        assert said not in page([MACHINE_WINS], "x")


def test_a_warning_is_told_once_and_without_the_names_of_the_files():
    without = report_evidence_sets._without_files
    assert without("a/b.csv.gz: strokes too short") == "strokes too short"
    assert without("a/b.csv.gz, a/c.csv.gz: hardly any sliding: slow") == "hardly any sliding: slow"


QUICK = ladder.Options(families=("coulomb_viscous", "lorentzian"), backend="sequential", n_jobs=1)


@cache
def mock_judged():
    """The mock's points and what is made of them, by two formulas."""
    points = read_points(ROOT / "configs/friction/mock_points.csv")
    return points, judge_set("mock", "", points, ("told",), QUICK)


def test_a_set_is_judged_by_what_it_never_saw():
    points, one = mock_judged()
    assert [row.family for row in one.lines] == ["coulomb_viscous", "lorentzian"]
    assert one.chosen == "lorentzian"
    assert one.chosen_nm == pytest.approx(4.0e-3, rel=0.05)
    assert one.least_nm == pytest.approx(one.chosen_nm)
    assert one.over_best == OverBest(1.0, 1.0, 1.0, 1.0)
    assert one.sessions == ()
    assert 2e-4 < one.floor_nm < 1e-3 < one.chosen_nm
    assert one.friction_nm == pytest.approx(np.sqrt(np.mean(points.friction_nm**2)))


def test_the_shipped_description_is_read_and_its_page_has_every_set():
    sets = read_description(ROOT / "docs/evidence.toml")
    text = (ROOT / "docs/evidence.md").read_text()
    assert "made by `rtctl evidence docs/evidence.toml --data DATA --out docs/evidence.md`" in text
    for one in sets:
        assert f"## {one.name[:1].upper()}{one.name[1:]}\n" in text
        assert one.source in text
    mock = next(one for one in sets if one.beside)
    points, notes = read_set(mock, ROOT / "docs")
    assert len(points.direction) == 110
    assert notes == ()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[[set]]\nname = "x"\n', "give one of logs, runs and points"),
        ('[[set]]\nname = "x"\npoints = "p.csv"\nruns = ["r.csv"]\n', "give one of logs, runs and points"),
        ('[[set]]\nname = "x"\npoints = "p.csv"\nwindow = 3\n', "window"),
    ],
)
def test_a_description_that_is_none_is_refused(tmp_path, text, said):
    (tmp_path / "d.toml").write_text(text)
    with pytest.raises(ConfigError) as caught:
        read_description(tmp_path / "d.toml")
    assert said in " ".join(caught.value.faults)


def test_the_command_writes_the_page_and_names_a_file_that_is_missing(tmp_path, monkeypatch):
    (tmp_path / "d.toml").write_text('[[set]]\nname = "mine"\nsource = "Mine"\npoints = "p.csv"\n')
    words = [str(tmp_path / "d.toml"), "--out", str(tmp_path / "page.md"), "--kernel", "formula"]
    done = CliRunner().invoke(command, words)
    assert isinstance(done.exception, ConfigError)
    assert "no file p.csv" in str(done.exception)
    (tmp_path / "p.csv").write_text((ROOT / "configs/friction/mock_points.csv").read_text())
    right, judged = mock_judged()

    def quick(name, source, points, notes, options):
        assert options.families == tuple(FORMULAS)
        assert options.folds == "speed"
        assert np.array_equal(points.friction_nm, right.friction_nm)
        return replace(judged, name=name, source=source, notes=tuple(notes))

    monkeypatch.setattr(report_evidence_sets, "judge_set", quick)
    done = CliRunner().invoke(command, words)
    assert done.exit_code == 0, done.output
    text = (tmp_path / "page.md").read_text()
    assert "## Mine" in text
    assert "| `coulomb_viscous` |" in text
    told = CliRunner().invoke(command, [*words, "--json"])
    (one,) = json.loads(told.stdout)["sets"]
    assert one["chosen"] == "lorentzian"


@pytest.mark.realdata
@pytest.mark.skipif(not DATA.is_dir(), reason=f"no recordings in {DATA}")
@pytest.mark.parametrize(
    "name",
    [
        "TU/e lever of the hand",
        pytest.param("TU/e lever of the environment", marks=pytest.mark.volume),
    ],
)
def test_a_held_out_error_says_what_the_next_session_brings(name):
    one = next(one for one in read_description(ROOT / "docs/evidence.toml") if one.name == name)
    points, notes = read_set(one, DATA)
    options = replace(QUICK, families=("coulomb", "coulomb_viscous", "epsilon-spline"), folds="log")
    told = judge_set(one.name, "", points, notes, options)
    assert told.units == len(told.sessions) == 3
    assert 1 / 1.5 <= told.chosen_nm / told.chosen_held_out_nm <= 1.5


def test_one_broken_file_of_several_is_left_out_and_named(tmp_path):
    for k in range(20):
        speed = (-1) ** k * (0.2 + 0.1 * k)
        rows = [f"{speed},{0.3 * np.sign(speed) + 0.05 * speed + 0.001 * (j % 3)}" for j in range(30)]
        (tmp_path / f"run{k}.csv").write_text("\n".join(["v,tau", *rows]) + "\n")
    (tmp_path / "run3.csv").write_text("v,tau\n0.2,0.3\n0.2,oops\n0.2,0.3\n0.2\n")
    (tmp_path / "sets.toml").write_text(
        '[[set]]\nname = "runs"\nruns = ["*.csv"]\n'
        'columns = { velocity = { column = "v" }, torque = { column = "tau" } }\n'
    )
    (one,) = read_description(tmp_path / "sets.toml")
    points, notes = read_set(one, tmp_path)
    assert len(points.direction) == 19
    assert notes[0].startswith(f"left out: {tmp_path / 'run3.csv'}: column 'tau' row 2: 'oops'")
    for k in range(20):
        (tmp_path / f"run{k}.csv").write_text("v,tau\nx,y\n")
    with pytest.raises(DataError):
        read_set(one, tmp_path)
