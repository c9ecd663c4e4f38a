"""Support-vector regression on many points by an interior-point method, with a kernel matrix of low rank
(docs/theory.md 8.2).

The kernels of speed are smooth, so that the matrix of a thousand points has a rank of twenty to a hundred:
one step costs points times rank squared, and a dozen steps are enough whatever C is. A decomposition method
(LIBSVM) takes ten thousands of steps there, or gives up."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

_STEPS = 40
"""Most steps; a dozen are usual, twenty many."""

_GAP = 1e-7
"""Complementarity at which a solution is one, share of the objective."""

_BACK = 0.995
"""Share of the way to the nearest bound that a step goes."""


@dataclass(frozen=True)
class Solution:
    """beta (n,): dual coefficients, 0 of points inside the tube; intercept and half width of the tube,
    N m."""

    beta: np.ndarray
    intercept: float
    epsilon_nm: float
    converged: bool


@dataclass
class _Iterate:
    """Where the method is: `x` = (alpha, alpha*), `room` to their bounds, multipliers of both, and of the
    equations."""

    x: np.ndarray
    room: np.ndarray
    low: np.ndarray
    high: np.ndarray
    of_equations: np.ndarray

    @property
    def gap(self) -> float:
        return float(self.x @ self.low + self.room @ self.high)

    def stepped(self, share: float, step: _Iterate) -> _Iterate:
        return _Iterate(
            self.x + share * step.x,
            self.room + share * step.room,
            self.low + share * step.low,
            self.high + share * step.high,
            self.of_equations + share * step.of_equations,
        )

    def furthest(self, step: _Iterate) -> float:
        """Share of a step that keeps everything positive, at most 1."""
        share = 1.0
        for value, change in (
            (self.x, step.x),
            (self.room, step.room),
            (self.low, step.low),
            (self.high, step.high),
        ):
            falls = change < 0
            share = min(share, float((-value[falls] / change[falls]).min(initial=1.0)))
        return share


def solve(
    factor: np.ndarray,
    friction_nm: np.ndarray,
    bound: np.ndarray,
    *,
    epsilon_nm: float | None = None,
    nu: float | None = None,
    tolerance_nm: float = 1e-6,
) -> Solution:
    """Solve the epsilon machine (`epsilon_nm`) or the nu machine (`nu`).

    Parameters
    ----------
    factor : ndarray, shape (n, r)
        Z, with the kernel matrix Z Z'.
    bound : ndarray, shape (n,)
        C of each point, times its weight, > 0.
    tolerance_nm
        Most that the curve may miss the conditions of the optimum by, N m.

    Notes
    -----
    Predictor and corrector after Mehrotra, on min x'Hx/2 + c'x with 0 <= x <= bound, x = (alpha, alpha*),
    whose sums are equal, and with nu together nu sum(bound), as LIBSVM has it. H has the rank of the factor,
    so that each step solves r equations."""
    with _libraries().limit(limits=1):  # so little at a time that threads only wait for each other
        return _solved(factor, friction_nm, bound, epsilon_nm, nu, tolerance_nm)


@cache
def _libraries() -> ThreadpoolController:
    """Libraries of linear algebra in this process; scikit-learn brings what tells them."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def _solved(
    factor: np.ndarray,
    friction_nm: np.ndarray,
    bound: np.ndarray,
    epsilon_nm: float | None,
    nu: float | None,
    tolerance_nm: float,
) -> Solution:
    n = len(friction_nm)
    tube = 0.0 if epsilon_nm is None else epsilon_nm
    signs = np.repeat([1.0, -1.0], n)
    equations = signs[None, :] if nu is None else np.stack([signs, np.ones(2 * n)])
    total = 0.0 if nu is None else nu * float(bound.sum())
    wanted = np.array([0.0, total])[: len(equations)]
    cost = np.concatenate([tube - friction_nm, tube + friction_nm])
    scale = max(float(np.abs(friction_nm).max()), 1e-300)
    upper = np.concatenate([bound, bound])
    x = 0.1 * upper if nu is None else 0.5 * nu * upper
    at = _Iterate(x, upper - x, np.full(2 * n, scale), np.full(2 * n, scale), np.zeros(len(equations)))
    reach = np.tile((factor**2).sum(axis=1), 2)
    beta, converged = np.zeros(n), False
    for _ in range(_STEPS):
        beta = at.x[:n] - at.x[n:]
        curve = factor @ (factor.T @ beta)
        off = np.concatenate([curve, -curve]) + cost + equations.T @ at.of_equations - at.low + at.high
        short = equations @ at.x - wanted
        objective = 0.5 * float(beta @ curve) + float(cost @ at.x)
        # what it moves the curve by, against its way to the edge of the tube: one of both goes to 0
        vector = at.x * reach > at.low
        alpha = np.where(vector, at.x, 0.0)
        rest = beta - alpha[:n] + alpha[n:]
        beta = beta - rest
        if at.gap <= _GAP * abs(objective) and np.abs(off).max() <= tolerance_nm:
            converged = bool(np.abs(factor @ (factor.T @ rest)).max() <= tolerance_nm)
        if converged or not np.isfinite(objective):
            break
        try:
            at = _better(at, factor, equations, off, short)
        except np.linalg.LinAlgError:
            break
    found = tube if nu is None else float(at.of_equations[1])
    return Solution(beta, float(at.of_equations[0]), found, converged)


def _better(
    at: _Iterate, factor: np.ndarray, equations: np.ndarray, off: np.ndarray, short: np.ndarray
) -> _Iterate:
    """One step: predicted towards the optimum, then corrected by what the prediction would have left."""
    import scipy.linalg

    n = len(factor)
    easy = 1.0 / (at.low / at.x + at.high / at.room)
    small = (factor * (easy[:n] + easy[n:])[:, None]).T @ factor
    small.flat[:: len(small) + 1] += 1.0
    decomposed = scipy.linalg.cho_factor(small, check_finite=False)

    def solved(right: np.ndarray) -> np.ndarray:
        """H plus the diagonal, inverted, times the columns of `right`, (2n, m)."""
        plain = easy[:, None] * right
        bent = factor @ scipy.linalg.cho_solve(
            decomposed, factor.T @ (plain[:n] - plain[n:]), check_finite=False
        )
        whole: np.ndarray = plain - easy[:, None] * np.concatenate([bent, -bent])
        return whole

    of_equations = solved(equations.T)
    between = equations @ of_equations

    def step(low: np.ndarray, high: np.ndarray) -> _Iterate:
        """Newton's step to the products `low` and `high` (changes of x low and room high)."""
        free = solved((-off + low / at.x - high / at.room)[:, None])[:, 0]
        pull = np.linalg.solve(between, equations @ free + short)
        dx = free - of_equations @ pull
        return _Iterate(dx, -dx, (low - at.low * dx) / at.x, (high + at.high * dx) / at.room, pull)

    tried = step(-at.x * at.low, -at.room * at.high)
    mean = at.gap / (2 * len(at.x))
    left = at.stepped(at.furthest(tried), tried).gap / (2 * len(at.x))
    centre = mean * (left / mean) ** 3
    final = step(
        centre - at.x * at.low - tried.x * tried.low, centre - at.room * at.high - tried.room * tried.high
    )
    return at.stepped(min(1.0, _BACK * at.furthest(final)), final)
