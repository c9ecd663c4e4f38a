"""The experiment on admittance displays: its fits, what it says of its tables, and contacts on the simulated
rig.
"""

import math
from collections import defaultdict
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.control.environments.table import Environment
from rtctl.control.vocabulary import State
from rtctl.experiments import admittance_findings as findings
from rtctl.experiments import admittance_runs as runs
from rtctl.experiments.admittance_findings import Felt
from rtctl.experiments.admittance_runs import Contact, Rubbing, Shown
from rtctl.experiments.statistics import Estimate
from rtctl.rig_file.config import load
from rtctl.simulation.family import with_plant
from rtctl.simulation.shipped_files import shipped_config
from rtctl.tick import new_ticks

SHOWN = Shown(0.012, 0.1, 2.0, 20.0)


@pytest.fixture(scope="module")
def mock():
    return load(shipped_config("mock.toml"))


def test_a_plant_of_known_mass_and_damping_gives_both_back():
    at = np.arange(4000) * 1e-3
    speed = sum(np.sin(2 * np.pi * hz * at + hz) for hz in runs.FELT_HZ)
    accelerated = sum(2 * np.pi * hz * np.cos(2 * np.pi * hz * at + hz) for hz in runs.FELT_HZ)
    mass, damping = runs.fit_mass(speed, 0.02 * accelerated + 0.3 * speed, 1e-3)
    assert mass == pytest.approx(0.02, rel=0.01)
    assert damping == pytest.approx(0.3, rel=0.01)


def test_what_is_above_a_frequency_is_counted_and_the_rest_is_not():
    at = np.arange(2000) * 1e-3
    signal = 5.0 + np.sin(2 * np.pi * 4 * at) + 0.3 * np.sin(2 * np.pi * 25 * at)
    assert runs.above(signal, runs.RING_HZ, 1e-3) == pytest.approx(0.3 / math.sqrt(2), rel=1e-6)


def test_the_numbers_are_the_rig_files_own_or_follow_from_its_joint(mock):
    joint = mock.config.axis[0]
    assert runs.usual(mock) == Shown(joint.inertia_kgm2, 0.1, 2.0, 28.0)
    own = runs.displayed(mock, Shown(0.02, 0.3, 4.0, 1.0, 0.5))
    assert runs.usual(own) == Shown(0.02, 0.3, 4.0, 1.0, 0.5)
    assert own.config.axis[0].display == "admittance"
    assert runs.displayed(own, None).config.axis[0].display == "impedance"


def left(impedance, admittance):
    rows = {"impedance, compensated": impedance, "admittance": 0.5, "admittance, compensated": admittance}
    return {"fast sine": {name: Estimate(mean, 0.0, 1) for name, mean in rows.items()}}


def test_the_sentence_on_free_motion_names_the_display_that_leaves_less_and_the_hand_that_is_certified():
    assert "the admittance leaves 11 %, the impedance 18 %" in findings.free_sentence(left(0.18, 0.11), 150.0)
    assert "the impedance leaves 11 %, the admittance 18 %" in findings.free_sentence(left(0.11, 0.18), 150.0)
    assert "the impedance leaves 11 %, the admittance 11 %" in findings.free_sentence(left(0.11, 0.11), 150.0)
    assert "certified for no hand" in findings.free_sentence(left(0.11, 0.18), 0.0)
    assert "not every display was measured" in findings.free_sentence(left(math.nan, 0.18), 1.0)


def felt(alone, ahead):
    return [
        Felt(replace(SHOWN, feedforward=0.0), 0.012 * (1 + alone), 0.1, Rubbing.BARE, 100.0),
        Felt(SHOWN, 0.012, 0.1 * (1 + ahead), Rubbing.BARE, 100.0),
    ]


def test_the_sentence_on_what_is_felt_says_when_what_is_sent_ahead_does_not_help():
    assert "brings that to 4 %" in findings.felt_sentence(felt(0.2, 0.04))
    worse = findings.felt_sentence(felt(0.02, 0.04))
    assert "does not help" in worse
    assert "4 %" in worse
    assert "stopped" in findings.felt_sentence(felt(math.nan, 0.04))


def touched(**changes):
    good = {f"spring of {k:g}": Contact(k, 0.0, 0.0, stopped=False) for k in findings.SPRINGS_NM_RAD}
    return {
        "impedance": good | changes.get("impedance", {}),
        "admittance": good | changes.get("admittance", {}),
    }


def test_the_sentence_on_contact_names_what_rings_and_how_far_springs_are_true():
    said = findings.contact_sentence(touched())
    assert said.count("up to 2000 N m/rad") == 2
    rings = {"spring of 2000": Contact(2000.0, 1.0, 0.0, stopped=False)}
    said = findings.contact_sentence(touched(admittance=rings))
    assert "the admittance renders springs from the softest tried up to 1000 N m/rad" in said
    assert "rings or stops on: spring of 2000" in said
    soft = {f"spring of {k:g}": Contact(k / 2, 0.0, 0.0, stopped=False) for k in findings.SPRINGS_NM_RAD}
    assert "the impedance renders no spring tried" in findings.contact_sentence(touched(impedance=soft))
    only_last = soft | {"spring of 2000": Contact(2000.0, 0.0, 0.0, stopped=False)}
    assert "the impedance renders no spring tried" in findings.contact_sentence(touched(impedance=only_last))
    stopped = {"wall": Contact(math.nan, math.nan, 0.0, stopped=True)}
    assert "rings or stops on: wall" in findings.contact_sentence(touched(impedance=stopped))


def test_a_spring_behind_a_coupling_is_felt_in_series_and_on_a_mass_as_it_is(mock):
    k_c = mock.config.axis[0].coupling.stiffness_nm_rad
    impedance = runs.contact(runs.displayed(mock, None), Environment.SPRING, 50.0)
    assert impedance.stiffness_nm_rad == pytest.approx(50 * k_c / (50 + k_c), rel=0.1)
    admittance = runs.contact(runs.displayed(mock, SHOWN), Environment.SPRING, 50.0)
    assert admittance.stiffness_nm_rad == pytest.approx(50.0, rel=0.05)
    assert admittance.calm
    alone = runs.contact(runs.displayed(mock, replace(SHOWN, feedforward=0.0)), Environment.SPRING, 50.0)
    assert alone.stiffness_nm_rad == pytest.approx(50 * 20 / 70, rel=0.1)  # in series with K_p


def test_what_rubs_is_felt_beside_the_spring_and_the_certificate_ends_before_the_simulation_does(mock):
    rig = runs.displayed(mock, SHOWN)
    smooth, bare, helped = (runs.contact(rig, Environment.SPRING, 1000.0, one) for one in Rubbing)
    assert smooth.stiffness_nm_rad == pytest.approx(1000.0, rel=0.1)
    assert abs(bare.stiffness_nm_rad / 1000 - 1) > 0.1
    assert abs(helped.stiffness_nm_rad / 1000 - 1) > 0.1
    assert 0 < runs.widest_certified(mock, SHOWN, 0.1) < runs.widest(mock, SHOWN, 0.1)


def test_a_display_that_no_hand_may_hold_stops_or_rings(mock):
    wild = Shown(0.012, 0.01, 2.0, 8000.0)
    assert not runs.contact(runs.displayed(mock, wild), Environment.WALL, 1e5).calm


def test_help_with_friction_goes_by_the_mass_and_does_not_push_the_joint_into_a_wall(mock):
    rig = runs.displayed(mock, SHOWN)
    bare, helped = (
        runs.contact(rig, Environment.WALL, 1e5, one) for one in (Rubbing.BARE, Rubbing.COMPENSATED)
    )
    assert bare.calm
    assert helped.calm
    assert helped.way_rad < 1.005 * bare.way_rad  # help for the hand's push drove it in five times as far


def test_help_with_friction_turns_with_the_mass_and_makes_it_no_lighter(mock):
    """On a slow drive, whose help is late: by the joint's motion it was 9 % lighter."""
    slow = with_plant(mock, "slow-drive")
    mass, damping = runs.felt(runs.displayed(slow, runs.usual(slow)), Rubbing.COMPENSATED)
    assert mass == pytest.approx(slow.config.axis[0].inertia_kgm2, rel=findings.FELT_WITHIN)
    assert damping == pytest.approx(2 * slow.config.axis[0].viscous_nms_rad, rel=findings.FELT_WITHIN)


class Resting:
    """A simulation of a joint that nothing moves."""

    def __init__(self, loaded):
        self.plan = SimpleNamespace(period_s=loaded.config.period_s)
        self.params = self.command = self.plant_params = self.plant_state = defaultdict(
            lambda: np.ones((1, 1))
        )

    def arm(self, **_fields):
        pass

    def run(self, seconds):
        trace = new_ticks(round(seconds / self.plan.period_s), 1)
        trace["state"] = State.ACTIVE
        self.truth = {name: np.zeros((len(trace), 1)) for name in ("hand_torque_nm", "position_rad")}
        return trace


@pytest.mark.parametrize("rate_hz", [500.0, 10_000.0])
def test_of_a_contact_half_a_second_is_judged_at_any_rate(mock, monkeypatch, rate_hz):
    judged_s = []
    monkeypatch.setattr(runs, "above", lambda signal, _hz, T: judged_s.append(len(signal) * T) or 0.0)
    monkeypatch.setattr(runs, "Simulation", Resting)
    other = mock.config.model_copy(update={"loop": mock.config.loop.model_copy(update={"rate_hz": rate_hz})})
    runs.contact(mock.model_copy(update={"config": other}), Environment.SPRING, 50.0, Rubbing.BARE)
    assert judged_s == pytest.approx([0.5, 0.5])
