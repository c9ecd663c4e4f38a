"""Identification of a carriage: lengths, speeds and accelerations in proportion to its highest speed, files
in m and N.
"""

import json
from dataclasses import replace
from pathlib import Path

import identified
import numpy as np
import pytest
from in_process import run as run_command

from rtctl.errors import ConfigError
from rtctl.experiments import positioning_on_rig
from rtctl.identify.dataset_files import read_document
from rtctl.identify.motion import Motion
from rtctl.identify.settings import Settings, rig_of, settings_of
from rtctl.rig_file.config import load
from rtctl.simulation import friction_truth

CONFIGS = Path(__file__).parents[3] / "configs"
FREE = CONFIGS / "mock-linear-identify.toml"
FEW = {
    "train_levels": 4,
    "test_levels": 2,
    "measurements": 12,
    "spots": 4,
    "warm_up_s": 2.0,
    "lower_levels": 0,
}


def variant(folder, *replacements):
    return identified.variant(folder, *replacements, source=FREE)


def test_what_is_not_given_is_in_proportion_to_travel_and_limits():
    found = settings_of(load(FREE), {"axis": 0, "speed_max_rad_s": None, "margin_rad": None})
    assert found.speed_max_rad_s == 0.2  # .4 m in two seconds
    assert found.speed_min_rad_s == 0.2 / 400
    assert found.ramp_nm_s == 60.0 / 40
    assert found.margin_rad == pytest.approx(0.005)
    slower = settings_of(load(FREE), {"speed_max_rad_s": 0.1})
    assert slower.speed_min_rad_s == 0.1 / 400
    assert slower.margin_rad == pytest.approx(0.0025)


def test_the_velocity_limit_bounds_the_speed_of_a_long_travel(tmp_path):
    long = variant(tmp_path, ("position_max_m = 0.2", "position_max_m = 200.0"))
    assert settings_of(load(long), {}).speed_max_rad_s == pytest.approx(0.8 * 0.6)


def test_a_rotary_axis_keeps_its_defaults():
    loaded = load(identified.CONFIG)
    assert settings_of(loaded, {"speed_max_rad_s": None}) == Settings()
    assert rig_of(loaded, Settings()).radian == 1.0


def test_every_length_is_of_one_scale():
    """Half the speed halves every length and acceleration that is chosen in rad: times stay as they are."""
    motions = []
    for top in (0.2, 0.1):
        settings = settings_of(load(FREE), {"speed_max_rad_s": top})
        motion = Motion(rig_of(load(FREE), settings), settings)
        motion.low_rad, motion.high_rad = -top, top
        motions.append(motion)
    fast, slow = motions
    assert fast.rig.radian == pytest.approx(0.1)
    assert slow.rig.turn_rad == pytest.approx(0.5 * fast.rig.turn_rad)
    assert slow.acceleration_rad_s2 == pytest.approx(0.5 * fast.acceleration_rad_s2)
    assert slow.stopping_rad(0.1) == pytest.approx(0.5 * fast.stopping_rad(0.2))
    assert slow.jog_speed_rad_s() == pytest.approx(0.5 * fast.jog_speed_rad_s())
    assert fast.acceleration_rad_s2 == pytest.approx(1.0)


def test_the_ripple_of_a_screw_comes_once_a_turn_of_its_motor(tmp_path):
    def period_m(path, **given):
        settings = replace(settings_of(load(path), {}), **given)
        rig = rig_of(load(path), settings)
        return rig.turn_rad / rig.ripple_per_turn

    assert period_m(FREE) == pytest.approx(0.005)
    assert period_m(FREE, ripple_per_turn=2.0) == pytest.approx(0.0025)
    geared = variant(tmp_path, ("gear_ratio = 1.0 ", "gear_ratio = 5.0 "))
    assert period_m(geared) == pytest.approx(0.001)
    motor = load(variant(tmp_path, ("lead_m = 0.005", "lead_m = 0.0")))
    assert rig_of(motor, settings_of(motor, {})).ripple_per_turn == 0.0  # nothing known turns


def test_the_points_of_a_carriage_are_its_friction(tmp_path):
    loaded = load(FREE)
    settings = settings_of(loaded, FEW)
    kept = identified.run(FREE, settings)
    assert not kept.skipped
    points = [
        (one.target_rad_s and one.velocity_rad_s, one.friction_torque_nm, one.direction)
        for one in kept.points
    ]
    for one in friction_truth.of_points(loaded, 0, points):
        assert one.worst_share < 0.005
        # LuGre's break-away falls with the rate of the ramp: by 2.4 % here, .9 % at a third of this rate
        assert abs(one.break_away_share) < 0.04
    lengths = [one.presliding_rad for one in kept.points if one.presliding_rad]
    assert lengths == pytest.approx([8.0 / 60000.0] * 2, rel=0.05)


def test_a_scaled_carriage_gives_scaled_points(tmp_path):
    """The same carriage measured at a tenth of the speed: friction at equal speeds does not depend on the
    scale.
    """
    loaded = load(FREE)
    quick = identified.run(FREE, settings_of(loaded, {**FEW, "speed_min_rad_s": 0.02, "train_levels": 2}))
    slow = identified.run(FREE, settings_of(loaded, {**FEW, "speed_max_rad_s": 0.02, "train_levels": 2}))
    at = [
        np.mean([abs(one.friction_torque_nm) for one in kept.points if abs(one.target_rad_s) == 0.02])
        for kept in (quick, slow)
    ]
    assert at[0] == pytest.approx(at[1], rel=0.005)


def command(monkeypatch, capsys, out, *more):
    options = (*("--train", 4), *("--test", 2), *("--measurements", 6), *("--spots", 3))
    options += (*("--warm-up", 1), *("--lower", 0))
    return run_command(monkeypatch, capsys, "identify", FREE, "--simulate", "--out", out, *options, *more)


def test_every_file_and_sentence_is_in_m_and_n(monkeypatch, capsys, tmp_path):
    out = tmp_path / "set"
    code, text, _ = command(monkeypatch, capsys, out, "--sweep", 0.02)
    assert code == 0
    assert "F_c = 6 N," in text
    assert " mm, spread" in text
    for name in ("points_train", "points_test", "points_places", "points_sweep"):
        head = (out / f"{name}.csv").read_text().splitlines()[1]
        assert head.startswith("velocity_m_s,friction_torque_n,")
        assert "rad" not in head
    whole = (out / "dataset.json").read_text()
    assert "rad" not in whole
    assert "_nm" not in whole
    assert json.loads(whole)["points"][0]["target_m_s"] == 0.0
    assert "velocity_rad_s" in read_document(out)["points"][0]
    with np.load(out / "ticks" / "000_train_plus_breakaway.npz") as ticks:
        assert "position_m" in ticks.files
        assert "position_rad" not in ticks.files


def test_a_data_set_is_continued_and_told_in_json(monkeypatch, capsys, tmp_path):
    code, _, _ = command(monkeypatch, capsys, tmp_path / "set")
    assert code == 0
    code, text, err = command(monkeypatch, capsys, tmp_path / "set", "--resume", "--json")
    assert code == 0, err
    told = json.loads(text)
    assert told["motion"] == "linear"
    assert told["complete"]
    assert told["truth"][0]["dry_n"] == 6.0


def test_a_hand_on_the_carriage_is_told_in_newtons(monkeypatch, capsys, tmp_path):
    held = variant(tmp_path, ('kind = "none" ', 'kind = "sine"\nstiffness_n_m = 500.0\namplitude_m = 0.05 '))
    code, _, err = run_command(
        monkeypatch, capsys, "identify", held, "--simulate", "--out", tmp_path / "set", "--bias", 3
    )
    assert code != 0
    assert " N with the motor off, more than 1.2" in err


def test_speeds_beyond_the_limit_are_refused_in_metres():
    settings = settings_of(load(FREE), {"speed_max_rad_s": 0.5})
    with pytest.raises(ConfigError, match=r"0.5 m/s: .* velocity_limit_m_s = 0.6"):
        rig_of(load(FREE), settings)


def test_an_experiment_whose_references_are_angles_refuses_a_carriage():
    from rtctl.experiments.order import Order

    with pytest.raises(ConfigError, match="is linear"):
        positioning_on_rig.require(Order(load(FREE), simulate=False), [])


def test_a_rotary_axis_of_another_size_keeps_within_its_velocity_limit_and_its_ramp_takes_as_long(tmp_path):
    path = tmp_path / "slow.toml"
    text = (CONFIGS / "mock-identify.toml").read_text()
    for name, old, new in (("velocity_limit_rad_s", "6.0", "1.0"), ("torque_limit_nm", "2.0", "60.0")):
        assert text.count(f"\n{name} = {old}") == 1
        text = text.replace(f"\n{name} = {old}", f"\n{name} = {new}")
    path.write_text(text)
    found = settings_of(load(path), {})
    assert found.speed_max_rad_s == pytest.approx(0.8)
    assert found.speed_min_rad_s == pytest.approx(0.002)
    assert found.ramp_nm_s == pytest.approx(1.5)
    assert rig_of(load(path), found).torque_limit_nm == 60.0
    assert settings_of(load(path), {"ramp_nm_s": 0.3}).ramp_nm_s == 0.3
