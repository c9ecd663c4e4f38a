"""The deviation from the simulated rig's own friction, against numbers worked out by hand."""

from pathlib import Path

import numpy as np
import pytest
from shipped_friction import law_nm

from rtctl.config import load
from rtctl.friction import artefact, truth

CONFIGS = Path(__file__).parents[3] / "configs"
SPEEDS = np.geomspace(0.005, 2, 20)


@pytest.fixture(scope="module")
def loaded():
    return load(CONFIGS / "mock-identify.toml")


def test_the_true_friction_is_the_rig_files_law(loaded):
    for direction in (1, -1):
        found = truth.true_friction_nm(loaded, 0, direction * SPEEDS)
        np.testing.assert_allclose(found, law_nm(SPEEDS, direction), rtol=1e-12)


def test_points_that_are_off_by_a_known_amount_are_off_by_that_share_of_coulomb(loaded):
    rows = [(0.0, 0.35 + 0.005, 1), (0.0, -0.35 * 1.06, -1)]
    rows += [(v, law_nm(v, 1) + (0.0025 if i % 2 else -0.0025), 1) for i, v in enumerate(SPEEDS)]
    rows += [(-v, -law_nm(v, -1), -1) for v in SPEEDS]
    forward, backward = truth.of_points(loaded, 0, rows)
    assert (forward.direction, forward.speeds, forward.coulomb_nm) == (1, 20, 0.25)
    assert forward.rms_share == pytest.approx(0.01)
    assert forward.worst_share == pytest.approx(0.01)
    assert forward.break_away_share == pytest.approx(0.02)
    assert backward.rms_share == pytest.approx(0.0, abs=1e-12)
    assert "RMS 1.00 % of F_c = 0.25 N m" in str(forward)


def test_a_direction_without_a_moving_point_is_left_out(loaded):
    assert truth.of_points(loaded, 0, []) == ()
    assert [one.direction for one in truth.of_points(loaded, 0, [(-1.0, -0.3, -1), (0.0, 0.35, 1)])] == [-1]


def test_the_shipped_model_is_within_two_percent(loaded):
    for one in truth.of_model(loaded, 0, artefact.load(CONFIGS / "friction" / "mock.json")):
        assert 0 < one.rms_share <= 0.02
        assert one.break_away_share is None


def test_only_the_mocks_friction_is_known(loaded):
    assert truth.is_known(loaded)
    device = loaded.config.device[0].model_copy(update={"kind": "playback"})
    config = loaded.config.model_copy(update={"device": (device,)})
    assert not truth.is_known(loaded.model_copy(update={"config": config}))
