"""The rung chosen against the best one, over made joints of other laws than the ladder's:
`python -m tests.bench.choice`.

A dozen laws, three of which are the ladder's own formulas; 12 to 45 speeds each way, evenly or by ratio,
noise of .2 to 2.5 %. The ladder chooses and learns by them; every rung that could be learned, refused or not,
is judged by 60 other speeds, with the noise of a point beside its error. Errors below what the ladder takes
for equal (decision 0012) count as that. No recording is used. `--sessions` measures each joint in two to five
sessions, which differ in friction, offset and shape, holds whole sessions out, and judges by eight others.
The best rung is one of those that are searched, so that their mean may err less. Of sessions it is said, too,
how often the next ones erred what was held out, and what was told (`ladder.Ladder.next_range_nm`).
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import click
import numpy as np

from rtctl.errors import RtctlError
from rtctl.friction.kind_table import MEAN
from rtctl.friction.learn import grids, ladder
from rtctl.friction.learn.report_sentences import AGREES
from rtctl.friction.learn.selection import Rung
from rtctl.friction.outliers import without_outliers
from rtctl.friction.points import FrictionPoints
from tests.bench.next_session import best_known

SPEEDS = (12, 14, 16, 20, 28, 45)
SPEEDS_OF_A_SESSION = (8, 12, 16, 20)

Law = Callable[[np.ndarray], np.ndarray]


def laws(a: float, b: float, at: float) -> dict[str, Law]:
    """Friction over speed, both as shares: peak or rise `a`, viscous `b`, at the speed `at`."""
    return {
        "gaussian": lambda v: 1 + a * np.exp(-((v / at) ** 2)) + b * v,
        "tustin": lambda v: 1 + a * np.exp(-v / at) + b * v,
        "lorentzian": lambda v: 1 + a / (1 + (v / at) ** 2) + b * v,
        "asinh": lambda v: 1 + a * np.arcsinh(v / at) / 3,
        "root viscous": lambda v: 1 + a * np.exp(-v / at) + b * np.sqrt(v),
        "stretched": lambda v: 1 + a * np.exp(-((v / at) ** 0.6)) + b * v,
        "two peaks": lambda v: 1 + 0.6 * a * np.exp(-((v / at) ** 2)) + 0.4 * a / (1 + (v / (4 * at)) ** 2)
        + b * v,
        "power": lambda v: 1 + b * v**0.6,
        "logarithm": lambda v: 1 + 0.3 * a * np.log1p(v / at),
        "bump": lambda v: 1 + a * np.exp(-v / at) + b * v + 0.05 * np.exp(-(((v - 0.6) / 0.15) ** 2)),
        "cubic": lambda v: 1 + b * v + 0.3 * v**3,
        "peak turned over": lambda v: 1 + a * np.tanh(v / at) + b * v,
    }  # fmt: skip


@dataclass(frozen=True)
class Judged:
    """One joint: what the choice errs over what the best rung errs, both with the noise of a point."""

    law: str
    speeds: int
    chosen: str
    best: str
    times: float
    held_out_nm: float = 0.0
    between_nm: tuple[float, float] = (0.0, 0.0)
    next_nm: np.ndarray = field(default_factory=lambda: np.zeros(0))
    """RMS error of each of the sessions it is judged by, N m."""

    def are_alike(self, came_nm: np.ndarray) -> np.ndarray:
        """Whether such errors are what was held out, within a factor 1.5."""
        alike: np.ndarray = np.abs(np.log(came_nm / self.held_out_nm)) <= np.log(AGREES)
        return alike


def joint(seed: int) -> tuple[str, FrictionPoints, FrictionPoints, float]:
    """Law, points to learn from, points without noise to judge by, and the noise of the first, N m."""
    rng = np.random.default_rng(seed)
    at, a, b = 10 ** rng.uniform(-1.6, -0.4), rng.uniform(0.1, 0.7), rng.uniform(0, 0.6)
    name, law = list(laws(a, b, float(at)).items())[rng.integers(12)]
    n, slowest, evenly = int(rng.choice(SPEEDS)), rng.uniform(0.01, 0.06), bool(rng.integers(2))
    top, size, noise = 10 ** rng.uniform(-0.5, 1.5), 10 ** rng.uniform(-2, 1), 10 ** rng.uniform(-2.7, -1.6)
    other = 1 + 0.15 * rng.normal()

    def points(speed: np.ndarray, off: float) -> FrictionPoints:
        rows = [
            (sign * top * v, size * share * (f + off * rng.normal()), sign, np.nan, np.nan)
            for sign, share in ((1, 1.0), (-1, other))
            for v, f in zip(speed, law(speed), strict=True)
        ]
        return FrictionPoints.from_rows(rows, f"joint {seed}", "0" * 64)

    speed = np.linspace(slowest, 1, n) if evenly else np.geomspace(slowest, 1, n)
    learned = points(speed, noise)
    return name, learned, points(rng.uniform(slowest, 1, 60), 0.0), float(size * noise)


def joint_in_sessions(seed: int) -> tuple[str, FrictionPoints, FrictionPoints, float]:
    """Law, points of some sessions to learn from, points of eight others to judge by, and 0: their noise is
    in them.
    """
    rng = np.random.default_rng(1000 + seed)
    at, a, b = 10 ** rng.uniform(-1.6, -0.4), rng.uniform(0.1, 0.7), rng.uniform(0, 0.6)
    name = list(laws(a, b, float(at)))[rng.integers(12)]
    sessions, n, slowest = (
        int(rng.integers(2, 6)),
        int(rng.choice(SPEEDS_OF_A_SESSION)),
        rng.uniform(0.01, 0.06),
    )
    top, size, noise = 10 ** rng.uniform(-0.5, 1.5), 10 ** rng.uniform(-2, 1), 10 ** rng.uniform(-2.7, -1.6)
    other = 1 + 0.15 * rng.normal() * bool(rng.integers(2))
    spread, shape, offset = rng.uniform(0, 0.04), rng.uniform(0, 0.2), rng.uniform(0, 0.02)

    def session() -> list[tuple[float, ...]]:
        factor, off = 1 + spread * rng.normal(), offset * rng.normal()
        bent = [float(x * np.exp(shape * rng.normal())) for x in (a, b, at)]
        drawn = rng.uniform(np.log(slowest) if seed % 2 else slowest, 0 if seed % 2 else 1, n)
        speed = np.sort(np.exp(drawn) if seed % 2 else drawn)
        return [
            (
                sign * top * v,
                size * (share * factor * f + sign * off + noise * rng.normal()),
                sign,
                np.nan,
                np.nan,
            )
            for sign, share in ((1, 1.0), (-1, other))
            for v, f in zip(speed, laws(*bent)[name](speed), strict=True)
        ]

    def points(count: int) -> FrictionPoints:
        rows = [session() for _ in range(count)]
        log = np.repeat(np.arange(count), 2 * n).astype(float)
        return FrictionPoints.from_rows(
            [row for one in rows for row in one], f"joint {seed}", "0" * 64, {"log": log}
        )

    return name, points(sessions), points(8), 0.0


def judge(seed: int, families: Sequence[str], *, sessions: bool = False) -> Judged:
    """Climb the ladder on one joint, and judge every rung."""
    law, points, test, noise_nm = joint_in_sessions(seed) if sessions else joint(seed)
    points, _ = without_outliers(points)
    options = ladder.Options(
        families=tuple(families), backend="sequential", folds="log" if sessions else "speed"
    )
    found = ladder.ascend(points, options)

    def off_nm(rung: Rung | None) -> np.ndarray:
        """Errors at the points to judge by, NaN beyond what was learned; N m."""
        model = ladder.learn(points, found, rig="made", rung=rung)
        off = np.full(len(test.direction), np.nan)
        for branch, direction in zip(model.branches, (1, -1), strict=True):
            speed, friction = test.branch(direction)
            off[test.rows_of(direction)] = np.where(
                speed <= branch.speed_max_rad_s, branch.magnitude(speed) - friction, np.nan
            )
        return off

    def error_nm(rung: Rung | None) -> float:
        error = float(np.hypot(np.sqrt(np.nanmean(off_nm(rung) ** 2)), noise_nm))
        return max(error, found.tolerance_nm)

    errors = {}
    for rung in (one for one in found.choice.rungs if one.family != MEAN.name):
        with contextlib.suppress(RtctlError, StopIteration):  # a rung that cannot be learned is no rival
            errors[rung.family] = error_nm(rung)
    best = min(errors, key=errors.__getitem__)
    chosen, times = found.choice.chosen.family, error_nm(None) / errors[best]
    one = Judged(law, len(points.branch(1)[0]), chosen, best, times)
    if not sessions:
        return one
    came, log = off_nm(None), test.columns["log"]
    next_nm = np.array([np.sqrt(np.nanmean(came[log == at] ** 2)) for at in np.unique(log)])
    assert found.next_range_nm is not None
    return replace(one, held_out_nm=found.expected_next_nm, between_nm=found.next_range_nm, next_nm=next_nm)


def of_next(judged: Sequence[Judged]) -> str:
    """What was told of next sessions, and what came: shares over all joints."""
    together = [one.are_alike(np.sqrt(np.mean(one.next_nm**2))) for one in judged]
    between = [
        np.mean((one.next_nm >= one.between_nm[0]) & (one.next_nm <= one.between_nm[1])) for one in judged
    ]
    return (
        f"next sessions together within a factor {AGREES} of what was held out on {np.mean(together):.0%}; "
        f"one alone in {np.mean([one.are_alike(one.next_nm).mean() for one in judged]):.0%} (by one number "
        f"that knows them all {np.mean([best_known(one.next_nm) for one in judged]):.0%}), within what was "
        f"told in {np.mean(between):.0%}"
    )


@click.command()
@click.option("--joints", default=150, type=click.IntRange(1))
@click.option("--first", default=0, type=click.IntRange(0))
@click.option("--kernels", default="all", help="rungs to climb besides the formulas, as of rtctl fit")
@click.option("--sessions", is_flag=True, help="joints that are measured in several sessions")
def main(joints: int, first: int, kernels: str, *, sessions: bool) -> None:
    """Print each joint, and how often the choice is how good."""
    families = dict.fromkeys((*grids.families("formula"), *grids.families(kernels)))
    # they seldom converge, and take the most time
    rungs = [name for name in families if not name.endswith("polynomial")]
    judged = []
    for seed in range(first, first + joints):
        one = judge(seed, rungs, sessions=sessions)
        judged.append(one)
        click.echo(
            f"{seed:4d} {one.law:<16} {one.speeds:2d} speeds: {one.chosen}, best {one.best}, "
            f"{one.times:.2f} times"
        )
    all_ = np.array([one.times for one in judged])
    click.echo(
        f"{joints} joints: chosen over best {all_.mean():.3f} (mean), {np.sqrt(np.mean(all_**2)):.3f} "
        f"(RMS), {all_.max():.2f} at most; above 1.1 in {np.mean(all_ > 1.1):.0%}, above 1.3 in "
        f"{np.mean(all_ > 1.3):.0%}"
    )
    if sessions:
        click.echo(of_next(judged))


if __name__ == "__main__":
    main()
