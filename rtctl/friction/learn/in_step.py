"""Waves of one part, seen twice: by which shift they fall into step, and how often those of another joint
would.

Each is given as `waves` (m,), what it was times the conjugate of what it is, in e^(-i n a): of a part that
moved by a share s of its period the phase of order n is 2 pi n s."""

from __future__ import annotations

import math

import numpy as np

_SHIFTS = 4096
"""Shifts of a period that are tried: 32 of the shortest wave."""

# a chance of one in a hundred is then told to a third of itself
_DRAWS = 1000
"""Random phases that the chance is counted of."""


def peak(waves: np.ndarray, orders: np.ndarray) -> float:
    """Shift of the best match, share of the period, -.5 to .5; between the grid's by Newton's steps on its
    slope."""
    at = float(np.argmax(_matches(waves[None], orders)[0])) / _SHIFTS
    # between two shifts of the grid the match is nearly a parabola: few steps are needed, and none is longer
    # than the grid's
    for _ in range(8):
        terms = np.exp(-2j * math.pi * at * orders) * waves
        slope, bend = np.real(-1j * orders @ terms), np.real(-(orders**2) @ terms)
        if not bend < 0:
            break
        step = slope / bend / (2 * math.pi)
        at -= float(np.clip(step, -1 / _SHIFTS, 1 / _SHIFTS))
    return (at + 0.5) % 1.0 - 0.5


def chance(waves: np.ndarray, orders: np.ndarray) -> float:
    """How often waves of these sizes and random phases match at some shift as well as these do, 0 to 1."""
    # drawn alike each time, so that a sweep is judged alike
    drawn = np.random.default_rng(0).uniform(-math.pi, math.pi, (_DRAWS, len(orders)))
    match = _matches(np.vstack([waves, np.abs(waves) * np.exp(1j * drawn)]), orders)
    rows, at = np.arange(len(match)), np.argmax(match, axis=1)
    low, most, high = match[rows, at - 1], match[rows, at], match[rows, (at + 1) % _SHIFTS]
    # the top between the grid's shifts, of a parabola
    most = most + (high - low) ** 2 / (8.0 * np.maximum(2.0 * most - low - high, 1e-300))
    return float(np.mean(most[1:] >= most[0]))


def _matches(waves: np.ndarray, orders: np.ndarray) -> np.ndarray:
    """Match of each row of waves (k, m) at each shift from 0 on, (k, `_SHIFTS`)."""
    spectrum = np.zeros((len(waves), _SHIFTS // 2 + 1), dtype=complex)
    spectrum[:, np.asarray(orders, dtype=int)] = np.conj(waves)
    return np.asarray(np.fft.irfft(spectrum, _SHIFTS))
