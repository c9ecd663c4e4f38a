"""Kernel functions in scikit-learn's form: `(n, d)` and `(m, d)` inputs, `(n, m)` kernel matrix.

docs/theory.md 8.3. Given to `SVR(kernel=...)` as a callable, scikit-learn leaves `support_vectors_`
empty: take `X[model.support_]`.
"""

from __future__ import annotations

import numpy as np


def spline(X: np.ndarray, Y: np.ndarray) -> np.ndarray:
    """Infinite linear-spline kernel, product over the coordinates.

    Parameters
    ----------
    X, Y : ndarray, shapes (n, d) and (m, d)
        Inputs, all >= 0: friction models give it |v|, one model per direction.

    Returns
    -------
    ndarray, shape (n, m)

    Raises
    ------
    ValueError
        For a negative or NaN input: the kernel is positive definite only on [0, inf).

    Notes
    -----
    Per coordinate, with m = min(u, v): ``k = 1 + uv + uv m/2 - m^3/6``, which is
    ``1 + uv + integral_0^inf (u-t)_+ (v-t)_+ dt``. (Vapnik; as "curvspline" in Gunn's SVM toolbox. The sum
    (u + v)/2 - m/3 of the other spelling, `spline_long`, is the same number.) Not scale invariant: speeds
    stay in rad/s.
    """
    out = np.ones((len(X), len(Y)))
    for u, v, m in _coordinates(X, Y):
        out *= 1 + u * v * (1 + m / 2) - m**3 / 6
    return out


def spline_long(X: np.ndarray, Y: np.ndarray) -> np.ndarray:
    """Evaluate the same kernel in its other published spelling; for tests of `spline`.

    Notes
    -----
    ``k = 1 + uv + uv m - (u+v)/2 m^2 + m^3/3`` per coordinate.
    """
    out = np.ones((len(X), len(Y)))
    for u, v, m in _coordinates(X, Y):
        out *= 1 + u * v + u * v * m - (u + v) / 2 * m**2 + m**3 / 3
    return out


def _coordinates(X: np.ndarray, Y: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    X, Y = np.asarray(X, dtype=float), np.asarray(Y, dtype=float)
    if not (np.all(X >= 0) and np.all(Y >= 0)):
        msg = "the spline kernel needs inputs >= 0: give it |v|, one model per direction"
        raise ValueError(msg)
    pairs = [(X[:, i, None], Y[None, :, i]) for i in range(X.shape[1])]
    return [(u, v, np.minimum(u, v)) for u, v in pairs]


def rbf(X: np.ndarray, Y: np.ndarray, sigma: float) -> np.ndarray:
    """Gaussian kernel ``exp(-|x-y|^2/(2 sigma^2))``; scikit-learn's gamma is ``1/(2 sigma^2)``."""
    X, Y = np.asarray(X, dtype=float), np.asarray(Y, dtype=float)
    distance2 = ((X[:, None, :] - Y[None, :, :]) ** 2).sum(axis=2)
    out: np.ndarray = np.exp(-distance2 / (2 * sigma**2))
    return out


def polynomial(X: np.ndarray, Y: np.ndarray, degree: int) -> np.ndarray:
    """Polynomial kernel ``(x.y + 1)^p``."""
    out: np.ndarray = (np.asarray(X, dtype=float) @ np.asarray(Y, dtype=float).T + 1) ** degree
    return out
