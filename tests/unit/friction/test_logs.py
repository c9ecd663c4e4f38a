"""Friction from a recorded log: what was put into a synthetic log comes out again."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from hw.interface import Rig
from hw.playback.options import PlaybackOptions
from hw.playback.reader import load
from rtctl.errors import DataError
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.logs.dynamics import AxisLog, differentiate, regress, smooth
from rtctl.friction.logs.intervals import Estimate
from rtctl.friction.logs.logs import axis_log, friction_samples, level_points, pool
from rtctl.simulation.playback_doubts import against_identify

RATE_HZ = 2000.0
INERTIA, VISCOUS, FORWARD, BACKWARD, BIAS = 1.6e-3, 0.01, 0.03, 0.02, 0.013


def velocity(t):
    return 0.9 * np.sin(2 * np.pi * 0.6 * t) + 0.35 * np.sin(2 * np.pi * 1.7 * t + 0.4)


def true_friction(v):
    return VISCOUS * v + np.where(v > 0, FORWARD, -BACKWARD)


def synthetic(seconds=20.0, *, bias=BIAS, noise=1e-3, quantum=2 * np.pi / 300_000):
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    w1, w2 = 2 * np.pi * 0.6, 2 * np.pi * 1.7
    x = -0.9 / w1 * np.cos(w1 * t) - 0.35 / w2 * np.cos(w2 * t + 0.4)
    a = 0.9 * w1 * np.cos(w1 * t) + 0.35 * w2 * np.cos(w2 * t + 0.4)
    torque = INERTIA * a + true_friction(velocity(t)) + bias
    torque = torque + noise * np.random.default_rng(3).normal(size=len(t))
    return AxisLog(RATE_HZ, np.round(x / quantum) * quantum, torque, "synthetic.csv", "0" * 64)


@pytest.mark.parametrize("shape", [(10,), (1, 400), (3, 5000)])
@pytest.mark.parametrize(("rate_hz", "cutoff_hz"), [(1000.0, 20.0), (100.0, 20.0), (20_000.0, 3.0)])
def test_the_filter_of_a_log_is_that_of_scipy_to_the_last_bit(shape, rate_hz, cutoff_hz):
    signal = np.cumsum(np.random.default_rng(2).normal(size=shape), axis=-1)
    wanted = sosfiltfilt(butter(2, cutoff_hz, fs=rate_hz, output="sos"), signal)
    assert np.array_equal(smooth(signal, rate_hz, cutoff_hz), wanted)
    signal[..., 3] = np.nan
    assert np.isnan(smooth(signal, rate_hz, cutoff_hz)).all()
    with pytest.raises(ValueError, match="too few for the filter"):
        smooth(signal[..., :9], rate_hz, cutoff_hz)


def test_inertia_viscous_and_dry_friction_come_out_as_put_in():
    found = regress(differentiate(synthetic()), speed_min_rad_s=0.15)
    assert found.inertia_kgm2 == pytest.approx(INERTIA, rel=0.02)
    assert found.viscous_nms_rad == pytest.approx(VISCOUS, rel=0.05)
    assert found.level_forward_nm == pytest.approx(FORWARD + BIAS, rel=0.02)
    assert found.level_backward_nm == pytest.approx(-BACKWARD + BIAS, abs=0.02 * BACKWARD)
    assert found.coulomb_nm == pytest.approx(0.5 * (FORWARD + BACKWARD), rel=0.02)
    assert found.midpoint_nm == pytest.approx(BIAS + 0.5 * (FORWARD - BACKWARD), abs=5e-4)
    assert found.rms_nm < 1.5e-3


@pytest.mark.parametrize("hz", [3.0, 8.0])
def test_the_inertia_of_a_log_of_a_low_rate_is_right_in_quick_motion(hz):
    t, w, slow = np.arange(0, 30, 0.01), 2 * np.pi * hz, np.pi
    x = 0.3 / hz * np.sin(w * t) + 0.1 * np.sin(slow * t)
    v = 0.3 / hz * w * np.cos(w * t) + 0.1 * slow * np.cos(slow * t)
    a = -0.3 / hz * w**2 * np.sin(w * t) - 0.1 * slow**2 * np.sin(slow * t)
    found = regress(differentiate(AxisLog(100.0, x, INERTIA * a + VISCOUS * v, "slow.csv", "0" * 64)))
    assert found.inertia_kgm2 == pytest.approx(INERTIA, rel=0.002)


def test_the_velocity_has_no_delay_and_the_torque_passes_the_same_filter():
    log = synthetic(noise=0.0)
    motion = differentiate(log)
    np.testing.assert_allclose(motion.velocity_rad_s, velocity(motion.time_s), atol=2e-3)
    index = np.round(motion.time_s * RATE_HZ).astype(int)
    np.testing.assert_array_equal(motion.torque_nm, smooth(log.torque_nm, RATE_HZ, 20.0)[index])
    steps = np.diff(index)
    assert steps.min() == steps.max() == 10


def test_friction_samples_give_the_true_friction_once_the_bias_is_known():
    samples = friction_samples(synthetic(), INERTIA, bias_nm=BIAS, speed_min_rad_s=0.15)
    error = samples.friction_nm - true_friction(samples.velocity_rad_s)
    assert np.sqrt(np.mean(error**2)) < 0.05 * BACKWARD
    assert np.abs(samples.velocity_rad_s).min() >= 0.15


def test_the_midpoint_bias_makes_both_directions_alike():
    samples = friction_samples(synthetic(), INERTIA, bias_nm="midpoint", speed_min_rad_s=0.15)
    dry = samples.friction_nm - VISCOUS * samples.velocity_rad_s
    forward, backward = dry[samples.velocity_rad_s > 0].mean(), dry[samples.velocity_rad_s < 0].mean()
    assert forward == pytest.approx(-backward, rel=0.01)
    assert forward == pytest.approx(0.5 * (FORWARD + BACKWARD), rel=0.02)


def test_samples_averaged_by_speed_train_a_model_of_the_true_friction():
    points = level_points(friction_samples(synthetic(), INERTIA, bias_nm=BIAS, speed_min_rad_s=0.1))
    for direction in (1, -1):
        speed, _ = points.branch(direction)
        assert 20 <= len(speed) <= 60
    assert points.count.min() >= 8
    assert np.isfinite(points.std_nm).all()
    model = fit_points(points, rig="bench", epsilon_nm=5e-4)
    v = np.concatenate([np.linspace(0.15, 1.1, 50), -np.linspace(0.15, 1.1, 50)])
    np.testing.assert_allclose(model.magnitude(v), np.abs(true_friction(v)), rtol=0.05)


def test_pooled_samples_keep_every_part_and_remember_where_they_came_from():
    samples = friction_samples(synthetic(5.0), INERTIA, bias_nm=BIAS)
    first, second = samples.between(0, 2.5), samples.between(2.5, 99)
    both = pool([first, second])
    np.testing.assert_array_equal(both.friction_nm, samples.friction_nm)
    assert both.sha256 != samples.sha256
    assert pool([samples]) is samples


def test_a_torque_of_the_wrong_sign_is_refused_with_the_remedy():
    log = synthetic(5.0)
    turned = AxisLog(log.rate_hz, log.position_rad, -log.torque_nm, log.source, log.sha256)
    with pytest.raises(DataError, match="scale = -1"):
        friction_samples(turned, 0.0)


def test_a_bias_larger_than_friction_is_refused():
    with pytest.raises(DataError, match=r"synthetic\.csv: friction backwards"):
        friction_samples(synthetic(5.0, bias=0.1), INERTIA)


def test_motion_in_one_direction_only_is_refused():
    n = 8000
    log = AxisLog(RATE_HZ, np.arange(n) * 1e-4, np.full(n, 0.03), "one_way.csv", "0")
    with pytest.raises(DataError, match="0 samples of motion backwards"):
        regress(differentiate(log))
    with pytest.raises(DataError, match=r"one_way\.csv: 0 samples of motion backwards"):
        friction_samples(log, INERTIA)


def test_motion_at_one_speed_cannot_show_an_inertia():
    motion = differentiate(synthetic(5.0))
    one_speed = np.where(motion.velocity_rad_s > 0, 0.5, -0.5)
    still = type(motion)(motion.time_s, one_speed, np.zeros_like(one_speed), motion.torque_nm)
    with pytest.raises(DataError, match="too even"):
        regress(still)


@pytest.mark.parametrize(
    ("cutoff", "said"), [(0.0, "cut-off"), (900.0, "cut-off"), (float("nan"), "cut-off"), (1.0, "too few")]
)
def test_a_filter_that_the_log_cannot_carry_is_refused(cutoff, said):
    with pytest.raises(DataError, match=said):
        differentiate(synthetic(5.0), cutoff)


def rig():
    return Rig(
        n_axes=1,
        period_s=1e-3,
        gear_ratio=np.array([80.0]),
        gear_efficiency=np.array([0.75]),
        torque_constant_nm_a=np.array([0.02]),
        encoder_counts_per_rev=np.array([160_000.0]),
        lever_m=np.array([[0.0, 0.1, 0.0]]),
    )


def recording(folder, axis, **more):
    lines = [f"{k / 1000!r},{0.01 * k!r},{0.1 * k!r},{-0.3 * k!r}" for k in range(20)]
    (folder / "log.csv").write_text("t,x,q,h\n" + "\n".join(lines) + "\n")
    table = {
        "file": "log.csv",
        "time": {"column": "t"},
        "axis": [{"position": {"column": "x"}, **axis}],
        **more,
    }
    return load(
        PlaybackOptions.model_validate(table, context={"folder": folder}).model_dump(mode="json"), rig()
    )


def test_motor_and_hand_torque_add_up_in_the_balance(tmp_path):
    both = recording(tmp_path, {"motor_torque": {"column": "q"}, "hand_torque": {"column": "h"}})
    k = np.arange(20)
    np.testing.assert_allclose(axis_log(both, rig()).torque_nm, -0.2 * k, atol=1e-14)
    np.testing.assert_allclose(axis_log(both, rig(), use="motor").torque_nm, 0.1 * k, atol=1e-14)
    np.testing.assert_allclose(axis_log(both, rig(), use="hand").torque_nm, -0.3 * k, atol=1e-14)


def test_force_columns_enter_the_balance_through_the_lever(tmp_path):
    force = [{"column": "x"}, {"column": "q"}, {"column": "h"}]
    np.testing.assert_allclose(
        axis_log(recording(tmp_path, {}, force=force), rig()).torque_nm, 0.01 * np.arange(20)
    )


def test_a_log_without_any_torque_is_refused(tmp_path):
    with pytest.raises(DataError, match="no motor or hand torque is mapped"):
        axis_log(recording(tmp_path, {}), rig())


def test_dry_friction_that_identify_does_not_say_is_warned_of():
    known = Estimate(0.248, 5e-4, 0.245, 0.25)
    fit = SimpleNamespace(symmetric=SimpleNamespace(parameters={"coulomb_nm": known, "inertia_kgm2": known}))
    learned = [("a.csv", SimpleNamespace(coulomb_nm=coulomb)) for coulomb in (0.2, 0.244, 0.248)]
    (said,) = against_identify(fit, learned, inertia_given=True)
    assert (
        "a.csv: the dry friction learned here, 200 mN m, is not that of rtctl identify --log (245 to 250)"
        in said
    )
