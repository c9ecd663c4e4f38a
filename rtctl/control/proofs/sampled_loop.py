"""The sampled loop behind any delay and a first-order lag: how much device damping it needs, over all
frequencies.

Pure functions of numbers. Symbols as in `stability`, and

======  =======  ==============================================================================
d       ticks    delay between a sample and its torque at the motor, any real number >= 0
tau     ticks    time constant of the current loop, A(s) = 1/(1 + s tau T); 0 is none
o       1        how far the current exceeds a step, share of it: of a loop of second order whose lag at low
                 frequencies is tau; 0 is one of first order
m       1        torques of m ticks ago and earlier share in what the joint feels now
======  =======  ==============================================================================

The condition (docs/theory.md 2.4) and its closed form. At the aliases ``w_n = w + 2 pi n/T`` the
joint moves with velocities V_n. With ``E = (1 - 1/z)^2/T^2``, S0, S1, S2 as there and ``g = Re(1/Z_c)``
of the coupling, the hand is given no energy by joint, coupling and environment iff ``b |V|^2 + Re(V* p y) >=
0`` whenever the environment takes none, ``Re(y* q V) >= g |y|^2``. With the multiplier l of that constraint
this is ``b >= |p - l q|^2/(4 l g)``, least at ``l = |p|/|q| = sqrt(S2/S0)``:

    b >= W(theta) (B^2 + K^2 cot^2 theta)/(2 B),     W = sqrt(S2/S0) + Re(E S1),     |E| S0 = 1.

A linear environment may be as bad as that at every frequency by itself. One that is not linear (a wall) is
covered where l is the same at all frequencies: l = 1 gives ``W = (1 + S2/S0)/2 + Re(E S1)``, the same without
a lag.

Both sums are exact. A fractional delay mixes whole ones: ``E S1 = -sum_m p_m z^-m`` with p_m >= 0 and sum 1,
where a lag is a mixture of delays d + X, X exponential with mean tau, each shared between the two whole ticks
beside it; ``S2/S0 = sum_m r_m cos(2 m theta)`` in the same way with |X|. So W is a mixture of ``2 sin^2(m
theta)``, W/sin^2 one of Fejer kernels, and their curvature is bounded by the moments of the mixture.

A loop that overshoots is the difference of two lags of complex time constants (`_pair`), in which the closed
forms hold as they stand; its mixture has weights of both signs, bounded by those of its envelope."""

from __future__ import annotations

import cmath
import math
from functools import lru_cache

import numpy as np

_POINTS_PER_TICK = 300
"""Cells of the frequency sweep per tick of delay and lag: the bound is then some 1e-6 to 1e-5 above the true
peak."""

_MOST_CELLS = 200_000
"""Reached where delay and lag add up to 660 ticks, as behind a current loop of .5 Hz at 1 kHz: an end for the
memory, not for the proof, whose bound is only less exact there (`_cells`)."""

_TAIL = 1e-6
"""Weight of the longest delays of a lag that are taken together."""


@lru_cache(maxsize=1024)
def peaks(
    d: float, tau: float, *, any_world: bool = False, overshoot: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of W and W/sin^2 such that no mixture of both exceeds its largest pair anywhere in (0, pi/2].

    Parameters
    ----------
    d, tau : float
        Delay and time constant of the lag, periods.
    any_world : bool
        Cover virtual environments that are not linear, too.
    overshoot : float
        Of the current loop, 0 to below 1.

    Notes
    -----
    On a cell of width h a function whose curvature is at most C exceeds the larger of its values at the ends
    by at most C h^2/8, whatever convex function is added; both ends of every cell are listed with that added.
    The root is bounded by its tangent, ``sqrt(R) <= (R/lam + lam)/2`` with lam from the middle of the cell,
    which leaves W a mixture of sin^2 and a constant >= 0, over sin^2 convex."""
    weight, mean = envelope(tau, overshoot)
    cells = _cells(d, weight * mean)
    theta = np.linspace(0.0, np.pi / 2, cells + 1)
    turned, ratio = _alias_sums(theta, d, tau, overshoot)
    # lam of the first cell stays 1: with any other W were above 0 at theta = 0, and W/sin^2 infinite
    lam = np.ones(cells)
    if tau > 0 and not any_world:
        lam[1:] = np.sqrt(_alias_sums(0.5 * (theta[2:] + theta[1:-1]), d, tau, overshoot)[1])
    h2 = (np.pi / 2 / cells) ** 2 / 8
    # m <= 2 + d + X: a torque is felt a tick after its sample at the soonest, and where d + X is not whole it
    # is felt in one tick more
    second, fourth = (weight * moment for moment in _moments(2 + d, mean))
    second_r, fourth_r = (weight**2 * moment if tau > 0 else 0.0 for moment in _moments(1.0, mean))
    sine2 = np.sin(theta) ** 2
    sine2[0] = 1.0  # 0/0 at 0: its limit is put in below
    ends = []
    for side in (slice(None, -1), slice(1, None)):
        W = turned[side] + 0.5 * (ratio[side] / lam + lam)
        U = W / sine2[side]
        if side.start is None:
            U[0] = _slow_limit(d, tau, overshoot)
        ends.append(
            (W + (4 * second + 2 * second_r / lam) * h2, U + (4 * fourth + 2 * fourth_r / lam) / 3 * h2)
        )
    (W_left, U_left), (W_right, U_right) = ends
    return undominated(np.concatenate([W_left, W_right]), np.concatenate([U_left, U_right]))


@lru_cache(maxsize=256)
def varying_peaks(
    low: float, high: float, tau: float, overshoot: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """As `peaks`, for a delay that changes from tick to tick anywhere within [low, high], both in ticks.

    Notes
    -----
    What the hand may be given in a tick is a sum over the torques that are felt in it of share times ``|y - y
    of the tick to come|^2``, so taking every share at its largest, `felt`, covers whatever way the delay
    changes: ``W = 2 sum_m share_m sin^2(m theta)``. It covers worlds that are not linear."""
    cells = _cells(high, envelope(tau, overshoot)[1])
    theta = np.linspace(0.0, np.pi / 2, cells + 1)
    h2 = (np.pi / 2 / cells) ** 2 / 8
    W, U, safe = np.zeros_like(theta), np.zeros_like(theta), np.sin(theta) ** 2
    safe[0] = 1.0
    for m, share in felt(high, tau, high - low, overshoot).items():
        wave = np.sin(m * theta) ** 2
        over = wave / safe
        over[0] = m * m
        # what lies between two points: |(sin^2 m theta)''| <= 2 m^2, of sin^2(m theta)/sin^2(theta) it is
        # 2 m^2 (m^2 - 1)/3 at most, at theta = 0
        W += 2 * share * (wave + 2 * m * m * h2)
        U += 2 * share * (over + 2 * m**4 / 3 * h2)
    return undominated(W, U)


def _cells(d: float, tau: float) -> int:
    """How many cells: the longer the delay, the narrower the peaks. Fewer would be as safe, only less
    exact."""
    return min(math.ceil(_POINTS_PER_TICK * (2 + d + 2 * tau)), _MOST_CELLS)


@lru_cache(maxsize=256)
def felt(d: float, tau: float, jitter: float = 0.0, overshoot: float = 0.0) -> dict[int, float]:
    """Largest share of a tick for which the joint feels the torque of m - 1 ticks ago, by m, behind a delay
    of `d`, at times up to `jitter` less, and a lag `tau`, all in ticks.

    The shares add up to 1 + jitter; of a loop that overshoots to ((1 + o)/(1 - o))^2 times that.

    Notes
    -----
    A lag is a mixture of delays l = d + X, X exponential with mean tau. With l the torque is felt for 1 - |l
    - (m - 1)| of a tick; where l may be up to `jitter` less, for all of it from m - 1 to m - 1 + jitter. That
    is a trapezium over l, and its mean the sum of four means of a ramp, E max(l - c, 0), c at its corners. A
    loop of second order has |a| for the density of X (`_mean_ramp`)."""
    # |integral a h|^2 <= integral |a| integral |a| |h|^2 for an answer a to an impulse: 1 of one sign
    scale, mean = (1 + overshoot) / (1 - overshoot), envelope(tau, overshoot)[1]

    def beyond(corner: float) -> float:
        return _mean_ramp(corner - d, tau, overshoot)

    # 13.8 time constants one by one: all but a millionth of a lag
    last = math.ceil(d - mean * math.log(_TAIL)) + 1
    shares = {
        m: beyond(m - 2) - beyond(m - 1) - beyond(m - 1 + jitter) + beyond(m + jitter)
        for m in range(1, last + 1)
    }
    # what is later lies a time constant beyond on average; two give its square no less than its mean
    shares[last + 1 + math.ceil(2 * mean)] = beyond(last - 1) - beyond(last + jitter)
    return {m: scale * share for m, share in shares.items() if share > 0}


def undominated(W: np.ndarray, U: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The pairs that no other exceeds in both numbers: only these can be the largest in any coupling."""
    # by falling W: a pair counts where its U exceeds that of all before it
    order = np.argsort(-W, kind="stable")
    W, U = W[order], U[order]
    best = np.maximum.accumulate(U)
    keep = np.concatenate([[True], U[1:] > best[:-1]])
    return W[keep], U[keep]


def _pair(tau: float, overshoot: float) -> complex:
    """One of the two conjugate time constants of a loop that overshoots; the real one of a loop that does
    not.

    Notes
    -----
    A damping ratio zeta exceeds a step by ``e^(-pi zeta/sqrt(1 - zeta^2))`` and is late by ``tau = 2
    zeta/w_0``, so that ``1/(1 + s tau + s^2/w_0^2)`` has the time constants ``tau/2 (1 +- j pi/ln(1/o))``."""
    return complex(0.5 * tau, 0.5 * tau * math.pi / -math.log(overshoot)) if overshoot > 0 else complex(tau)


def envelope(tau: float, overshoot: float) -> tuple[float, float]:
    """(weight, mean): the answer to an impulse is nowhere more than the weight times that of a lag of the
    mean.

    Notes
    -----
    It is ``e^(-t/mean) sin(w t)/(w |tau_1|^2)`` with ``1/tau_1 = 1/mean - j w``."""
    one = _pair(tau, overshoot)
    if one.imag == 0:
        return 1.0, tau
    mean = 1 / (1 / one).real
    return mean / abs(one.imag), mean


def step_answer(t: np.ndarray, tau: float, overshoot: float) -> np.ndarray:
    """Answer to a step at 0 of a loop that overshoots, t in ticks."""
    since, rate = np.maximum(t, 0.0), 1 / _pair(tau, overshoot)
    turned = -rate.imag * since
    ring = np.cos(turned) - rate.real / rate.imag * np.sin(turned)
    return np.asarray(1 - np.exp(-rate.real * since) * ring)


def _mean_ramp(corner: float, tau: float, overshoot: float) -> float:
    """Integral of |a(x)| max(x - corner, 0) over x > 0, a the answer to an impulse of the loop, in ticks.

    Notes
    -----
    Without the bars it is R(c) = Im(q e^(-l c)/l^2) with l = 1/tau_1 and q = |l|^2/Im(-l), and that of a
    alone beyond the i-th zero x_i of a is (-o)^i. There the sign changes, so
    ``G(c) = +-R(c) + 2 sum over x_i > c of o^i (tau + x_i - c)``."""
    one = _pair(tau, overshoot)
    if one.imag == 0:
        return tau - corner if corner <= 0 else tau * math.exp(-corner / tau) if tau > 0 else 0.0
    rate = 1 / one
    half, o = math.pi / -rate.imag, overshoot
    begun = math.floor(max(corner, 0.0) / half)
    left = (abs(rate) ** 2 / -rate.imag * cmath.exp(-rate * max(corner, 0.0)) / rate**2).imag
    later, counted = o ** (begun + 1) / (1 - o), o ** (begun + 1) * (begun + 1 - begun * o) / (1 - o) ** 2
    found = (-1) ** begun * left + 2 * ((tau - max(corner, 0.0)) * later + half * counted)
    return found - min(corner, 0.0) * (1 + o) / (1 - o)


def _alias_sums(
    theta: np.ndarray, d: float, tau: float, overshoot: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Re(E S1) and S2/S0 at every theta, exactly.

    Notes
    -----
    With a pair of time constants ``A = (t_1 A_1 - t_2 A_2)/(t_1 - t_2)``, and ``A(s) A(-s)`` in the same way
    with their squares; ``sum 1/(1/tau^2 + w_n^2)`` is ``T tau/2 sinh(1/tau)/(cosh(1/tau) - cos w T)``."""
    one = _pair(tau, overshoot)
    if one.imag == 0:
        return -_stepped(theta, d, one).real, _spread(theta, one).real
    other = one.conjugate()
    turned = (one * _stepped(theta, d, one) - other * _stepped(theta, d, other)) / (one - other)
    return -turned.real, (one**2 * _spread(theta, one)).imag / (one**2).imag


def _stepped(theta: np.ndarray, d: float, tau: complex) -> np.ndarray:
    """-E S1 of one lag.

    Notes
    -----
    ``1/(s^2 (1 + s tau))`` is the step-invariant image of ``t - tau + tau e^(-t/tau)``, so that with d = k +
    f and q = e^(-1/tau) its samples at the times m - f give the modified z-transform
    ``E S1 = -z^-(k+1) (1 - (f + tau)(1 - 1/z) + tau e^(-(1-f)/tau) (1 - 1/z)^2/(1 - q/z))``."""
    k = math.floor(d)
    f = d - k
    back = np.exp(-2j * theta)  # 1/z
    inner = 1 - (f + tau) * (1 - back)
    if tau != 0:
        inner += tau * cmath.exp(-(1 - f) / tau) * (1 - back) ** 2 / (1 - cmath.exp(-1 / tau) * back)
    return np.asarray(back ** (k + 1) * inner)


def _spread(theta: np.ndarray, tau: complex) -> np.ndarray:
    """S2/S0 of one lag: 1 without, as all aliases answer alike."""
    if tau == 0:
        return np.ones(len(theta), dtype=complex)
    q, sine2 = cmath.exp(-1 / tau), np.sin(theta) ** 2
    return np.asarray(1 - 2 * tau * sine2 * (1 - q * q) / ((1 - q) ** 2 + 4 * q * sine2))


def _slow_limit(d: float, tau: float, overshoot: float = 0.0) -> float:
    """W/sin^2 for theta -> 0.

    Both are 0 there, and where b_c is 0 this quotient is all that counts: K^2 cot^2 alone is left."""
    k = math.floor(d)
    f, M = d - k, k + 1
    one = _pair(tau, overshoot)

    def stepped(tau: complex) -> complex:
        limit = 2 * M * M + 4 * (f + tau) * (M + 0.5)
        return limit + 4 * tau * cmath.exp(-(1 - f) / tau) / (1 - cmath.exp(-1 / tau)) if tau != 0 else limit

    def spread(tau: complex) -> complex:
        return tau * (1 + cmath.exp(-1 / tau)) / (1 - cmath.exp(-1 / tau)) if tau != 0 else 0j

    if one.imag == 0:
        return (stepped(one) - spread(one)).real
    # as in `_alias_sums`: conjugate halves
    return (one * stepped(one)).imag / one.imag - (one**2 * spread(one)).imag / (one**2).imag


def _moments(c: float, t: float) -> tuple[float, float]:
    """Second and fourth moment of c + X, X exponential with mean t: bounds of those of m."""
    second = c * c + 2 * c * t + 2 * t * t
    fourth = c**4 + 4 * c**3 * t + 12 * c * c * t * t + 24 * c * t**3 + 24 * t**4
    return second, fourth
