"""The speed servo of an identification rings on no elastic, late joint that it was made for: the simulated
joint judges.

With the gains of a rigid joint 14 of 40 random ones rang at .2 N m and more (decision 0171)."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from identified import CONFIG, variant

from rtctl.errors import ConfigError, FaultError
from rtctl.experiments.position_gains import gains_of, slower_of
from rtctl.experiments.simulated_identification import drive
from rtctl.identify.motion import Motion, Order
from rtctl.identify.session import arm
from rtctl.identify.settings import SERVOS, Settings, rig_of, without_feedforward
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

CONFIGS = CONFIG.parent
HAND = (CONFIGS / "mock-elastic.toml").read_text().partition("[[device.options.hand]]")[2]
HAND = f"[[device.options.hand]]{HAND}"
QUICK = Settings(bias_s=0.5)


def rig_with(folder, hz, link_share, delay_ticks, bandwidth_hz=0.0, damped=0.01, told=0.05):
    """An elastic joint without hand or help: where it swings freely, its link, its drive, its damping as
    told."""
    reduced, omega = link_share * (1 - link_share) * 0.012, 2 * np.pi * hz
    loop = f"current_loop = {{ bandwidth_hz = {bandwidth_hz} }}\n" if bandwidth_hz else ""
    text = (
        ("stiffness_nm_rad = 106.6 ", f"stiffness_nm_rad = {reduced * omega**2:.6g} "),
        ("damping_nms_rad = 0.02262 ", f"damping_nms_rad = {2 * damped * reduced * omega:.6g} "),
        ("link_inertia_share = 0.5 ", f"link_inertia_share = {link_share} "),
        ("ripple_order = 1.0\n", f"ripple_order = 1.0\ntorque_delay_ticks = {delay_ticks}\n{loop}"),
        ("coulomb_nm = 0.25 ", "coulomb_nm = 0.04 "),
        ("breakaway_nm = 0.35 ", "breakaway_nm = 0.05 "),
        ('model = "friction/mock.json"', "#"),
        ('policy = "hybrid"', 'policy = "off"'),
        ("viscous_nms_rad = 0.05              # b: ", f"viscous_nms_rad = {told}  # b: "),
        (HAND, '[[device.options.hand]]\nkind = "none"\n'),
    )
    return without_feedforward(load(variant(folder, *text, source=CONFIGS / "mock-elastic.toml")))


def chatter_nm(loaded, rig, speed_rad_s=0.5):
    """RMS change of the torque from tick to tick while the servo turns the joint, after 1 s."""
    simulation, motion, seen = Simulation(loaded), Motion(rig, QUICK), []

    def steps():
        yield from motion.see_any(Order(look_s=0.7))
        yield from arm(motion)
        motion.choose_travel()
        seen.append((yield from motion.watch(1.5, motion.turn(speed_rad_s))))

    try:
        drive(simulation, steps(), rig.axis)
    except FaultError:  # it rang until the rig was stopped
        return math.inf
    return float(np.std(np.diff(seen[0]["torque_applied_nm"][1000:, 0])))


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("hz", "share", "delay", "bandwidth"), [(139, 0.67, 1, 200), (106, 0.78, 0, 200), (31, 0.62, 3, 500)]
)
def test_a_servo_that_would_ring_is_slowed_until_it_does_not(tmp_path, hz, share, delay, bandwidth):
    loaded = rig_with(tmp_path, hz, share, delay, bandwidth, damped=0.007)
    rig = rig_of(loaded, QUICK)
    assert len(rig.servos) == len(SERVOS)
    assert chatter_nm(loaded, replace(rig, stiffer=1.0, calmer=1.0)) > 0.05, "else nothing is shown"
    # a count of the encoder makes .008 N m
    assert all(chatter_nm(loaded, rig.with_servo(k)) < 0.02 for k in range(len(SERVOS)))


@pytest.mark.parametrize("name", ["mock.toml", "mock-identify.toml", "mock-elastic.toml", "can-odrive.toml"])
def test_a_joint_on_which_it_does_not_ring_keeps_its_servo(name):
    rig = rig_of(load(CONFIGS / name), QUICK)
    assert (rig.servos, rig.stiffer, rig.calmer) == (SERVOS, 1.0, 1.0)


def test_the_later_and_the_stiffer_the_slower(tmp_path):
    found = [rig_of(rig_with(tmp_path, 100, 0.8, late), QUICK).servos for late in (0, 1, 2)]
    calmer = np.array(found)[:, :, 1]
    assert np.all(np.diff(calmer, axis=0) >= 0)
    assert np.all(calmer[2] > calmer[0])
    # a stiffer one asks for more of a rather slow filter
    assert np.all(calmer[:, 1] >= calmer[:, 0])


def test_a_joint_without_any_damping_is_refused_by_name(tmp_path):
    loaded = rig_with(tmp_path, 100, 0.8, 3, damped=1e-12, told=1e-12)
    with pytest.raises(ConfigError, match=r"axis 0: no speed servo .*joint_damping_nms_rad.*--log"):
        rig_of(loaded, QUICK)


def test_a_current_that_overshoots_slows_it_further(tmp_path):
    """Behind a loop of .5 more than a step the servo of a loop of first order grows by 6 % a tick."""
    found = []
    for over in (0.0, 0.5):
        loaded = rig_with(tmp_path, 26.7, 0.672, 0, damped=0.021)
        text = loaded.path.read_text()
        drive = f"[axis.drive]\ncurrent_loop_hz = 89.0\ncurrent_overshoot = {over}\n\n[axis.velocity]"
        loaded.path.write_text(text.replace("[axis.velocity]", drive, 1))
        found.append(rig_of(without_feedforward(load(loaded.path)), QUICK).calmer)
    assert found[0] < 1.5
    assert found[1] > 2 * found[0]


def test_a_resonance_that_the_rig_file_names_slows_it_though_nothing_else_calls_the_joint_elastic(tmp_path):
    """On two halves that swing at 50 Hz the servo of a rigid joint, so late, grows by 2.7 % a tick."""

    def calmer(hz):
        drive = f"[axis.drive]\ncurrent_loop_hz = 200.0\nresonance_hz = {hz}\n\n[axis.velocity]"
        late = ("ripple_order = 1.0\n", "ripple_order = 1.0\ntorque_delay_ticks = 3\n")
        return rig_of(load(variant(tmp_path, ("[axis.velocity]", drive), late)), QUICK).calmer

    assert calmer(0.0) == calmer(600.0) == 1.0, "beyond half of the rate it is nothing that a tick sees"
    assert calmer(50.0) > 2.0


def test_a_controller_of_positions_is_slowed_likewise(tmp_path):
    rigs = [rig_with(tmp_path, 100, 0.8, late) for late in (0, 1, 5)]
    found = [slower_of(rig) for rig in rigs]
    assert found[0] == 1.0 < found[1] < found[2]
    gains = [gains_of(SimpleNamespace(loaded=rig), "PD")["kp_nm_rad"][0] for rig in rigs]
    assert gains == pytest.approx([gains[0] / slower**2 for slower in found])
    assert slower_of(load(CONFIGS / "mock-elastic.toml")) == 1.0
    with pytest.raises(ConfigError, match=r"joint: no position controller .*joint_damping_nms_rad"):
        slower_of(rig_with(tmp_path, 100, 0.8, 3, damped=1e-12, told=1e-12))
