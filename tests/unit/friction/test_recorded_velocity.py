"""A velocity column is used in place of the derivative, and refused where it is not that of the position."""

import re
from dataclasses import replace

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.regression import joint_fit
from rtctl.friction.logs.regressors import regressors

RATE_HZ = 500.0
SINES = [(a, 2 * np.pi * f) for a, f in ((0.4, 0.4), (0.15, 1.1), (0.06, 2.3))]


def velocity(t):
    return sum(a * k * np.cos(k * t) for a, k in SINES)


def log(counts_per_rev=None):
    t = np.arange(12_500) / RATE_HZ
    x = sum(a * np.sin(k * t) for a, k in SINES)
    acceleration = -sum(a * k**2 * np.sin(k * t) for a, k in SINES)
    torque = 0.012 * acceleration + 0.05 * velocity(t) + 0.25 * np.sign(velocity(t))
    noise = np.random.default_rng(5).normal(0, 0.01, len(t))
    if counts_per_rev:
        step = 2 * np.pi / counts_per_rev
        x = np.floor(x / step) * step
    return AxisLog(RATE_HZ, x, torque + noise, "log.csv", "0", velocity(t)), t


def test_the_parameters_come_out_from_the_recorded_velocity():
    recorded, _ = log()
    found = joint_fit(regressors(recorded)).symmetric.parameters
    for name, truth in (("inertia_kgm2", 0.012), ("viscous_nms_rad", 0.05), ("coulomb_nm", 0.25)):
        assert found[name].value == pytest.approx(truth, rel=0.01)
        assert found[name].holds(truth)


def test_it_takes_the_place_of_the_derivative_and_does_better_with_a_coarse_encoder():
    recorded, _ = log(counts_per_rev=2000)
    with_it, without = (
        joint_fit(regressors(each)).symmetric for each in (recorded, replace(recorded, velocity_rad_s=None))
    )
    assert with_it.relative_error < 0.8 * without.relative_error
    assert (
        with_it.parameters["inertia_kgm2"].standard_error < without.parameters["inertia_kgm2"].standard_error
    )


@pytest.mark.parametrize("delay_s", [0.006, -0.004])
def test_a_late_velocity_is_put_back_and_said(delay_s):
    recorded, t = log()
    late = replace(recorded, velocity_rad_s=velocity(t - delay_s))
    there, back = regressors(recorded), regressors(late)
    assert np.abs(there.velocity_rad_s - back.velocity_rad_s).max() < 2e-3
    word = "6 ms late" if delay_s > 0 else "4 ms early"
    assert any(word in text and "put right" in text for text in back.warnings)
    assert joint_fit(back).symmetric.parameters["viscous_nms_rad"].value == pytest.approx(0.05, rel=0.02)


def test_the_zero_of_a_tachometer_is_removed_and_said():
    recorded, t = log()
    found = regressors(replace(recorded, velocity_rad_s=velocity(t) + 0.1))
    assert any("zero is off by 0.1 rad/s" in text for text in found.warnings)
    assert np.abs(found.velocity_rad_s - regressors(recorded).velocity_rad_s).max() < 1e-3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v: -v, r"column velocity: turned against the position; turn its sign \(scale -1, behind"),
        (lambda v: np.degrees(v), r"57.* times the derivative .*its unit were deg/s.*give scale 0\.0174533"),
        (lambda v: 30 / np.pi * v, "its unit were rpm"),
        (lambda v: 1.1 * v, r"1\.1 times the derivative.*give scale 0\.909"),
        (lambda v: np.roll(v, 400), "does not follow the position"),
        (lambda v: 0 * v, "does not follow the position"),
    ],
)
def test_a_velocity_that_disagrees_with_the_position_is_refused_with_the_remedy(change, message):
    recorded, t = log()
    with pytest.raises(DataError, match=message):
        regressors(replace(recorded, velocity_rad_s=change(velocity(t))))


def test_a_delay_too_long_to_put_right_is_refused():
    t = np.arange(12_500) / RATE_HZ
    slow = AxisLog(RATE_HZ, np.sin(2.5 * t), np.cos(2.5 * t), "log.csv", "0", 2.5 * np.cos(2.5 * (t - 0.04)))
    with pytest.raises(DataError, match=r"40.1 ms late .* at most 25 ms"):
        regressors(slow)


@pytest.mark.parametrize("cutoff_hz", [20.0, 60.0])
@pytest.mark.parametrize("counts_per_rev", [None, 1024])
def test_a_velocity_that_its_program_low_passed_is_undone_and_said(cutoff_hz, counts_per_rev):
    recorded, _ = log(counts_per_rev)
    share = 1 - np.exp(-2 * np.pi * cutoff_hz / RATE_HZ / 50)
    fine = np.interp(np.arange(50 * 12_500) / 50, np.arange(12_500), recorded.velocity_rad_s)
    from scipy.signal import lfilter

    behind = lfilter([share], [1, share - 1], fine)[::50]
    found = regressors(replace(recorded, velocity_rad_s=behind))
    inside = slice(200, -200)
    assert np.abs((found.velocity_rad_s - regressors(recorded).velocity_rad_s)[inside]).max() < 0.01
    said = " ".join(found.warnings)
    assert re.search(r"filtered, as by a low-pass of (\d+\.?\d*) Hz .*; put right", said), said
    told_hz = float(re.search(r"low-pass of (\d+\.?\d*) Hz", said)[1])
    assert told_hz == pytest.approx(cutoff_hz, rel=0.15)
    assert joint_fit(found).symmetric.parameters["inertia_kgm2"].value == pytest.approx(0.012, rel=0.02)


def test_a_coarse_position_is_no_reason_to_refuse_a_good_velocity():
    """Rows of a slow joint see a step in turn with none: the derivative of such a position is noise as large
    as itself.
    """
    t = np.arange(30_000) / 2000.0
    v = 0.06 * np.cos(0.9 * t)
    x = np.floor(0.06 / 0.9 * np.sin(0.9 * t) / 3e-3) * 3e-3
    slow = AxisLog(2000.0, x, np.sign(v), "log.csv", "0", v)
    assert np.abs(regressors(slow).velocity_rad_s).max() < 0.07
    with pytest.raises(DataError, match="does not follow the position"):
        regressors(replace(slow, velocity_rad_s=0.06 * np.cos(1.7 * t)))


def test_a_position_whose_scale_drifts_against_the_velocity_is_told():
    recorded, t = log()
    drifted = replace(recorded, position_rad=recorded.position_rad * (1 + 0.1 * (t / t[-1] - 0.5)))
    told = "".join(text for text in regressors(drifted).warnings if "drifts" in text)
    assert "its derivative is 0.967, 0.999, 1.03 times the velocity" in told
    assert not any("drifts" in text for text in regressors(recorded).warnings)


def test_a_part_at_one_speed_tells_no_scale():
    t = np.arange(15_000) / RATE_HZ
    own = sum(a * k * np.cos(k * t) for a, k in SINES)
    v = np.where((t > 9.5) & (t < 20.5), 0.3, own)
    x = np.round(np.cumsum(v) / RATE_HZ / 1e-4) * 1e-4
    noise = np.random.default_rng(2).normal(0, 1e-5, len(t))
    told = regressors(AxisLog(RATE_HZ, x, 0.25 * np.sign(v), "log.csv", "0", v + noise)).warnings
    assert not any("drifts" in text for text in told)
