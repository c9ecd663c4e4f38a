"""The friction models that the experiments compare, all learned from the same measured points."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from rtctl.control.records import MODEL
from rtctl.errors import DataError
from rtctl.experiments.identification import measured
from rtctl.experiments.order import Order
from rtctl.friction.learn import ladder
from rtctl.friction.learn.ladder import Ladder
from rtctl.friction.point_reader import read_points
from rtctl.friction.points import FrictionPoints
from rtctl.rig_file.config import LoadedConfig
from rtctl.simulation import mock_points

COMPARED = {
    "Coulomb": "coulomb",
    "Tustin": "tustin",
    "Gaussian": "gaussian",
    "Lorentzian": "lorentzian",
    "nu-SVR, RBF": "nu-rbf",
    "epsilon-SVR, RBF": "epsilon-rbf",
    "epsilon-SVR, spline": "epsilon-spline",
}
"""Name in the reports -> rung of the ladder."""

SVR = tuple(name for name in COMPARED if "SVR" in name)


@dataclass(frozen=True)
class Compared:
    """One friction model: compiled record of shape (1,), dtype `MODEL`, and its held-out error, N m."""

    name: str
    record: np.ndarray
    rmse_nm: float
    terms: str


def points_of(order: Order) -> FrictionPoints:
    """Points to learn from: those given, those beside the rig's model, or measured on the simulated rig.

    Raises
    ------
    DataError
        Points that cannot be read, or are of an axis of the other motion."""
    path = points_path(order)
    if path is not None:
        return _read(str(path), order.motion)
    if not order.simulate and not order.loaded.config.simulated:
        raise DataError(
            f"{order.loaded.path}: no measured friction to learn from: measure it with `rtctl identify`, "
            "and give its points_train.csv with --points"
        )
    order.progress(0.0, "measuring friction")
    if order.motion == "linear":  # `mock_points` turns: its jogs are whole turns
        return measured(order.loaded, int(order.loaded.options.get("seed", 0))).of("train")
    rows = [
        (p.velocity_rad_s, abs(p.friction_torque_nm), p.direction, p.std_nm, p.count)
        for p in mock_points.measure(order.loaded)
    ]
    return FrictionPoints.from_rows(rows, "measured on the simulated rig", "")


def points_path(order: Order) -> Path | None:
    """File of the points to learn from; None where the simulated rig is measured."""
    # the points of the rig's own model before a simulation: they are what was measured
    return order.points or _beside(order.loaded)


def digest(path: Path) -> str:
    """SHA-256 of a file. Raises DataError when it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror}") from error


def _beside(loaded: LoadedConfig) -> Path | None:
    model = loaded.model_path(loaded.config.axis[0])
    if model is None:
        return None
    path = model.with_name(f"{model.stem}_points.csv")
    return path if path.exists() else None


def _read(path: str, motion: str) -> FrictionPoints:
    points = read_points(path)
    if points.motion != motion:  # m/s would be followed as rad/s
        raise DataError(f"{path}: is of a {points.motion} axis, the rig's first axis is {motion}")
    return points


# the page of the papers asks for the same points three times
@lru_cache(maxsize=2)
def _climbed(path: str, motion: str) -> tuple[FrictionPoints, Ladder]:
    points = _read(path, motion)
    return points, _climb(points)


def _climb(points: FrictionPoints) -> Ladder:
    # two curves of each: the comparison is of models, not of whether directions share one
    options = ladder.Options(families=tuple(COMPARED.values()), symmetric="no", n_jobs=2)
    return ladder.ascend(points, options)


def climb(order: Order) -> tuple[FrictionPoints, Ladder]:
    """The ladder over every compared model; climbed once per file."""
    path = points_path(order)
    order.progress(0.0, "learning friction models")
    if path is not None:
        return _climbed(str(path), order.motion)
    points = points_of(order)
    return points, _climb(points)


def compared(order: Order) -> list[Compared]:
    """No model at all (`none`), then every model of `COMPARED` that could be learned.

    Raises
    ------
    DataError
        No support-vector model could be learned; says why of each. Another one is left out and announced."""
    points, found = climb(order)
    lost: list[str] = []
    # first in every table: what all others are held against
    models = [Compared("none", np.zeros(1, MODEL), float("nan"), "-")]
    rungs = {rung.family: rung for rung in found.choice.rungs}
    for name, family in COMPARED.items():
        if order.models and name not in order.models:
            continue
        rung = rungs.get(family)
        if rung is None or rung.refused:
            lost.append(f"{name} is left out: {rung.refused if rung else 'not climbed'}")
            order.announce(lost[-1])
            continue
        model = ladder.learn(points, found, rig=order.loaded.config.rig.name, rung=rung)
        terms = " + ".join(f"{score.n_terms:.0f}" for score in rung.scores)
        models.append(Compared(name, model.record(), rung.rmse_nm, terms))
    # formulas among themselves answer no question of these papers
    if not any(one.name in SVR for one in models):
        said = "; ".join(lost)
        raise DataError(
            f"{points.source}: no support-vector model could be learned, which the others are compared with: "
            f"{said}; measure more points"
        )
    return models
