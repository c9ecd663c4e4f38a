"""Units of a board's numbers on a linear axis: those of its screw and of its travel, or a refusal."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hardware import rig

from hw.can import board_map
from hw.interface import BackendError
from hw.serial import described_plan

LEAD_M = 5e-3
SCREW, MOTOR = (replace(rig(), lead_m=np.full(1, lead_m)) for lead_m in (LEAD_M, 0.0))
SPELT = {"rev": "turn", "rev/s": "turn/s", "N m": "Nm", "mN m": "mNm"}
"""Units of described boards -> the same in a field map of a CAN board."""


def both(channel, unit, of_rig):
    """SI units per unit, as boards on a serial port and on a CAN bus have it."""
    field = {"channel": channel, "unit": unit, "axis": 0}
    found = described_plan.unit_of(field, of_rig)
    assert board_map.factor({**field, "unit": SPELT.get(unit, unit)}, of_rig) == found
    return found


@pytest.mark.parametrize(
    ("channel", "unit", "si"),
    [
        ("position", "rev", LEAD_M),
        ("position", "rad", LEAD_M / (2 * math.pi)),
        ("position", "mm", 1e-3),
        ("velocity", "rpm", LEAD_M / 60),
        ("velocity", "mm/s", 1e-3),
        ("torque", "mN m", 1e-3 * 2 * math.pi / LEAD_M),
        ("torque", "kN", 1e3),
        ("current", "mA", 1e-3),
        ("current_command", "A", 1.0),
        ("force", "N", 1.0),
    ],
)
def test_a_turn_of_a_screw_is_its_lead_and_a_torque_on_it_pulls_by_it(channel, unit, si):
    assert both(channel, unit, SCREW) == pytest.approx(si, rel=1e-12)


@pytest.mark.parametrize(
    ("of_rig", "channel", "unit"),
    [
        (MOTOR, "position", "rad"),
        (MOTOR, "velocity", "rpm"),
        (MOTOR, "torque", "N m"),
        (rig(), "position", "mm"),
        (rig(), "torque", "N"),
    ],
)
def test_a_unit_that_the_axis_does_not_have_is_refused(of_rig, channel, unit):
    field = {"channel": channel, "unit": unit, "axis": 0}
    for found in (described_plan.unit_of, board_map.factor):
        spelt = SPELT.get(unit, unit) if found is board_map.factor else unit
        with pytest.raises(BackendError, match=f"{channel}: unit '{spelt}', which axis 0 does not have"):
            found({**field, "unit": spelt}, of_rig)
