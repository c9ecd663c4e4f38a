"""The ladder of models on the samples of one log: halving, full, and plain GridSearchCV on the same grids, in
one run.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.friction.kind_table import FAMILIES, FORMULAS, KERNELS
from rtctl.friction.learn import grids, ladder, machines, search
from rtctl.friction.learn.hold_out import TRAINS
from rtctl.friction.learn.search import Side
from rtctl.friction.points import FrictionPoints
from rtctl.rig_file.config import load
from rtctl.simulation import friction_truth
from tests.bench.row import Row

SAMPLES = 2500
RATE_HZ = 50.0
NOISE_NM = 0.006
JOBS = 2
MOST_S = {"halving": 30.0, "full": 90.0}
SHARE = 0.1
"""Of each grid, what plain GridSearchCV is timed on in a quick run."""


def samples(config: Path, n: int = SAMPLES, seed: int = 1) -> FrictionPoints:
    """Samples of a slow motion of the simulated joint, whose friction is none of the formulas, with noise."""
    t = np.arange(n) / RATE_HZ
    v = 1.2 * np.sin(1.44 * t) + 0.5 * np.sin(3.83 * t + 1) + 0.2 * np.sin(8.6 * t + 2)
    v = np.where(np.abs(v) < 1e-3, 1e-3, v)
    noise = np.random.default_rng(seed).normal(0, NOISE_NM, n)
    friction = np.abs(friction_truth.true_friction_nm(load(config), 0, v)) + noise
    rows = [(x, y, np.sign(x), np.nan, np.nan) for x, y in zip(v, friction, strict=True)]
    return FrictionPoints.from_rows(rows, "simulated log", "0" * 64, {"time_s": t})


def rows(config: Path, *, quick: bool) -> Iterator[Row]:
    """Seconds of both searches and of plain GridSearchCV, and how many times longer the last takes."""
    points = samples(config)
    took, chosen = {}, {}
    beside = f"{SAMPLES} samples, {len(FAMILIES)} rungs, {JOBS} processes"
    for strategy in ("halving", "full"):
        began = time.perf_counter()
        found = ladder.ascend(
            points, ladder.Options(strategy=strategy, folds="time", symmetric="no", n_jobs=JOBS)
        )
        took[strategy] = time.perf_counter() - began
        chosen[strategy] = found.choice.chosen
        text, most_s = f"{beside}: {chosen[strategy].family}", MOST_S[strategy]
        yield Row(f"ladder: {strategy}", took[strategy], "s", text, most_s)
    both = chosen["halving"].rmse_nm / chosen["full"].rmse_nm
    yield Row("ladder: held-out error of halving's choice over full's", both, "x", "the same folds", 1.1)
    sides = [search.side(points, direction, folds="time") for direction in (1, -1)]
    share = SHARE if quick else 1.0
    plain_s = _plain_s(sides, share) / share
    least = "the same grids and folds, scikit-learn" + (
        f", timed on {100 * share:g} % of them" if quick else ""
    )
    yield Row("ladder: plain GridSearchCV", plain_s, "s", least)
    for strategy, took_s in took.items():
        yield Row(f"ladder: plain over {strategy}", plain_s / took_s, "x", least, 3.0, ">=")


def _plain_s(sides: list[Side], share: float) -> float:
    """Seconds of GridSearchCV over all machines, `share` of each grid's bounds C and tubes."""
    total = 0.0
    for data in sides:
        for family in FAMILIES:
            if family not in FORMULAS:
                total += _grid_s(family, data, share)
    return total


def _grid_s(family: str, data: Side, share: float) -> float:
    from sklearn.model_selection import GridSearchCV, PredefinedSplit
    from sklearn.svm import SVR, NuSVR

    machine, kind = family.split("-")
    every = grids.candidates(family, data.speed, data.friction_nm)
    some = every if share == 1 else [every[i] for i in _spread(len(every), share)]
    tube = "nu" if machine == "nu" else "epsilon"
    asked = [{"C": [one.c], tube: [one.tube], **_of_kernel(kind, one.parameters)} for one in some]
    tolerance_nm = 3e-5 * float(data.friction_nm.max())
    learner = (NuSVR if machine == "nu" else SVR)(
        kernel="precomputed" if kind == "spline" else {"rbf": "rbf", "polynomial": "poly"}[kind],
        tol=tolerance_nm,
        max_iter=machines.MAX_ITERATIONS,
    )
    inputs: Any = (
        KERNELS[kind].matrix({}, data.speed, data.speed) if kind == "spline" else data.speed[:, None]
    )
    folds = PredefinedSplit(np.where(data.fold == TRAINS, -1, data.fold))
    began = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        GridSearchCV(
            learner,
            asked,
            cv=folds,
            n_jobs=JOBS,
            refit=False,
            scoring="neg_mean_squared_error",
            error_score=np.nan,
        ).fit(inputs, data.friction_nm)
    return (time.perf_counter() - began) * share * len(every) / len(some)


def _of_kernel(kind: str, parameters: Any) -> dict[str, list[float]]:
    if kind == "rbf":
        return {"gamma": [0.5 / parameters["sigma_rad_s"] ** 2]}
    if kind == "polynomial":
        return {"degree": [round(parameters["degree"])], "gamma": [1.0], "coef0": [1.0]}
    return {}


def _spread(n: int, share: float) -> list[int]:
    """Places in a grid, drawn evenly by chance: neighbours take equally long."""
    return sorted(np.random.default_rng(1).choice(n, max(2, round(share * n)), replace=False).tolist())
