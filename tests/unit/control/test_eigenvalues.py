"""Eigenvalues of many small matrices: each must make its matrix singular, to rounding; by that alone."""

import numpy as np
import pytest

from rtctl.control.proofs import eigenvalues
from rtctl.control.proofs.eigenvalues import eigenvalues_of_each


def jordan(n):
    return np.eye(n) + np.diag(np.ones(n - 1), 1)


def companion(n):
    matrix = np.diag(np.ones(n - 1), -1)
    matrix[0] = np.poly(np.linspace(0.5, 1.5, n))[1:] * -1
    return matrix


def turns(n):
    """What plain shifts never get on with: it only turns its rows round."""
    return np.roll(np.eye(n), 1, axis=0)


def drawn(n, seed):
    """Of any scale, some of a structure that falls into parts, as the loops of a rigid joint do."""
    draw = np.random.default_rng((n, seed))
    matrices = draw.standard_normal((40, n, n)) * 10.0 ** draw.uniform(-3, 3, (40, 1, 1))
    matrices[::3] *= draw.random((14, n, n)) < 0.25
    units = 10.0 ** draw.uniform(-2, 2, (13, n))  # of its states
    matrices[1::3] *= units[:, :, None] / units[:, None, :]
    return matrices


def worst(matrices):
    """Least singular value of M - z for the worst eigenvalue z, share of what rounding of M may make; and by
    how much their sum is beside the trace."""
    found, unit = eigenvalues_of_each(matrices), np.eye(matrices.shape[1])
    beside = np.abs(found.sum(axis=1) - np.trace(matrices, axis1=1, axis2=2))
    left = np.array(
        [
            max(np.linalg.svd(matrix - z * unit, compute_uv=False)[-1] for z in of)
            for matrix, of in zip(matrices, found, strict=True)
        ]
    )
    size = np.maximum(np.linalg.norm(matrices, 2, axis=(1, 2)), 1e-300) * len(unit) * 2.0**-52
    return (left / size).max(), (beside / size).max()


@pytest.mark.parametrize("n", [1, 2, 3, 4, 7, 14, 16, 25, 39])
def test_every_eigenvalue_makes_its_matrix_singular(n):
    one, trace = worst(drawn(n, seed=1))
    assert one < 4
    assert trace < 40


@pytest.mark.parametrize("make", [jordan, companion, turns, np.zeros, np.eye])
@pytest.mark.parametrize("n", [2, 3, 6, 16])
def test_difficult_ones_are_found_too(make, n):
    matrix = make((n, n)) if make is np.zeros else make(n)
    one, trace = worst(np.stack([matrix, 1e9 * matrix, 1e-9 * matrix, matrix.T]))
    assert one < 4
    assert trace < 40


def test_all_of_them_are_found():
    """As often as the characteristic polynomial has them, of a matrix known by them."""
    known = np.array([1.0, 1.0 - 1e-3, 0.5, -0.25, 0.9 + 0.3j, 0.9 - 0.3j])
    draw = np.random.default_rng(5)
    base = np.linalg.qr(draw.standard_normal((6, 6)))[0]
    blocks = np.diag(known.real)
    blocks[4, 5], blocks[5, 4] = 0.3, -0.3
    found = eigenvalues_of_each((base @ blocks @ base.T)[None])[0]
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(known), abs=1e-14)


@pytest.mark.compiled
def test_what_cannot_be_found_is_asked_of_numpy(monkeypatch):
    def gives_up(_work, _found, ended):
        ended[:] = False

    gives_up.py_func = None  # as what is compiled has one
    monkeypatch.setattr(eigenvalues, "_all", gives_up)
    assert np.sort(eigenvalues_of_each(np.diag([3.0, 1.0, 2.0])[None])[0].real).tolist() == [1, 2, 3]


def test_the_matrices_stay_as_they_were():
    matrices = drawn(9, seed=2)
    before = matrices.copy()
    eigenvalues_of_each(matrices)
    assert np.array_equal(matrices, before)
