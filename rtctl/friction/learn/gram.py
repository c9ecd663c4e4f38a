"""The kernel matrix of the points of one direction, computed once for all that share it: C, tubes, machines
and folds.

Of many points its factor of low rank is what is trained on; that of a fold is its rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rtctl.friction.kind_table import KERNELS

# LIBSVM spends most of its time on fits that it gives up; below 300 models stay as they were (decision 0032)
MANY = 300
"""Points from which a machine is trained by its factor; fewer are quick whatever the method."""

COARSE, FINE = 1e-8, 1e-10
"""What a factor may miss, share of the largest diagonal value: to choose by, and for a curve that is
deployed."""


@dataclass(frozen=True)
class Gram:
    """Kernel matrix (n, n), None of a part that has a factor; factor (n, r), None of few points."""

    matrix: np.ndarray | None
    factor: np.ndarray | None

    @classmethod
    def of(cls, kind: str, parameters: Mapping[str, float], speed: np.ndarray) -> Gram:
        """Kernel matrix of these speeds (rad/s, (n,)), and its factor if they are many."""
        # whole, although the factor is what is trained on: the sum of kernels that is deployed is held
        # against it
        matrix = KERNELS[kind].matrix(parameters, speed, speed)
        return cls(matrix, pivoted(matrix, COARSE) if len(speed) >= MANY else None)

    def part(self, kept: np.ndarray) -> Gram:
        """Kernel matrix of some of the points: `kept` (n,) bool."""
        if self.factor is not None:
            return Gram(None, self.factor[kept])
        assert self.matrix is not None
        return Gram(self.matrix[np.ix_(kept, kept)], None)


def pivoted(matrix: np.ndarray, tolerance: float) -> np.ndarray:
    """Factor Z (n, r) with Z Z' = matrix but for `tolerance` times its largest diagonal value (pivoted
    Cholesky)."""
    # what of each point is not explained yet: the largest is taken next, as a pivot
    left = matrix.diagonal().copy()
    limit = tolerance * left.max()
    columns = np.zeros((len(matrix), len(matrix)), order="F")  # filled column by column
    for rank in range(len(matrix)):
        at = int(np.argmax(left))
        if left[at] <= limit:
            break
        column = matrix[:, at] - columns[:, :rank] @ columns[at, :rank]
        columns[:, rank] = column / np.sqrt(left[at])
        # rounding may leave less than nothing: such a point is never the largest, and is no pivot any more
        left -= columns[:, rank] ** 2
    else:
        rank = len(matrix)
    return np.ascontiguousarray(columns[:, :rank])
