"""The deviation from the simulated rig's own friction, against numbers worked out by hand."""

from pathlib import Path

import numpy as np
import pytest
from shipped_friction import BACKWARD, law_nm

from rtctl.friction import artefact
from rtctl.rig_file.config import load
from rtctl.simulation import friction_truth

CONFIGS = Path(__file__).parents[3] / "configs"
SPEEDS = np.geomspace(0.005, 2, 20)


def dry_nm(speed):
    """Dry part of the law in both directions: all of it but what rises with speed."""
    thin = (0.05 + 0.02 / (1 + (speed / 2.0) ** 2)) * speed
    return np.array([(law_nm(speed) - thin) * scale for scale in (1.0, BACKWARD)])


@pytest.fixture(scope="module")
def loaded():
    return load(CONFIGS / "mock-identify.toml")


def test_the_true_friction_is_the_rig_files_law(loaded):
    for direction in (1, -1):
        found = friction_truth.true_friction_nm(loaded, 0, direction * SPEEDS)
        np.testing.assert_allclose(found, law_nm(SPEEDS, direction), rtol=1e-12)


def test_errors_of_a_joint_with_hardly_any_dry_friction_are_shares_of_all_of_its_friction(loaded):
    viscous = {**loaded.options["axis"][0]["friction"], "coulomb_nm": 1e-6, "breakaway_nm": 1e-6,
        "thinning_nms_rad": 0.0, "viscous_nms_rad": 4.0}  # fmt: skip
    options = {**loaded.options, "axis": [{**loaded.options["axis"][0], "friction": viscous}]}
    points = [(speed, 1.01 * 4.0 * speed, 1) for speed in SPEEDS]
    (found,) = friction_truth.of_points(loaded.model_copy(update={"options": options}), 0, points)
    assert found.rms_share == pytest.approx(0.01, rel=0.01)
    assert "of the friction's RMS = " in str(found)


def test_of_a_joint_that_cannot_make_a_turn_it_is_the_mean_over_its_travel(loaded):
    # waves of 18 and 2 % of the dry friction, one in a turn, and a ripple of two turns of the joint
    waves = {"friction": [[0.18, 1.0, 0.4]], "ripple": [[0.01, 0.5, 0.0]]}
    low, high = 0.2, 1.4
    options = {**loaded.options, "axis": [{**loaded.options["axis"][0], "waves": waves, "ripple_nm": 0.0}]}
    axis = loaded.config.axis[0]

    def found(update):
        config = loaded.config.model_copy(update={"axis": (axis.model_copy(update=update),)})
        changed = loaded.model_copy(update={"options": options, "config": config})
        return [friction_truth.true_friction_nm(changed, 0, sign * SPEEDS) for sign in (1, -1)]

    dry = 1 + 0.18 * (np.cos(low + 0.4) - np.cos(high + 0.4)) / (high - low)
    dry += 0.02 * (np.cos(low) - np.cos(high)) / (high - low)
    ripple_nm = 0.02 * (np.cos(low / 2) - np.cos(high / 2)) / (high - low)
    wet = np.array([law_nm(SPEEDS, sign) for sign in (1, -1)]) - dry_nm(SPEEDS)
    expected = wet + dry * dry_nm(SPEEDS) - [[ripple_nm], [-ripple_nm]]
    assert dry > 1.15
    np.testing.assert_allclose(
        found({"position_min_rad": low, "position_max_rad": high}), expected, rtol=1e-5
    )
    turn = found({"position_min_rad": -3.2, "position_max_rad": 3.2})
    np.testing.assert_allclose(turn, [law_nm(SPEEDS, sign) for sign in (1, -1)], rtol=1e-12)


def test_points_that_are_off_by_a_known_amount_are_off_by_that_share_of_coulomb(loaded):
    rows = [(0.0, 0.35 + 0.005, 1), (0.0, -0.35 * 1.06, -1)]
    rows += [(v, law_nm(v, 1) + (0.0025 if i % 2 else -0.0025), 1) for i, v in enumerate(SPEEDS)]
    rows += [(-v, -law_nm(v, -1), -1) for v in SPEEDS]
    forward, backward = friction_truth.of_points(loaded, 0, rows)
    assert (forward.direction, forward.speeds, forward.dry_nm) == (1, 20, 0.25)
    assert forward.rms_share == pytest.approx(0.01)
    assert forward.worst_share == pytest.approx(0.01)
    assert forward.break_away_share == pytest.approx(0.02)
    assert backward.rms_share == pytest.approx(0.0, abs=1e-12)
    assert "RMS 1.00 % of F_c = 0.25 N m" in str(forward)


def test_a_direction_without_a_moving_point_is_left_out(loaded):
    assert friction_truth.of_points(loaded, 0, []) == ()
    assert [
        one.direction for one in friction_truth.of_points(loaded, 0, [(-1.0, -0.3, -1), (0.0, 0.35, 1)])
    ] == [-1]


def test_the_shipped_model_is_within_two_percent(loaded):
    for one in friction_truth.of_model(loaded, 0, artefact.load(CONFIGS / "friction" / "mock.json")):
        assert 0 < one.rms_share <= 0.02
        assert one.break_away_share is None


def test_only_the_mocks_friction_is_known(loaded):
    assert friction_truth.is_known(loaded)
    device = loaded.config.device[0].model_copy(update={"kind": "playback"})
    config = loaded.config.model_copy(update={"device": (device,)})
    assert not friction_truth.is_known(loaded.model_copy(update={"config": config}))


def test_friction_that_grows_with_the_motors_torque_is_that_of_the_torque_that_moves_the_joint():
    """The eRob 80 of the rig file: F = F_c + .048888 F + (F_s - F_c + 8.8e-6 F) s(v) + b v, no hand at the
    joint.
    """
    v = np.array([0.05, 1.0, 3.0])
    left = np.exp(-((v / 2.033) ** 2.9999))
    dry = 0.00048 + (5.2269 - 0.00048) * left + 9.709 * v
    expected = dry / (1 - 0.048888 - 8.8e-6 * left)
    found = friction_truth.true_friction_nm(load(CONFIGS / "mock-erob80.toml"), 0, v)
    assert found == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(("file", "name", "dry_nm"), [("mock-erob80", "F_s", 5.2269), ("mock", "F_c", 0.25)])
def test_errors_are_shares_of_the_friction_that_there_is(file, name, dry_nm):
    loaded = load(CONFIGS / f"{file}.toml")
    v = np.array([0.1, 0.5])
    true_nm = friction_truth.true_friction_nm(loaded, 0, v)
    (found,) = friction_truth.of_points(
        loaded, 0, [(speed, nm + 0.01, 1) for speed, nm in zip(v, true_nm, strict=True)]
    )
    assert (found.dry_name, found.dry_nm) == (name, dry_nm)
    assert found.rms_share == pytest.approx(0.01 / dry_nm)
    assert f"of {name} = {dry_nm:g} N m" in str(found)
