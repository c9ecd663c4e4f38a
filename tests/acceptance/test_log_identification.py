"""Identification from 25 s of a hand's motion on the simulated rig: right values, and intervals that hold
them.
"""

from pathlib import Path

import numpy as np
import pytest

from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.regression import joint_fit
from rtctl.friction.logs.regressors import regressors
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

SEEDS = 20
TRUTH = {"inertia_kgm2": 0.012, "viscous_nms_rad": 0.05, "coulomb_nm": 0.25, "offset_nm": 0.0}
FIGURE = {
    "inertia_kgm2": 0.01 * 0.012,
    "viscous_nms_rad": 0.03 * 0.05,
    "coulomb_nm": 0.02 * 0.25,
    "offset_nm": 0.05 * 0.25,
}
PER_AMPERE = 80 * 0.72 * 0.0134
DRIFT_N_SQRT_S = 0.002
BIAS_NM = 0.01 * PER_AMPERE - 0.2 * 0.1
"""Of the Hall sensor and of the force sensor (N m at the joint)."""


def recording(seed, drift_n_sqrt_s=0.0, seconds=25.0):
    """A log of the mock, and the true drift of its torque (N m) at each row."""
    loaded = load(Path(__file__).parents[2] / "configs" / "mock.toml")
    axis, hand = loaded.options["axis"][0], loaded.options["hand"][0]
    plain = {"breakaway_nm": 0.25, "coulomb_nm": 0.25, "thinning_nms_rad": 0.0}
    plain |= {"modulation_share": 0.0, "scale_negative": 1.0}
    sines = ((0.4, 0.4), (0.15, 1.1), (0.06, 2.3))
    options = {
        **loaded.options,
        "seed": seed,
        "axis": [{**axis, "friction": {**axis["friction"], **plain}}],
        "hand": [{**hand, "kind": "sines", "sines": sines, "stiffness_nm_rad": 20.0, "damping_nms_rad": 0.5}],
        "force": {**loaded.options["force"], "drift_n_sqrt_s": drift_n_sqrt_s},
    }
    simulation = Simulation(loaded.model_copy(update={"options": options}))
    simulation.run(1.5)
    ticks = simulation.run(seconds)
    torque = ticks["current_a"][:, 0] * PER_AMPERE + ticks["force_n"] @ np.array([0.0, 0.1, 0.0])
    log = AxisLog(1000.0, ticks["position_rad"][:, 0], torque - BIAS_NM, "mock", "0")
    return log, 0.1 * simulation.truth["force_drift_n"][:, 1]


def identified(seed, drift_n_sqrt_s=0.0):
    """Parameters found, and what the offset truly was on average over the rows they rest on."""
    log, drift_nm = recording(seed, drift_n_sqrt_s)
    signals = regressors(log)
    rows = np.round(signals.time_s[signals.sliding] * 1000).astype(int)
    return joint_fit(signals).symmetric.parameters, {**TRUTH, "offset_nm": drift_nm[rows].mean()}


@pytest.fixture(scope="module")
def runs():
    """At the plant's default step, without and with the drift of the shipped rig's force sensor."""
    return {
        drift: [identified(seed, drift) for seed in range(1, SEEDS + 1)] for drift in (0.0, DRIFT_N_SQRT_S)
    }


@pytest.mark.parametrize("drift", [0.0, DRIFT_N_SQRT_S])
@pytest.mark.parametrize("name", TRUTH)
def test_every_run_meets_the_figure(runs, name, drift):
    assert max(abs(found[name].value - truth[name]) for found, truth in runs[drift]) <= FIGURE[name]


@pytest.mark.parametrize("drift", [0.0, DRIFT_N_SQRT_S])
@pytest.mark.parametrize("name", TRUTH)
def test_the_intervals_hold_the_truth_as_often_as_they_say(runs, name, drift):
    """Measured (inertia, viscous, Coulomb, offset): 20, 19, 20, 18 of 20 without drift, 19, 20, 20, 18
    with.
    """
    held = sum(found[name].holds(truth[name]) for found, truth in runs[drift])
    assert held >= 17  # 19 expected, fewer than 17 at 1.6 %
