"""Least squares by the normal equations against the singular values of all rows."""

import contextlib

import numpy as np
import pytest

from rtctl.friction.logs.normal_equations import RCOND, SQUARE_LEAST, solved

ROWS = 2000


def by_singular_values(columns, wanted):
    return np.linalg.lstsq(columns, wanted, rcond=RCOND)[0]


def columns(alike=0.0, sizes=(1.0, 1e-4, 1e5, 1.0)):
    """Columns of these sizes, the last of them the first again but for a share `alike`."""
    made = np.random.default_rng(1).standard_normal((ROWS, len(sizes)))
    if alike:
        made[:, -1] = made[:, 0] + alike * made[:, -1]
    return made * np.array(sizes)


@pytest.mark.parametrize("alike", [0.0, 1.0, 0.1, 0.01, 2e-3, 1e-3, 1e-5, 1e-8, 1e-12])
def test_it_is_what_all_rows_say_however_alike_two_columns_are(alike):
    matrix = columns(alike)
    wanted = matrix @ np.array([1.0, 2e4, 3e-5, -2.0]) + np.random.default_rng(2).standard_normal(ROWS)
    size = np.linalg.norm(matrix, axis=0)
    found, true = solved(matrix / size, wanted), by_singular_values(matrix / size, wanted)
    assert np.linalg.norm(found - true) <= 1e-9 * np.linalg.norm(wanted)
    left, least = wanted - matrix / size @ found, wanted - matrix / size @ true
    assert left @ left == pytest.approx(least @ least, rel=1e-12)


def test_columns_that_hardly_differ_are_left_to_the_singular_values():
    matrix = columns(0.1 * SQUARE_LEAST**0.5)
    wanted = matrix.sum(axis=1)
    assert np.array_equal(solved(matrix, wanted), by_singular_values(matrix, wanted))


@pytest.mark.parametrize("dead", [0.0, 1e-200, 1e200])
def test_a_column_of_nothing_or_beyond_squares_takes_nothing_from_the_others(dead):
    matrix = columns(sizes=(1.0, dead, 2.0))
    wanted = np.random.default_rng(3).standard_normal(ROWS)
    assert np.array_equal(solved(matrix, wanted), by_singular_values(matrix, wanted))


def test_several_are_solved_for_at_once_and_fewer_rows_than_columns_give_the_smallest():
    matrix, both = columns(), np.random.default_rng(4).standard_normal((ROWS, 2))
    for at in range(2):
        assert solved(matrix, both)[:, at] == pytest.approx(solved(matrix, both[:, at]), rel=1e-9)
    assert np.array_equal(solved(matrix[:2], both[:2]), by_singular_values(matrix[:2], both[:2]))


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_what_is_no_number_is_no_answer(wrong):
    """As NumPy has it: an error, or coefficients that are no numbers."""
    for of in (0, 1):
        matrix, wanted = columns(), np.ones(ROWS)
        (matrix if of == 0 else wanted)[3] = wrong
        with contextlib.suppress(np.linalg.LinAlgError):
            assert not np.isfinite(solved(matrix, wanted)).all()
