"""The torque as a whole: friction that is a share of it, scales that bend and drift.

That nothing of the kind is said of honest logs is a matter of `test_dirty_logs.py`.
"""

import re

import numpy as np
import pytest
from dirty_changes import clean, through_gear
from dirty_logs import identified
from scipy.ndimage import gaussian_filter1d

from rtctl.friction.logs.bristle_columns import lugre_bristle
from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.regression import joint_fit
from rtctl.friction.logs.regressors import regressors
from rtctl.friction.logs.torque_shape import Effect, bent, drifting, with_share
from rtctl.friction.logs.two_gains import of_two_gains

RATE_HZ = 500.0
INERTIA, VISCOUS, COULOMB = 0.02, 0.05, 0.2


def moved(shape, brisk=1.0, noise=2e-3, seed=1, peak=0.0):
    """A log of strokes, quicker with `brisk`, with a Stribeck peak of `peak` of the Coulomb friction; `shape`
    makes the torque of that which the motion wants, its direction and the share of the time.
    """
    t = np.arange(0, 30, 1 / RATE_HZ)
    parts = [(0.5, 0.31, 0.1), (0.25, 0.83, 1.1), (0.12, 1.9, 2.0)]
    w = [(a, 2 * np.pi * f * brisk, p) for a, f, p in parts]
    x = sum(a * np.sin(k * t + p) for a, k, p in w)
    v = sum(a * k * np.cos(k * t + p) for a, k, p in w)
    acceleration = sum(-a * k**2 * np.sin(k * t + p) for a, k, p in w)
    s = np.sign(v)
    wanted = INERTIA * acceleration + VISCOUS * v + COULOMB * s * (1 + peak * np.exp(-np.abs(v) / 0.5))
    torque = shape(wanted, s, t / t[-1]) + np.random.default_rng(seed).normal(0, noise, len(t))
    return regressors(AxisLog(RATE_HZ, x, torque, "made", "0" * 64))


def geared(k):
    return lambda u, s, _: u / (1 - k * np.sign(u * s))


@pytest.mark.parametrize("k", [0.1, 0.25])
def test_a_share_of_the_torque_is_found_and_taken_out_of_the_parameters(k):
    signals = moved(geared(k), brisk=1.6)
    plain = joint_fit(signals).symmetric.parameters
    assert abs(plain["inertia_kgm2"].value / INERTIA - 1) > 0.3 * k
    shared, told, untold = with_share(signals)
    assert "grows with the torque" in told[0]
    assert untold == ()
    found = joint_fit(shared).symmetric.parameters
    assert found["torque_share"].value == pytest.approx(k, abs=0.01)
    assert found["inertia_kgm2"].value == pytest.approx(INERTIA, rel=0.02)
    assert found["coulomb_nm"].value == pytest.approx(COULOMB, rel=0.02)
    assert found["viscous_nms_rad"].value == pytest.approx(VISCOUS, rel=0.05)


def test_a_torque_that_always_drives_tells_no_share_and_that_is_said():
    shared, told, untold = with_share(moved(geared(0.2), brisk=0.5))
    assert shared.share_nm is None
    assert told == ()
    assert "share of the torque" in untold[0]


def test_a_torque_whose_scale_differs_between_its_signs_is_told_and_friction_that_does_is_not():
    (told,) = of_two_gains(moved(lambda u, s, _: np.where(u < 0, 0.8 * u, u), brisk=1.6))
    assert re.search("the torque is 2[456] % larger above 0 than on the other side", told)
    assert of_two_gains(moved(lambda u, s, _: u + 0.05, brisk=1.6)) == ()
    # s u holds the viscous friction, |v|, and an offset
    assert of_two_gains(moved(lambda u, s, _: np.where(s < 0, u - 0.4 * s * COULOMB, u), brisk=1.6)) == ()


def test_a_torque_in_proportion_has_no_share_no_bend_and_no_drift():
    for seed in range(8):
        signals = moved(lambda u, s, _: u, brisk=1.6, noise=0.02, seed=seed)
        assert with_share(signals)[0].share_nm is None
        assert bent(signals) == ()
        assert drifting(signals) == ()


@pytest.mark.parametrize(
    ("value", "error", "beside", "beside_error", "rest", "sure"),
    [
        (0.1, 0.02, 0.1, 0.02, 0.9, True),
        (0.1, 0.03, 0.1, 0.02, 0.9, False),
        (0.1, 0.02, 0.1, 0.04, 0.9, False),
        (0.1, 0.02, -0.1, 0.02, 0.9, False),
        (0.1, 0.02, 0.1, 0.02, 0.99, False),
    ],
)
def test_an_effect_is_sure_by_its_errors_alone_and_beside_others_and_by_what_it_explains(
    value, error, beside, beside_error, rest, sure
):
    assert Effect(np.zeros(1), value, error, beside, beside_error, rest, 1.0).sure() is sure


@pytest.mark.parametrize(("missing", "word"), [(0.2, "too small"), (-0.2, "too large")])
def test_a_torque_that_bends_is_told_with_how_much(missing, word):
    signals = moved(lambda u, s, _: u * (1 - missing * (u / np.abs(u).max()) ** 2), brisk=1.6)
    assert f"% {word}" in bent(signals)[0]
    assert with_share(signals)[0].share_nm is None


def test_a_torque_constant_that_falls_is_told_beside_a_friction_that_leaves_as_much_over():
    def of_current(u, s, _):
        return u * (1 + 0.25 * (u / np.abs(u).max()) ** 2)

    (told,) = bent(moved(of_current, brisk=1.6, peak=1.2))
    assert "% too large against small torques (the motor makes less of a large current" in told
    assert bent(moved(lambda u, s, _: u, brisk=1.6, peak=1.2)) == ()
    # far too little to matter for the inertia
    assert bent(moved(lambda u, s, _: u * (1 + 0.01 * (u / np.abs(u).max()) ** 2), brisk=1.6, peak=1.2)) == ()


def test_a_scale_that_drifts_is_told_of_which_column_it_is():
    of_torque = drifting(moved(lambda u, s, at: u * (1 + 0.3 * at)))
    assert "the scale of the torque drifts" in of_torque[0]
    of_position = drifting(moved(lambda u, s, at: COULOMB * s + (u - COULOMB * s) * (1 + 0.3 * at)))
    assert "the scale of the position drifts" in of_position[0]
    assert "grow together" in of_position[0]


def test_a_geared_joint_in_brisk_motion_is_right_to_the_tenth(tmp_path):
    found = identified(through_gear(0.2, brisk=True)(clean("motor")), tmp_path)
    assert "friction grows with the torque" in found.said
    assert abs(found.off["inertia_kgm2"]) < 0.1


def test_friction_that_grows_with_the_square_of_speed_is_no_sensor_that_bends():
    """Even strokes at five speeds: the cube of the torque looks like it, but leaves more over."""
    t = np.arange(0, 40, 1 / RATE_HZ)
    steps = np.where(t % 2 < 1, 1, -1) * np.array([0.3, 1, 2, 4, 5])[(t // 2).astype(int) % 5]
    x = gaussian_filter1d(np.cumsum(steps) / RATE_HZ, 10)
    assert bent(resisted(t, x, lambda v: np.sign(v) * (0.3 + 0.02 * v**2))) == ()


def test_long_bristles_in_a_chirp_are_no_scale_that_drifts():
    """Slow wide strokes first, quick narrow ones last: bristles of 30 mrad are another friction in each."""
    t = np.arange(0, 40, 1 / RATE_HZ)
    hertz = 0.1 * 30 ** (t / t[-1])
    x = 0.6 * np.minimum(1, (0.35 / hertz) ** 0.9) * np.sin(2 * np.pi * np.cumsum(hertz) / RATE_HZ)
    assert drifting(resisted(t, x, lambda _: 0.3 * lugre_bristle(x, 0.03))) == ()


def resisted(t, x, friction):
    """A log of a motion whose torque is that of a mass, viscous friction and `friction` of the velocity."""
    v = np.gradient(x, t)
    torque = 0.02 * np.gradient(v, t) + 0.02 * v + friction(v)
    torque += np.random.default_rng(1).normal(0, 2e-3, len(t))
    return regressors(AxisLog(RATE_HZ, x, torque, "made", "0" * 64))
