"""From nobody's hand to a person's: a joint of 18 % of modulation is identified by place, fitted, checked,
and helped with.
"""

from pathlib import Path

import numpy as np
import pytest

from rtctl.check import stability_report
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation
from tests.bench.drift_plants import moved
from tests.bench.learned_by_place import learned_by_place

CONFIGS = Path(__file__).parents[2] / "configs"
LEFT = {
    0.23: {"kind": "sine", "amplitude_rad": 0.3, "frequency_hz": 0.5},
    0.18: {"kind": "triangle", "amplitude_rad": 0.3, "speed_rad_s": 0.2},
}
"""Most that is left of the hand's torque in a motion."""


@pytest.mark.volume
def test_what_is_identified_by_place_passes_check_and_helps(tmp_path):
    rig = load(CONFIGS / "mock-places.toml")
    rig = learned_by_place(load(CONFIGS / "mock-places-identify.toml"), rig, tmp_path)
    assert stability_report.examine(rig, telling=False).ok
    for most, hand in LEFT.items():
        rms_nm = []
        for compensation in (0.0, 1.0):
            simulation = Simulation(moved(rig, hand))
            simulation.arm(compensation=compensation)
            simulation.run(3.0)
            rms_nm.append(float(np.sqrt(np.mean(simulation.run(24.0)["hand_torque_nm"] ** 2))))
        assert rms_nm[1] < most * rms_nm[0]
