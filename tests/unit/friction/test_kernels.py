"""Kernel functions: both spellings, their definition, and the domain on which they are kernels."""

import numpy as np
import pytest

from rtctl.friction.kind_spline import spline
from rtctl.friction.kind_table import KERNELS

X = np.random.default_rng(3).uniform(0, 4, (60, 1))


def spline_long(u, v):
    """The other published spelling of one coordinate."""
    m = np.minimum(u, v)
    return 1 + u * v + u * v * m - (u + v) / 2 * m**2 + m**3 / 3


def test_both_spellings_of_the_spline_kernel_agree_to_1e_14():
    scale = spline(X, X).max()
    assert np.abs(spline(X, X) - spline_long(X, X.T)).max() <= 1e-14 * scale


@pytest.mark.parametrize(("u", "v"), [(0.3, 0.3), (0.7, 2.5), (3.0, 0.1), (0.0, 2.0)])
def test_the_spline_kernel_is_its_defining_integral(u, v):
    t = np.linspace(0, min(u, v), 200001)
    integral = np.trapezoid((u - t) * (v - t), t)
    assert spline(np.array([[u]]), np.array([[v]]))[0, 0] == pytest.approx(1 + u * v + integral, abs=1e-8)


def test_the_spline_kernel_is_positive_definite_on_speeds():
    assert np.linalg.eigvalsh(spline(X, X)).min() > -1e-10


def test_several_coordinates_multiply():
    Y = np.random.default_rng(4).uniform(0, 2, (7, 2))
    product = spline(Y[:, :1], Y[:, :1]) * spline(Y[:, 1:], Y[:, 1:])
    assert np.allclose(spline(Y, Y), product, rtol=1e-14)


@pytest.mark.parametrize("bad", [-0.1, np.nan])
def test_signed_or_nan_inputs_are_refused(bad):
    with pytest.raises(ValueError, match=r"give it \|v\|"):
        spline(np.array([[bad]]), X)


def test_rbf_and_polynomial_are_scikit_learns():
    from sklearn.metrics.pairwise import polynomial_kernel, rbf_kernel

    x = X[:, 0]
    assert np.allclose(
        KERNELS["rbf"].matrix({"sigma_rad_s": 0.4}, x, x),
        rbf_kernel(X, X, gamma=1 / (2 * 0.4**2)),
        rtol=1e-12,
    )
    assert np.allclose(
        KERNELS["polynomial"].matrix({"degree": 3.0}, x, x),
        polynomial_kernel(X, X, degree=3, gamma=1, coef0=1),
        rtol=1e-12,
    )
