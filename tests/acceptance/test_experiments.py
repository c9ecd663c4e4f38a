"""The experiments on the shipped rigs, with few seeds: `rtctl experiment` has ten by default."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from rtctl.cli import cli
from rtctl.errors import ConfigError
from rtctl.experiments import (
    free_motion,
    policies,
    policies_on_family,
    same_path,
    spring,
    still_hand,
    virtual,
)
from rtctl.experiments.order import Order
from rtctl.experiments.registry import EXPERIMENTS
from rtctl.experiments.virtual import FAST_SINE, SLOW_TRIANGLE, Variant
from rtctl.rig_file.config import load
from rtctl.simulation.campaign_still import QUIET_RAD_S
from rtctl.simulation.family import FAMILY

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(scope="module")
def mock():
    return load(CONFIGS / "mock.toml")


def figures_of(loaded, motion, variant, seeds=2):
    rows = [free_motion.figures_of(virtual.measure(loaded, seed, motion, variant)) for seed in range(seeds)]
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


@pytest.mark.parametrize(("motion", "least"), [(FAST_SINE, 0.75), (SLOW_TRIANGLE, 0.83)])
def test_feed_forward_and_then_force_feedback_take_the_friction_off_the_hand(mock, motion, least):
    off, on, feedback = (
        figures_of(mock, motion, one) for one in (free_motion.OFF, free_motion.ON, free_motion.FEEDBACK)
    )
    assert 1 - on["hand_rms_nm"].mean() / off["hand_rms_nm"].mean() >= least
    assert 1 - feedback["hand_rms_nm"].mean() / off["hand_rms_nm"].mean() >= 0.88
    assert feedback["hand_energy_min_j"].min() >= -1e-6


def test_with_the_observer_a_model_a_quarter_too_low_costs_little(mock):
    off, default, alone = (
        figures_of(mock, FAST_SINE, one, 1)["hand_rms_nm"].mean()
        for one in (free_motion.OFF, free_motion.LOW_MODEL, free_motion.LOW_ALONE)
    )
    assert alone / off > 0.33
    assert default / off < 0.25


@pytest.mark.parametrize("policy", [policies.DEFAULT, "observer"])
def test_a_hand_that_holds_still_is_left_alone(mock, policy):
    found = still_hand.worst(Order(mock), Variant(policy, 1.0, policies.POLICIES[policy]))
    assert found.faults() == []


def test_a_hand_that_holds_still_is_shaken_by_the_old_policy_without_its_account(mock):
    # so the test before can fail: elasto-plastic friction of soft bristles, in a loose hand
    def old(simulation):
        virtual.with_observer(0.0)(simulation)
        simulation.params["assistance_bank_j"] = 1e9
        simulation.params["tremble_turn_s"] = simulation.params["paying_nm"] = 0.0
        simulation.params["friction_intent_alpha"] = 1.0
        simulation.plant_params["bristle_stiffness_nm_rad"] = 100.0
        simulation.plant_params["bristle_damping_nms_rad"] = 0.3
        simulation.plant_params["elastic_share"] = 0.7

    found = still_hand.held(mock, 0, Variant("old", 1.0, old), 20.0, 0.1)
    assert found.speed_rad_s > QUIET_RAD_S


def test_the_family_is_compared_on_every_plant(mock, monkeypatch):
    monkeypatch.setattr(policies_on_family, "FAMILY", {"drifted": FAMILY["drifted"]})
    part, found = policies_on_family.part(Order(mock, seeds=1), lambda _share, _text: None)
    assert "on 1 of 1 plants: drifted" in part.paragraphs[1]
    assert found["drifted"][policies_on_family.BOTH]["fast sine"] <= 0.2


@pytest.mark.parametrize("motion", [FAST_SINE, SLOW_TRIANGLE])
def test_a_hand_that_wishes_the_same_goes_another_path_and_a_stiff_one_the_same(mock, motion):
    ways = same_path.compare(Order(mock, seeds=1), motion)
    assert ways["same hand"].path.mean > 0.15
    assert ways["same path"].path.mean < 0.01
    assert all(way.reduction.mean > 0.7 for way in ways.values())


def grip(stiffness_nm_rad, damping_nms_rad, delay_ticks, gain):
    def change(simulation):
        p = simulation.plant_params
        p["hand_stiffness_nm_rad"], p["hand_damping_nms_rad"] = stiffness_nm_rad, damping_nms_rad
        p["torque_delay_ticks"] = delay_ticks
        simulation.params["proof_delay_s"] = 0.0  # the test pulse would see the delay and refuse
        simulation.params["force_feedback_gain"] = gain

    return Variant("grip", 1.0, change)


@pytest.mark.parametrize("stiffness_nm_rad", [50.0, 200.0])
@pytest.mark.parametrize("delay_ticks", [0, 1])
def test_force_feedback_never_feeds_a_stiff_hand_even_with_a_tick_of_delay_nobody_knew_of(
    mock, stiffness_nm_rad, delay_ticks
):
    for motion in (FAST_SINE, SLOW_TRIANGLE):
        run = virtual.measure(mock, 0, motion, grip(stiffness_nm_rad, 0.2, delay_ticks, 4.0))
        assert virtual.hand_energy_min_j(run) >= -1e-6


def test_a_model_a_quarter_too_high_neither_runs_away_nor_feeds_the_hand_with_force_feedback(mock):
    change = virtual.both(virtual.with_model_scaled(1.25), virtual.with_feedback)
    high = Variant("high", 1.0, change)
    assert figures_of(mock, FAST_SINE, high, 1)["hand_energy_min_j"].min() >= -1e-6
    assert virtual.speed_after_release(mock, 0, high) < 1e-3


def test_the_same_seed_is_the_same_rig_and_another_seed_another():
    loaded = load(CONFIGS / "mock.toml")
    first, again, other = (virtual.make(loaded, seed) for seed in (3, 3, 4))
    assert first.plant_params.tobytes() == again.plant_params.tobytes()
    assert first.plant_state.tobytes() == again.plant_state.tobytes()
    assert first.plant_state["position_rad"][0, 0] != other.plant_state["position_rad"][0, 0]


def test_the_spring_experiment_writes_its_report(tmp_path):
    out = tmp_path / "spring"
    command = ["experiment", "spring", str(CONFIGS / "mock-spring.toml"), "--out", str(out)]
    done = CliRunner().invoke(cli, [*command, "--simulate", "--seeds", "1", "--json"])
    assert done.exit_code == 0, done.output
    body = json.loads(done.stdout)["experiments"]["spring"]
    assert body["targets"][0]["reached"]
    assert json.loads((out / "report.json").read_text())["experiments"]["spring"]["targets"][0]["reached"]
    assert {item.name for item in out.iterdir()} == {
        "report.html",
        "report.json",
        "spring_time.png",
        "spring_loop.png",
    }


def test_an_experiment_of_the_simulated_rig_alone_is_refused_on_the_loop(mock):
    for one in EXPERIMENTS.values():
        if one.on_rig is None:
            with pytest.raises(ConfigError, match="simulated rig alone"):
                one.run(Order(mock, simulate=False))


def test_the_spring_needs_a_spring_on_the_loop(mock):
    with pytest.raises(ConfigError, match=r"environment\.kind"):
        EXPERIMENTS["spring"].run(Order(mock, simulate=False))


def test_only_the_mock_can_be_simulated(mock):
    device = (mock.config.device[0].model_copy(update={"kind": "playback"}),)
    other = mock.model_copy(update={"config": mock.config.model_copy(update={"device": device})})
    with pytest.raises(ConfigError, match="simulated rig"):
        spring.run(Order(other))
