"""The compiled bicubic is the product-spline regression of position and velocity."""

import numpy as np
import pytest
from sklearn.svm import SVR

from rtctl.friction.kinds.product_spline import compile_spline_2d
from rtctl.friction.kinds.spline import spline


@pytest.fixture(scope="module")
def regression():
    rng = np.random.default_rng(7)
    X = rng.uniform(0, [3, 2], (120, 2))
    y = 0.3 + 0.05 * np.sin(2 * X[:, 0]) + 0.1 * np.exp(-((X[:, 1] / 0.3) ** 2)) + 0.05 * X[:, 1]
    model = SVR(kernel=spline, C=30, epsilon=0.01).fit(X, y)
    return model, X[model.support_]


def test_the_compiled_surface_equals_scikit_learn_to_1e_11(regression):
    model, vectors = regression
    surface = compile_spline_2d(vectors, model.dual_coef_[0], model.intercept_[0])
    places = np.random.default_rng(8).uniform(0, [4, 3], (20_000, 2))  # beyond the last knots too
    error = np.abs(surface(*places.T) - model.predict(places)).max()
    assert 0 < error <= 1.4e-12


def test_the_surface_equals_the_sum_for_large_coefficients():
    rng = np.random.default_rng(9)
    vectors, beta = rng.uniform(0, 2, (30, 2)), rng.uniform(-100, 100, 30)
    surface = compile_spline_2d(vectors, beta, 0.2)
    places = rng.uniform(0, 3, (5000, 2))
    assert np.abs(surface(*places.T) - (spline(places, vectors) @ beta + 0.2)).max() <= 1e-11 * 100
    on_grid = np.array([(x, y) for x in surface.knots_x for y in surface.knots_y])
    assert np.abs(surface(*on_grid.T) - (spline(on_grid, vectors) @ beta + 0.2)).max() <= 1e-11 * 100


def test_the_grid_is_that_of_the_support_vectors(regression):
    _, vectors = regression
    surface = compile_spline_2d(vectors, np.ones(len(vectors)), 0.0)
    assert surface.knots_x.tolist() == [0.0, *sorted(set(vectors[:, 0]))]
    assert surface.coefficients.shape == (len(surface.knots_x), len(surface.knots_y), 4, 4)


def test_nan_stays_nan(regression):
    surface = compile_spline_2d(regression[1], np.ones(len(regression[1])), 0.0)
    assert np.isnan(surface(np.array([np.nan, 1.0]), np.array([1.0, np.nan]))).all()


@pytest.mark.parametrize(
    ("vectors", "beta"),
    [
        ([[-0.1, 1.0]], [1.0]),
        ([[np.nan, 1.0]], [1.0]),
        ([[1.0, 1.0]], [np.inf]),
        ([[1.0]], [1.0]),
        ([1.0], [1.0]),
    ],
)
def test_inputs_that_are_no_regression_are_refused(vectors, beta):
    with pytest.raises(ValueError):
        compile_spline_2d(np.array(vectors), np.array(beta), 0.0)


def test_too_many_cells_are_refused():
    with pytest.raises(ValueError, match="cells"):
        compile_spline_2d(np.random.default_rng(1).uniform(0, 1, (150, 2)), np.ones(150), 0.0)
