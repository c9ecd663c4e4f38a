"""True friction of a simulated rig: what its own measurements are held against."""

from pathlib import Path

import numpy as np
import pytest

from rtctl.friction import truth
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"


def test_friction_that_grows_with_the_motors_torque_is_that_of_the_torque_that_moves_the_joint():
    """The eRob 80 of the rig file: F = F_c + .048888 F + (F_s - F_c + 8.8e-6 F) s(v) + b v, no hand at the joint."""
    v = np.array([0.05, 1.0, 3.0])
    left = np.exp(-((v / 2.033) ** 2.9999))
    dry = 0.00048 + (5.2269 - 0.00048) * left + 9.709 * v
    expected = dry / (1 - 0.048888 - 8.8e-6 * left)
    found = truth.true_friction_nm(load(CONFIGS / "mock-erob80.toml"), 0, v)
    assert found == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(("file", "name", "dry_nm"), [("mock-erob80", "F_s", 5.2269), ("mock", "F_c", 0.25)])
def test_errors_are_shares_of_the_friction_that_there_is(file, name, dry_nm):
    loaded = load(CONFIGS / f"{file}.toml")
    v = np.array([0.1, 0.5])
    true_nm = truth.true_friction_nm(loaded, 0, v)
    (found,) = truth.of_points(
        loaded, 0, [(speed, nm + 0.01, 1) for speed, nm in zip(v, true_nm, strict=True)]
    )
    assert (found.dry_name, found.dry_nm) == (name, dry_nm)
    assert found.rms_share == pytest.approx(0.01 / dry_nm)
    assert f"of {name} = {dry_nm:g} N m" in str(found)
