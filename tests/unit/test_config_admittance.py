"""Rig files of an admittance display: what it needs is asked for by name."""

import pytest

from rtctl.errors import ConfigError
from rtctl.rig_file.config import load

RIG = """
schema = 1
[rig]
name = "bench"
absent = {absent}
[loop]
rate_hz = 1000
[[axis]]
name = "joint"
display = "{display}"
inertia_kgm2 = 0.012
viscous_nms_rad = 0.05
encoder_counts_per_rev = 160000
torque_constant_nm_a = 0.02
lever_m = [0.0, 0.1, 0.0]
torque_limit_nm = 1.0
torque_rate_nm_s = 200
velocity_limit_rad_s = 10
[axis.admittance]
{table}
[axis.force_feedback]
gain = {feedback}
[[device]]
kind = "mock"
"""
TABLE = ("mass_kgm2 = 0.02", "damping_nms_rad = 0.05", "velocity_gain_nms_rad = 2.0")


@pytest.fixture
def rig(tmp_path):
    def _load(table=TABLE, display="admittance", absent="[]", feedback=0.0):
        path = tmp_path / "rig.toml"
        path.write_text(RIG.format(table="\n".join(table), display=display, absent=absent, feedback=feedback))
        return load(path).config

    return _load


def test_an_axis_is_an_impedance_unless_it_says_otherwise(rig):
    assert rig(display="impedance").axis[0].display == "impedance"
    assert rig().axis[0].display == "admittance"
    assert rig().axis[0].admittance.position_gain_nm_rad == 0.0


def fault(rig, **changed):
    """The one fault that this file has."""
    with pytest.raises(ConfigError) as caught:
        rig(**changed)
    (line,) = caught.value.faults
    return line


@pytest.mark.parametrize("missing", range(3))
def test_mass_damping_and_gain_have_no_default_that_is_safe(rig, missing):
    key = TABLE[missing].split()[0]
    told = fault(rig, table=[line for k, line in enumerate(TABLE) if k != missing])
    assert f"admittance.{key} 0.0" in told
    assert "above 0" in told
    rig(table=(), display="impedance")


def test_without_a_force_sensor_it_is_refused_with_a_remedy(rig):
    told = fault(rig, absent='["force"]')
    assert 'axis joint: display = "admittance" needs the force sensor' in told
    assert 'display = "impedance"' in told


def test_force_feedback_on_top_of_it_is_refused(rig):
    assert "set gain = 0" in fault(rig, feedback=0.5)


def test_numbers_have_bounds(rig):
    assert "hand_stiffness_nm_rad" in fault(rig, table=[*TABLE, "hand_stiffness_nm_rad = -1"])
    assert "mass_kgm2" in fault(rig, table=["mass_kgm2 = nan", *TABLE[1:]])
