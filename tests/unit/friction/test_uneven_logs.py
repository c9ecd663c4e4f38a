"""Logs whose stamps alternate, jitter or pause give the parameters of an evenly sampled log."""

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction.logs.log_input import Gearing, options_of, read_log
from rtctl.friction.logs.regression import joint_fit
from rtctl.friction.logs.regressors import cutoff_for, of_stretches

COLUMNS = {"time": {"column": "t"}, "position": {"column": "x"}, "motor_torque": {"column": "tau"}}
TRUTH = {"inertia_kgm2": 0.05, "viscous_nms_rad": 0.05, "coulomb_nm": 0.25}
MOTION = [(a, 2 * np.pi * f) for a, f in ((0.4, 0.4), (0.15, 1.1), (0.06, 2.3))]


def steps(kind, n=4000):
    rng = np.random.default_rng(4)
    return {
        "even": np.full(n, 0.011),
        "alternating": np.tile([0.010, 0.012], n // 2),
        "jitter": rng.uniform(0.008, 0.014, n),
        "lost rows": np.where(rng.uniform(size=n) < 0.05, 0.022, 0.011),
        "pauses": np.where(np.arange(n) % 900 == 450, 3.7, 0.011),
        "alternating and pauses": np.where(np.arange(n) % 900 == 450, 0.5, np.tile([0.010, 0.012], n // 2)),
    }[kind]


def write(folder, t):
    x, v, a = (
        sum(f(each, k) for each, k in MOTION)
        for f in (
            lambda r, k: r * np.sin(k * t),
            lambda r, k: r * k * np.cos(k * t),
            lambda r, k: -r * k**2 * np.sin(k * t),
        )
    )
    tau = TRUTH["inertia_kgm2"] * a + TRUTH["viscous_nms_rad"] * v + TRUTH["coulomb_nm"] * np.sign(v) + 0.02
    tau += np.random.default_rng(3).normal(0, 0.01, len(t))
    path = folder / "log.csv"
    rows = "\n".join(f"{1e3 * p:.3f},{q:.9g},{r:.9g}" for p, q, r in zip(t, x, tau, strict=True))
    path.write_text(f"t,x,tau\n{rows}\n")
    return path


def fitted(path):
    columns = {**COLUMNS, "time": {"column": "t", "unit": "ms"}}
    parts = read_log(options_of(path, columns, None), Gearing(), 0.0)
    return parts, joint_fit(of_stretches(parts, cutoff_for(parts)))


@pytest.mark.parametrize(
    ("kind", "stretches", "said"),
    [
        ("even", 1, ()),
        ("alternating", 1, ("10 to 12 ms: resampled on the stamps, every 11 ms",)),
        ("jitter", 1, ("resampled",)),
        ("lost rows", 1, ("11 to 22 ms: resampled",)),
        ("pauses", 5, ("4 gap(s), the longest 3.7 s",)),
        ("alternating and pauses", 5, ("4 gap(s)", "resampled")),
    ],
)
def test_the_parameters_are_those_of_the_even_log_within_their_spread(tmp_path, kind, stretches, said):
    t = np.concatenate([[0.0], np.cumsum(steps(kind))])
    parts, fit = fitted(write(tmp_path, t))
    assert len(parts) == stretches
    for name, truth in TRUTH.items():
        found = fit.symmetric.parameters[name]
        assert abs(found.value - truth) <= max(3 * found.standard_error, 0.01 * truth), name
        assert found.standard_error < 0.03 * truth, name
    assert len(fit.symmetric.parameters) == 4, "one offset for the log, however many its stretches"
    for text in said:
        assert any(text in warning for warning in fit.warnings), fit.warnings
    if not said:
        assert not any("resampled" in warning or "gap" in warning for warning in fit.warnings)


def test_stretches_too_short_or_at_rest_are_left_out_and_the_blocks_are_of_what_was_recorded(tmp_path):
    t = np.concatenate([[0.0], np.cumsum(steps("pauses"))])
    whole = fitted(write(tmp_path, t))[1]
    short = np.concatenate([t, t[-1] + 5 + 0.011 * np.arange(30)])
    fit = fitted(write(tmp_path, short))[1]
    assert any("1 stretches between gaps are shorter than" in warning for warning in fit.warnings)
    assert fit.symmetric.n == whole.symmetric.n
    assert fit.symmetric.blocks == whole.symmetric.blocks


def test_a_log_of_short_stretches_only_is_refused(tmp_path):
    t = np.concatenate([[0.0], np.cumsum(np.where(np.arange(2000) % 40 == 39, 1.0, 0.011))])
    with pytest.raises(DataError, match="too few for a cut-off"):
        fitted(write(tmp_path, t))
