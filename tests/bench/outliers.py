"""One bad point among many: does it change which model is chosen, or how good the model is?

    python -m tests.bench.outliers --draws 1000 --minutes 60

A draw takes one of 140 points of a made-up joint three times too large. Where the bad point alone is left
out, the fit does not depend on its value, so each place is fitted once; and a fit to the very points of
another one is not made again: the bad point touches neither the other direction nor the fold it is held out
with.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import click
import numpy as np

from rtctl.friction.kind_table import FAMILIES
from rtctl.friction.learn import ladder, machines, search
from rtctl.friction.learn.machines import Candidate, FailedFitError, Trained
from rtctl.friction.outliers import without_outliers
from rtctl.friction.points import FrictionPoints

FACTOR = 3.0


@dataclass(frozen=True)
class Found:
    """Of the draws whose place was fitted: share with the choice of the clean points, and errors against the
    truth over those of the clean fit.
    """

    draws: int
    places: int
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


Fits = dict[tuple[object, ...], list[tuple[int, Trained | FailedFitError]]]
"""Fits by all that they are made of, each with the iterations after which its solver was to give up."""


@contextmanager
def remembered(clean: Fits, here: Fits) -> Iterator[None]:
    """Within it, the search makes no fit twice that is in `clean` or `here`; what is new goes into `here`.

    One that converged within fewer iterations than are asked for would go the same way again.
    """

    def fit(candidate: Candidate, *data: np.ndarray, **more: Any) -> Trained:
        found: Trained | FailedFitError
        limit = more.get("max_iterations", machines.MAX_ITERATIONS)
        of = (repr(candidate), *(column.tobytes() for column in data))
        for before, found in (*here.get(of, ()), *clean.get(of, ())):
            ended = isinstance(found, Trained) and found.converged and before < limit
            if ended or before == limit:
                break
        else:
            try:
                found = machines.train(candidate, *data, **more)
            except FailedFitError as error:
                found = error
            here.setdefault(of, []).append((limit, found))
        if isinstance(found, FailedFitError):
            raise found
        return found

    vars(search)["train"] = fit
    try:
        yield
    finally:
        vars(search)["train"] = machines.train


def run(
    draws: int,
    options: ladder.Options,
    points: FrictionPoints,
    seed: int = 7,
    seconds: float = math.inf,
    say: Callable[[str], None] = lambda _text: None,
) -> Found:
    """Spoil one point at a time, `draws` times; no new place is begun after so many seconds."""
    end_s = time.monotonic() + seconds
    rng = np.random.default_rng(seed)
    clean_fits: Fits = {}
    with remembered({}, clean_fits):
        clean, clean_error = fitted(points, options)
    say(f"clean: {clean}, error {1e3 * clean_error:.3g} mN m")
    known: dict[int, tuple[str, float]] = {}
    rows = rng.integers(0, len(points.direction), draws)
    for row in dict.fromkeys(map(int, rows)):
        if time.monotonic() > end_s:
            break
        friction = points.friction_nm.copy()
        friction[row] *= FACTOR
        with remembered(clean_fits, {}):
            family, error_nm = fitted(replace(points, friction_nm=friction), options)
        known[row] = family, error_nm / clean_error
        say(
            f"place {len(known)}, {points.velocity_rad_s[row]:+.4f} rad/s: {family}, "
            f"{known[row][1]:.3f} times the clean error"
        )
    results = [known[row] for row in map(int, rows) if row in known]
    share = np.array([error for _, error in results])
    unchanged = float(np.mean([family == clean for family, _ in results]))
    return Found(
        len(results),
        len(known),
        unchanged,
        float(share.max()),
        float(share.mean()),
        float(np.quantile(share, 0.95)),
    )


def main() -> None:
    """Print each place as it is fitted, and what was found."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--draws", type=int, default=1000)
    parser.add_argument("--families", default=",".join(FAMILIES))
    parser.add_argument("--minutes", type=float, default=math.inf, help="no new place is begun after these")
    given = parser.parse_args()
    options = ladder.Options(families=tuple(given.families.split(",")), backend="loky", n_jobs=1)
    found = run(given.draws, options, joint(), seconds=60 * given.minutes, say=partial(click.echo, err=True))
    click.echo(
        f"{found.draws} of {given.draws} draws, at {found.places} places: choice unchanged in "
        f"{100 * found.unchanged:.1f} %, error {found.mean_error:.3f} times the clean fit's, "
        f"{found.error_95:.3f} in 95 %, at most {found.worst_error:.3f}"
    )


if __name__ == "__main__":
    main()
