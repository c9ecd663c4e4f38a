"""The product kernel of speed and place: its oracle, its exact compilation, and the evaluator of the law."""

import math

import numpy as np
import pytest

from rtctl.control.jit import records
from rtctl.control.place_friction import conservative_torque, curve_and_place, turn_waves
from rtctl.control.records import MODEL, PLACE_ORDERS, PLACE_SEGMENTS
from rtctl.friction.kind_place import PlaceKernel, compile_place
from rtctl.friction.kind_spline import compile_spline

V, X, BETA, BIAS = np.array([0.1, 0.5, 1.5]), np.array([0.3, 2.0, 5.0]), np.array([2.0, -1.0, 0.5]), 0.3
ORACLE = {(0.0, 1.0): 2.183267475950, (0.7, 1.0): 2.453000294048, (3.0, -2.0): 5.391770415523}
KERNEL = PlaceKernel(2 * math.pi, 2, 0.3, 0.9)


def law_record(kernel=KERNEL, v=V, x=X, beta=BETA, speed_max=4.0):
    base, tables = compile_spline(v, beta, BIAS), compile_place(kernel, v, x, beta)
    made = np.zeros(1, MODEL)
    row, n = made[0], len(base.knots)
    row["n_segments"] = n
    row["knot_rad_s"][:, :n], row["knot_rad_s"][:, n:] = base.knots, speed_max
    row["coefficient"][:, :n] = base.coefficients
    row["lookup_scale"] = 1024 / speed_max
    row["lookup"] = np.searchsorted(base.knots, np.arange(1024) * speed_max / 1024, side="right") - 1
    row["place_orders"] = kernel.orders
    row["place_turns_per_rad"] = 1 / kernel.period_rad
    row["place_coefficient"][:, :n, : 2 * kernel.orders] = tables.coefficients
    return records(made)[0], base, tables


@pytest.mark.parametrize("at", ORACLE)
def test_the_kernel_sum_its_tables_and_the_law_give_the_oracle(at):
    v, x = np.array([at[0]]), np.array([at[1]])
    record, base, tables = law_record()
    kernel_sum = float((KERNEL.product(v, x, V, X) @ BETA)[0]) + BIAS
    assert kernel_sum == pytest.approx(ORACLE[at], abs=1e-10)
    assert float(base(v)[0] + tables(v, x)[0]) == pytest.approx(ORACLE[at], abs=1e-10)
    in_law = float(base(v)[0]) + curve_and_place(record, 1, *at)[1]
    assert in_law == pytest.approx(ORACLE[at], abs=1e-10)


def test_tables_and_law_are_the_kernel_sum_at_any_speed_and_place_of_any_period():
    rng = np.random.default_rng(3)
    n = 40
    v, x, beta = rng.choice(np.linspace(0, 2, 12), n), rng.uniform(-9, 9, n), rng.normal(size=n)
    kernel = PlaceKernel(0.7, PLACE_ORDERS, 0.5, 0.6)
    record, base, tables = law_record(kernel, v, x, beta, 2.5)
    at, there = rng.uniform(0, 2.5, 300), rng.uniform(-20, 20, 300)
    wanted = kernel.product(at, there, v, x) @ beta + BIAS
    assert np.abs(base(at) + tables(at, there) - wanted).max() <= 1e-10
    in_law = [float(base(a)) + curve_and_place(record, 0, a, b)[1] for a, b in zip(at, there, strict=True)]
    assert np.abs(in_law - wanted).max() <= 1e-10
    turned = tables(at, there + 0.7 * 13)
    assert np.abs(turned - tables(at, there)).max() <= 1e-10  # no jump from turn to turn


def test_the_slope_over_position_is_bounded():
    _, _, tables = law_record()
    speed, x = np.linspace(0, 3, 50), np.linspace(0, 2 * math.pi, 4001)
    slopes = [np.abs(np.diff(tables(np.full(len(x), v), x)) / np.diff(x)).max() for v in speed]
    assert max(slopes) <= tables.steepest_nm_rad(speed) <= 2 * max(slopes)


def test_without_orders_place_adds_nothing_and_a_place_that_is_no_number_gives_none():
    empty = records(np.zeros(1, MODEL))[0]
    assert curve_and_place(empty, 0, 0.5, 1.0) == (0.0, 0.0)
    assert conservative_torque(empty, 1.0) == 0.0
    record, _, _ = law_record()
    assert math.isnan(curve_and_place(record, 0, 0.5, math.nan)[1])
    assert math.isnan(curve_and_place(record, 0, math.nan, 0.5)[1])
    assert compile_place(PlaceKernel(1.0, 0, 0.3, 0.9), V, X, BETA).over_turn(V).shape == (3, 256)


def test_too_many_speeds_or_orders_are_refused():
    many = np.linspace(0, 1, PLACE_SEGMENTS + 1)
    with pytest.raises(ValueError, match="average the points"):
        compile_place(KERNEL, many, many, many)
    with pytest.raises(ValueError, match="at most"):
        compile_place(PlaceKernel(1.0, PLACE_ORDERS + 1, 0.3, 0.9), V, X, BETA)
    with pytest.raises(ValueError, match="equally long"):
        compile_place(KERNEL, V, X[:2], BETA)


def test_cos_and_sin_of_a_turn_are_those_of_the_library():
    turns = np.concatenate([np.arange(-9, 9) / 8, np.random.default_rng(1).uniform(-1, 1, 500)])
    found = np.array([turn_waves(turn) for turn in turns])
    assert (
        np.abs(found - np.column_stack([np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns)])).max() < 1e-14
    )
