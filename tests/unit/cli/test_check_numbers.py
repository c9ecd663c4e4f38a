"""Rows of `rtctl check` on what the numbers of encoder, drive and force sensor come to."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from checked_rig import DEFAULTS, RIG, edited, rows_of

from hw import registry
from hw.interface import BackendError, Rig, Shown
from rtctl.check.verdict import Outcome

CONFIGS = Path(__file__).parents[3] / "configs"
FACTS = Rig(1, 1e-3, *(np.array([x]) for x in (80.0, 0.72, 0.0134, 160000.0)), np.array([[0.0, 0.1, 0.0]]))
FORCE = "[axis.force]\nlimit_n = {}\n[axis.coupling]"


@pytest.fixture
def rig(tmp_path):
    def write():
        path = tmp_path / "rig.toml"
        path.write_text(RIG.format(**DEFAULTS))
        return path

    return write


@pytest.mark.parametrize(
    ("change", "name", "key"),
    [
        (("160000", "4096"), "encoder counts of a motor's turn", "encoder_counts_per_rev"),
        # a tenth and a quarter of them are too few, and in themselves no motor's
        (("160000", "16000"), "encoder counts of a motor's turn", "encoder_counts_per_rev"),
        (("160000", "163860"), "encoder counts of a motor's turn", "encoder_counts_per_rev"),
        (
            ("gear_ratio", "position_min_rad = -60.0\nposition_max_rad = 60.0\ngear_ratio"),
            "travel from end to end",
            "position_max_rad",
        ),
        (
            ("stiffness_nm_rad = 40.0", "stiffness_nm_rad = 40.0\ncenter_rad = 11.5"),
            "center_rad of the world over the travel",
            "environment.center_rad",
        ),
        (
            ("[axis.coupling]", FORCE.format(5.1)),
            "range of the force sensor over the motor's force",
            "force.limit_n",
        ),
        (
            ("[axis.coupling]", FORCE.format(1e4)),
            "range of the force sensor over the motor's force",
            "force.limit_n",
        ),
    ],
)
def test_a_number_that_few_rigs_have_is_told_with_its_key(rig, change, name, key):
    before = rows_of(rig()).get(name)
    assert before is None or before.outcome is Outcome.PASS
    row = rows_of(edited(rig(), change))[name]
    assert row.outcome is Outcome.WARN
    assert f"axis[0].{key}:" in row.refusal


@pytest.mark.parametrize(
    "change",
    [
        ("gear_ratio = 80.0", "gear_ratio = 80.004"),  # as a data sheet rounds it
        ("gear_ratio = 80.0", "gear_ratio = 1.0"),
        ("[axis.environment]", '[axis.drive]\nencoder = "link"\n[axis.environment]'),
    ],
)
def test_counts_that_may_be_right_are_not_told(rig, change):
    row = rows_of(edited(rig(), change)).get("encoder counts of a motor's turn")
    assert row is None or row.outcome is Outcome.PASS


def shipped(tmp_path, name, *changes):
    path = tmp_path / name
    path.write_text((CONFIGS / name).read_text())
    return rows_of(edited(path, *changes))


@pytest.mark.parametrize(
    ("name", "change", "outcome"),
    [
        ("can-cia402.toml", ("5242880", "160000"), Outcome.WARN),
        ("can-cia402.toml", ("65536.0", "4096.0"), Outcome.FAIL),
        ("can-cia402.toml", ("65536.0", "65536.0"), Outcome.PASS),
        ("can-mit.toml", ("16470", "47000"), Outcome.WARN),
    ],
)
def test_counts_are_held_against_those_of_the_drive(tmp_path, name, change, outcome):
    row = shipped(tmp_path, name, change)["step of the device over an encoder count"]
    assert row.outcome is outcome
    assert outcome is Outcome.PASS or "axis[0].encoder_counts_per_rev: axis joint:" in row.refusal


def test_digits_beyond_the_encoder_are_no_counts(tmp_path):
    """A board tells its angle in millionths of a degree."""
    assert "step of the device over an encoder count" not in shipped(tmp_path, "serial-vesc.toml")


@pytest.mark.parametrize(
    ("change", "name"),
    [
        # of N m for N, of a kilogram, of a millinewton
        (("scale = 0.005", "scale = 0.0005"), "range of the force sensor over what its numbers show"),
        (("scale = 0.005", "scale = 5.0"), "steps of the force within its range"),
    ],
)
def test_a_force_in_another_unit_is_told_by_its_numbers(tmp_path, change, name):
    assert shipped(tmp_path, "can-optoforce.toml")[name].outcome is Outcome.PASS
    row = shipped(tmp_path, "can-optoforce.toml", change)[name]
    assert row.outcome is Outcome.WARN
    assert "axis[0].force.limit_n:" in row.refusal


@pytest.mark.parametrize(
    ("key", "old", "new"),
    [("intent_nm", "0.05", "50"), ("gate_nm", "0.03", "30"), ("gate_nm", "0.03", "3e-5")],
)
def test_pushes_in_another_unit_are_told(tmp_path, key, old, new):
    name = f"{key} over the help"
    old_line, model = f"{key} = {old}", ("friction/mock.json", str(CONFIGS / "friction/mock.json"))
    assert shipped(tmp_path, "mock.toml", model)[name].outcome is Outcome.PASS
    row = shipped(tmp_path, "mock.toml", model, (old_line, f"{key} = {new}"))[name]
    assert row.outcome is Outcome.WARN
    assert f"axis[0].friction.{key}: axis joint:" in row.refusal


def test_a_world_is_held_against_the_ends_where_they_are_given(tmp_path):
    name, center = "center_rad of the world over the travel", ("center_rad = 0.2", "center_rad = 1.2")
    model = ("friction/mock.json", str(CONFIGS / "friction/mock.json"))
    rows = shipped(tmp_path, "mock-wall.toml", model, center)
    assert rows[name].outcome is Outcome.PASS
    ends = ("gear_ratio", "position_min_rad = -0.5\nposition_max_rad = 1.0\ngear_ratio")
    assert shipped(tmp_path, "mock-wall.toml", model, center, ends)[name].outcome is Outcome.WARN


def test_a_matrix_with_a_unit_in_it_is_told(tmp_path):
    name, file = "force shown for a newton of the sensor", "drive-and-force-sensor.toml"
    old = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"
    turned = "[[0, 0, -1], [0, 1, 0], [1, 0.02, 0]]"
    assert shipped(tmp_path, file, (old, turned))[name].outcome is Outcome.PASS
    scaled = "[[0.102, 0, 0], [0, 0.102, 0], [0, 0, 0.102]]"
    row = shipped(tmp_path, file, (old, scaled))[name]
    assert row.outcome is Outcome.WARN
    assert "options.matrix" in row.refusal


def test_the_numbers_of_force_sensors():
    one = ((2.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    found = registry.shown("optoforce", {"matrix": one, "counts_per_n": (100.0, 50.0, 100.0)}, FACTS)
    assert found == Shown((), False, (), 2 / 50, 2 * 32767 / 100, 2.0)
    found = registry.shown("rdt", {"matrix": one[1:], "counts_per_n": 1e6}, FACTS)
    assert found.force_most_n == pytest.approx(2147.483647)
    assert registry.shown("rokubi", {"matrix": one}, FACTS) == Shown(force_gain=2.0)
    assert registry.shown("odrive", {}, FACTS) == Shown()


def test_a_pulse_that_is_less_than_a_step_of_the_current_is_told_with_the_budget_that_does(tmp_path):
    """A strong arm with the budget of a knob was refused by its own test: CURRENT, and WIRING."""
    name = "test pulse of arming in steps of the current"

    def row(budget_j, step_a):
        edits = ("[[device]]", f"[passivity]\nbudget_j = {budget_j}\n[[device]]")
        options = f'kind = "mock"\n[[device.options.axis]]\ncurrent_resolution_a = {step_a}'
        path = tmp_path / "rig.toml"
        path.write_text(RIG.format(**DEFAULTS))
        return rows_of(edited(path, edits, ('kind = "mock"', options)))[name]

    # no more than a joint without friction may move by: .072 N m, .093 A
    assert row(0.02, 0.05).outcome is Outcome.PASS
    few = row(0.0001, 0.05)
    assert few.outcome is Outcome.WARN
    budget_j = float(few.refusal.partition("budget_j = ")[2].split()[0])
    assert 0.0001 < budget_j <= 0.02
    assert row(budget_j, 0.05).outcome is Outcome.PASS
    assert row(0.97 * budget_j, 0.05).outcome is Outcome.WARN
    assert "a current of finer steps" in row(0.02, 0.1).refusal


def test_unsigned_numbers_end_where_they_are_short_of_a_sign():
    field = {"channel": "force", "type": "u16", "scale": 0.1, "zero": 1000.0, "unit": "N", "axis": 0}
    position = {"channel": "position", "type": "i32", "scale": -2.0, "zero": 0.0, "unit": "counts", "axis": 0}
    real = {**field, "type": "f32"}
    current = {**position, "channel": "current", "scale": 2.0, "unit": "mA"}
    found = registry.shown("serial-described", {"sample": {"field": [field, position, real, current]}}, FACTS)
    assert found.current_step_a == (0.002,)
    assert found.force_most_n == pytest.approx(100.0)
    assert found.force_step_n == pytest.approx(0.1)
    assert found.step_rad == pytest.approx((2 * 2 * math.pi / 160000,))


@pytest.mark.parametrize(
    "given",
    [
        Shown((math.nan,)),
        Shown((1.0, 1.0)),
        Shown(force_step_n=-1.0),
        None,
        Shown(force_gain=math.inf),
        Shown(current_step_a=(math.nan,)),
    ],
)
def test_a_declaration_that_is_none_is_refused(monkeypatch, given):
    monkeypatch.setattr("hw.force.declared.rokubi_shown", lambda options, rig: given)
    with pytest.raises(BackendError, match="finite numbers"):
        registry.shown("rokubi", {}, SimpleNamespace(n_axes=1))
