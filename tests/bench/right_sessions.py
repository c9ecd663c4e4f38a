"""How often `rtctl fit --judge` refuses a right session, and passes a wrong one: `python -m
tests.bench.right_sessions`.

Sessions of one joint whose friction is another one at each place (`session` of
tests/unit/friction/test_band_of_one_log.py, 2 N m): of each ten seeds the first makes a model, the next three
are judged, thinned evenly to so many points each way. Wrong is a session whose friction is larger by
`--wrong`. Decision 0162 has the tables."""

from __future__ import annotations

from dataclasses import replace

import click
import numpy as np
from scipy.special import fdtri

from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.report_judge import RIGHT_REFUSED, Judgement, faults, judge
from rtctl.friction.model import FrictionModel
from rtctl.friction.points import FrictionPoints
from tests.unit.friction.test_band_of_one_log import session

SIZE_NM = 2.0
EACH_WAY = (5, 12, 24, 60)
RULES = {"band": "outside the 95 % band", "line": "Coulomb + viscous", "any": "direction"}
"""Rule -> words of `report_judge.faults` by which it is known."""

BEFORE = ("line before", "any before")
"""The rule of the line without Fisher's F, as it was before decision 0162, and all with that one."""


def thinned(points: FrictionPoints, each_way: int) -> FrictionPoints:
    """Evenly so many points of each direction, by speed."""
    kept = np.zeros(len(points.direction), dtype=bool)
    for way in (1, -1):
        rows = points.rows_of(way)
        kept[rows[np.linspace(0, len(rows) - 1, min(each_way, len(rows))).round().astype(int)]] = True
    return replace(points, left_out=~kept)


def nearer_before(one: Judgement) -> bool:
    """Whether a line was nearer by the rule of before decision 0162."""
    judged = one.points - one.outside - one.slower
    free = max(judged - 2, 1)
    chance = fdtri(judged, free, np.sqrt(1 - RIGHT_REFUSED))
    fitted = (one.floor_rmse_nm or 0.0) ** 2 * judged / free
    allowed = (one.allowed_rmse_nm or 0.0) ** 2 - (chance - 1) * fitted
    return bool((one.rmse_nm or 0.0) ** 2 > allowed)


def refused(model: FrictionModel, points: FrictionPoints) -> dict[str, bool]:
    """Whether each of `RULES`, and of `BEFORE`, speaks against the model."""
    found = judge(model, points)
    said = faults(found)
    line = any(map(nearer_before, found))
    others = any(RULES["line"] not in one for one in said)
    rules = {rule: any(words in one for one in said) for rule, words in RULES.items()}
    return {**rules, **dict(zip(BEFORE, (line, line or others), strict=True))}


@click.command()
@click.option("--models", default=20, type=click.IntRange(1))
@click.option("--first", default=9000, help="seed of the first model")
@click.option("--wrong", default=1.06, help="factor of the friction of wrong sessions")
def main(models: int, first: int, wrong: float) -> None:
    """Print the shares refused by each rule, in %."""
    found: dict[tuple[int, bool], list[dict[str, bool]]] = {}
    for seed in range(first, first + 10 * models, 10):
        model = fit_points(session(seed, SIZE_NM), rig="made", c=100.0)
        for other in range(seed + 1, seed + 4):
            came = session(other, SIZE_NM)
            larger = replace(came, friction_nm=came.friction_nm * wrong)
            for each_way in EACH_WAY:
                for points, right in ((came, True), (larger, False)):
                    row = refused(model, thinned(points, each_way))
                    found.setdefault((each_way, right), []).append(row)
    click.echo(
        "| points each way | right, refused by " + " | ".join((*RULES, *BEFORE)) + f" | {wrong:g} times |"
    )
    click.echo("|---" * (len(RULES) + len(BEFORE) + 2) + "|")
    for each_way in EACH_WAY:
        of = [np.mean([row[rule] for row in found[each_way, True]]) for rule in (*RULES, *BEFORE)]
        of.append(np.mean([row["any"] for row in found[each_way, False]]))
        click.echo(f"| {each_way} | " + " | ".join(f"{100 * one:.1f}" for one in of) + " |")
    click.echo(f"{3 * models} sessions of {models} models")


if __name__ == "__main__":
    main()
