import math

import numpy as np
import pytest
from law_rig import COUNT, LawRig, Plant, T

from rtctl.control.environments import detents
from rtctl.control.vocabulary import Fault, State

K_C, B_C = 60.0, 0.005


def rig(kind, k_c=K_C, b_c=B_C, **values):
    made = LawRig(coupling_stiffness_nm_rad=k_c, coupling_damping_nms_rad=b_c, energy_budget_j=1e3)
    made.environment(kind, **values)
    return made.arm()


def settle(made, position, ticks=40):
    """Move there slowly enough not to be a jump, and stay."""
    for x in np.linspace(made.position[0], position, 60)[1:]:
        made.tick(x)
    return made.run(ticks)


@pytest.mark.parametrize("k_e", [1.0, 60.0, 1e3, 1e6])
def test_a_spring_behind_the_coupling_is_felt_as_both_in_series(k_e):
    made = settle(rig("spring", environment_stiffness_nm_rad=k_e, environment_center_rad=0.01), 0.03)
    series = K_C * k_e / (K_C + k_e)
    assert made["coupling_torque_nm"] == pytest.approx(-series * 0.02, rel=1e-6)
    assert K_C * (0.03 - made["proxy_position_rad"]) == pytest.approx(series * 0.02, rel=1e-6)


def test_free_space_gives_no_torque_at_rest():
    assert settle(rig("free"), 0.5)["coupling_torque_nm"] == pytest.approx(0.0, abs=1e-12)


def test_without_a_coupling_there_is_no_torque_at_all():
    made = settle(rig("spring", k_c=0.0, b_c=0.0, environment_stiffness_nm_rad=1e6), 0.5)
    assert made["coupling_torque_nm"] == 0.0
    assert made["proxy_position_rad"] == 0.5


def test_a_damper_opposes_motion_and_lets_go_at_rest():
    made = rig("damper", b_c=0.0, environment_damping_nms_rad=0.02)
    for k in range(200):
        made.tick(0.5 * T * k)
    assert made["coupling_torque_nm"] == pytest.approx(-0.02 * 0.5, rel=1e-3)
    assert made.run(100)["coupling_torque_nm"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("damping", [0.0, 0.02, 5.0])
@pytest.mark.parametrize("k_e", [5.0, 1e6])
def test_a_wall_pushes_out_and_never_pulls(side, damping, k_e):
    made = rig(
        "wall",
        environment_side=side,
        environment_stiffness_nm_rad=k_e,
        environment_damping_nms_rad=damping,
        environment_center_rad=side * 0.02,
    )
    touched = 0
    for k in range(1500):
        made.tick(side * 0.05 * math.sin(k * 0.02) + 0.001 * math.sin(k * 0.9))
        push = -side * made["coupling_torque_nm"]
        assert push >= -1e-9
        if made["proxy_position_rad"] * side < 0.02 - 1e-9:
            assert abs(push) < 1e-9
        touched += push > 1e-6
    assert 100 < touched < 1400


def test_a_wall_is_not_felt_from_outside_and_is_the_series_spring_inside():
    made = rig("wall", environment_side=1, environment_stiffness_nm_rad=30.0, environment_center_rad=0.02)
    assert settle(made, 0.019)["coupling_torque_nm"] == pytest.approx(0.0, abs=1e-12)
    assert settle(made, 0.03)["coupling_torque_nm"] == pytest.approx(-20.0 * 0.01, rel=1e-6)


def test_detents_pull_to_the_nearest_valley():
    values = {
        "environment_stiffness_nm_rad": 5.0,
        "environment_pitch_rad": 0.2,
        "environment_center_rad": 0.05,
    }
    made = rig("detents", **values)
    for x, direction in ((0.27, -1), (0.23, 1), (0.25, 0)):
        settle(made, x)
        assert made["coupling_torque_nm"] * direction >= 0.0
        proxy = made["proxy_position_rad"]
        force = 5.0 * 0.2 / (2 * math.pi) * math.sin(2 * math.pi * (proxy - 0.05) / 0.2)
        assert made["coupling_torque_nm"] == pytest.approx(-force, abs=1e-9)


def test_the_implicit_detent_solution_leaves_no_residual():
    rng = np.random.default_rng(5)
    for _ in range(500):
        k, stiffness, pitch = rng.uniform(0.1, 2e3), rng.uniform(1.0, 300.0), rng.uniform(0.01, 1.0)
        before, w = rng.uniform(-2, 2), rng.uniform(-2, 2) * 100
        p = detents.solve(w, stiffness, k, 0.1, pitch, before)
        force, _ = detents.force(p, before, k, 0.1, pitch)
        assert w - stiffness * p == pytest.approx(force, abs=1e-6 * (1 + abs(w) + k * pitch))


def test_the_slope_of_the_detent_force_is_its_derivative():
    rng = np.random.default_rng(6)
    for _ in range(300):
        p, before = rng.uniform(-0.3, 0.3, 2)
        h = 1e-7
        force, slope = detents.force(p, before, 7.0, 0.02, 0.2)
        up, down = (detents.force(p + d, before, 7.0, 0.02, 0.2)[0] for d in (h, -h))
        one_sided = sorted(((up - force) / h, (force - down) / h))
        assert one_sided[0] - 1e-4 <= slope <= one_sided[1] + 1e-4  # between them where the branch changes


def test_a_remote_target_is_followed_extrapolated_and_then_kept():
    made = rig("free", b_c=0.0)
    made.environment("remote", target_position_rad=0.01, target_velocity_rad_s=0.5)
    made.request("target_count")
    made.tick()
    assert made["coupling_torque_nm"] == pytest.approx(K_C * 0.01)
    made.run(10)
    assert made["target_age_ticks"] == 10
    assert made["proxy_position_rad"] == pytest.approx(0.01 + 0.5 * T * 10)
    made.run(30)
    assert made["proxy_position_rad"] == pytest.approx(0.01 + 0.5 * T * 20)


def test_nothing_winds_up_while_disabled():
    made = LawRig(coupling_stiffness_nm_rad=K_C, coupling_damping_nms_rad=B_C)
    made.environment("damper", environment_damping_nms_rad=100.0)
    for k in range(500):
        made.tick(1.0 * T * k)
    assert made["proxy_position_rad"] == pytest.approx(made.position[0], abs=2e-3)


def test_a_command_that_is_not_finite_cuts_and_leaves_nothing_in_the_state():
    made = rig("spring", environment_stiffness_nm_rad=5.0)
    made.environment("spring", environment_center_rad=math.nan)
    made.tick()
    assert made.faults & Fault.LAW_NOT_FINITE
    assert made.mode is State.FAULT
    assert made["torque_applied_nm"] == 0.0
    made.environment("spring", environment_center_rad=0.0)
    made.tick()
    assert made.faults == Fault(0)
    assert math.isfinite(made["coupling_torque_nm"])


def swing(k_c, b_c, k_e, kind="spring", ticks=6000, count=COUNT, **params):
    """Let the nominal plant go with a velocity against an environment; peak motion of the last tenth."""
    made = LawRig(
        coupling_stiffness_nm_rad=k_c,
        coupling_damping_nms_rad=b_c,
        **{"torque_limit_nm": 1e3, "torque_rate_nm": 1e4, "energy_budget_j": 1e6, "velocity_limit_rad_s": 1e3,
           "injected_damping_max_nms_rad": 0.0, **params},
    )  # fmt: skip
    made.environment(kind, environment_stiffness_nm_rad=k_e, environment_side=1).arm()
    plant = Plant(velocity=0.2)
    tail = []
    for k in range(ticks):
        made.tick(math.floor(plant.x / count) * count)
        plant.advance(made["torque_applied_nm"])
        if k > 0.9 * ticks:
            tail.append(abs(plant.x))
        if abs(plant.x) > 10:
            return math.inf, made
    return max(tail), made


def test_a_stiff_spring_inside_the_sampled_data_bound_comes_to_rest():
    tail, made = swing(k_c=85.0, b_c=0.005, k_e=1e6)
    assert tail < 10 * COUNT  # of 61 counts at the start; quantisation keeps the rest alive without friction
    assert made["energy_port_j"] >= 0.0


def test_the_free_device_is_unstable_just_above_its_eigenvalue_bound_and_stable_below():
    # Eigenvalues of the free joint on its coupling: 119.98 N m/rad for b = .05, b_c = .01.
    def growth(k_c):
        return (
            swing(k_c, 0.01, 1e12, ticks=6000, count=1e-12)[0]
            / swing(k_c, 0.01, 1e12, count=1e-12, ticks=2000)[0]
        )

    assert growth(118.5) < 0.95
    assert growth(121.5) > 1.05


def test_a_wall_inside_the_bound_is_left_and_does_not_throw():
    made = LawRig(coupling_stiffness_nm_rad=85.0, coupling_damping_nms_rad=0.005)
    made.environment(
        "wall", environment_side=1, environment_stiffness_nm_rad=1e5, environment_center_rad=0.02
    )
    made.arm()
    plant = Plant(velocity=1.0)
    fastest_out = 0.0
    for _ in range(2000):
        made.tick(math.floor(plant.x / COUNT) * COUNT)
        plant.advance(made["torque_applied_nm"])
        fastest_out = min(fastest_out, plant.v)
    assert -1.0 < fastest_out < -0.1
    assert made.faults == Fault(0)
