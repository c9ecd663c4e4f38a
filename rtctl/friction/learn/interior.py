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

# what reaches a bound has no room for the next step; a hair of the way is left to it
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
    """Where the method is, or a step of it: rows of `parts` (4, 2n) are x = (alpha, alpha*), the room that it
    has to its bounds, and the multipliers of both; then those of the equations.

    One array, so that a step is a few calls of NumPy: of some hundred points each call costs more than what
    it reckons."""

    parts: np.ndarray
    of_equations: np.ndarray

    @property
    def gap(self) -> float:
        """What all products of a part with its multiplier, which an optimum has at 0, are together."""
        return float(np.vdot(self.parts[:2], self.parts[2:]))

    def stepped(self, share: float, step: _Iterate) -> _Iterate:
        return _Iterate(self.parts + share * step.parts, self.of_equations + share * step.of_equations)

    def furthest(self, step: _Iterate) -> float:
        """Share of a step that keeps everything positive, at most 1."""
        return 1.0 / max(1.0, -float((step.parts / self.parts).min()))


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
    # alpha and alpha* have the same bound; a point is never in need of both
    upper = np.concatenate([bound, bound])
    # away from both bounds, where the first step has room
    x = 0.1 * upper if nu is None else 0.5 * nu * upper  # of nu: where its equation holds already
    at = _Iterate(np.stack([x, upper - x, 0 * x + scale, 0 * x + scale]), np.zeros(len(equations)))
    # k(v, v): by how much a point's own dual moves the curve at its own speed
    reach = np.tile((factor**2).sum(axis=1), 2)
    beta, converged = np.zeros(n), False
    for _ in range(_STEPS):
        x, _, low, high = at.parts
        beta = x[:n] - x[n:]
        # never the n by n matrix: its rank is some tens (decision 0032)
        curve = factor @ (factor.T @ beta)
        off = np.concatenate([curve, -curve]) + cost + equations.T @ at.of_equations - low + high
        short = equations @ x - wanted
        objective = 0.5 * float(beta @ curve) + float(cost @ x)
        # what it moves the curve by, against its way to the edge of the tube: one of both goes to 0
        alpha = np.where(x * reach > low, x, 0.0)
        rest = beta - alpha[:n] + alpha[n:]
        beta = beta - rest
        # both: a small gap beside equations that do not hold is no optimum
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
    from scipy.linalg import lapack

    n = len(factor)
    inside, prices = at.parts[:2], at.parts[2:]
    # 1/theta of docs/theory.md 8.2: the nearer a part is to a bound that holds it, the less it moves
    easy = 1.0 / (prices / inside).sum(axis=0)
    weighed = factor * np.sqrt(easy[:n] + easy[n:])[:, None]
    small = weighed.T @ weighed
    # Woodbury: the inverse of diagonal plus Z Z' needs one of the rank's size alone
    small.flat[:: len(small) + 1] += 1.0
    # scipy.linalg looks at its arguments for longer than LAPACK takes
    decomposed, refused = lapack.dpotrf(small, lower=1)
    if refused:
        raise np.linalg.LinAlgError

    def solved(right: np.ndarray) -> np.ndarray:
        """H plus the diagonal, inverted, times the columns of `right`, (2n, m)."""
        plain: np.ndarray = easy[:, None] * right
        bent = factor @ lapack.dpotrs(decomposed, factor.T @ (plain[:n] - plain[n:]), lower=1)[0]
        plain[:n] -= easy[:n, None] * bent
        plain[n:] += easy[n:, None] * bent
        return plain

    of_equations = solved(equations.T)
    between = np.linalg.inv(equations @ of_equations)

    def step(products: np.ndarray) -> _Iterate:
        """Newton's step to these products (2, 2n) of a part's multiplier and its change, and the reverse."""
        low, high = products / inside
        free = solved((low - high - off)[:, None])[:, 0]
        pull = between @ (equations @ free + short)
        dx = free - of_equations @ pull
        change = np.stack([dx, -dx])
        return _Iterate(np.concatenate([change, (products - prices * change) / inside]), pull)

    products = inside * prices
    tried = step(-products)
    # 2 (2 n) products, of which half belong to each bound
    mean = at.gap / (2 * len(off))
    left = at.stepped(at.furthest(tried), tried).gap / (2 * len(off))
    # Mehrotra's centring: the further the prediction gets, the less it is held in the middle
    final = step(mean * (left / mean) ** 3 - products - tried.parts[:2] * tried.parts[2:])
    return at.stepped(min(1.0, _BACK * at.furthest(final)), final)
