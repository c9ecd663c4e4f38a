"""Held-out error against the error on the session after: the simulated joint drifts by a script,
`python -m tests.bench.next_session`.

Each session is measured from the joint's sensors as a laboratory would (`rtctl.simulation.mock_points`), on a
joint whose dry friction moves by a script: it warms up within each session, and is another one each day. The
ladder learns from all sessions so far, holding out whole sessions, and is judged by the one after.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np

from rtctl.friction.learn import ladder
from rtctl.friction.learn.hold_out import folds_of
from rtctl.friction.learn.report_sentences import AGREES
from rtctl.friction.points import FrictionPoints
from rtctl.rig_file.config import LoadedConfig, load
from rtctl.simulation import mock_points
from rtctl.simulation.family import merged

SHIPPED = Path(__file__).parents[2] / "configs" / "mock.toml"

DAYS = (0.97, 1.02, 0.99, 1.04, 0.96, 1.01, 1.05, 0.98, 1.00, 0.95, 1.03, 0.97)
"""Dry friction of each session, as a factor of the joint's: within 5 %, no trend."""

WARMING = -0.02
"""Change of the factor within a session."""

SLOWEST = 0.05
"""Slowest run of a session, rad/s; no break-away."""

FIRST = 4
"""Sessions that are learned from before the first is foretold."""

QUIET = {"temperature": (), "dry_per_c": 0.0, "viscous_per_c": 0.0, "reference_c": 25.0}


@dataclass(frozen=True)
class Foretold:
    """One session after others, N m; `covered` is the share of it within the band.

    `held_out_nm` is what the ladder says of the next session: what it held out, or what sessions err that
    those before them foretell; `between_nm` is between what it says that the next one errs.
    """

    held_out_nm: float
    next_nm: float
    covered: float
    between_nm: tuple[float, float]

    @property
    def is_alike(self) -> bool:
        """Whether it erred what was held out, within a factor 1.5."""
        return self.held_out_nm / AGREES <= self.next_nm <= AGREES * self.held_out_nm

    @property
    def is_between(self) -> bool:
        """Whether it erred what was told of it."""
        return self.between_nm[0] <= self.next_nm <= self.between_nm[1]


def session(
    loaded: LoadedConfig, factor: float, number: int, levels: int, measurements: int
) -> list[tuple[float, ...]]:
    """Rows of (velocity, torque, std, count, log) of one session."""
    script = {"points": ((0.0, factor - WARMING / 2, 1.0), (120.0, factor + WARMING / 2, 1.0)), **QUIET}
    axes = [merged(axis, {"drift": script}) for axis in loaded.options["axis"]]
    changed = {**loaded.options, "axis": axes, "seed": number + 1}
    rig = mock_points.Rig(loaded.model_copy(update={"options": changed}))
    mock_points.constant_velocity_point(rig, 0.5, 2)  # bends the bristles once
    measured = [
        mock_points.constant_velocity_point(rig, sign * float(speed), measurements)
        for sign in (1, -1)
        for speed in np.geomspace(SLOWEST, mock_points.SPEED_MAX_RAD_S, levels)
    ]
    return [(p.velocity_rad_s, p.friction_torque_nm, p.std_nm, p.count, number) for p in measured]


def points_of(rows: Sequence[tuple[float, ...]]) -> FrictionPoints:
    """Friction points of sessions, each a log."""
    velocity, torque, std, count, log = np.array(rows).T
    columns = {"std_nm": std, "count": count, "log": log}
    return FrictionPoints.from_signed(velocity, torque, "mock", "0" * 64, columns, str)


def foretold(sessions: Sequence[list[tuple[float, ...]]], families: tuple[str, ...]) -> list[Foretold]:
    """Learn from the first `FIRST` sessions and more, and judge each time by the one after."""
    found = []
    for upto in range(FIRST, len(sessions)):
        points = points_of([row for one in sessions[:upto] for row in one])
        climbed = ladder.ascend(points, ladder.Options(families=families, folds="log", backend="sequential"))
        model = ladder.learn(points, climbed, rig="mock")
        after = points_of(sessions[upto])
        errors, inside = [], []
        for branch, direction in zip(model.branches, (1, -1), strict=True):
            speed, friction_nm = after.branch(direction)
            kept = folds_of(after, (direction,), "speed") >= 0  # both ends always train
            error = branch.magnitude(speed[kept]) - friction_nm[kept]
            errors.append(error)
            assert branch.band is not None
            inside.append(branch.band.holds(speed[kept], error))
        rmse = math.sqrt(float(np.mean(np.concatenate(errors) ** 2)))
        assert climbed.next_range_nm is not None
        covered = float(np.mean(np.concatenate(inside)))
        found.append(Foretold(climbed.expected_next_nm, rmse, covered, climbed.next_range_nm))
    return found


def ratio(found: Sequence[Foretold]) -> float:
    """Error on next sessions over what was held out, RMS over all of them."""
    return math.sqrt(sum(one.next_nm**2 for one in found) / sum(one.held_out_nm**2 for one in found))


def best_known(next_nm: Sequence[float] | np.ndarray) -> float:
    """Most of these errors, as a share, that one number told beforehand is right of within a factor 1.5."""
    came = np.sort(next_nm)
    return float(max(np.mean((came >= low) & (came <= AGREES**2 * low)) for low in came))


@click.command()
@click.option("--levels", default=20, show_default=True, help="speeds of a session")
@click.option("--measurements", default=10, show_default=True, help="measurements of a point")
@click.option("--seed", type=click.IntRange(1), help="other days, drawn within 5 %")
def main(levels: int, measurements: int, seed: int | None) -> None:
    """Print what was foretold of each session, and what came."""
    loaded = load(SHIPPED)
    days = DAYS if seed is None else np.random.default_rng(seed).uniform(0.95, 1.05, len(DAYS))
    for name, factors in (
        ("days", days),
        ("days and wear", [day - 0.01 * at for at, day in enumerate(days)]),
    ):
        sessions = [session(loaded, day, at, levels, measurements) for at, day in enumerate(factors)]
        found = foretold(sessions, ("coulomb_viscous", "tustin", "gaussian", "lorentzian", "epsilon-spline"))
        for at, one in enumerate(found, FIRST):
            click.echo(
                f"{name}: session {at + 1}: held out {1e3 * one.held_out_nm:.3g} mN m, came "
                f"{1e3 * one.next_nm:.3g} mN m (told: {1e3 * one.between_nm[0]:.2g} to "
                f"{1e3 * one.between_nm[1]:.2g}), {100 * one.covered:.0f} % in the band"
            )
        click.echo(
            f"{name}: next over held out {ratio(found):.2f}, in the band "
            f"{100 * np.mean([one.covered for one in found]):.1f} %; a session alone within a factor "
            f"{AGREES} of what was held out: {sum(one.is_alike for one in found)} of {len(found)} (by one "
            f"number that knows them all {best_known([one.next_nm for one in found]):.0%}), within what was "
            f"told: {sum(one.is_between for one in found)}"
        )


if __name__ == "__main__":
    main()
