"""Local force feedback in the law: bounded by what friction takes out, off by default, safe with NaN."""

import math
from pathlib import Path

import numpy as np
import pytest
from law_rig import LEVER, LawRig, Plant

from rtctl.check.law_plan import build
from rtctl.control.force_feedback import BANK_KEPT, SPEED_MIN_RAD_S, SPEND_S, assistance_limit
from rtctl.control.vocabulary import Environment, Fault, State
from rtctl.errors import ConfigError
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"
FEEDBACK = {
    "force_feedback_gain": 4.0,
    "force_feedback_alpha": 0.2,
    "force_feedback_deadband_nm": 0.002,
    "force_feedback_cap_nm": 0.6,
    "force_feedback_share": 0.95,
}


def made(**params):
    return LawRig(**{**FEEDBACK, **params}).friction()


def feedback_nm(rig):
    """What the law added beyond the torques the tick names."""
    known = ("coupling_torque_nm", "feedforward_torque_nm", "damping_torque_nm", "program_torque_nm")
    return rig["torque_wanted_nm"] - sum(rig[name] for name in known)


def push(rig, torque_nm, n=300):
    rig.force_n = np.array([0.0, torque_nm / LEVER, 0.0])
    return rig.run(n)


def test_it_is_off_unless_configured():
    rig = push(made(force_feedback_gain=0.0).arm(), 0.1)
    assert feedback_nm(rig) == pytest.approx(0.0, abs=1e-15)
    plan = build(load(CONFIGS / "mock.toml"))
    assert plan.params["force_feedback_gain"][0, 0] == 0.0


@pytest.mark.parametrize("sign", [1, -1])
def test_it_pushes_the_way_the_hand_does_and_settles_at_gain_times_what_is_beyond_the_dead_band(sign):
    rig = push(made().arm(), sign * 0.02)
    assert feedback_nm(rig) == pytest.approx(sign * 4.0 * (0.02 - 0.002), rel=1e-6)


def test_it_never_exceeds_what_friction_surely_takes_out_while_the_account_is_empty():
    rig = push(made().arm(), 0.2)
    assert float(rig.state["force_feedback_energy_j"][0, 0]) <= BANK_KEPT * 0.02
    assert feedback_nm(rig) == pytest.approx(0.95 * 0.35, rel=1e-6)


def test_feed_forward_and_feedback_share_one_bound():
    rig = push(made(friction_policy=6).arm(), 0.2)  # INTENT: feed-forward .9 * .35 by itself
    forward = rig["feedforward_torque_nm"]
    assert forward == pytest.approx(0.9 * 0.3, rel=0.2)
    assert forward + feedback_nm(rig) == pytest.approx(0.95 * 0.35, rel=1e-6)


def test_a_feed_forward_above_the_bound_is_left_alone():
    rig = push(made(friction_policy=6, friction_gain=1.0, force_feedback_share=0.1).arm(), 0.2)
    assert rig["feedforward_torque_nm"] > 0.25
    assert feedback_nm(rig) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("compensation", [0.0, 0.5, 1.0])
def test_the_command_that_scales_the_feed_forward_scales_it_too(compensation):
    rig = made()
    rig.command["compensation"] = compensation
    assert feedback_nm(push(rig.arm(), 0.02)) == pytest.approx(compensation * 4 * 0.018, rel=1e-6)


def test_inside_a_virtual_spring_it_acts_on_the_difference_only():
    rig = made(coupling_stiffness_nm_rad=60.0, coupling_damping_nms_rad=0.01)
    rig.environment("spring", environment_stiffness_nm_rad=3.0, environment_center_rad=-0.02)
    rig.arm()
    wanted = -rig["coupling_torque_nm"]
    assert wanted == pytest.approx(0.02 * 3 * 60 / 63, rel=1e-3)
    assert feedback_nm(push(rig, wanted)) == pytest.approx(0.0, abs=1e-12)
    assert feedback_nm(push(rig, wanted + 0.02)) == pytest.approx(4 * 0.018, rel=1e-6)


def test_damping_that_the_coupling_needs_is_not_spent_unless_nothing_is_coupled():
    rig = made(force_feedback_damping_nms_rad=0.01, force_feedback_reserve_nm=0.002)
    limits = {}
    for kind in (Environment.FREE, Environment.SPRING):
        rig.state["world_kind"] = int(kind)
        args = (rig.state[0], rig.params[0], rig.model[0], 0)
        limits[kind] = float(assistance_limit(*args, 1.0))
    assert limits[Environment.FREE] == pytest.approx(0.95 * (0.25 + 0.05) - 0.002, rel=1e-3)
    assert limits[Environment.SPRING] == pytest.approx(0.95 * (0.25 + 0.01) - 0.002, rel=1e-3)


def test_energy_in_the_account_may_be_spent_but_half_the_bank_stays_and_a_deficit_ends_the_help():
    rig = made()

    def limit(energy, speed=0.5):
        rig.state["force_feedback_energy_j"] = energy
        return float(assistance_limit(rig.state[0], rig.params[0], rig.model[0], 0, speed))

    usual = limit(0.0)
    assert limit(0.01) == pytest.approx(usual)
    assert limit(0.02) - usual == pytest.approx(0.01 / (SPEND_S * 0.5))
    assert limit(0.02, 0.0) - limit(0.0, 0.0) == pytest.approx(0.01 / (SPEND_S * SPEED_MIN_RAD_S))
    assert limit(-0.0005) == pytest.approx(0.5 * usual)
    assert limit(-0.001) == limit(-1.0) == limit(math.nan) == 0.0


@pytest.mark.parametrize(
    ("ago", "shown_late"),
    [(2, 0), (1, 3)],
    ids=["one tick more than the delay that is known", "not as late as the current may show it"],
)
def test_the_account_takes_the_worse_of_when_the_torque_acts_and_one_tick_more(ago, shown_late):
    """Samples every third tick make the measured current up to two ticks older, and the torque no later."""
    rig = push(made(friction_policy=0, follow_delay_ticks=shown_late).arm(), 0.02, n=50)
    rig.state["force_feedback_energy_j"] = 0.0
    rig.state["assistance_nm"] = 0.0
    rig.state["bristle_share"] = 1.0
    rig.state["assistance_nm"][0, 0, (int(rig.state["ticks"][0]) - ago) % 32] = 0.3  # it acts now
    rig.tick(position=rig.position + 1e-5)
    v = abs(rig["velocity_rad_s"])
    friction = 0.25 + 0.1 * math.exp(-((v / 0.1) ** 2))
    expected = 0.95 * (friction * 1e-5 + 0.05 * 1e-10 / 1e-3) - 0.3 * 1e-5
    assert float(rig.state["force_feedback_energy_j"][0, 0]) == pytest.approx(expected, abs=1e-8)


def test_an_unknown_speed_allows_nothing():
    rig = made()
    args = (rig.state[0], rig.params[0], rig.model[0], 0)
    assert float(assistance_limit(*args, math.nan)) == 0.0


def test_a_hand_torque_that_is_not_a_number_cuts_the_torque_and_does_not_stay_in_the_filter():
    rig = push(made().arm(), 0.02)
    rig.state["force_filtered_nm"] = math.nan  # the sample check would refuse the sensor's own NaN
    rig.tick()
    assert rig["torque_applied_nm"] == 0.0
    assert Fault.LAW_NOT_FINITE in rig.faults
    assert rig.mode is State.FAULT
    assert rig.state["force_error_nm"][0, 0] == 0.0


def test_a_missed_sample_moves_no_filter():
    rig = push(made().arm(), 0.02, n=3)
    before = float(rig.state["force_error_nm"][0, 0])
    rig.tick(fresh=False)
    assert rig.state["force_error_nm"][0, 0] == before


def test_an_adversarial_hand_gets_no_energy_out_of_a_joint_whose_friction_is_as_promised():
    # the hand pushes whichever way the joint moves, hard, late and noisily; the account must hold
    rig = made(energy_budget_j=1e-3, energy_bank_j=2e-3).arm()
    plant, rng, least = Plant(damping=0.05), np.random.default_rng(3), 0.0
    lag = [0.0, 0.0]
    for k in range(4000):
        lag = [*lag[1:], 0.4 * np.sign(math.sin(0.02 * k)) + 0.05 * rng.standard_normal()]
        rig.force_n = np.array([0.0, lag[0] / LEVER, 0.0])
        dry = -0.25 * np.sign(plant.v) if abs(plant.v) > 1e-3 else 0.0
        rig.tick(position=plant.advance(float(rig["torque_applied_nm"]) + dry + lag[1]))
        least = min(least, rig["energy_port_j"])
    assert rig.mode is State.ACTIVE
    assert least >= -1e-3


def test_a_rig_without_force_sensor_refuses_it(tmp_path):
    text = (
        (CONFIGS / "mock.toml").read_text().replace("friction/mock.json", str(CONFIGS / "friction/mock.json"))
    )
    text = text.replace('name = "mock" ', 'absent = ["force"]\nname = "mock" ')
    text = text.replace("[axis.friction]", "[axis.force_feedback]\ngain = 2.0\n\n[axis.friction]")
    path = tmp_path / "rig.toml"
    path.write_text(text)
    with pytest.raises(ConfigError) as told:
        load(path)
    assert any("force_feedback" in fault for fault in told.value.faults)
