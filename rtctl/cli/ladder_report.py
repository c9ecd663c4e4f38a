"""The ladder of `rtctl fit --ladder` at the terminal: progress bar, table, JSON."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rtctl.friction.learn.ladder import Ladder, Options
    from rtctl.friction.model import FrictionModel
    from rtctl.friction.points import FrictionPoints


def climb(
    measured: FrictionPoints, options: Options, rig: str, fade_rad_s: float | None
) -> tuple[Ladder, FrictionModel]:
    """Search the ladder with a progress bar on stderr; learn the chosen rung."""
    from rtctl.friction.learn import ladder

    # no time left: rungs differ too much for the pace so far to foretell anything
    with click.progressbar(length=1, label="searching", file=sys.stderr, show_eta=False) as bar:

        def progress(done: int, of: int) -> None:
            # how many there are is known once the first grid was made
            bar.length = of
            bar.update(done - bar.pos)

        found = ladder.ascend(measured, options, progress)
    return found, ladder.learn(measured, found, rig=rig, fade_rad_s=fade_rad_s)


def body(ladder: Ladder) -> dict[str, Any]:
    """Ladder as JSON: one row per rung, null where a rung was refused."""
    rows = [
        {
            "family": rung.family,
            # null: a rung that was refused has no error, and 0 would be the best of all
            "held_out_rmse_nm": None if rung.refused else rung.rmse_nm,
            "held_out_se_nm": None if rung.refused else rung.se_nm,
            "terms": [score.n_terms for score in rung.scores],
            "tried": rung.tried,
            "failed": rung.failures,
            "refused": rung.refused,
        }
        for rung in ladder.choice.rungs
    ]
    runner_up = ladder.choice.runner_up
    return {
        "ladder": rows,
        "chosen": ladder.choice.chosen.family,
        "runner_up": runner_up.family if runner_up else None,
        "symmetric": ladder.symmetric,
        "folds": ladder.folds,
        "tolerance_nm": ladder.tolerance_nm,
        "next_session_nm": ladder.next_range_nm,
        "max_support_vectors": ladder.max_support_vectors,
        "explanation": ladder.explanation,
    }


def show(ladder: Ladder) -> None:
    """Ladder as a table, and the reason of the choice."""
    from rtctl.friction.learn.report_tables import mnm_cell

    click.echo(f"{'rung':<20}{'held out, mN m':>18}{'numbers':>12}{'tried':>7}{'failed':>8}")
    for rung in ladder.choice.rungs:
        lost = sum(rung.failures.values())
        if rung.refused:
            click.echo(f"{rung.family:<20}  refused: {rung.refused}")
            continue
        error = f"{mnm_cell(rung.rmse_nm)} +- {mnm_cell(rung.se_nm)}"
        numbers = " + ".join(f"{score.n_terms:.0f}" for score in rung.scores)
        mark = "  <- chosen" if rung is ladder.choice.chosen else ""
        click.echo(f"{rung.family:<20}{error:>18}{numbers:>12}{rung.tried:>7}{lost:>8}{mark}")
    click.echo(f"\n{ladder.explanation}\n")
