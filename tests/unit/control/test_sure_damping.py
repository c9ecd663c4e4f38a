"""Damping behind an elastic joint's spring is credited only as far as no hand can take it away."""

import math
from pathlib import Path

import numpy as np
import pytest
from law_rig import COUNT, LawRig, T
from scipy.linalg import expm

from hw.interface import Joint
from rtctl.check.devices_of_axis import joint_of_axis, sure_damping
from rtctl.check.law_plan import build
from rtctl.check.stability_report import admittance_loop, bearing, figures_alone
from rtctl.control.force_feedback import spare_damping
from rtctl.control.jit import compiled
from rtctl.control.proofs.admittance_loop import AdmittanceLoop, points, spectral_radii
from rtctl.control.proofs.drive_in_hand import ElasticJoint
from rtctl.rig_file.config import Config, load

CONFIGS = Path(__file__).parents[3] / "configs"
B_M, B_J, B_L = 0.02, 0.01, 0.03
OF_JOINT = Joint(motor_share=B_M / (B_M + B_L), damping_nms_rad=B_J)


def dissipated(omega, stiffness, hand):
    """Of a motor that moves with 1 rad/s RMS at omega: power that its joint loses, W, where `hand` (complex,
    N m s/rad) holds the link."""
    joint = B_J + stiffness / (1j * omega)
    # forces on the link: its own damper and the hand against the spring and damper of the joint
    link = joint / (joint + B_L + hand)
    return B_M + B_J * abs(1 - link) ** 2 + B_L * abs(link) ** 2


def test_no_hand_leaves_less_and_one_leaves_no_more():
    sure, least = sure_damping(B_M + B_L, OF_JOINT), math.inf
    draw = np.random.default_rng(158)
    for _ in range(20_000):
        omega, stiffness = math.tau * 10 ** draw.uniform(-1, 2.5), 10 ** draw.uniform(-1, 3)
        # any passive hand: a damper of at least nothing, with a mass or a spring
        reactance = draw.choice([-1, 1]) * 10 ** draw.uniform(-3, 2)
        left = dissipated(omega, stiffness, draw.choice([0.0, 10 ** draw.uniform(-4, 1)]) + 1j * reactance)
        assert left >= sure * (1 - 1e-9)
        # a spring by which the link moves as the motor does, b_j/(b_j + b_l) as far
        least = min(least, dissipated(omega, stiffness, stiffness / (1j * omega) * B_L / B_J))
    assert sure == pytest.approx(B_M + B_J * B_L / (B_J + B_L), rel=1e-12)
    assert least == pytest.approx(sure, rel=1e-6)


def growth(undamped, stiffness, link, hand_stiffness, hand_damping=0.0):
    """Largest real part, 1/s, of a motor of .005 kg m2 that the law gives `undamped` N m s/rad of its motion
    back, with its joint, link (kg m2) and a hand that is a spring and a damper."""
    motor = 0.005
    spring = np.array([[stiffness, -stiffness], [-stiffness, stiffness + hand_stiffness]])
    damper = np.array([[B_M + B_J - undamped, -B_J], [-B_J, B_J + B_L + hand_damping]])
    each = np.array([[motor], [link]])
    whole = np.block([[np.zeros((2, 2)), np.eye(2)], [-spring / each, -damper / each]])
    return np.linalg.eigvals(whole).real.max()


def test_a_hand_is_fed_by_what_is_taken_beyond_it_and_by_no_less():
    sure, draw = sure_damping(B_M + B_L, OF_JOINT), np.random.default_rng(14)
    for _ in range(1000):
        stiffness, link = 10 ** draw.uniform(0, 3), 10 ** draw.uniform(-4, -2)
        assert growth(0.999 * sure, stiffness, link, *10 ** draw.uniform((-1, -5), (4, 1))) < 0
        # the motor swings on what is left of the spring: there the hand carries the link's inertia, too
        omega_squared = stiffness * B_L / (B_J + B_L) / 0.005
        hand = stiffness * B_L / B_J + link * omega_squared
        # up to b_m + b_l the account once called it paid for by the joint
        assert growth(1.001 * sure, stiffness, link, hand) > 0


@pytest.mark.parametrize("b", [0.0, 0.05, math.nan])
def test_a_rigid_joint_keeps_all_of_it(b):
    assert sure_damping(b, Joint()) == pytest.approx(b, nan_ok=True)


def credited(**params):
    """J that the account gains while a joint without friction is moved at 1 rad/s for .1 s without torque."""
    rig = LawRig(energy_bank_j=1.0, **params).arm()
    before = rig["energy_port_j"]
    for k in range(100):
        rig.tick(math.floor((k + 1) * T / COUNT) * COUNT)
    assert rig["torque_applied_nm"] == pytest.approx(0.0, abs=1e-6)
    return rig["energy_port_j"] - before


def test_the_account_is_credited_what_is_sure():
    sure = sure_damping(B_M + B_L, OF_JOINT)
    found = credited(viscous_nms_rad=B_M + B_L, sure_viscous_nms_rad=sure)
    assert found == pytest.approx(100 * T * sure, rel=0.02)


@compiled
def spare(state, params):
    return spare_damping(state[0], params[0], 0)


def test_free_help_lives_on_what_is_sure():
    rig = LawRig(viscous_nms_rad=0.05, sure_viscous_nms_rad=0.03)
    assert spare(rig.state, rig.params) == 0.03


def test_the_plan_of_an_elastic_joint_says_what_is_sure():
    loaded = load(CONFIGS / "mock-elastic.toml")
    p, b = build(loaded).params[0], loaded.config.axis[0].viscous_nms_rad
    sure = sure_damping(b, joint_of_axis(loaded, 0))
    assert 0.8 * b < sure < 0.96 * b
    assert p["viscous_nms_rad"][0] == b
    # our own dampers live on no more either
    for name in ("sure_viscous_nms_rad", "hold_damping_nms_rad", "injected_damping_max_nms_rad"):
        assert p[name][0] == sure


def test_behind_a_current_that_overshoots_hold_takes_less_than_is_sure():
    """Against the frequency response, written anew: difference, hold and delay of a tick each turn it."""
    loaded = load(CONFIGS / "mock.toml")
    table = loaded.config.model_dump(mode="json", by_alias=True)
    b, T, hz, share = table["axis"][0]["viscous_nms_rad"], loaded.config.period_s, 100.0, 0.3
    table["axis"][0]["coupling"]["delay_ticks"] = 6.0
    table["axis"][0]["drive"] |= {"current_loop_hz": hz, "current_overshoot": share}
    held = build(loaded.model_copy(update={"config": Config.model_validate(table)})).params[0]
    s = 2j * np.pi * np.geomspace(1.0, 400.0, 4000)
    damped = -np.log(share) / np.hypot(np.pi, np.log(share))
    quick = 2 * np.pi * hz
    loop = quick**2 / (s**2 + 2 * damped * quick * s + quick**2)
    answer = loop * ((1 - np.exp(-s * T)) / (s * T)) ** 2 * np.exp(-6 * s * T)
    assert b + b * answer.real.min() < 0.0, "else nothing is asked"
    assert b + held["hold_damping_nms_rad"][0] * answer.real.min() >= 0.0
    assert held["hold_damping_nms_rad"][0] > 0.5 * b


def helped(loaded, **axis):
    """The rig file with four fifths of the viscous friction compensated."""
    table = loaded.config.model_dump(mode="json", by_alias=True)
    table["axis"][0] |= axis
    table["axis"][0]["friction"]["viscous_gain"] = 0.8
    return loaded.model_copy(update={"config": Config.model_validate(table)})


@pytest.mark.parametrize("rig", ["mock-elastic.toml", "mock.toml"])
def test_what_help_takes_it_takes_at_the_motor(rig):
    loaded = load(CONFIGS / rig)
    strong = helped(loaded)
    plain, found = figures_alone(loaded, 0), figures_alone(strong, 0)
    taken = plain.total_damping_nms_rad - found.total_damping_nms_rad
    assert taken > 0.5 * plain.total_damping_nms_rad
    left = plain.device_damping_nms_rad - taken
    assert found.device_damping_nms_rad == pytest.approx(left, abs=1e-12)
    # the watch of a run's delay goes by the same
    assert bearing(strong, 0)[0] == found.device_damping_nms_rad
    if rig == "mock.toml":
        assert found.device_damping_nms_rad == found.total_damping_nms_rad


def test_behind_a_virtual_mass_help_takes_nothing_of_the_link_either():
    shown = {"mass_kgm2": 0.03, "damping_nms_rad": 0.3, "velocity_gain_nms_rad": 1.2}
    strong = helped(load(CONFIGS / "mock-elastic.toml"), display="admittance", admittance=shown)
    loop, b = admittance_loop(strong, 0), strong.config.axis[0].viscous_nms_rad
    assert loop.viscous_nms_rad == figures_alone(strong, 0).total_damping_nms_rad < 0.5 * b
    share = joint_of_axis(strong, 0).motor_share
    assert loop.link_viscous_nms_rad == pytest.approx((1 - share) * b, rel=1e-12)


def growth_of_a_mass(motor, link, spring, virtual, heavy, late, ticks=1000):
    """Growth a tick of a virtual mass on a world's spring, its servo, an elastic joint and a hand that is a
    mass: Newton's law, each torque held. `motor` and `link`: inertia, damping."""
    (m, b_v, k_e, K_v, K_p, force_hz, velocity_hz), (k_j, b_j) = virtual, spring
    quick_f, quick_v = (1 - math.exp(-math.tau * hz * T) for hz in (force_hz, velocity_hz))
    law = np.zeros((5, 5))  # x, v, the link's, and the torque, which stays
    law[0, 1] = law[2, 3] = 1.0
    law[1] = np.array([-k_j, -b_j - motor[1], k_j, b_j, 1.0]) / motor[0]
    law[3] = np.array([k_j, b_j, -k_j, -b_j - link[1], 0.0]) / (link[0] + heavy)
    first, rest = expm(late * T * law), expm((1 - late) * T * law)
    y, felt, v_hat, v_r, x_r, before, sizes = np.array([0, 0, 0, 0.01, 0]), 0.0, 0.0, 0.0, 0.0, 0.0, []
    for _ in range(ticks):
        felt += quick_f * (-heavy * law[3] @ y - felt)
        v_hat, before = v_hat + quick_v * ((y[0] - before) / T - v_hat), y[0]
        v_r = (m * v_r + T * (felt - k_e * x_r)) / (m + b_v * T + k_e * T * T)
        x_r += T * v_r
        sent = K_v * (v_r - v_hat) + K_p * (x_r - y[0])
        y = first @ y
        y[4] = sent
        y = rest @ y
        sizes.append(abs(y[1]) + abs(y[3]))
    early, last = (max(sizes[end - ticks // 5 : end]) for end in (ticks // 2, ticks))
    return (last / early) ** (2 / ticks)


@pytest.mark.parametrize(("link", "grows"), [(0.1109, True), (0.0376, False)])
def test_a_display_whose_help_is_taken_from_the_link_too_looks_stable_and_is_not(link, grows):
    """Damping of .0463 that help leaves of .1366; behind the spring are .1109 of it, or a share as small."""
    J, share, left, heavy, late, k_j, b_j = 0.012, 0.733, 0.0463, 0.02, 0.578, 657.9, 0.0568
    m, b_v, k_e, K_v, K_p, force_hz, velocity_hz = virtual = 0.0847, 0.723, 2.89e4, 1.548, 10.0, 138.3, 84.4
    loop = AdmittanceLoop(
        J, left, T, m, b_v, K_v, K_p, force_lowpass_hz=force_hz, velocity_lowpass_hz=velocity_hz, delay=late,
        link_viscous_nms_rad=link, joints=(ElasticJoint(share, k_j, b_j),),
    )  # fmt: skip
    radius = spectral_radii(loop, points([(0, 0, heavy, 0, 0, k_e, 0)]))[0]
    motor, behind = ((1 - share) * J, left - link), (share * J, link)
    growth = growth_of_a_mass(motor, behind, (k_j, b_j), virtual, heavy, late)
    assert (growth > 1.005) == grows == (radius > 1.005)
    assert growth == pytest.approx(radius, abs=1e-4)


def test_help_is_taken_off_the_dry_friction_of_the_motor_too():
    def held_nm(motor_share, gain):
        loaded = load(CONFIGS / "mock.toml")
        table = loaded.config.model_dump(mode="json", by_alias=True)
        table["axis"][0]["drive"]["motor_share"] = motor_share
        table["axis"][0]["friction"]["gain"] = gain
        return figures_alone(
            loaded.model_copy(update={"config": Config.model_validate(table)}), 0
        ).dry_friction_nm

    alone = held_nm(0.6, 0.0)
    assert alone == pytest.approx(0.6 * held_nm(1.0, 0.0), rel=1e-9)
    # half of the friction is sent as help, at the motor, where six tenths of it are
    assert 0 <= held_nm(0.6, 0.5) < 0.3 * alone
    assert held_nm(0.6, 0.95) == 0
