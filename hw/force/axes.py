"""How a moment turns with the axes of its force."""

from __future__ import annotations

from collections.abc import Sequence

from hw.interface import BackendError, Options

Rows = Sequence[Sequence[float]]

# a turn of 45 degrees written as .707 is off by 3e-4, a scale of 1 % by 2e-2
TOLERANCE = 1e-3
"""Largest entry of matrix . transpose - unit matrix of a matrix that only turns or mirrors; entries are
written with few digits."""


def only_turns(matrix: Rows) -> bool:
    """Whether a 3 by 3 matrix changes axes and signs only: it is orthonormal."""
    products = (
        (i, j, sum(a * b for a, b in zip(matrix[i], matrix[j], strict=True)))
        for i in range(3)
        for j in range(3)
    )
    return all(abs(product - (i == j)) <= TOLERANCE for i, j, product in products)


def determinant(matrix: Rows) -> float:
    """Determinant of a 3 by 3 matrix."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def moment_matrix(options: Options) -> list[list[float]]:
    """What makes rig moments of a sensor's: `moment_matrix`, or as `matrix` turns the force.

    A moment is r x F: where axes are mirrored (determinant -1) its sign changes besides.

    Raises
    ------
    BackendError
        `matrix` scales or mixes, and no `moment_matrix` is given."""
    given, matrix = options["moment_matrix"], options["matrix"]
    # what somebody has measured goes before what follows from the force's axes
    if given is not None:
        return [list(row) for row in given]
    if not only_turns(matrix):
        raise BackendError(NOT_TOLD)
    # a moment is an axial vector: mirrored axes turn the sense of every rotation
    sign = 1.0 if determinant(matrix) > 0 else -1.0
    return [[sign * entry for entry in row] for row in matrix]


NOT_TOLD = "moments: matrix scales or mixes forces, which says nothing of moments: give moment_matrix, too"
