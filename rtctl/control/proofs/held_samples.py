"""How much device damping the sampled loop needs where only every n-th tick has a fresh sample.

Between fresh samples the law goes on with the held position, in which coupling and environment relax: the
torque changes, though nothing was measured. Pure functions of numbers; symbols as in `stability` and
`sampled_loop`, and

======  =======  ==============================================================================
n       ticks    between two fresh samples
y_i     N m      torque of the i-th tick of a frame of n ticks, i = 0 with the fresh sample
s_i     rad      stretch of the coupling in that tick, a_i its change
z       1        advances by a frame
======  =======  ==============================================================================

The law: ``y_0 = k_c s_0 + b_c a_0/(n T)``, ``y_i = k_c s_i + b_c a_i/T``, and the environment takes
``y_i (moved_i - a_i)`` of energy, where the held position has moved by D in tick 0 and not at all in the
others. So

    sum_i y_i a_i = change of what is stored + sum_i L_i a_i^2,
    L_0 = k_c/2 + b_c/(n T),  L_i = k_c/2 + b_c/T,

and what the software believes to take is y_0 D, where the joint was given the torque in force, late by d,
times its velocity at each instant. With ``h(t) = torque in force - y_0 of the frame to come`` the hand is
given no energy if ``b v^2 + h v`` and the sum add up to no less than zero over all v, which is

    b >= (1/4) max over z of the largest eigenvalue of L^-1/2 (integral of h* h) L^-1/2,

a matrix of n rows, as h is linear in the a_i. For n = 1 it is the condition of `sampled_loop` with l = 1: it
covers environments that are not linear. A lag is a mixture of delays, and h h* is convex: the mixture bounds
it; of a loop of second order, whose mixture has weights of both signs, h is taken at nodes of time
(`_grams`). A delay that changes from tick to tick is covered as in `varying_peaks`: h* h is never negative,
so every share of a tick is taken at its largest."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from rtctl.control.proofs.sampled_loop import envelope, felt, step_answer

_ANGLES = 256
"""Points of the sweep. 2048 find .09 % more at most (80 random couplings, 2 to 5 ticks, delays to 15):
`_ALLOWANCE` is five times that."""
_ALLOWANCE = 1.005
"""For what may lie between the points of the sweep."""
_MOST_TICKS = 3
"""Older samples are STALE, and their rig is refused: a bound does."""
_NODES = 8
_TAIL = 1e-6
"""Nodes of time in a tick, and the weight of the longest delays of a lag that are left out."""


def damping_needed(
    k_c: float,
    b_c: float,
    T: float,
    n: int,
    d: float = 0.0,
    tau: float = 0.0,
    jitter: float = 0.0,
    overshoot: float = 0.0,
) -> float:
    """Least device damping with which the loop is passive, N m s/rad: a fresh sample every `n` ticks, delay
    `d`, up to `jitter` less in any tick, lag `tau`, all in ticks, `overshoot` as in `sampled_loop`. Arguments
    are taken as valid. 0 without a coupling.

    Notes
    -----
    Who asks for all that is less late asks the ends of delay and lag alone: of 60 random couplings, 2 to 5
    ticks and delays to 4, whole delays between asked for .96 of the ends at most, of 25 lags between for .98.
    """
    if k_c == 0 and b_c == 0:
        return 0.0
    if overshoot > 0 and tau > 0 and jitter == 0 and n <= _MOST_TICKS:
        return _ALLOWANCE * _needed_exactly(k_c, b_c, T, n, (d, tau, overshoot))
    return _ALLOWANCE * _needed(k_c, b_c, T, n, felt(d, tau, jitter, overshoot))


def _needed(k_c: float, b_c: float, T: float, n: int, shares: dict[int, float]) -> float:
    """Largest eigenvalue over the sweep, a quarter of it."""
    back = np.exp(-2j * _angles())  # 1/z
    torque, weight = _torques(k_c, b_c, T, n, back)
    total = np.zeros((len(back), n, n), dtype=complex)
    for m, share in shares.items():
        total += share * T * _gram(torque, weight, n, m - 1, back)
    return 0.25 * float(np.linalg.eigvalsh(total)[:, -1].max())


def _needed_exactly(k_c: float, b_c: float, T: float, n: int, between: tuple[float, float, float]) -> float:
    """As `_needed`, for one delay, lag and overshoot, whose mixture has weights of both signs: h at nodes of
    time."""
    stiff, mixed, damped = _grams(n, *between)
    _, weight = _torques(k_c, b_c, T, n, np.ones(1) * 1j)
    rate = b_c / T
    total = (k_c * k_c * stiff + k_c * rate * mixed + rate * rate * damped) * T
    return 0.25 * float(np.linalg.eigvalsh(total * weight[:, None] * weight)[:, -1].max())


@lru_cache(maxsize=512)
def _grams(n: int, d: float, tau: float, overshoot: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integrals of h* h over a frame, in ticks: of h with k_c = 1, of both, and with b_c/T = 1.

    Notes
    -----
    With S the answer to a step, the torque of m ticks ago is in force at the time t of a tick by ``S(t + m -
    d) - S(t + m - d - 1)``: smooth but where t + m = d, up to which and from where there are `_NODES`
    each."""
    back, f = np.exp(-2j * _angles()), d - math.floor(d)
    x, share = np.polynomial.legendre.leggauss(_NODES)
    parts = [(low, high) for low, high in ((0.0, f), (f, 1.0)) if high > low]
    t = np.concatenate([low + (x + 1) / 2 * (high - low) for low, high in parts])
    shares = np.concatenate([share / 2 * (high - low) for low, high in parts])
    m = np.arange(math.ceil(d + 1 - envelope(tau, overshoot)[1] * math.log(_TAIL)) + 1)
    felt_by = step_answer(t[:, None] + m - d, tau, overshoot) - step_answer(
        t[:, None] + m - d - 1, tau, overshoot
    )
    stiff, damped = (_torques(*one, 1.0, n, back)[0] for one in ((1.0, 0.0), (0.0, 1.0)))
    out = [np.zeros((len(back), n, n), dtype=complex) for _ in range(3)]
    for tick in range(n):
        frame, i = np.divmod(tick - m, n)  # below 0: of a frame before, as many times 1/z
        of_row = np.stack(
            [felt_by[:, i == q] @ back ** (-frame[i == q])[:, None] for q in range(n)], axis=1
        )  # nodes, rows, angles
        h = [
            np.einsum("tqz,zqj->tzj", of_row, torque) - torque[:, 0] / back[:, None]
            for torque in (stiff, damped)
        ]
        for k, (one, other) in enumerate(((h[0], h[0]), (h[0], h[1]), (h[1], h[1]))):
            out[k] += np.einsum("t,tzi,tzj->zij", shares, one.conj(), other)
    return out[0], out[1] + out[1].conj().swapaxes(1, 2), out[2]


def _angles() -> np.ndarray:
    """Half angles of a frame in (0, pi/2]."""
    return np.linspace(0.0, np.pi / 2, _ANGLES + 1)[1:]


def _torques(k_c: float, b_c: float, T: float, n: int, back: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """y_i as rows over the a_l as columns at every z, and 1/sqrt(L_l).

    ``(1 - 1/z) s_0 = a_0 + (1/z) sum of the others`` closes the frame."""
    rows = np.zeros((len(back), n, n), dtype=complex)
    # the stretch is a sum over all that was before: 1/(1 - 1/z) of a frame's changes
    rows[:, :, 0] = (k_c / (1 - back))[:, None]
    rows[:, :, 1:] = (k_c * back / (1 - back))[:, None, None]
    for i in range(n):
        rows[:, i, 1 : i + 1] += k_c
        rows[:, i, i] += b_c / (n * T if i == 0 else T)
    # the damper of tick 0 goes by a difference over n ticks, as long as the held position was the same
    L = np.full(n, k_c / 2 + b_c / T)
    L[0] = k_c / 2 + b_c / (n * T)
    return rows, 1 / np.sqrt(L)


def _gram(torque: np.ndarray, weight: np.ndarray, n: int, late: int, back: np.ndarray) -> np.ndarray:
    """Integral of h* h over the n ticks of a frame, per tick, where the torque in force is `late` whole ticks
    old."""
    out = np.zeros_like(torque)
    for tick in range(n):
        # below 0: of a frame before, as many times 1/z
        frame, i = divmod(tick - late, n)
        h = (torque[:, i] * (back ** (-frame))[:, None] - torque[:, 0] / back[:, None]) * weight
        out += h.conj()[:, :, None] * h[:, None, :]
    return out
