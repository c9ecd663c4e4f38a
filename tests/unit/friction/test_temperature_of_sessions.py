"""Sessions that differ a little, each at its own temperature: the standard error knows how few they are."""

import numpy as np

from rtctl.friction.learn.beside_speed import judge_temperature
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.points import FrictionPoints

PER_K = -0.003
SESSIONS = 8


def sessions(seed):
    """Friction of each is 2 % off, and goes by its temperature."""
    rng = np.random.default_rng(seed)
    celsius = rng.permutation(np.linspace(20, 40, SESSIONS))
    rows, log, heat = [], [], []
    for session in range(SESSIONS):
        factor = 1 + 0.02 * rng.normal()
        for sign in (1, -1):
            for v in np.geomspace(0.02, 2, 12):
                now = celsius[session] + 0.3 * rng.normal()
                friction = 0.3 * factor * (1 + PER_K * (now - 30)) + 0.03 * v + 0.002 * rng.normal()
                rows.append((sign * v, friction, sign, np.nan, np.nan))
                log.append(float(session))
                heat.append(now)
    columns = {"log": np.array(log), "temperature_c": np.array(heat)}
    return FrictionPoints.from_rows(rows, "made", "0" * 64, columns)


def test_the_standard_error_of_a_temperature_is_that_of_sessions():
    """Counted row by row it was a sixth of the scatter."""
    found = []
    for seed in range(12):
        points = sessions(seed)
        found.append(judge_temperature(fit_points(points, rig="mock", c=10.0, folds="log"), points).dry_per_k)
    value, error = np.array(found).T
    assert 0.5 < error.mean() / np.std(value - PER_K) < 1.5
