"""Least squares of many rows and few columns by the normal equations, wherever these are as good as the
singular values of all rows: a third to a fifth of their time, and most of that of reading a log."""

from __future__ import annotations

import numpy as np

RCOND = 1e-9
"""Singular values below this share of the largest count as nothing."""

SQUARE_LEAST = 1e-6
"""Least eigenvalue of the columns' products, as if each had size 1: columns that tell each other apart by no
more are left to the singular values, as are columns of nothing. Above it one correction by what is left over
has the coefficients as exact as theirs."""


@np.errstate(over="ignore", invalid="ignore")
def solved(columns: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Coefficients (k,) or (k, m) with which `columns` (n, k) come nearest to what is `wanted`, (n,) or
    (n, m); of many the smallest."""
    products = columns.T @ columns
    size = np.sqrt(np.diag(products))
    if not (np.isfinite(products).all() and (size > 0).all()):
        return _by_singular_values(columns, wanted)
    values, vectors = np.linalg.eigh(products / np.outer(size, size))
    if not values[0] >= SQUARE_LEAST:
        return _by_singular_values(columns, wanted)
    back = vectors / size[:, None]
    inverse = (back / values) @ back.T
    found = inverse @ (columns.T @ wanted)
    better: np.ndarray = found + inverse @ (columns.T @ (wanted - columns @ found))
    return better


def _by_singular_values(columns: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.lstsq(columns, wanted, rcond=RCOND)[0])
