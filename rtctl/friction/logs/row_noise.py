"""Noise of the rows of a log in its balance of torques: white in each column, or of a position's steps.

What somebody smoothed has none left, so that this tells it from a column that is noisy as it was recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hw.playback.quantum import quantum
from rtctl.friction.logs.dynamics import (
    SAMPLES_PER_CUTOFF,
    STRETCH_PERIODS,
    AxisLog,
    rows_of_a_period,
    smooth,
)
from rtctl.friction.logs.signal_shift import derivatives

COARSE_STEP = 2e-3
"""Share of the range of the position from which on its steps are those of lost digits, not of an encoder."""


@dataclass(frozen=True)
class RowNoise:
    """Noise of each signal behind the filter: `motion` (n, 2) of acceleration and velocity, `torque_nm` (n,),
    `log` (n,) each row's log. Rows are as far apart as those of the balance, but not the same."""

    motion: np.ndarray
    torque_nm: np.ndarray
    log: np.ndarray


def step_of(log: AxisLog) -> float:
    """Step of the position as it was recorded: resampling on uneven stamps leaves none."""
    return log.step_rad or quantum(log.position_rad)


def rounded_again(log: AxisLog, cutoff_hz: float) -> AxisLog:
    """The log with as much noise of rounding again: rounded where the joint lingers on a step, else white
    noise, since even motion may pass its steps in time with the rows."""
    step = step_of(log)
    if step == 0:
        return log
    if step > COARSE_STEP * np.ptp(log.position_rad):
        # the smoothed position: what is rounded already would stay as it is
        position = step * (np.floor(smooth(log.position_rad, log.rate_hz, cutoff_hz) / step) + 0.5)
    else:
        # even over a step, so q^2/12 as rounding has it; drawn alike each time, so that a log is judged alike
        position = log.position_rad + step * (np.random.default_rng(0).random(len(log.position_rad)) - 0.5)
    return replace(log, position_rad=position, velocity_rad_s=None)


def row_noise(logs: Sequence[Sequence[AxisLog]], cutoff_hz: float) -> RowNoise:
    """Noise of the logs (each a tuple of stretches), drawn alike each time."""
    rng, motion, torque, of_log = np.random.default_rng(0), [], [], []
    for k, stretches in enumerate(logs):
        for log in stretches:
            edge, n = rows_of_a_period(log, cutoff_hz), len(log.position_rad)
            if n < STRETCH_PERIODS * edge:
                continue  # it is left out of the balance, too
            kept = slice(edge, n - edge, max(1, edge // SAMPLES_PER_CUTOFF))
            # one noise each: of one for both the balance would lose a part that no log loses
            white = rng.normal(size=(2, n))
            rows = [_of_position(log, cutoff_hz, white[0]), _like(log.torque_nm, white[1], log, cutoff_hz)]
            x, tau = smooth(np.stack(rows), log.rate_hz, cutoff_hz)
            # derivatives of one noise, as in a log: velocity and acceleration of white noises apart would not
            # belong together
            v, a = derivatives(x, 1 / log.rate_hz)
            if log.velocity_rad_s is not None:
                v = smooth(_like(log.velocity_rad_s, white[0], log, cutoff_hz), log.rate_hz, cutoff_hz)
                a = derivatives(v, 1 / log.rate_hz)[0]
            motion.append(np.column_stack([a, v])[kept])
            torque.append(tau[kept])
            of_log.append(np.full(len(tau[kept]), k))
    return RowNoise(np.concatenate(motion), np.concatenate(torque), np.concatenate(of_log))


def _of_position(log: AxisLog, cutoff_hz: float, white: np.ndarray) -> np.ndarray:
    if step_of(log) > COARSE_STEP * np.ptp(log.position_rad):
        passed: np.ndarray = smooth(log.position_rad, log.rate_hz, cutoff_hz)
        found: np.ndarray = rounded_again(log, cutoff_hz).position_rad - passed
        return found
    return _like(log.position_rad, white, log, cutoff_hz)


def _like(column: np.ndarray, white: np.ndarray, log: AxisLog, cutoff_hz: float) -> np.ndarray:
    """As much white noise as the column has in the octave above the cut-off, where motion has hardly any;
    resampling takes noise away further up."""
    # measured by the same two filters on both: what these leave of white noise need not be reckoned
    both = np.stack([column, white])
    above = smooth(both, log.rate_hz, 2 * cutoff_hz) - smooth(both, log.rate_hz, cutoff_hz)
    # of jumps (a reversal of friction) a median takes no notice
    size, of_white = np.median(np.abs(above), axis=1)
    return white * float(size / of_white)
