"""One bad point among many: does it change which model is chosen, or how good the model is?

    python -m tests.bench.outliers --draws 1000

A draw takes one of 140 points of a made-up joint three times too large. Where the bad point alone is left
out, the fit does not depend on its value, so each place is fitted once.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace

import click
import numpy as np

from rtctl.friction.kind_table import FAMILIES
from rtctl.friction.learn import ladder
from rtctl.friction.outliers import without_outliers
from rtctl.friction.points import FrictionPoints

FACTOR = 3.0


@dataclass(frozen=True)
class Found:
    """Of all draws: share with the choice of the clean points, and errors against the truth over those of the
    clean fit.
    """

    draws: int
    unchanged: float
    worst_error: float
    mean_error: float
    error_95: float


def truth(speed: np.ndarray) -> np.ndarray:
    """Friction of the joint, N m: two peaks and a grease that thins out, as the shipped joint, which no
    formula of the ladder has.
    """
    peaks = 0.07 * np.exp(-((speed / 0.04) ** 2)) + 0.04 * np.exp(-((speed / 0.4) ** 2))
    return 0.24 + peaks + 0.03 * np.log1p(speed / 0.1)


def joint(per_direction: int = 70, noise_nm: float = 0.001, seed: int = 1) -> FrictionPoints:
    """Clean points of both directions, break-away included."""
    rng = np.random.default_rng(seed)
    v = np.concatenate([[0.0], np.geomspace(0.005, 2, per_direction - 1)])
    rows = [
        (sign * x, share * float(truth(np.array(x))) + rng.normal(0, noise_nm), sign, np.nan, np.nan)
        for sign, share in ((1, 1.0), (-1, 1.1))
        for x in v
    ]
    return FrictionPoints.from_rows(rows, "made up", "0" * 64)


def fitted(points: FrictionPoints, options: ladder.Options) -> tuple[str, float]:
    """Rung that is chosen, and RMS error of its model against the truth, N m."""
    kept, _ = without_outliers(points)
    found = ladder.ascend(kept, options)
    model = ladder.learn(kept, found, rig="made-up")
    v = np.linspace(0.0, 2.0, 800)
    off = [
        branch.magnitude(v) - share * truth(v)
        for branch, share in zip(model.branches, (1.0, 1.1), strict=True)
    ]
    return found.choice.chosen.family, float(np.sqrt(np.mean(np.square(off))))


def run(draws: int, options: ladder.Options, points: FrictionPoints, seed: int = 7) -> Found:
    """Spoil one point at a time, `draws` times."""
    rng = np.random.default_rng(seed)
    clean, clean_error = fitted(points, options)
    known: dict[int, tuple[str, float]] = {}
    results = []
    for row in rng.integers(0, len(points.direction), draws):
        if row not in known:
            friction = points.friction_nm.copy()
            friction[row] *= FACTOR
            known[row] = fitted(replace(points, friction_nm=friction), options)
        results.append(known[row])
    share = np.array([error / clean_error for _, error in results])
    unchanged = float(np.mean([family == clean for family, _ in results]))
    return Found(draws, unchanged, float(share.max()), float(share.mean()), float(np.quantile(share, 0.95)))


def main() -> None:
    """Print what was found."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--draws", type=int, default=1000)
    parser.add_argument("--families", default=",".join(FAMILIES))
    given = parser.parse_args()
    options = ladder.Options(families=tuple(given.families.split(",")), backend="loky", n_jobs=1)
    found = run(given.draws, options, joint())
    click.echo(
        f"{found.draws} draws: choice unchanged in {100 * found.unchanged:.1f} %, error "
        f"{found.mean_error:.3f} times the clean fit's, {found.error_95:.3f} in 95 %, at most "
        f"{found.worst_error:.3f}"
    )


if __name__ == "__main__":
    main()
