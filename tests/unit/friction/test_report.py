"""The report of a fit: whole, self-contained, and showing the numbers that were computed."""

import base64
import html
import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction import gain as report_gain
from rtctl.friction.kind_table import FORMULAS
from rtctl.friction.learn import fit, ladder, report_evidence, report_tables
from rtctl.friction.learn import report_write as report
from rtctl.friction.learn.machines import FailedFitError
from rtctl.friction.margins import friction_figures
from rtctl.friction.point_reader import read_points
from rtctl.rig_file import config

ROOT = Path(__file__).parents[3]
POINTS = ROOT / "configs/friction/mock_points.csv"
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def points():
    return read_points(POINTS)


@pytest.fixture(scope="module")
def model(points):
    return fit.fit_points(points, rig="mock", c=1e3)


@pytest.fixture(scope="module")
def evidence(points, model):
    return report_evidence.gather(points, model, None)


@pytest.fixture(scope="module")
def climbed(points):
    options = ladder.Options(
        families=("coulomb", "gaussian", "epsilon-polynomial", "epsilon-spline"),
        backend="sequential",
        n_jobs=1,
    )
    return ladder.ascend(points, options)


@pytest.fixture(scope="module")
def loaded():
    return config.load(ROOT / "configs/mock.toml")


@pytest.fixture(scope="module")
def drawn(evidence):
    return report._pictures(evidence)


@pytest.fixture
def drawn_before(drawn, monkeypatch):
    """The pictures of the page as they are, for tests that ask something else of the page."""
    monkeypatch.setattr(report, "_pictures", lambda _evidence: drawn)


def test_the_report_is_one_page_that_needs_nothing_else(evidence, tmp_path):
    report.write(tmp_path / "r", evidence)
    page = (tmp_path / "r/report.html").read_text()
    inline = [base64.b64decode(data) for data in re.findall(r'src="data:image/png;base64,([^"]+)"', page)]
    files = sorted((tmp_path / "r").glob("*.png"))
    assert {path.name for path in files} == {"curve_epsilon-spline.png", "ladder.png", "residuals_speed.png"}
    assert {path.read_bytes() for path in files} == set(inline)
    assert all(png.startswith(PNG) for png in inline)
    text = re.sub(r"base64,[^\"]+", "", page)
    assert not re.search(r"https?:|//|<script|<link|@import|url\(", text)
    assert "default-src 'none'; img-src data:; style-src 'unsafe-inline'" in page
    assert page.count("<img") == page.count("<figcaption>") == len(files)
    for family in (*FORMULAS, "epsilon-spline"):
        assert f"<td>{family}</td>" in page
    assert "No residuals against position and time" in page
    assert "--config RIG.toml" in page
    assert [path.name for path in tmp_path.iterdir()] == ["r"]


def test_the_numbers_are_those_of_the_ladder(points, climbed, tmp_path):
    model = ladder.learn(points, climbed, rig="mock")
    report.write(tmp_path / "r", report_evidence.gather(points, model, climbed))
    document = json.loads((tmp_path / "r/report.json").read_text())
    page = (tmp_path / "r/report.html").read_text()
    assert document["chosen"] == climbed.choice.chosen.family
    assert html.escape(climbed.explanation) in page
    for row, rung in zip(document["ladder"], climbed.choice.rungs, strict=True):
        assert row["family"] == rung.family
        assert row["held_out_rmse_nm"] == rung.rmse_nm
        low, high = row["interval_nm"]
        assert (high - low) / 2 == pytest.approx(1.959964 * rung.se_nm, rel=1e-6)
        assert f"<td>{1e3 * rung.rmse_nm:.3f}</td>" in page
        for score in rung.scores:
            cells = [
                row
                for row in document["errors"]
                if (row["family"], row["direction"]) == (rung.family, score.direction)
            ]
            worst = max(cell["prediction_max_error_nm"] for cell in cells)
            assert worst == np.abs(score.errors).max()
            assert sum(cell["prediction_points"] for cell in cells) == len(score.errors)
    at = document["model"]["train_max_error_nm"]
    assert at == [branch.train_max_error_nm for branch in model.branches]


def test_the_curve_that_is_shown_is_the_one_that_is_written(points, climbed):
    rung = next(rung for rung in climbed.choice.rungs if rung.family == "epsilon-spline")
    model = ladder.learn(points, climbed, rig="mock", rung=rung)
    for one, branch in zip(
        report_evidence.gather(points, model, climbed).of("epsilon-spline"), model.branches, strict=True
    ):
        np.testing.assert_array_equal(one.curve.dual_coef, branch.dual_coef)
        assert one.epsilon_nm == branch.hyper_parameters["epsilon_nm"]
        outside = np.isin(one.trained.speed, one.curve.support_vectors[one.bounded])
        slack = 1e-3 * branch.friction_max_nm  # the solver's tolerance
        assert (np.abs(one.trained.error_nm[outside]) >= one.epsilon_nm - slack).all()


def test_a_rung_that_fails_on_all_points_is_left_out_and_said(points, climbed, monkeypatch, tmp_path):
    model, right = ladder.learn(points, climbed, rig="mock"), report_evidence.train

    def fail(candidate, *data):
        if candidate.kind == "polynomial":
            raise FailedFitError("not finite")
        return right(candidate, *data)

    monkeypatch.setattr(report_evidence, "train", fail)
    gathered = report_evidence.gather(points, model, climbed)
    assert "epsilon-polynomial" not in gathered.families
    report.write(tmp_path / "r", gathered)
    assert "not finite when trained on all points" in (tmp_path / "r/report.html").read_text()


def test_a_symmetric_ladder_is_told_apart_by_direction(points):
    options = ladder.Options(families=("gaussian",), symmetric="yes", backend="sequential", n_jobs=1)
    found = ladder.ascend(points, options)
    gathered = report_evidence.gather(points, ladder.learn(points, found, rig="mock"), found)
    forward, backward = gathered.of("gaussian")
    (score,) = found.choice.chosen.scores
    both = np.concatenate([forward.held_out.error_nm, backward.held_out.error_nm])
    np.testing.assert_array_equal(both, score.errors)
    shared = replace(gathered, ladder=replace(found, symmetric=True, symmetric_rung=found.choice.chosen))
    (row,) = report_tables.ladder(shared).rows
    assert row[-1] == f"reported model, of one curve for both directions: {row[1]} mN m"
    # mock: more friction below 0
    assert forward.held_out.error_nm.mean() > 0 > backward.held_out.error_nm.mean()


def test_test_points_give_the_prediction_errors(points, model):
    shifted = replace(points, friction_nm=points.friction_nm + 0.1)
    gathered = report_evidence.gather(points, model, None, shifted)
    for one in gathered.learned:
        np.testing.assert_allclose(one.judged.error_nm, one.trained.error_nm - 0.1, atol=1e-12)


def test_residuals_against_position_and_time_are_drawn_when_the_points_have_them(tmp_path):
    header, *rows = POINTS.read_text().splitlines()
    lines = [f"{header},time_s,position_rad"] + [f"{row},{i},{i % 7}" for i, row in enumerate(rows)]
    (tmp_path / "p.csv").write_text("\n".join(lines))
    points = read_points(tmp_path / "p.csv")
    report.write(
        tmp_path / "r", report_evidence.gather(points, fit.fit_points(points, rig="mock", c=1e3), None)
    )
    assert (tmp_path / "r/residuals_time.png").read_bytes().startswith(PNG)
    assert (tmp_path / "r/residuals_position.png").read_bytes().startswith(PNG)
    assert "No residuals against" not in (tmp_path / "r/report.html").read_text()


def test_the_recommended_gain_is_the_largest_that_passes_the_two_line_test(model, loaded):
    axis = loaded.config.axis[0]
    drifting = axis.friction.model_copy(update={"drift_nm": 0.03})  # without it all of the curve passes
    axis = axis.model_copy(update={"friction": drifting})
    config = loaded.config.model_copy(update={"axis": (axis,)})
    (found,) = report_gain.recommend(model, loaded.model_copy(update={"config": config})).axes

    def margin(gain):
        table = axis.friction.model_copy(update={"gain": gain, "policy": "hybrid"})
        count = 2 * np.pi / axis.encoder_counts_per_rev
        with_gain = axis.model_copy(update={"friction": table})
        return friction_figures(
            model, Path(), with_gain, loaded.config.period_s, count
        ).two_line_capped_margin_nm

    assert 0 < found.gain < 1
    assert margin(found.gain) == found.margin_nm >= 0
    assert margin(found.gain + 0.002) < 0
    assert found.cap_nm == pytest.approx(found.gain * model.friction_min_nm.min())
    assert found.cap_share * axis.torque_limit_nm == pytest.approx(found.cap_nm)
    alone = report_gain.recommend(model, None)
    assert alone.axes == ()
    assert alone.gain_model == pytest.approx(
        min((b.magnitude(v) - b.error_max_nm).min() / b.magnitude(v).min() for b, v in _grids(model)),
        rel=1e-3,
    )


def test_the_suggested_gain_and_cap_pass_the_two_line_test_with_room(model, loaded):
    (found,) = report_gain.recommend(model, loaded).axes
    axis = loaded.config.axis[0]
    table = tomllib.loads(found.snippet("m.json"))["axis"]["friction"]
    assert set(table) == {"model", "gain", "viscous_gain", "cap_share", "drift_nm"}
    assert 0.8 * found.gain < table["gain"] < found.gain
    assert table["cap_share"] * axis.torque_limit_nm <= table["gain"] * model.friction_min_nm.min()
    pasted = axis.model_copy(update={"friction": axis.friction.model_copy(update=table)})
    count = 2 * np.pi / axis.encoder_counts_per_rev
    assert friction_figures(model, Path(), pasted, loaded.config.period_s, count).two_line_margin_nm > 0


def test_the_recommendation_does_not_depend_on_the_gain_and_cap_that_are_set(model, loaded):
    axis = loaded.config.axis[0]
    other = axis.friction.model_copy(update={"gain": 0.1, "cap_share": 0.01, "policy": "off"})
    config = loaded.config.model_copy(update={"axis": (axis.model_copy(update={"friction": other}),)})
    changed = loaded.model_copy(update={"config": config})
    assert report_gain.recommend(model, changed).axes == report_gain.recommend(model, loaded).axes


def _grids(model):
    return [(branch, np.linspace(0, branch.speed_max_rad_s, 4000)) for branch in model.branches]


def test_everything_from_outside_is_escaped(evidence, tmp_path):
    strange = replace(evidence, model=replace(evidence.model, rig="<b>&rig", selection='"<script>x'))
    report.write(tmp_path / "r", strange, {"<i>": "<u>"})
    page = (tmp_path / "r/report.html").read_text()
    assert not re.search(r"<b>|<script|<i>|<u>", page)
    assert "&lt;b&gt;&amp;rig" in page


@pytest.mark.usefixtures("drawn_before")
def test_a_folder_that_is_no_report_of_ours_is_refused_and_kept(evidence, tmp_path):
    folder = tmp_path / "mine"
    folder.mkdir()
    report.write(folder, evidence)  # empty is free
    report.write(folder, evidence)  # a report of ours is replaced
    (folder / "thesis.txt").write_text("years of work")
    with pytest.raises(DataError, match=r"thesis\.txt.*choose another --report"):
        report.write(folder, evidence)
    assert (folder / "thesis.txt").read_text() == "years of work"
    for name, content in (("report.json", "{}"), ("other.txt", "")):
        other = tmp_path / name.partition(".")[0]
        other.mkdir()
        (other / name).write_text(content)
        with pytest.raises(DataError, match="no report wrote"):
            report.write(other, evidence)
    with pytest.raises(DataError, match="no report wrote"):
        report.write(folder / "thesis.txt", evidence)


@pytest.mark.parametrize("method", ["write_bytes", "rename"])
@pytest.mark.usefixtures("drawn_before")
def test_a_failure_leaves_the_old_report_and_nothing_else(evidence, tmp_path, monkeypatch, method):
    report.write(tmp_path / "r", evidence, {"run": 1})
    before = (tmp_path / "r/report.json").read_bytes()
    right = getattr(Path, method)

    def fail(path, *args):
        if path.name == "ladder.png" or path.name.endswith(".new"):
            raise OSError(28, "No space left on device")
        return right(path, *args)

    monkeypatch.setattr(Path, method, fail)
    with pytest.raises(DataError, match="No space left"):
        report.write(tmp_path / "r", evidence, {"run": 2})
    assert [path.name for path in tmp_path.iterdir()] == ["r"]
    assert (tmp_path / "r/report.json").read_bytes() == before
