"""Every sentence of a report follows from the tables under it: other tables, another sentence."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hw.motion import words
from rtctl import pictures
from rtctl.friction.gain import AxisGain, Gains
from rtctl.friction.learn import (
    fit,
    report_evidence,
    report_figure,
    report_figures,
    report_measured_range,
    report_page,
    report_sentences,
    report_tables,
    selection,
)
from rtctl.friction.learn.machines import Candidate
from rtctl.friction.learn.report_measured_range import unmeasured
from rtctl.friction.learn.score import Score
from rtctl.friction.points import FrictionPoints


def on_test(**rmse_mnm):
    """Rows of the table of errors: RMS on the test points by family, mN m; standard error one tenth."""
    return [
        {"family": name.replace("_", "-"), "prediction_rmse_nm": x / 1e3, "prediction_se_nm": x / 1e4}
        for name, x in rmse_mnm.items()
    ]


def held(**rmse_mnm):
    return [
        {"family": name.replace("_", "-"), "held_out_rmse_nm": x / 1e3, "refused": None}
        for name, x in rmse_mnm.items()
    ]


def model(**mnm):
    return {f"{name}_max_error_nm": [None if x is None else x / 1e3, 1e-4] for name, x in mnm.items()}


def rung(family, rmse_mnm, terms):
    machine, _, kind = family.rpartition("-")
    # hard places of their own
    errors = 1e-3 * rmse_mnm * np.where(np.arange(50) % 2 == bool(machine), 1.1, 0.9)
    return selection.Rung(family, (Score(Candidate(machine or "formula", kind), 1, errors, terms),))


SPLINE = "epsilon-spline"

CASES = [
    (report_sentences.of_test, (on_test(epsilon_spline=2, gaussian=3), SPLINE),
        "errs 2 mN m RMS, the least of 2 models"),
    (report_sentences.of_test, (on_test(epsilon_spline=2, gaussian=1.9), SPLINE),
        "within one standard error of the best of 2"),
    (report_sentences.of_test, (on_test(epsilon_spline=4, gaussian=1), SPLINE),
        "4 times the best of 2 models: the least has gaussian, 1 mN m"),
    (report_sentences.of_test, (on_test(gaussian=1), SPLINE), "nothing is said of epsilon-spline"),
    (report_sentences.of_test_formulas, (on_test(epsilon_spline=2, gaussian=1),),
        "a formula is the best: gaussian beats epsilon-spline, 1 against 2"),
    (report_sentences.of_test_formulas, (on_test(epsilon_spline=2, gaussian=2.1),),
        "a formula is as good: gaussian is within one standard error"),
    (report_sentences.of_test_formulas, (on_test(epsilon_spline=2, gaussian=4),),
        "no formula is as good: the best, gaussian, errs 2 times as much"),
    (report_sentences.of_test_formulas, (on_test(gaussian=4),), "^$"),
    (report_sentences.of_agreement, (on_test(epsilon_spline=2), held(epsilon_spline=1.9), SPLINE),
        "1.1 times its held-out error .*: the two agree"),
    (report_sentences.of_agreement, (on_test(epsilon_spline=8), held(epsilon_spline=2), SPLINE),
        "4 times .* too little of another session: .* test points, and hold out whole logs"),
    (report_sentences.of_agreement, (on_test(epsilon_spline=8), held(epsilon_spline=2), SPLINE, "log"),
        r"4 times .* too little of another session: trust the test points\.$"),
    (report_sentences.of_agreement, (on_test(epsilon_spline=1), held(epsilon_spline=2), SPLINE),
        "the test points are easier"),
    (report_sentences.of_bound, (model(train=3, validation=2, test=None),),
        "is 3 mN m, on the points it was learned from"),
    (report_sentences.of_bound, (model(train=3, validation=4, test=None),),
        "is 4 mN m, on what was held out"),
    (report_sentences.of_bound, (model(train=3, validation=4, test=9, single=None),),
        "is 9 mN m, on the test points"),
    (report_sentences.of_bound, (model(train=3, validation=4, test=9, single=20),),
        "is 20 mN m, on single measurements"),
    (report_sentences.of_left_out, (0, 140), "^$"),
    (report_sentences.of_left_out, (1, 140), "1 of 140 points is left out"),
]  # fmt: skip


@pytest.mark.parametrize(("sentence", "rows", "said"), CASES)
def test_a_sentence_says_what_its_table_says_and_no_other_table_makes_it_say_so(sentence, rows, said):
    assert re.search(said, sentence(*rows)), sentence(*rows)
    others = [case for case in CASES if case[0] is sentence and case[2] != said]
    assert others
    for _, other, _ in others:
        assert not re.search(said, sentence(*other))


def test_test_points_are_held_against_what_was_expected_of_the_next_session():
    rows, before = on_test(epsilon_spline=8), held(epsilon_spline=2)
    more = report_sentences.of_agreement(rows, before, SPLINE, expected_nm=6e-3)
    assert "1.3 times what was expected of the next session (6 mN m): the two agree" in more
    less = report_sentences.of_agreement(rows, before, SPLINE, expected_nm=1e-3)
    assert "4 times its held-out error (2 mN m), which says too little" in less


@pytest.mark.parametrize(("sessions", "odds"), [(1, ""), (2, "51 %"), (3, "64 %"), (4, "76 %"), (5, "")])
def test_the_odds_of_a_held_out_error_are_told_of_few_sessions(sessions, odds):
    log = np.repeat(np.arange(float(sessions)), 8)
    rows = [(d * v, 0.3, d, np.nan, np.nan) for _ in range(sessions) for d in (1, -1) for v in (1, 2, 3, 4)]
    points = FrictionPoints.from_rows(rows, "made", "0" * 64, {"log": log})
    said = report_sentences.of_few_sessions(points, "log")
    assert bool(said) == bool(odds)
    assert odds in said
    assert not report_sentences.of_few_sessions(points, "speed")


def test_a_model_that_no_search_compared_is_compared_with_the_formulas_of_the_table():
    better, worse = held(epsilon_spline=2, gaussian=1), held(epsilon_spline=2, gaussian=3)
    assert "A formula errs no more: gaussian, 1 against 2" in report_sentences.of_formulas(better, SPLINE)[0]
    assert (
        "No formula errs as little: the best is gaussian, 3 against 2"
        in report_sentences.of_formulas(worse, SPLINE)[0]
    )
    assert report_sentences.of_formulas(better, "gaussian") == []


@pytest.mark.parametrize(
    ("rungs", "said"),
    [
        ({"gaussian": (1.01, 4), SPLINE: (1.0, 9)},
            "gaussian errs more by less than one standard error of epsilon-spline"),
        ({"gaussian": (0.99, 4), SPLINE: (1.0, 9)}, "gaussian does not err more than epsilon-spline"),
        ({"gaussian": (3.0, 4), SPLINE: (1.0, 9)},
            "No parametric model is as good: the best, gaussian, errs 3 times"),
        ({"gaussian": (1.0, 9), SPLINE: (1.01, 4)},
            "the fewest numbers of 2 within one standard error of the best"),
        ({"gaussian": (1.0, 4), SPLINE: (3.0, 9)},
            "the smallest expected error by more than one standard error"),
        ({"gaussian": (1.0, 4), SPLINE: (1.01, 9)}, "the smallest expected error and the fewest numbers"),
    ],
)  # fmt: skip
def test_the_reason_of_the_choice_follows_from_the_ladder(rungs, said):
    choice = selection.choose([rung(family, *figures) for family, figures in rungs.items()])
    assert said in choice.explanation


SPEEDS = np.concatenate([[0.0], np.geomspace(0.01, 2.0, 20)])


def joint(speeds=SPEEDS, factor=1.0):
    rows = [
        (sign * v, factor * (0.25 + 0.1 * np.exp(-v / 0.1) + 0.05 * v), sign, np.nan, np.nan)
        for sign in (1, -1)
        for v in speeds
    ]
    return FrictionPoints.from_rows(rows, "joint.csv", "0" * 64)


@pytest.fixture(scope="module")
def learned():
    return fit.fit_points(joint(), rig="bench", c=100.0)


def test_the_page_confronts_its_headline_with_test_points_that_contradict_it(learned):
    said = {}
    for name, test in (("none", None), ("same", joint()), ("weaker", joint(factor=0.5))):
        evidence = report_evidence.gather(joint(), learned, None, test)
        said[name] = " ".join(report_sentences.headline(evidence))
    assert "test points" not in said["none"]
    assert "which says too little of another session" not in said["same"]
    # where it is known why, that alone is said
    assert re.search(r"That is [\d.e+]+ times its held-out error \(\S+ mN m\)\. The model", said["weaker"])
    assert (
        "The model does not hold on the test points (rtctl fit --judge): the friction is 0.5"
        in said["weaker"]
    )
    assert "does not hold" not in said["same"]
    evidence = report_evidence.gather(joint(), learned, None, joint(factor=0.5))
    html = report_page.page(evidence, SimpleNamespace(axes=(), gain_model=0.5, friction_min_nm=0.2),
        {"provenance": {}}, [
        report_page.Picture("ladder", "", b"")])  # fmt: skip
    assert "times its held-out error" in html


def test_points_that_are_missing_do_not_speak_against_a_model(learned):
    quick = replace(joint(), velocity_rad_s=np.where(joint().direction > 0, joint().velocity_rad_s, -9.0))
    said = report_sentences.of_verdict(learned, quick)
    assert "cannot be judged in full on the test points" in said
    assert "direction -1: no point within the trained range, nothing can be said" in said
    weak = replace(quick, friction_nm=quick.friction_nm * np.where(quick.velocity_rad_s > 1, 0.6, 1))
    assert "does not hold on the test points" in report_sentences.of_verdict(learned, weak)


def test_errors_of_a_small_joint_are_told_with_digits():
    cells = [report_tables.mnm_cell(nm) for nm in (None, 0.0, 1.2e-3, -4.5678e-7, 1e-5)]
    assert cells == ["-", "0.000", "1.200", "-0.000457", "0.010"]


def test_the_table_of_errors_says_what_was_held_out(learned):
    evidence = report_evidence.gather(joint(), learned, None)
    assert "on speeds held out of training" in report_tables.errors(evidence).caption
    assert (
        "on stretches of time held out of training"
        in report_tables.errors(replace(evidence, folds="time")).caption
    )


def test_a_curve_is_dashed_where_nothing_was_measured():
    assert unmeasured(SPEEDS) == []
    assert unmeasured(SPEEDS[1:]) == [(0.0, 0.01)]
    assert unmeasured(np.concatenate([SPEEDS[SPEEDS < 0.1], [1.9, 2.0]])) == [
        (pytest.approx(0.0931, rel=0.01), 1.9)
    ]
    drawn = []
    plot = SimpleNamespace(plot=lambda v, curve, **how: drawn.append((v[np.isfinite(curve)], how)))
    v = np.linspace(0, 2, 400)
    report_measured_range.draw(plot, -v, np.ones(400), SPEEDS[SPEEDS > 0.1], label="curve")
    (solid, how), (dashed, dashes) = drawn
    assert dashes["linestyle"] == "--"
    assert how["label"] == "curve"
    assert dashes["label"] is None
    first = SPEEDS[SPEEDS > 0.1].min()
    assert np.abs(solid).min() >= first
    assert np.abs(dashed).max() < first + 0.01
    assert len(solid) + len(dashed) >= 400


@pytest.mark.parametrize(("motion", "unit"), [("rotary", "mN m at v > 0"), ("linear", "mN at v > 0")])
def test_a_legend_speaks_in_the_units_of_its_axis(motion, unit, learned, monkeypatch):
    told = []
    monkeypatch.setattr(
        pictures, "save",
        lambda figure, _path: told.extend(one.get_text() for one in figure.axes[0].get_legend().get_texts()),
    )  # fmt: skip
    report_figure.draw(replace(learned, motion=motion), joint(), "never.png")
    assert any(one.startswith("epsilon tube") and one.endswith(unit) for one in told)


def test_a_direction_that_ends_early_is_drawn_as_far_as_it_was_measured(learned, monkeypatch):
    evidence = report_evidence.gather(joint(), learned, None)
    titles, figures = [], []
    monkeypatch.setattr(report_figures, "_label", lambda _plot, _x, _y, title: titles.append(title))
    monkeypatch.setattr(report_figures, "_png", lambda figure, _motion: figures.append(figure))
    report_figures.curves(replace(evidence, boundary_rad_s=99.0), evidence.chosen)
    assert [title.partition(", ")[2] for title in titles] == ["whole range", "low speed"] * 2
    assert all(plot.get_xlim()[1] < 3 for plot in figures[0].axes)


def test_the_caption_names_the_speeds_that_were_not_measured():
    assert report_measured_range.said(joint()) == ""
    assert "below 0.01 rad/s (direction +1)" in report_measured_range.said(joint(SPEEDS[1:]))
    slow = words(report_measured_range.said(joint(np.array([0.002, 0.02, 0.021, 0.022, 0.5]))), "linear")
    assert "below 2 mm/s, 2 to 20 mm/s, 0.022 to 0.5 m/s (direction +1)" in slow


def test_the_vectors_of_one_curve_for_both_directions_stand_there_once():
    def one(direction, *weights):
        dual = np.array(weights)
        curve = SimpleNamespace(support_vectors=np.array([0.1, 0.5]), dual_coef=dual)
        return SimpleNamespace(direction=direction, curve=curve, limit=np.ones(2), bounded=np.abs(dual) >= 1)

    shared = report_tables.support_vectors(SPLINE, [one(1, 0.5, -1.0), one(-1, 0.5, -1.0)])
    assert [row[0] for row in shared.rows] == ["both", "both"]
    assert "2 (direction both)." in shared.caption
    apart = report_tables.support_vectors(SPLINE, [one(1, 0.5, -1.0), one(-1, 0.4, -1.0)])
    assert [row[0] for row in apart.rows] == ["+1", "+1", "-1", "-1"]


@pytest.mark.parametrize(("gain", "said"), [(0.8, "nothing left: stay below"), (1.0, "0.02 N m to spare")])
def test_the_page_says_that_the_two_line_test_is_spent_only_where_it_is(gain, said):
    one = AxisGain("yaw", gain, 0.1, 0.01, 0.02, gain, gain, 0.1, 0.0, 0.0)
    html = report_page._gain(Gains(0.9, 0.2, (one,), "rig.toml"))
    assert said in html
    assert ("nothing left" in html) == (gain < 1)
