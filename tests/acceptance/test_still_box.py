"""Hands that hold still, and hands at work: nothing is felt of the help with friction, and nothing is alarmed
by it.
"""

import numpy as np
import pytest
from amounts import WHOLE, asked_often

from hw.simulators.mock_records import Hand
from rtctl.control.vocabulary import Environment, State
from rtctl.rig_file import config
from rtctl.simulation import campaign_still
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.family import FAMILY, with_plant
from rtctl.simulation.shipped_files import shipped_config

ASKED = {1: (1000, 20), 2: (300, 1)} if WHOLE else {1: (200, 10)}
"""Hands that hold still, the product's first promise: seed -> how many, and how many of them hold one gear
behind one force sensor, so that an observer is tuned once for them all. In `make test` on twenty gears; as
volume on fifty, and on three hundred. `rtctl campaign --still` takes as many as one likes."""

SECONDS = 12.0
"""Of each plant in each world; `slow`: so long that all of them make ten hours."""
SLOW_SECONDS = 36_000 / (len(FAMILY) * 4)

WORLDS = {
    "free sine": {},
    "free triangle": {},
    "spring": {"environment_kind": int(Environment.SPRING), "environment_stiffness_nm_rad": 10.0},
    "wall": {"environment_kind": int(Environment.WALL), "environment_stiffness_nm_rad": 100.0},
}


@asked_often
@pytest.mark.compiled
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("seed", ASKED)
def test_of_many_hands_that_hold_still_none_feels_anything_of_the_default_policy(seed):
    cases, hands = ASKED[seed]
    found = campaign_still.run(campaign_still.Order(seed, cases, policies=("hybrid",), hands=hands))
    assert not found.loud
    assert found.cases == cases
    assert found.own <= cases / 100, "joints that ring by themselves are the exception"
    assert 0 < found.worst_rad_s <= campaign_still.OWN_RING * campaign_still.QUIET_RAD_S
    assert found.most_fed_j <= campaign_still.FED_J


@asked_often
@pytest.mark.compiled
def test_the_judge_hears_a_policy_that_shakes():
    found = campaign_still.run(campaign_still.Order(seed=1, cases=26 if WHOLE else 18, policies=("dither",)))
    assert len(found.loud) >= 4, "a square wave shakes a quarter of the hands"


def alarms(name, world, seconds):
    """Ticks outside ACTIVE of this plant in this world, and the least energy of its port, J."""
    simulation = Simulation(with_plant(config.load(shipped_config("mock.toml")), name))
    if world == "free triangle":
        plant = simulation.plant_params[0]
        plant["hand_kind"], plant["hand_amplitude_rad"], plant["hand_speed_rad_s"] = (
            int(Hand.TRIANGLE),
            0.15,
            0.1,
        )
    simulation.arm(**WORLDS[world])
    every = max(1, round(seconds / 60))
    trace = simulation.run(seconds, every=every)
    return int(np.sum(trace["state"] != State.ACTIVE)), float(trace["energy_port_j"].min())


@pytest.mark.compiled
@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("name", FAMILY)
def test_ordinary_motion_alarms_nobody(name, world):
    stopped, least_j = alarms(name, world, SECONDS)
    assert stopped == 0
    assert least_j > -0.02, "nor is the budget ever used"


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", FAMILY)
def test_ten_hours_of_ordinary_motion_alarm_nobody(name):
    for world in WORLDS:
        stopped, least_j = alarms(name, world, SLOW_SECONDS)
        assert stopped == 0, world
        assert least_j > -0.02, world
