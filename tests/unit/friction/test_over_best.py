"""The best rung of many is the best partly by luck, and the points that say so are few."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rtctl.friction.learn.over_best import OverBest, over_best


def test_the_best_of_equals_is_the_best_by_luck_and_not_on_other_points() -> None:
    rng = np.random.default_rng(1)
    found = []
    for _ in range(100):
        errors = {f"rung {at}": rng.normal(size=28) for at in range(10)}
        found.append(over_best(rng.normal(size=28), errors, np.arange(28)))
    assert np.mean([one.times for one in found]) > 1.15
    assert np.exp(np.mean(np.log([one.by_others for one in found]))) == pytest.approx(1.0, abs=0.05)


def test_the_interval_holds_the_ratio_of_two_and_goes_by_blocks() -> None:
    rng = np.random.default_rng(2)
    held = {"point": 0, "block": 0}
    for _ in range(200):
        # of ten sessions each errs as one
        size = np.repeat(np.exp(0.5 * rng.normal(size=(2, 10))), 12, axis=1)
        ours, theirs = 1.3 * size[0] * rng.normal(size=120), size[1] * rng.normal(size=120)
        for name, block in (("point", np.arange(120)), ("block", np.repeat(np.arange(10), 12))):
            one = over_best(ours, {"x": theirs}, block)
            held[name] += one.low <= 1.3 <= one.high
    assert held["block"] >= 170  # of 200; 178, and 190 of normal numbers
    assert held["point"] < 150


def test_one_block_and_no_errors_say_what_they_can() -> None:
    one, none, block = np.ones(4), np.zeros(4), np.arange(4)
    assert over_best(one, {"x": 2 * one}, np.zeros(4)).low == 0
    assert over_best(one, {"x": 2 * one}, np.zeros(4)).high == math.inf
    assert over_best(2 * one, {"x": one, "y": 3 * one}, block) == OverBest(2.0, 2.0, 2.0, 2.0)
    assert over_best(none, {"x": none}, block) == OverBest(1.0, 1.0, 1.0, 1.0)
    assert over_best(one, {"x": none}, block).times == math.inf
    assert over_best(none, {"x": one}, block) == OverBest(0.0, 0.0, 0.0, 0.0)
