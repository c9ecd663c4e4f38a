"""`rtctl identify --log` of a recording of rtctl's own: its columns are known, and a linear axis is in m and
N.
"""

from pathlib import Path

import pytest

from rtctl.cli.columns import own_columns
from rtctl.cli.identify_log import _tables
from rtctl.errors import ConfigError
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"


@pytest.mark.parametrize(
    ("rig", "position", "torque"),
    [
        ("mock.toml", {"column": "position_rad.joint"}, {"column": "motor_torque_nm.joint"}),
        (
            "mock-linear.toml",
            {"column": "position_m.carriage", "unit": "m"},
            {"column": "motor_torque_n.carriage", "unit": "N"},
        ),
    ],
)
def test_columns_of_its_own_need_not_be_mapped(rig, position, torque):
    (axis,) = load(CONFIGS / rig).config.axis
    tables = _tables(Path(), own_columns(axis), None)
    assert tables["position"] == position
    assert tables["motor_torque"] == torque
    assert set(tables) == {"position", "motor_torque", "hand_torque"}


def test_a_unit_that_is_given_counts_and_other_logs_are_still_mapped(tmp_path):
    told = _tables(Path(), ("position=position_m.joint:mm", "torque=motor_torque_n.joint:N"), None)
    assert told["position"]["unit"] == "mm"
    assert "unit" not in _tables(Path(), ("position=x", "torque=y"), None)["position"]
    log = tmp_path / "a.csv"
    log.write_text("t,winkel,moment\n0,1,2\n1,2,3\n")
    with pytest.raises(ConfigError, match=r"map position and a torque(?s:.*)winkel, moment"):
        _tables(log, (), None)
