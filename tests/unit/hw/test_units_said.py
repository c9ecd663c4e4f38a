"""A unit that the file says itself, against the one it is read in."""

import pytest

from hw.interface import BackendError
from hw.playback.units import require_unit, said_unit


@pytest.mark.parametrize(
    ("name", "row", "unit"),
    [
        ("angle", "deg", "deg"),
        ("angle", "[\u00b0]", "deg"),
        ("angle [deg]", "", "deg"),
        ("tau (mN m)", "", "mN m"),
        ("tau", "Nm", "N m"),
        ("torque_mnm", "", "mN m"),
        ("neg_torque_human_nm", "", "N m"),
        ("time", "msec", "ms"),
        ("speed", "1/min", "rpm"),
        ("load", "%", "%"),
        ("plain", "", ""),
        ("velocity_rad_s", "", "rad/s"),
        ("pos_a", "", ""),
        ("Gelenkwinkel in Grad", "", "deg"),
        ("Drehmoment in mNm", "", "mN m"),
        ("Strom in A", "", "A"),
        ("M/Nm", "", "N m"),
        ("phi / \u00b0", "", "deg"),
        ("n / (U/min)", "", "rpm"),
        ("angle, deg", "", "deg"),
        ("CH1", "V", "V"),
        ("/joint/position", "", ""),
        ("counts/s", "", ""),
        ("built in Rome", "", ""),
        ("M", "[Ncm]", "N cm"),
        ("tau_ncm", "", "N cm"),
        ("M [oz-in]", "", "oz in"),
        ("trq_lbf-in", "", "lb in"),
        ("trq_oz_in", "", "oz in"),
        ("force_lbf", "", "lbf"),
        ("load (kgf.cm)", "", "kg cm"),
        ("Torque", "Pound-inches", "lb in"),
        ("Torque", "in lbf", "lb in"),
        ("Torque", "Newton metres", "N m"),
        ("Position", "Revolutions", "rev"),
        ("Torque [per mille]", "", "\u2030"),
        ("Torque [% of rated torque]", "", "%"),
        ("Current [A RMS]", "", "A"),
        ("torque_in", "", ""),
        ("x_um", "", "um"),
        ("torque (Nmm)", "", "mN m"),
        ("x", "\u00b5m", "um"),
        ("force_kN", "", "kN"),
        ("Load [kgf]", "", "kgf"),
        ("F [daN]", "", "daN"),
        ("stroke (cm)", "", "cm"),
        ("p_A [bar]", "", "bar"),
        ("Angle (degrés)", "", "deg"),
        ("Angolo", "gradi", "deg"),
        ("トルク [mN・m]", "", "mN m"),
        ("位置（毫米）", "", "mm"),
        ("力（牛）", "", "N"),
        ("Момент [Н·м]", "", "N m"),
    ],
)
def test_units_are_understood_however_they_are_spelt(name, row, unit):
    assert said_unit(name, row) == unit


@pytest.mark.parametrize(
    ("column", "row", "units", "said"),
    [
        ({"column": "angle"}, "deg", ("rad", "deg"),
            "'angle' is read in rad, the file says deg; give the unit deg"),
        ({"column": "angle_deg"}, "", ("rad", "deg"), "the file says deg"),
        ({"column": "t"}, "ms", ("s", "ms"), "read in s, the file says ms"),
        ({"column": "m", "unit": "mN m", "scale": -1.0}, "Nm", ("N m", "mN m", "Nm"),
            "read in mN m, the file says N m"),
        ({"column": "i"}, "A", ("N m", "mN m"),
            "read in N m, the file says A, which is another quantity; .*torque constant"),
        ({"column": "M [lbf-in]"}, "", ("N m", "mN m"),
            "the file says lb in, which needs a scale: give 0.1129848 N m .:N m:0.1129848 behind"),
        ({"column": "CH2"}, "V", ("N m", "mN m"),
            "read in N m, the file says V, which is another quantity; .*give the scale"),
        ({"column": "force_lbf", "unit": "N"}, "", ("N m", "N"), "says lbf, which needs a scale: give 4.448"),
        ({"column": "pos_in", "unit": "mm"}, "", ("rad", "mm"), "file says in, .*give 25.4 mm"),
        ({"column": "Load [kgf]", "unit": "N"}, "", ("N m", "N"), "says kgf, .*give 9.80665 N"),
        ({"column": "dp [bar]", "unit": "N"}, "", ("N m", "N"), "says bar, which is another quantity"),
        ({"column": "x_um", "unit": "mm"}, "", ("rad", "mm", "um"), "the file says um; give the unit um"),
        ({"column": "Current (0.01A)", "unit": "A"}, "", ("A", "mA"), "says 0.01A, .*:A:0.01 behind"),
        ({"column": "Torque [per mille]"}, "", ("N m",), "says \u2030, which is another .*rated torque"),
        ({"column": "Last in kg"}, "", ("N m", "N"), "the file says kg"),
        ({"column": "T [K]", "unit": "degC"}, "", ("degC",), "the file says K"),
        ({"column": "temp", "unit": "degC"}, "\u00b0F", ("degC",), "the file says degF.*offset"),
        ({"column": "velocity_rad_s"}, "", ("rad", "deg"),
            "the file says rad/s, which is another quantity; map another"),
    ],
)  # fmt: skip
def test_a_unit_that_contradicts_the_file_is_refused(tmp_path, column, row, units, said):
    with pytest.raises(BackendError, match=said):
        require_unit(tmp_path, column["column"], row, column, units)


@pytest.mark.parametrize(
    ("column", "row", "units"),
    [
        ({"column": "angle", "unit": "deg"}, "deg", ("rad", "deg")),
        ({"column": "m", "unit": "Nm"}, "N m", ("N m", "mN m", "Nm")),
        ({"column": "load", "scale": 0.01}, "%", ("N m",)),
        ({"column": "angle", "scale": 0.0174533}, "deg", ("rad", "deg")),
        ({"column": "free"}, "whatever", ("rad",)),
        ({"column": "i", "scale": 0.77}, "A", ("N m",)),
        ({"column": "T [K]", "unit": "degC", "offset": 273.15}, "", ("degC",)),
        ({"column": "T", "unit": "degC"}, "\u00b0C", ("degC",)),
    ],
)
def test_what_agrees_or_is_scaled_on_purpose_is_taken(tmp_path, column, row, units):
    require_unit(tmp_path, column["column"], row, column, units)
