"""Rows of `rtctl check` on the figures of a rig file: wrong units, declared delays, elastic joints,
encoders.
"""

import dataclasses
import json
from types import SimpleNamespace

import pytest
from checked_rig import edited, learned, rows_of, writer
from in_process import run

from hw import registry
from hw.interface import BackendError, Timing
from rtctl.check import verdicts_of_units
from rtctl.check.stability_report import examine
from rtctl.check.verdict import Outcome, Verdict, ranked
from rtctl.rig_file.config import load


@pytest.fixture(scope="module")
def model():
    return learned()


@pytest.fixture
def rig(tmp_path, model):
    return writer(tmp_path, model)


def test_a_current_that_the_device_cuts_off_is_told(rig):
    def row(amperes):
        path = edited(
            rig(), ('kind = "mock"', f'kind = "mock"\n[[device.options.axis]]\ncurrent_max_a = {amperes}')
        )
        return rows_of(path)["current that the device lets through"]

    needed_a = 2.0 / (80 * 0.0134)
    assert row(1.001 * needed_a).outcome is Outcome.PASS
    found = row(needed_a / 2)
    assert found.outcome is Outcome.WARN
    assert "which is 1 N m, and torque_limit_nm is 2" in found.refusal


@pytest.mark.parametrize(
    ("change", "name", "key"),
    [
        (("inertia_kgm2 = 0.012", "inertia_kgm2 = 120"), "acceleration at the torque limit", "inertia_kgm2"),
        (("0.0134", "13.4"), "current at the torque limit", "torque_constant_nm_a"),
        (("0.0134", "1.34e-5"), "current at the torque limit", "torque_constant_nm_a"),
        (("160000", "2000"), "steps of the encoder", "encoder_counts_per_rev"),
        (("torque_rate_nm_s = 200.0", "torque_rate_nm_s = 0.02"), "ticks to full torque", "torque_rate_nm_s"),
        (("viscous_nms_rad = 0.05", "viscous_nms_rad = 50.0"), "mechanical time constant", "viscous_nms_rad"),
        (("160000", "16"), "encoder counts over the travel", "encoder_counts_per_rev"),
        (
            ("gear_ratio", "position_min_rad = -9e3\nposition_max_rad = 9e3\ngear_ratio"),
            "travel from end to end",
            "position_max_rad",
        ),
        (("_rad_s = 2.0", "_rad_s = 0.002"), "time to the velocity limit", "velocity_limit_rad_s"),
        (("[0.0, 0.1, 0.0]", "[0.0, 0.0001, 0.0]"), "force at the handle at the torque limit", "lever_m"),
        (
            ("viscous_nms_rad = 0.05", "viscous_nms_rad = 0.05\ndry_friction_nm = 200.0"),
            "guaranteed dry friction over the torque limit",
            "dry_friction_nm",
        ),
    ],
)
def test_a_wrong_unit_is_refused_by_name_with_its_key(rig, monkeypatch, capsys, change, name, key):
    path = edited(rig(), change)
    row = rows_of(path)[name]
    assert row.outcome is Outcome.FAIL
    code, _, err = run(monkeypatch, capsys, "check", path)
    assert code == 5
    assert f"axis[0].{key}: axis joint:" in err


@pytest.mark.parametrize(
    ("change", "name", "key"),
    [
        (
            ("[axis.friction]", "[axis.friction]\npresliding_rad = 0.0802"),
            "presliding length",
            "friction.presliding_rad",
        ),
        (
            ("stiffness_nm_rad = 60.0", "stiffness_nm_rad = 1.047"),
            "coupling over the stiffest that passes",
            "coupling.stiffness_nm_rad",
        ),
        (("delay_ticks = 0", "delay_ticks = 0.001"), "stated delay", "coupling.delay_ticks"),
    ],
)
def test_degrees_and_seconds_that_no_proof_refuses_are_told_with_their_key(rig, change, name, key):
    assert rows_of(rig()).get(name) is None or rows_of(rig())[name].outcome is Outcome.PASS
    row = rows_of(edited(rig(), change))[name]
    assert row.outcome is Outcome.WARN
    assert f"axis[0].{key}: axis joint:" in row.refusal


def test_a_presliding_length_that_no_joint_has_is_refused(rig):
    path = edited(rig(), ("[axis.friction]", "[axis.friction]\npresliding_rad = 0.5"))
    assert rows_of(path)["presliding length"].outcome is Outcome.FAIL


def test_a_figure_that_few_rigs_have_is_told_and_passes(rig, monkeypatch, capsys):
    path = edited(rig(), ("viscous_nms_rad = 0.05", "viscous_nms_rad = 0.5"))
    assert rows_of(path)["mechanical time constant"].outcome is Outcome.WARN
    code, out, _ = run(monkeypatch, capsys, "check", path)
    assert code == 0
    assert "look again at: joint: mechanical time constant" in out


def test_more_viscous_friction_than_the_model_was_ever_taught_is_refused(rig):
    path = edited(rig(model="model.json", policy="off"), ("viscous_nms_rad = 0.05", "viscous_nms_rad = 0.3"))
    row = rows_of(path)["viscous_nms_rad against the model"]
    assert row.outcome is Outcome.FAIL
    assert "axis[0].viscous_nms_rad" in row.refusal


def test_what_no_test_can_say_of_a_figure_that_is_no_number_fails():
    band = verdicts_of_units.ACCELERATION
    assert band.outcome(float("nan")) is Outcome.FAIL
    assert band.outcome(1e4) is Outcome.PASS
    assert band.outcome(1.0) is Outcome.WARN
    rows = [
        Verdict("a", "fine", "", "", Outcome.PASS, "", 0.9),
        Verdict("a", "no number", "", "", Outcome.FAIL, "", float("nan")),
        Verdict("a", "bad", "", "", Outcome.FAIL, "", 3.0),
        Verdict("a", "open", "", "", Outcome.NOT_PROVED, "", 9.0),
        Verdict("a", "odd", "", "", Outcome.WARN, "", 99.0),
    ]
    assert [row.name for row in ranked(rows)] == ["fine", "odd", "open", "bad", "no number"]


@pytest.mark.parametrize(
    ("extra", "k_max"),
    [
        ("[device.options.axis]\ntorque_delay_ticks = 1", 37.48),  # declared by the device
        ("", 80.0),
    ],
)
def test_a_delay_that_a_device_declares_counts_though_the_rig_file_forgot_it(rig, extra, k_max):
    path = rig()
    path.write_text(
        path.read_text() + extra.replace("[device.options.axis]", "[[device.options.axis]]") + "\n"
    )
    (axis,) = examine(load(path)).axes
    assert axis.sampled_data_k_max_nm_rad == pytest.approx(k_max, abs=0.01)
    assert axis.ok == (k_max > 60)
    assert axis.delay_from == ("device[0] 'mock'" if extra else "rig file")


def test_the_worst_of_declared_configured_and_measured_counts(rig):
    more = "[axis.measured]\ndelay_ticks = {}\ncurrent_loop_hz = 400.0\nsample_ticks = 2\n[axis.environment]"
    for measured, delay, who in ((0.25, 0.5, "rig file"), (0.75, 0.75, "measured")):
        path = edited(rig(d=0.5, k_c=5.0), ("[axis.environment]", more.format(measured)))
        (axis,) = examine(load(path)).axes
        assert (axis.delay_ticks, axis.delay_from) == (delay, who)
        assert (axis.current_loop_hz, axis.lag_from) == (400.0, "measured")
        assert (axis.sample_ticks, axis.sample_from) == (2, "measured")
        assert "worlds that are not linear, behind the lag" in {row.name for row in axis.verdicts}


def test_only_the_damping_that_no_hand_can_cancel_counts_of_an_elastic_joint(rig):
    joint = "[axis.drive]\nmotor_share = 0.4\njoint_damping_nms_rad = 0.02\n[axis.environment]"
    (axis,) = examine(load(edited(rig(k_c=20.0), ("[axis.environment]", joint)))).axes
    link = 0.6 * 0.05
    assert axis.device_damping_nms_rad == pytest.approx(0.4 * 0.05 + link * 0.02 / (link + 0.02))
    assert axis.total_damping_nms_rad == 0.05
    stiff = edited(
        rig(k_c=60.0), ("[axis.environment]", "[axis.drive]\nmotor_share = 0.4\n[axis.environment]")
    )
    assert examine(load(stiff)).axes[0].sampled_data_k_max_nm_rad == pytest.approx(20.0)
    assert not examine(load(stiff)).ok


def test_an_encoder_behind_the_spring_is_named_as_not_proved(rig):
    path = edited(rig(), ("[axis.environment]", '[axis.drive]\nencoder = "link"\n[axis.environment]'))
    row = rows_of(path)["elastic joint, encoder at the link"]
    assert row.outcome is Outcome.NOT_PROVED
    assert examine(load(path)).ok


def test_steps_of_the_encoder_want_dry_friction_or_a_slow_shake(rig):
    def row(path):
        return rows_of(path)["steps of the encoder"]

    def held(friction_nm, *edits):
        return edited(rig(), ("torque_limit_nm", f"dry_friction_nm = {friction_nm}\ntorque_limit_nm"), *edits)

    assert row(rig(k_c=10.0)).outcome is Outcome.PASS
    assert row(rig()).outcome is Outcome.NOT_PROVED
    quiet = row(held(0.009))
    assert quiet.outcome is Outcome.PASS
    assert quiet.bound == "<= 1.5 counts"
    spring = row(held(0.0016))
    assert spring.outcome is Outcome.NOT_PROVED
    assert "bristles bend over 127 counts" in spring.meaning
    assert row(held(0.009, ("160000", "2000"))).outcome is Outcome.FAIL
    assert "at rest, 5 counts" in row(rig(k_c=200.0)).meaning, "as far as the shake is reckoned"
    assert "steps of the encoder" not in rows_of(rig(k_c=0.0, b_c=0.0))


def test_a_joint_that_friction_holds_shakes_no_further_than_its_bristles_bend(rig):
    held = ("torque_limit_nm", "dry_friction_nm = 0.0016\ntorque_limit_nm")
    short = ("[axis.friction]", "[axis.friction]\npresliding_rad = 1e-5")
    rows = rows_of(edited(rig(), held)), rows_of(edited(rig(), held, short))
    shaken = [row["steps of the encoder"] for row in rows]
    assert all(row.outcome is Outcome.NOT_PROVED for row in shaken), "a quarter of a count at 200 Hz is fast"
    assert "at rest, 1.3 counts" in shaken[0].meaning
    assert "at rest, 0.25 counts" in shaken[1].meaning


def test_a_handle_beyond_a_sensor_of_moments_is_as_stiff_a_hand_for_the_steps_of_the_encoder(rig):
    """The lever is the sensor's own, and may be nothing: the hand was as soft as that."""
    at_the_handle = rows_of(rig())["steps of the encoder"]
    turned = ("[0.0, 0.1, 0.0]", "[0.0, 0.01, 0.0]\naxis_direction = [1.0, 0.0, 0.0]")
    assert rows_of(edited(rig(), turned))["steps of the encoder"] == at_the_handle


def test_a_step_of_a_moment_makes_a_torque_though_the_axis_has_no_lever(rig, monkeypatch):
    from rtctl.check import stability_report, verdicts_of_admittance_steps

    asked = []
    monkeypatch.setattr(stability_report, "verdicts", lambda subject, **_: asked.append(subject) or [])
    turned = ("[0.0, 0.1, 0.0]", "[0.0, 0.1, 0.0]\naxis_direction = [1.0, 0.0, 0.0]")
    loaded = load(edited(rig(), turned))
    sensor = loaded.config.force_sensor.model_copy(update={"moments": True, "limit_nm": 4.0})
    config = loaded.config.model_copy(update={"force_sensor": sensor})
    examine(loaded.model_copy(update={"config": config}))
    assert asked[0].moment_step_nm == pytest.approx(0.04)
    shown = asked[0].table.admittance.model_copy(update={"mass_kgm2": 0.02, "velocity_gain_nms_rad": 2.0})

    def torque(lever_m, step_nm):
        table = asked[0].table.model_copy(update={"admittance": shown, "lever_m": lever_m})
        one = dataclasses.replace(asked[0], table=table, moment_step_nm=step_nm)
        return verdicts_of_admittance_steps.force_step_torque_nm(one)

    force_n = asked[0].table.force.limit_n * verdicts_of_admittance_steps.RESOLUTION_SHARE
    assert torque((0.0, 0.0, 0.0), force_n * 0.1) == pytest.approx(torque((0.0, 0.1, 0.0), 0.0))
    assert torque((0.0, 0.1, 0.0), 0.04) >= torque((0.0, 0.1, 0.0), 0.0) > 0.0


def test_a_stiffer_display_needs_more_friction_to_hold_a_flicker(rig):
    from rtctl.friction.guarantee import guarantee, holds_flicker

    axis = load(edited(rig(), ("torque_limit_nm", "dry_friction_nm = 0.009\ntorque_limit_nm"))).config.axis[0]
    sure = guarantee(axis, None)
    assert holds_flicker(axis, sure, 1.0)
    assert not holds_flicker(axis, sure, 0.5)
    stiff = axis.admittance.model_copy(update={"position_gain_nm_rad": 100.0})
    both = axis.model_copy(update={"admittance": stiff, "display_change": True})
    assert not holds_flicker(both, sure, 1.0)


def test_json_carries_the_rows_of_the_table(rig, monkeypatch, capsys):
    _, out, _ = run(monkeypatch, capsys, "check", rig(k_c=100.0), "--json")
    body = json.loads(out, parse_constant=pytest.fail)
    assert body["verdicts"][-1]["verdict"] == "FAIL"
    assert body["axes"][0]["verdicts"][-1] == body["verdicts"][-1]
    assert {"name", "figure", "bound", "verdict", "meaning"} <= set(body["verdicts"][0])


@pytest.mark.parametrize("given", [[Timing(float("nan"))], [Timing(-1.0)], [], ["soon"]])
def test_a_declaration_that_is_none_is_refused(monkeypatch, given):
    monkeypatch.setattr("hw.simulators.mock_declared.timing", lambda options, rig: given)
    with pytest.raises(BackendError, match="finite numbers"):
        registry.timing("mock", {}, SimpleNamespace(n_axes=1, period_s=1e-3))


def test_a_device_that_declares_nothing_is_named(rig, monkeypatch):
    info = registry.lookup("mock")
    monkeypatch.setitem(registry.BUILT_IN, "mock", dataclasses.replace(info, timing=None))
    registry.lookup.cache_clear()
    row = rows_of(rig())["delay of the devices"]
    stated = rows_of(rig(d=1, k_c=20.0)).get("delay of the devices")
    registry.lookup.cache_clear()
    assert row.outcome is Outcome.NOT_PROVED
    assert "device[0] 'mock'" in row.meaning
    assert stated is None


def test_a_torque_that_acts_later_than_the_law_remembers_is_not_proved(rig):
    name = "torque that acts late, remembered"
    file = edited(
        rig(k_c=1.0, d=20), ("[axis.coupling]", "[axis.drive]\ncurrent_loop_hz = 0\n[axis.coupling]")
    )
    assert name not in rows_of(file)
    row = rows_of(edited(file, ("current_loop_hz = 0", "current_loop_hz = 1000")))[name]
    assert row.outcome == Outcome.NOT_PROVED
    assert "loop.rate_hz = 992 at most" in row.meaning
    # by the lag alone, too
    file = edited(
        file, ("current_loop_hz = 1000", "current_loop_hz = 10"), ("delay_ticks = 20", "delay_ticks = 5")
    )
    assert "20.9 ticks" in rows_of(file)[name].figure
