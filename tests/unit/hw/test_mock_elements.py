"""Maxwell-slip elements against what springs and sliders in parallel must do, in closed form."""

import numpy as np
import pytest
from mock_runs import plant

from hw.simulators.mock_bristles import static_friction
from hw.simulators.mock_elements import element_torque, settle_elements

STIFFNESS, FRICTION, COUNT = 250.0, 0.3, 8
LONGEST = 2 * COUNT / (COUNT + 1) * FRICTION / STIFFNESS


def elements(**friction):
    """Parameters without a Stribeck peak and bristle damping: the elements alone."""
    fields = {"coulomb_nm": FRICTION, "breakaway_nm": FRICTION, "bristle_damping_nms_rad": 0.0, **friction}
    return plant(axis=[{"friction": {"model": "gms", "elements": COUNT, **fields}}])[0][0]


def path(p, places, torques=None, h=1e-3):
    """Torque at each place (rad), reached in one step from the last; `torques` is changed."""
    torques = np.zeros(16) if torques is None else torques
    shown, before = [], 0.0
    for x in places:
        shown.append(settle_elements((x - before) / h, 0.0, torques, FRICTION, FRICTION, 1.0, h, p, 0))
        before = x
    return np.array(shown)


def virgin(x):
    """First loading of equally stiff springs that slide at i / N of the longest deflection."""
    limits = LONGEST * np.arange(1, COUNT + 1) / COUNT
    return STIFFNESS / COUNT * np.minimum(np.abs(np.atleast_1d(x))[:, None], limits).sum(axis=1)


def test_the_first_loading_is_the_sum_of_the_springs():
    x = np.linspace(0, 2 * LONGEST, 300)
    assert np.allclose(path(elements(), x), virgin(x), rtol=1e-12, atol=1e-14)
    assert virgin(LONGEST)[0] == pytest.approx(FRICTION, rel=1e-12)
    assert virgin(1e-6)[0] / 1e-6 == pytest.approx(STIFFNESS, rel=1e-9), "sigma0 is the slope at the start"


def test_a_reversal_follows_masings_rule():
    turn = 0.6 * LONGEST
    up, down = np.linspace(0, turn, 100), np.linspace(turn, -turn, 200)
    torque = path(elements(), np.concatenate([up, down]))[100:]
    assert np.allclose(torque, virgin(turn)[0] - 2 * virgin((turn - down) / 2), rtol=1e-9, atol=1e-12)


def test_an_inner_loop_closes_and_the_way_before_it_is_remembered():
    p, torques = elements(), np.zeros(16)
    out = np.linspace(0, 0.8 * LONGEST, 50)
    inner = np.concatenate([np.linspace(0.8, 0.3, 50), np.linspace(0.3, 0.8, 50)]) * LONGEST
    on = np.linspace(0.8, 1.5, 50) * LONGEST
    shown = path(p, np.concatenate([out, inner, on]), torques)
    assert shown[49] == pytest.approx(shown[149], rel=1e-9)
    assert np.allclose(shown[150:], virgin(on), rtol=1e-9)


def test_the_loss_of_a_loop_is_its_area_and_not_its_energy_back():
    p, torques, h = elements(), np.zeros(16), 1e-3
    x = 0.7 * LONGEST * np.sin(np.linspace(0, 6 * np.pi, 6_001))
    lost, before = 0.0, 0.0
    for k, place in enumerate(x):
        w = (place - before) / h
        force, _ = element_torque(w, torques, FRICTION, FRICTION, 1.0, h, 0.0, p, 0)
        settle_elements(w, 0.0, torques, FRICTION, FRICTION, 1.0, h, p, 0)
        lost += force * (place - before) if k > 4_000 else 0.0
        before = place
    # area of the loop between +-a by Masing's rule: 8 times the integral of virgin over 0..a, less 4 a
    # virgin(a)
    a = 0.7 * LONGEST
    fine = np.linspace(0, a, 100_001)
    area = 8 * np.trapezoid(virgin(fine), fine) - 4 * a * virgin(a)[0]
    assert lost == pytest.approx(area, rel=1e-3)


@pytest.mark.parametrize("w", [-3.0, -0.01, 1e-4, 0.2, 10.0])
@pytest.mark.parametrize("end", [0.0, 0.3, 1.0])
def test_the_torque_of_a_step_never_falls_with_its_speed_and_its_slope_is_the_derivative(w, end):
    p = elements(bristle_damping_nms_rad=1.0)
    torques = np.zeros(16)
    torques[:COUNT] = (
        np.random.default_rng(1).uniform(-1, 1, COUNT) * FRICTION * p["element_strength"][0, :COUNT]
    )
    step = 1e-7 * abs(w)
    low, high = (element_torque(w + d, torques, 0.3, 0.33, 0.7, 1e-3, end, p, 0)[0] for d in (-step, step))
    slope = element_torque(w, torques, 0.3, 0.33, 0.7, 1e-3, end, p, 0)[1]
    assert slope >= 0
    assert (high - low) / (2 * step) == pytest.approx(slope, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("speed", [0.01, 0.1, -0.3, 2.0])
def test_steady_sliding_gives_the_static_curve(speed):
    p = plant(axis=[{"friction": {"model": "gms", "scale_negative": 1.2}}])[0][0]
    g = abs(static_friction(speed, 0.0, p, 0)) - 0.05 * abs(speed) * (1.2 if speed < 0 else 1.0)
    torques = np.zeros(16)
    for _ in range(400):
        shown = settle_elements(speed, speed, torques, g, g, 1.0, 1e-3, p, 0)
    assert shown == pytest.approx(np.copysign(g, speed), rel=1e-9)
    assert element_torque(speed, torques, g, g, 1.0, 1e-4, 0.0, p, 0)[0] == pytest.approx(
        np.copysign(g, speed), rel=1e-9
    )


def test_what_falls_below_an_elements_torque_lets_it_slip_at_once():
    p, torques = elements(), np.zeros(16)
    path(p, [LONGEST], torques)
    assert settle_elements(0.0, 0.0, torques, 0.1, 0.1, 1.0, 1e-3, p, 0) == pytest.approx(0.1, rel=1e-12)
