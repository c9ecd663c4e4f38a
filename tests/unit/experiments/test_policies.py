"""The experiment of the policies: what is judged, and sentences that follow from the figures."""

import math
from pathlib import Path

import numpy as np
import pytest

from rtctl.check.law_plan import build
from rtctl.control.vocabulary import Policy
from rtctl.experiments import policies, policies_on_family, still_hand, virtual
from rtctl.experiments.policies import Judged
from rtctl.experiments.policies_on_family import ALONE, BOTH, HYBRID, LUGRE, MOTIONS
from rtctl.experiments.still_hand import Still
from rtctl.rig_file.config import load
from rtctl.simulation.family import FAMILY

CONFIGS = Path(__file__).parents[3] / "configs"


@pytest.fixture(scope="module")
def loaded():
    return load(CONFIGS / "mock.toml")


@pytest.mark.parametrize(
    ("still", "faults"),
    [
        (Still(0.0019, 0.9e-3, stopped=False), []),
        (Still(0.0021, 0.0, stopped=False), ["shakes a hand that holds still"]),
        (Still(0.0, 1.1e-3, stopped=False), ["feeds a hand that holds still"]),
        (Still(0.0, 0.0, stopped=True), ["stopped by a fault in a hand that holds still"]),
        (
            Still(math.nan, math.nan, stopped=False),
            ["shakes a hand that holds still", "feeds a hand that holds still"],
        ),
    ],
)
def test_a_hand_that_holds_still_is_judged_by_speed_energy_and_faults(still, faults):
    assert still.faults() == faults


def judged(speed=0.0, energy=0.0):
    figures = {"speed_after_release_rad_s": np.array([speed]), "hand_energy_min_j": np.array([energy])}
    return Judged(figures, Still(0.0, 0.0, stopped=False)).faults()


def test_a_policy_is_quiet_or_told_what_it_does():
    assert judged() == []
    assert judged(speed=2e-3) == ["hunts or runs"]
    assert judged(energy=-1e-3) == ["feeds the hand"]
    assert judged(energy=math.nan) == ["stopped by a fault"]


def left(hybrid, alone):
    def both_motions(share):
        return {motion.name: share for motion in MOTIONS}

    of = {HYBRID: hybrid, BOTH: 0.1, ALONE: alone, LUGRE: 0.3}
    return {name: both_motions(share) for name, share in of.items()}


def test_the_page_names_the_plants_on_which_the_learned_model_alone_loses():
    text = policies_on_family.said({"good": left(0.2, 0.25), "soft": left(0.4, 0.25)})[0]
    assert "on 1 of 2 plants: soft." in text
    assert "hybrid alone: at most fast sine 40.0 % (soft)" in text
    assert "on 0 of 1 plants." in policies_on_family.said({"good": left(0.2, 0.25)})[0]


def test_a_plant_on_which_the_rig_stopped_is_lost_and_named():
    text = policies_on_family.said({"good": left(0.2, 0.25), "bad": left(math.nan, 0.25)})[0]
    assert "on 1 of 2 plants: bad." in text
    assert "hybrid alone: at most fast sine 20.0 % (good), stopped by a fault on bad" in text
    assert "stopped by a fault" in policies_on_family.table({"bad": left(math.nan, 0.25)}).rows[0]


def test_every_plant_has_its_row():
    table = policies_on_family.table({name: left(0.2, 0.25) for name in FAMILY})
    assert [row[0] for row in table.rows] == list(FAMILY)
    assert {len(row) for row in table.rows} == {len(table.header)}


class Rig:
    """What a change of a variant sees, without compiled code."""

    def __init__(self, loaded):
        self.plan = build(loaded)
        self.params, self.model = self.plan.params, self.plan.model
        self.motion = loaded.config.axis[0].motion


def test_an_observer_set_by_a_variant_is_the_one_the_plan_makes(loaded):
    expected, found = Rig(loaded), Rig(loaded)
    virtual.with_observer(float(expected.params["observer_gain"][0, 0]))(found)
    assert found.params.tobytes() == expected.params.tobytes()
    virtual.with_observer(0.0)(found)
    assert found.params["observer_gain"][0, 0] == 0.0


def test_the_default_has_the_observer_and_the_baselines_do_not(loaded):
    gains = {}
    for name, change in policies.POLICIES.items():
        rig = Rig(loaded)
        change(rig)
        gains[name] = (
            Policy(int(rig.params["friction_policy"][0, 0])),
            float(rig.params["observer_gain"][0, 0]),
        )
    assert gains.pop(policies.DEFAULT) == (Policy.HYBRID, loaded.config.axis[0].friction.observer.gain)
    assert gains.pop("observer") == (Policy.OBSERVER, policies_on_family.OBSERVER_ALONE_GAIN)
    assert {gain for _, gain in gains.values()} == {0.0}
    assert gains["lugre observer"][0] == Policy.LUGRE


def test_hands_that_hold_still_are_loose_and_stiff():
    stiffness = [k for k, _ in still_hand.HANDS]
    assert (min(stiffness), max(stiffness)) == (5.0, 500.0)
