"""How long one evaluation of a compiled friction model takes, at the slowest speed."""

from __future__ import annotations

import time

import numpy as np

from rtctl.control.friction_curve import friction_magnitude
from rtctl.control.jit import compiled, records

_SPEEDS = 64
_REPEATS = 300
_ROUNDS = 5


@compiled
def _evaluate(model: np.ndarray, velocity: float, step: float, n: int) -> float:
    """Sum of `n` evaluations at speeds a hair apart, so that no compiler can skip any."""
    total = 0.0
    for k in range(n):
        total += friction_magnitude(model[0], velocity + step * k)
    return total


def evaluation_ns(record: np.ndarray) -> float:
    """Time of one evaluation at the slowest of 64 speeds of each direction, ns.

    Parameters
    ----------
    record : ndarray, shape (1,), dtype `MODEL`

    Notes
    -----
    Of every speed the quickest of five rounds: the time it takes, without what else the machine does. Of
    those the largest: the look-up and the walk to the segment take longest there."""
    model = records(record)
    ends = record["speed_max_rad_s"][0]
    speeds = [
        sign * share
        for sign, end in zip((1, -1), ends, strict=True)
        for share in np.linspace(0, end, _SPEEDS)
    ]
    _evaluate(model, 0.0, 1e-15, 1)  # compiles it before the clock runs
    slowest = 0.0
    for speed in speeds:
        rounds = []
        for _ in range(_ROUNDS):
            start = time.perf_counter_ns()
            _evaluate(model, float(speed), 1e-15, _REPEATS)
            rounds.append(time.perf_counter_ns() - start)
        slowest = max(slowest, min(rounds) / _REPEATS)
    return slowest
