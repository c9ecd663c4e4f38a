"""Every plant of the family is what its name says, runs under the law, and the law is told what is true of
it.
"""

from pathlib import Path

import numpy as np
import pytest

from rtctl.check import stability_report
from rtctl.errors import ConfigError
from rtctl.rig_file import config
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.family import FAMILY, merged, with_plant

MOCK = Path(__file__).parents[2] / "configs/mock.toml"


@pytest.fixture(scope="module")
def loaded():
    return config.load(MOCK)


def test_the_family_has_what_the_order_names():
    assert next(iter(FAMILY)) == "lugre"
    models = {plant.axis.get("friction", {}).get("model") for plant in FAMILY.values()}
    assert {"lugre", "elasto_plastic", "gms"} <= models
    for effect in ("elastic", "current_loop", "waves", "load", "drift"):
        assert any(effect in plant.axis for plant in FAMILY.values()), effect
    assert any("timing" in plant.device for plant in FAMILY.values())
    assert all(name == plant.name for name, plant in FAMILY.items())


def test_a_change_reaches_into_tables_and_leaves_the_rest():
    assert merged({"a": {"b": 1, "c": 2}, "d": None}, {"a": {"b": 3}, "d": {"e": 4}}) == {
        "a": {"b": 3, "c": 2},
        "d": {"e": 4},
    }


@pytest.mark.parametrize("name", FAMILY)
def test_a_plant_runs_two_seconds_armed_and_is_repeatable(loaded, name):
    ends = []
    for _ in range(2):
        simulation = Simulation(with_plant(loaded, name))
        simulation.arm()
        trace = simulation.run(2.0)
        assert np.all(trace["faults"] == 0)
        assert np.ptp(simulation.truth["position_rad"][:, 0]) > 0.1, "the hand moves it"
        ends.append(simulation.plant_state.tobytes())
    assert ends[0] == ends[1]


@pytest.mark.parametrize("name", FAMILY)
def test_what_the_law_is_told_is_true_of_the_plant(loaded, name):
    changed = with_plant(loaded, name)
    simulation = Simulation(changed)
    plant = simulation.plant_params[0]
    late = float(plant["transport_delay_ticks"] + plant["torque_delay_ticks"][0])
    assert simulation.params["follow_delay_ticks"][0, 0] >= late
    report = stability_report.examine(changed)
    assert report.ok, "its coupling is passive with all that the device declares"


def test_an_unknown_plant_and_a_rig_that_is_no_mock_are_refused_by_name(loaded):
    with pytest.raises(ConfigError, match="no plant 'rubber'; there are: lugre"):
        with_plant(loaded, "rubber")
    with pytest.raises(ConfigError, match="only a mock alone"):
        with_plant(config.load(MOCK.with_name("serial.toml")), "lugre")
