"""The model file: what is written is what is read, and anything else is refused by name."""

import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest

from rtctl.control.friction_curve import friction_magnitude
from rtctl.control.jit import records
from rtctl.errors import ModelError
from rtctl.friction import artefact
from rtctl.friction.document import checksum, render
from rtctl.friction.learn import fit, ladder
from rtctl.friction.points import FrictionPoints

V = np.concatenate([[0.0], np.geomspace(0.01, 3, 30)])


@pytest.fixture(scope="module")
def model():
    rng = np.random.default_rng(1)
    rows = [
        (
            s * v,
            0.25 + 0.1 * np.exp(-((v / 0.1) ** 2)) + (0.05 + 0.01 * s) * v + rng.normal(0, 0.003),
            s,
            0,
            1,
        )
        for s in (1, -1)
        for v in V
    ]
    return fit.fit_points(FrictionPoints.from_rows(rows, "points.csv", "0" * 64), rig="mock", c=1e3)


@pytest.fixture
def path(model, tmp_path):
    artefact.save(model, tmp_path / "m.json")
    return tmp_path / "m.json"


def _forge(path, change):
    """Change the document and give it a right checksum: what only the later checks can see."""
    document = json.loads(path.read_text())
    change(document)
    document["sha256"] = checksum(document)
    path.write_text(render(document))
    return path


def test_a_saved_model_is_read_back_bit_for_bit(model, path):
    again = artefact.load(path)
    assert np.array_equal(again.record(), model.record())
    assert np.array_equal(again.self_test, model.self_test)
    assert (again.rig, again.kind, again.created, again.versions) == (
        model.rig,
        "spline",
        model.created,
        model.versions,
    )


def test_a_model_of_nanoradians_is_a_model_all_the_same(tmp_path):
    speed = np.geomspace(0.02, 2, 12) * 1e-9
    rows = [(d * v, 0.1 + 2e7 * v, d, np.nan, np.nan) for d in (1, -1) for v in speed]
    points = FrictionPoints.from_rows(rows, "made", "0" * 64)
    slow = fit.fit_points(points, rig="telescope", c=1.0)
    assert slow.branches[0].viscous_nms_rad > 1e6
    artefact.save(slow, tmp_path / "slow.json")
    assert artefact.load(tmp_path / "slow.json").friction_max_nm == slow.friction_max_nm


def test_a_file_from_before_presliding_and_places_were_kept_is_read(path):
    def older(document):
        for name in ("presliding_rad", "presliding_spread_rad", "presliding_ramps"):
            del document[name]
        for branch in document["branches"].values():
            del branch["place_spread_nm"]

    model = artefact.load(_forge(path, older))
    assert (model.presliding_rad, model.presliding_spread_rad, model.presliding_ramps) == (None, None, 0)
    assert model.place_spread_nm is None


def test_the_file_says_where_it_comes_from(path):
    document = json.loads(path.read_text())
    assert document["schema"] == 2
    assert document["rig"] == "mock"
    assert set(document["versions"]) == {"python", "rtctl", "numpy", "scikit-learn"}
    assert len(document["self_test"]) == 64
    assert document["branches"]["forward"]["hyper_parameters"] == {"C": 1000.0, "epsilon_nm": 0.005}


def test_saving_leaves_no_temporary_file_and_replaces_whole(model, path):
    artefact.save(model, path)
    assert [p.name for p in path.parent.iterdir()] == ["m.json"]


def test_the_loops_compiled_evaluation_is_the_models_magnitude(model):
    record = records(model.record())
    velocity = np.concatenate(
        [np.linspace(-4, 4, 8001), *(s * b.curve.knots for s, b in zip((1, -1), model.branches, strict=True))]
    )
    compiled = np.array([friction_magnitude(record[0], v) for v in velocity])
    assert np.array_equal(compiled, model.magnitude(velocity))


def test_the_look_up_never_points_past_the_segment(model):
    row = model.record()[0]
    for d in (0, 1):
        cells = np.arange(1024)
        left = row["knot_rad_s"][d, row["lookup"][d]]
        assert (left <= cells / row["lookup_scale"][d]).all()
        assert (np.diff(row["lookup"][d]) >= 0).all()
        assert row["lookup"][d, -1] >= row["n_segments"][d] - 2


def test_magnitude_is_held_beyond_the_range_and_nan_stays_nan(model):
    assert model.magnitude(100.0) == model.magnitude(3.0)
    assert np.isnan(model.magnitude(np.nan))


def test_a_model_of_another_rig_is_refused_by_both_names(model):
    with pytest.raises(ModelError, match=r"m\.json: rig: .*'mock'.*'arm'"):
        artefact.require_rig(model, "arm", "m.json")
    artefact.require_rig(model, "mock", "m.json")


def test_an_absent_file_is_refused(tmp_path):
    with pytest.raises(ModelError, match=r"absent\.json: \(file\): cannot read"):
        artefact.load(tmp_path / "absent.json")


@pytest.mark.parametrize(
    "text", ["", "{}", "[]", "null", "[" * 100_000, '{"format": 1e999}', "\x00", "1" * 10_000]
)
def test_what_is_not_a_model_file_is_refused(tmp_path, text):
    (tmp_path / "m.json").write_text(text)
    with pytest.raises(ModelError, match=r"m\.json"):
        artefact.load(tmp_path / "m.json")


def test_a_huge_file_is_refused_unread(tmp_path):
    with (tmp_path / "m.json").open("wb") as file:
        file.truncate(10**9)
    with pytest.raises(ModelError, match="larger than"):
        artefact.load(tmp_path / "m.json")


def test_a_newer_schema_is_refused_as_such(path):
    with pytest.raises(ModelError, match="schema: version 3 is not 2"):
        artefact.load(_forge(path, lambda d: d.update(schema=3)))


@pytest.mark.parametrize("word", ["NaN", "Infinity", "-Infinity"])
def test_nan_and_infinity_are_refused(path, word):
    text = path.read_text()
    value = json.dumps(json.loads(text)["branches"]["forward"]["intercept"])
    path.write_text(text.replace(value, word, 1))
    with pytest.raises(ModelError, match="is not a number"):
        artefact.load(path)


@pytest.mark.parametrize("key", ["kind", "rig", "self_test", "sha256", "speed_fade_rad_s", "data_sha256"])
def test_a_missing_key_is_named(path, key):
    document = json.loads(path.read_text())
    del document[key]
    path.write_text(render(document))
    with pytest.raises(ModelError, match=f"{key} is missing"):
        artefact.load(path)


def _branch(d):
    return d["branches"]["forward"]


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda d: d.update(kind="table"), "kind"),
        (lambda d: d.update(extra=1), "extra"),
        (lambda d: d.update(speed_fade_rad_s=0.0), "speed_fade_rad_s"),
        (lambda d: d.update(friction_max_nm=9.0), "friction_max_nm"),
        (lambda d: _branch(d).update(friction_max_nm=0.1), "friction_max_nm"),
        (lambda d: _branch(d).update(friction_min_nm=0.3), "friction_min_nm"),
        (lambda d: _branch(d)["knots"].reverse(), "forward.knots"),
        (lambda d: _branch(d)["knots"].pop(), "forward"),
        (lambda d: _branch(d)["dual_coef"].pop(), "forward"),
        (lambda d: _branch(d)["support_vectors"].append(-1.0), "support_vectors"),
        (lambda d: _branch(d)["coefficients"][0].append(0.0), "coefficients"),
        (lambda d: _branch(d)["coefficients"][2].__setitem__(0, -5.0), "not positive"),
        (
            lambda d: _branch(d)["coefficients"][1].__setitem__(0, _branch(d)["coefficients"][1][0] + 1e-6),
            "self_test",
        ),
        (lambda d: d["self_test"][7].__setitem__(1, 0.2), "self_test.7"),
        (lambda d: d["self_test"][7].__setitem__(0, 99.0), "outside the trained range"),
        (lambda d: d.update(self_test=[d["self_test"][0]] * 64), "one direction only"),
        (lambda d: d["self_test"].pop(), "self_test"),
        (lambda d: d.update(presliding_rad=0.0), "presliding_rad"),
        (lambda d: d.update(presliding_rad=1.5), "presliding_rad"),
        (lambda d: d.update(presliding_rad=0.001, presliding_ramps=3), "presliding_spread_rad"),
        (lambda d: d.update(presliding_spread_rad=1e-4, presliding_ramps=3), "presliding_rad"),
        (lambda d: _branch(d).update(place_spread_nm=-0.01), "place_spread_nm"),
    ],
)
def test_a_forged_file_with_a_right_checksum_is_still_refused_by_key(path, change, named):
    with pytest.raises(ModelError, match=named) as caught:
        artefact.load(_forge(path, change))
    assert str(path) in str(caught.value)


def test_a_rearranged_file_with_the_same_numbers_is_refused(path):
    path.write_text(json.dumps(json.loads(path.read_text())))
    with pytest.raises(ModelError, match="sha256: the checksum does not match"):
        artefact.load(path)


def test_a_model_that_could_not_be_read_is_not_written(model, tmp_path):
    for broken in (
        dataclasses.replace(model, speed_fade_rad_s=float("nan")),
        dataclasses.replace(model, rig="two words"),
        dataclasses.replace(model, self_test=model.self_test * [1, 1.01]),
    ):
        with pytest.raises(ModelError):
            artefact.save(broken, tmp_path / "m.json")
    assert not list(tmp_path.iterdir())


def test_a_folder_that_does_not_exist_is_refused(model, tmp_path):
    with pytest.raises(ModelError, match="cannot write"):
        artefact.save(model, tmp_path / "nowhere" / "m.json")


def test_reading_a_model_imports_no_learner_and_no_plots():
    code = (
        "import sys, rtctl.check.stability_report, rtctl.friction.artefact, rtctl.friction.learn.fit; "
        "bad = {'sklearn', 'matplotlib', 'scipy', 'pickle5', 'joblib'} & set(sys.modules); assert not bad, "
        "bad"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.fixture(scope="module")
def rbf_model():
    rows = [(s * v, 0.25 + 0.1 * np.exp(-((v / 0.3) ** 2)) + 0.05 * v, s, 0, 1) for s in (1, -1) for v in V]
    points = FrictionPoints.from_rows(rows, "points.csv", "0" * 64)
    found = ladder.ascend(points, ladder.Options(families=("epsilon-rbf",), backend="sequential", n_jobs=1))
    return dataclasses.replace(
        ladder.learn(points, found, rig="mock"),
        temperature_min_c=20.0,
        temperature_max_c=31.5,
        evaluation_ns=9.5,
    )


@pytest.fixture
def rbf_path(rbf_model, tmp_path):
    artefact.save(rbf_model, tmp_path / "rbf.json")
    return tmp_path / "rbf.json"


def test_range_of_temperature_and_evaluation_time_are_kept(rbf_path):
    again = artefact.load(rbf_path)
    assert (again.temperature_min_c, again.temperature_max_c, again.evaluation_ns) == (20.0, 31.5, 9.5)
    assert json.loads(rbf_path.read_text())["branches"]["forward"]["compile_bound_nm"] > 0


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda d: d.update(kind="gaussian"), "forward.parameters"),
        (lambda d: d.update(kind="spline"), "forward.parameters"),
        (lambda d: _branch(d)["parameters"].update(sigma_rad_s=0.0), "sigma_rad_s"),
        (lambda d: _branch(d)["parameters"].update(sigma_rad_s=0.21), "forward"),
        (lambda d: _branch(d).update(compile_bound_nm=1e-9), "compile_bound_nm"),
        (lambda d: _branch(d).update(compile_bound_nm=1e-3), "compile_bound_nm"),
        (lambda d: _branch(d).update(friction_lower_nm=0.3), "friction_lower_nm"),
        (lambda d: _branch(d).update(secant_damping_nms_rad=1.0), "secant_damping_nms_rad"),
        (lambda d: _branch(d).update(slope_damping_nms_rad=0.0), "slope_damping_nms_rad"),
        (lambda d: _branch(d)["coefficients"][-2].__setitem__(3, 99.0), "forward"),
        (lambda d: _branch(d)["dual_coef"].__setitem__(0, _branch(d)["dual_coef"][0] + 1e-4), "forward"),
    ],
)
def test_a_forged_table_with_a_right_checksum_is_refused_by_key(rbf_path, change, named):
    with pytest.raises(ModelError, match=named):
        artefact.load(_forge(rbf_path, change))


def test_the_coarser_bound_of_an_older_proof_is_still_true(rbf_path):
    path = _forge(
        rbf_path, lambda d: _branch(d).update(compile_bound_nm=_branch(d)["compile_bound_nm"] * 1.004)
    )
    assert artefact.load(path).kind == "rbf"
