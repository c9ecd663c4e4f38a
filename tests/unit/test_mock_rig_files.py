"""Every rig file whose device is the mock loads, is provably passive, and runs; those of the family are its
plants.
"""

from pathlib import Path

import numpy as np
import pytest

from rtctl.check import stability_report
from rtctl.control.vocabulary import State
from rtctl.rig_file import config
from rtctl.simulation import friction_truth
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.family import FAMILY, with_plant

CONFIGS = Path(__file__).parents[2] / "configs"
FILES = sorted(path.name for path in CONFIGS.glob("mock*.toml"))

PLANTS = {
    "mock.toml": "lugre",
    "mock-gms.toml": "maxwell-slip",
    "mock-elasto-plastic.toml": "elasto-plastic",
    "mock-elastic.toml": "elasto-plastic-30hz",
    "mock-slow-drive.toml": "slow-drive",
    "mock-harmonic-drive.toml": "harmonic-drive",
    "mock-stiction.toml": "strong-stiction",
    "mock-load.toml": "load-dependent",
}
"""Rig files that show one plant of the family each."""

MOVED_RAD = dict.fromkeys(
    ("mock-identify.toml", "mock-linear-identify.toml", "mock-places-identify.toml"), -1.0
)
"""How far the joint must get in two seconds, where it is not .05 rad: nobody holds the rig that identifies
itself."""


@pytest.mark.parametrize("name", FILES)
def test_a_rig_file_is_passive_and_runs_two_seconds_armed(name):
    loaded = config.load(CONFIGS / name)
    assert stability_report.examine(loaded, telling=False).ok
    simulation = Simulation(loaded)
    simulation.arm()
    trace = simulation.run(2.0)
    assert np.all(trace["faults"] == 0)
    assert np.all(trace["state"] == State.ACTIVE)
    assert np.ptp(simulation.truth["position_rad"][:, 0]) > MOVED_RAD.get(name, 0.05)


@pytest.mark.parametrize("name", PLANTS)
def test_a_rig_file_of_the_family_is_that_plant(name):
    told, wanted = config.load(CONFIGS / name), with_plant(config.load(CONFIGS / "mock.toml"), PLANTS[name])
    assert told.options == wanted.options
    assert told.config.axis == wanted.config.axis


@pytest.mark.parametrize("name", FILES)
def test_friction_is_nowhere_below_what_the_controller_is_told_of_it(name):
    """Coulomb friction and the viscous friction stated, at every speed: the certificate stands on both."""
    loaded = config.load(CONFIGS / name)
    speed = np.linspace(1e-3, loaded.config.axis[0].velocity_limit_rad_s, 500)
    least = (
        loaded.options["axis"][0]["friction"]["coulomb_nm"] + loaded.config.axis[0].viscous_nms_rad * speed
    )
    for sign in (1, -1):
        assert (friction_truth.true_friction_nm(loaded, 0, sign * speed) >= least).all()


def test_the_shipped_joint_has_neither_one_peak_nor_linear_viscous_friction():
    friction = config.load(CONFIGS / "mock.toml").options["axis"][0]["friction"]
    assert 0.2 <= friction["second_share"] <= 0.8
    assert friction["second_rad_s"] > 3 * friction["stribeck_rad_s"]
    assert friction["thinning_nms_rad"] > 0.2 * friction["viscous_nms_rad"]


def test_every_effect_has_a_rig_file():
    shown = [config.load(CONFIGS / name).options for name in FILES]
    for effect in ("elastic", "current_loop", "waves", "load", "drift"):
        assert any(options["axis"][0][effect] for options in shown), effect
    assert any(options["timing"]["sample_every_ticks"] > 1 for options in shown)
    assert set(PLANTS.values()) <= set(FAMILY)
