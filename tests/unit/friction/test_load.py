"""Friction that grows with load, and with temperature: found again from points, told where the points do not
say.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from rtctl.check import verdicts_of_load
from rtctl.check.verdict import Outcome, Verdict
from rtctl.cli.fit import command
from rtctl.errors import DataError
from rtctl.friction import artefact
from rtctl.friction.learn import beside_speed, unloaded
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.load_terms import NAMES, Rows, fit_terms, friction, slopes
from rtctl.friction.learn.report_beside_speed import body, sentences
from rtctl.friction.learn.report_evidence import gather
from rtctl.friction.learn.report_sentences import headline
from rtctl.friction.learn.warmth import Warmth, judge_temperature
from rtctl.friction.load import LOOP_MOST
from rtctl.friction.margins import friction_figures
from rtctl.friction.points import FrictionPoints
from rtctl.rig_file.config import load as load_config
from tests import loaded_gear

SHIPPED = Path(__file__).parents[3] / "configs" / "mock.toml"

_SERVO = {"coulomb_nm": 0.06, "viscous_nms_rad": 0.04, "stribeck_rad_s": 1.5, "stribeck_power": 1.2}
_SMALL = {"coulomb_nm": 0.004, "viscous_nms_rad": 0.005, "stribeck_rad_s": 2.5, "stribeck_power": 2.0}
_HARMONIC = {"coulomb_nm": 2.0, "viscous_nms_rad": 8.0, "stribeck_rad_s": 1.2, "stribeck_power": 2.5}
_PLANTS = {  # own numbers; largest weight N m, fastest speed rad/s, one value of each form
    "servo": (_SERVO, 3.0, 5.0, 0.10, 0.20),
    "small": (_SMALL, 0.3, 10.0, 0.12, 0.25),
    "harmonic": (_HARMONIC, 40.0, 3.5, 0.06, 0.15),
}


def plant(name: str, model: str) -> tuple[dict[str, float], float, float]:
    base, load_nm, fastest, low, high = _PLANTS[name]
    more = {"outside": low, "motor": low}
    if model != "m3":
        more |= {"stribeck_nm": 0.5 * base["coulomb_nm"], "outside_peak": high, "motor_peak": high}
    if model in ("m5", "m6"):
        more |= {"motor": 2 * low, "outside_peak": 0.5 * high}
    if model == "m6":
        more |= {"outside_square_per_nm": 0.1 / load_nm, "motor_square_per_nm": 0.15 / load_nm}
    return loaded_gear.as_told(base | more), load_nm, fastest


@pytest.mark.parametrize("model", ["m3", "m4", "m5", "m6"])
@pytest.mark.parametrize("name", list(_PLANTS))
def test_load_terms_are_found_again(name, model):
    values, load_nm, fastest = plant(name, model)
    made, truth = loaded_gear.points(values, load_nm, fastest, 1e-3 * load_nm, seed=1, speeds=10)
    rows, kept = beside_speed.rows_of(made)
    true = truth[kept]
    clean = Rows(rows.speed, true, rows.outside_nm, true - rows.outside_nm, rows.backward)
    rung = loaded_gear.RUNG_OF[model]
    found = fit_terms(rung, rows)
    wanted = loaded_gear.that_matter(values, load_nm, float(true.max()))
    assert len(wanted) >= 2
    for coefficient, value in wanted.items():
        assert found.value(coefficient) == pytest.approx(value, rel=0.1)
    error, plain = (
        np.sqrt(np.mean((one(clean) - true) ** 2)) for one in (found, fit_terms("coulomb_viscous", rows))
    )
    assert error <= 0.5 * plain


def test_the_slopes_by_which_a_form_is_fitted_are_its_derivatives():
    draw, n, step = np.random.default_rng(1), 200, 1e-6
    speed = np.abs(draw.normal(size=n)) * (np.arange(n) >= 5)
    rows = Rows(speed, *draw.normal(size=(3, n)), draw.random(n) < 0.5)
    values = np.array([0.3, 0.1, 0.2, 0.05, 0.07, 0.03, 0.02, 0.01, 0.04, 0.3, 1.3, 0.2, 0.6, 1.2])
    found = slopes(values, rows)
    for k, moved in enumerate(step * np.eye(len(values))):
        wanted = (friction(values + moved, rows) - friction(values - moved, rows)) / (2 * step)
        assert found[:, k] == pytest.approx(wanted, abs=1e-8), NAMES[k]


def test_held_out_points_choose_the_form():
    values, load_nm, fastest = plant("servo", "m3")
    made, _ = loaded_gear.points(values, load_nm, fastest, 1e-3 * load_nm, seed=2, speeds=5)
    verdict = beside_speed.judge_load(made, "speed")
    assert verdict.chosen.terms.rung == "load"
    assert verdict.less_share > 0.9
    said = sentences(verdict, Warmth(reason="x"))[0]
    assert "by the form load (outside 0.1 +- " in said
    assert "judged, not deployed" in said
    assert body(verdict, Warmth())["load"]["coefficients"]["outside"][0] == pytest.approx(0.1, rel=0.05)


@cache
def without_load():
    """Points of a servo that load does not change, and the verdict on it."""
    made, _ = loaded_gear.points(loaded_gear.as_told(_SERVO), 3.0, 5.0, 1e-3, seed=3, speeds=4)
    return made, beside_speed.judge_load(made, "speed")


def test_load_that_changes_nothing_is_told():
    _, verdict = without_load()
    assert verdict.chosen.terms.told == {}
    assert "friction does not depend on it: no form with load errs less" in sentences(verdict, Warmth())[0]


def test_points_that_do_not_span_load_say_so():
    values, _, fastest = plant("servo", "m3")
    made, _ = loaded_gear.points(values, 0.005, fastest, 1e-4, seed=4, speeds=5)
    assert "do not span it" in beside_speed.judge_load(made, "speed").reason
    without = replace(made, columns={})
    assert "no column load_nm" in beside_speed.judge_load(without, "speed").reason


def test_a_load_that_one_session_alone_has_is_not_judged_by_it():
    points, _ = loaded_gear.points(plant("servo", "m3")[0], 3.0, 5.0, 3e-3, seed=2, speeds=10)
    log = (np.arange(len(points.direction)) % 4 > 1).astype(float)
    load_nm = np.where(log == 0, points.columns["load_nm"], np.nan)
    one = replace(points, columns={**points.columns, "log": log, "load_nm": load_nm})
    with pytest.raises(DataError, match="are of one log alone"):
        beside_speed.judge_load(one, "speed")
    told, _ = beside_speed.judge(fit_points(points, rig="mock", c=100.0), one, "speed")
    assert "measure the load in every session" in told.reason


def test_the_motor_that_is_known_goes_before_the_one_computed():
    values, load_nm, fastest = plant("servo", "m3")
    made, _ = loaded_gear.points(values, load_nm, fastest, 0.0, seed=5, speeds=4)
    rows, kept = beside_speed.rows_of(made)
    np.testing.assert_allclose(rows.motor_nm, rows.friction_nm - rows.outside_nm)
    known = replace(made, columns={**made.columns, "motor_nm": np.full(len(made.direction), 0.3)})
    np.testing.assert_allclose(beside_speed.rows_of(known)[0].motor_nm, 0.3 * made.direction[kept])


@pytest.fixture(scope="module")
def learned_by_load(tmp_path_factory):
    """What `--by-load` makes of points of the servo under weights: once for all that only look at it."""
    return cache(lambda model="m4": by_load(tmp_path_factory.mktemp("by_load"), model))


def by_load(folder, model):
    """The plant's values, the command's exit, and the model that it writes."""
    values, load_nm, fastest = plant("servo", model)
    made, _ = loaded_gear.points(values, load_nm, fastest, 1e-3 * load_nm, seed=7, speeds=8)
    rows = zip(made.velocity_rad_s, made.direction * made.friction_nm, made.columns["load_nm"], strict=True)
    path, out = folder / "points.csv", folder / "model.json"
    lines = [f"{v:.6f},{f:.6f},{load:.6f}" for v, f, load in rows]
    path.write_text("\n".join(["velocity_rad_s,friction_torque_nm,load_nm", *lines]))
    told = CliRunner().invoke(
        command, [str(path), "--out", str(out), "--C", "10", "--by-load"], catch_exceptions=False
    )
    return values, told, out


def test_a_model_by_load_has_the_curve_without_load_and_the_coefficients(learned_by_load):
    values, told, out = learned_by_load()
    assert told.exit_code == 0, told.output
    assert "the law goes by it as friction.load_gain says" in told.output
    found = artefact.load(out)
    for name in ("outside", "motor", "outside_peak", "motor_peak"):
        assert getattr(found.load, name) == pytest.approx(values[name], rel=0.15)
    speed = np.array([0.2, 1.0, 3.0])
    fall = np.exp(-((speed / values["stribeck_rad_s"]) ** values["stribeck_power"]))
    true = values["coulomb_nm"] + fall * values["stribeck_nm"] + values["viscous_nms_rad"] * speed
    np.testing.assert_allclose(found.magnitude(speed), true, atol=0.02)
    assert 0 <= found.load.doubt_share < 0.2
    row = found.record()[0]
    assert row["load_motor"] == found.load.motor
    assert row["load_most_nm"] >= 3.0
    assert row["load_fall"][0] == 1.0
    judged = CliRunner().invoke(command, [str(out.parent / "points.csv"), "--judge", str(out)])
    assert judged.exit_code == 0, judged.output


def test_points_that_show_no_load_make_no_model_by_load(learned_by_load):
    made, verdict = without_load()
    with pytest.raises(DataError, match="does not depend on load; leave --by-load out"):
        unloaded.load_of(made, verdict)
    without = replace(made, columns={})
    with pytest.raises(DataError, match="no column load_nm"):
        unloaded.load_of(without, beside_speed.judge_load(without, "speed"))
    _, _, out = learned_by_load()
    with pytest.raises(DataError, match="the load of some points is unknown"):
        unloaded.without_load(without, artefact.load(out).load)


def judged_with(out, **friction):
    """Figures and rows of the shipped axis with this model."""
    axis = load_config(SHIPPED).config.axis[0]
    axis = axis.model_copy(update={"friction": axis.friction.model_copy(update=friction)})
    figures = friction_figures(artefact.load(out), out, axis, 1e-3, 1e-4)
    subject = SimpleNamespace(
        axis=SimpleNamespace(friction=figures, name="joint"), table=axis, where="f: axis[0]"
    )
    subject.row = lambda *row: Verdict("joint", *row)
    return figures, verdicts_of_load.load(subject)


def test_check_bounds_what_the_compensation_of_load_feeds_back(learned_by_load):
    _, told, out = learned_by_load("m5")
    assert told.exit_code == 0, told.output
    part = artefact.load(out).load
    off, none = judged_with(out, load_gain=0.0, gain=0.5)
    assert none == []
    assert (off.load_share, off.load_loop, off.load_most_nm) == (0.0, 0.0, 0.0)
    some, (row,) = judged_with(out, load_gain=0.4, gain=0.5)
    assert row.outcome == Outcome.PASS
    assert some.load_share == pytest.approx(0.4 * part.share(2.0))
    assert some.feedforward_max_nm > off.feedforward_max_nm
    assert some.gain_max < off.gain_max  # the coupling acts by so much more
    # friction is credited as without load
    assert some.secant_damping_nms_rad == pytest.approx(off.secant_damping_nms_rad)
    much, (row,) = judged_with(out, load_gain=1.0, gain=0.5)
    assert much.load_share > LOOP_MOST
    assert row.outcome == Outcome.FAIL
    bound = float(row.refusal.rsplit("up to ", 1)[1])
    assert judged_with(out, load_gain=bound, gain=0.5)[0].load_share == pytest.approx(LOOP_MOST, abs=2e-3)
    assert judged_with(out, load_gain=bound, gain=0.5)[1][0].outcome == Outcome.PASS


def test_load_that_is_not_surely_there_takes_damping(learned_by_load, tmp_path):
    _, _, out = learned_by_load()
    known = artefact.load(out)
    doubtful = replace(known, load=replace(known.load, doubt_share=0.8))
    artefact.save(doubtful, tmp_path / "model.json")
    sure, _ = judged_with(tmp_path / "model.json", load_gain=0.1, gain=0.5)
    wrong, _ = judged_with(tmp_path / "model.json", load_gain=0.4, gain=0.5)
    assert wrong.secant_damping_nms_rad < sure.secant_damping_nms_rad


def warm(per_k: float, span_k: float, *, by_speed: bool = False) -> FrictionPoints:
    """A Coulomb + viscous joint whose dry friction changes with temperature."""
    noise, rows, heat = np.random.default_rng(6), [], []
    for lap in range(4):
        for v in np.geomspace(0.05, 2, 12):
            for sign in (1, -1):
                celsius = 30 + span_k * (v / 2 if by_speed else lap / 3)
                f = 0.3 * (1 + per_k * (celsius - 30 - span_k / 2)) + 0.1 * v + noise.normal(0, 1e-3)
                rows.append((sign * v, f, sign, np.nan, np.nan))
                heat.append(celsius)
    return FrictionPoints.from_rows(rows, "made", "0" * 64, {"temperature_c": np.array(heat)})


def of_log(points: FrictionPoints) -> FrictionPoints:
    """The same as points of one log."""
    return replace(points, columns=points.columns | {"log": np.zeros(len(points.direction))})


def warmth(points: FrictionPoints) -> Warmth:
    return judge_temperature(fit_points(points, rig="mock", c=10.0), points)


def test_temperature_scales_friction_where_the_points_span_it():
    found = warmth(warm(-0.005, 20.0))
    assert found.dry_per_k[0] == pytest.approx(-0.005, abs=5e-4)
    assert abs(found.dry_per_k[0] + 0.005) < 4 * found.dry_per_k[1]
    assert "dry friction -0.5" in sentences(beside_speed.LoadVerdict(0.0, reason="x"), found)[1]


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        (warm(-0.005, 3.0), "temperature spans 3.0 K: the data do not span it"),
        (of_log(warm(-0.005, 3.0)), "of one that warms give the parts"),
        (warm(-0.005, 20.0, by_speed=True), "rises and falls with speed"),
        (replace(warm(0.0, 20.0), columns={}), "no column temperature_c"),
    ],
)
def test_points_that_do_not_tell_temperature_say_so(points, reason):
    assert reason in warmth(points).reason


def test_the_command_tells_load_and_temperature(tmp_path):
    values, load_nm, fastest = plant("servo", "m3")
    made, _ = loaded_gear.points(values, load_nm, fastest, 1e-3 * load_nm, seed=7, speeds=5)
    header = "velocity_rad_s,friction_torque_nm,load_nm,temperature_c"
    rows = zip(made.velocity_rad_s, made.direction * made.friction_nm, made.columns["load_nm"], strict=True)
    path = tmp_path / "points.csv"
    lines = (f"{v:.6f},{f:.6f},{load:.6f},{25 + v / 50:.3f}" for v, f, load in rows)
    path.write_text("\n".join([header, *lines]))
    asked = [str(path), "--out", str(tmp_path / "m.json"), "--C", "1", "--keep-outliers"]
    told = CliRunner().invoke(command, asked, catch_exceptions=False)
    assert told.exit_code == 0, told.output
    assert "Load: friction grows with it by the form load (outside 0.1 +- " in told.output
    assert "Temperature: temperature spans 0.2 K: the data do not span it" in told.output
    assert "95 % band, widest, mN m" in told.output


def test_the_report_says_what_the_points_do_not_span():
    points = warm(0.0, 3.0)
    said = headline(gather(points, fit_points(points, rig="mock", c=10.0), None))
    assert "Load: no column load_nm: nothing is known of load." in said
    assert any(
        one.startswith("Temperature: temperature spans 3.0 K: the data do not span it") for one in said
    )
