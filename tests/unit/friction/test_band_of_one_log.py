"""The band of one log holds on another session of the same joint, whatever its size."""

import numpy as np
import pytest

from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.report_judge import judge
from rtctl.friction.logs.logs import FrictionSamples, level_points


def session(seed, size_nm):
    """Strokes of a joint whose friction is another one at each place by 3 %, and which strokes pass other
    places.
    """
    random, rows = np.random.default_rng(seed), []
    for k in range(60):
        peak, place = random.uniform(0.4, 2.0), random.uniform(0, 2 * np.pi)
        v = (-1) ** k * peak * np.sin(np.linspace(0.2, np.pi - 0.2, 60))
        friction = size_nm * (1 + 0.4 * np.exp(-np.abs(v) / 0.15) + 0.1 * np.abs(v)) * np.sign(v)
        friction *= 1 + 0.03 * np.sin(place + 0.01 * np.arange(60))
        rows.append(np.column_stack([k + np.arange(60) / 60, v, friction]))
    time_s, v, friction = np.vstack(rows).T
    return level_points(FrictionSamples(time_s, v, friction, f"{seed}.csv", "0" * 64))


@pytest.mark.parametrize("size_nm", [0.02, 2.0, 60.0])
def test_it_covers_90_to_99_percent_of_other_sessions(size_nm):
    model = fit_points(session(1, size_nm), rig="x", c=100.0)
    outside = [one.outside_band_share for seed in range(2, 8) for one in judge(model, session(seed, size_nm))]
    assert 0.002 < np.mean(outside) < 0.1  # 12 % without what stretches of a log differ by
