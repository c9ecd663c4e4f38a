"""What `rtctl fit` says of a model that it has learned: for people, and as one JSON object."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hw.motion import named
from rtctl.cli import fit_points, fit_table
from rtctl.cli.json_text import json_text
from rtctl.cli.outputs import in_units_of

if TYPE_CHECKING:
    from rtctl.friction.learn.beside_speed import LoadVerdict
    from rtctl.friction.learn.ladder import Ladder
    from rtctl.friction.learn.warmth import Warmth
    from rtctl.friction.model import FrictionModel
    from rtctl.friction.points import FrictionPoints
    from rtctl.rig_file.config import LoadedConfig


@dataclass(frozen=True)
class Learned:
    """A model, what it was learned from and how, and what was written."""

    model: FrictionModel
    measured: FrictionPoints
    ladder: Ladder | None
    """What was compared; None where nothing was."""
    folds: str
    over_turn: list[str]
    """Lines on what differs from place to place."""
    turn_body: dict[str, Any]
    beside: tuple[LoadVerdict, Warmth]
    """What the friction depends on beside the speed."""
    loaded: LoadedConfig | None
    """The rig file that it is for."""
    out: Path
    plot: Path | None
    page: Path | None

    def faults(self) -> list[str]:
        """What speaks against the model on the very points that it was learned from, as `--judge` says it."""
        from rtctl.friction.learn.report_judge import faults, judge

        return faults(judge(self.model, self.measured))


def tell_json(learned: Learned) -> None:
    """Every figure, in one object."""
    from rtctl.cli import fit_advice, ladder_report
    from rtctl.friction.learn import report_beside_speed as report_beside

    model, measured = learned.model, learned.measured
    body: dict[str, Any] = {"model": str(learned.out), "rig": model.rig, "data_sha256": model.data_sha256}
    body |= {"presliding": fit_advice.presliding_body(model)}
    body |= {"directions": fit_table.rows(model), "kind": model.kind, "evaluation_ns": model.evaluation_ns}
    body |= {"folds": learned.folds, "left_out": fit_points.left_out_rows(measured)}
    body |= fit_advice.body(model, learned.loaded, learned.out)
    body |= {"report": str(learned.page)} if learned.page else {}
    body |= learned.turn_body | {"motion": measured.motion}
    body |= report_beside.body(*learned.beside) | {"faults": learned.faults()}
    body |= {} if model.load is None else {"deployed_load": model.load.body()}
    if learned.ladder is not None:
        body |= ladder_report.body(learned.ladder)
    click.echo(json_text(named(body, measured.motion), indent=2))


def tell(learned: Learned) -> None:
    """The ladder, the curve, what it rests on, and the advice for the rig file."""
    from rtctl.cli import fit_advice, ladder_report
    from rtctl.friction.learn import hold_out
    from rtctl.friction.learn import report_beside_speed as report_beside

    model, plot, page = learned.model, learned.plot, learned.page
    # all that is printed meanwhile is written for a rotary joint
    with in_units_of(learned.measured.motion):
        if learned.ladder is not None:
            ladder_report.show(learned.ladder)
        fit_table.show(model.kind, fit_table.rows(model), learned.measured.motion)
        click.echo(f"presliding length: {fit_advice.presliding_text(model)}")
        click.echo(fit_table.band_text(model))
        click.echo(f"\n{hold_out.describe(learned.measured, learned.folds)}")
        click.echo("\n".join(["", *learned.over_turn])) if learned.over_turn else None
        told = report_beside.sentences(*learned.beside, deployed=model.load is not None)
        click.echo("\n".join(["", *told]))
        fit_advice.show(model, learned.loaded, learned.out)
        click.echo(
            f"\nmodel: {learned.out}"
            + (f"\nplot:  {plot}" if plot else "")
            + (f"\nreport: {page}" if page else "")
        )
        # a ladder has compared other curves already
        remedy = (
            "" if learned.ladder else "; compare with other curves (--ladder), or give a smaller --epsilon"
        )
        for fault in learned.faults():
            click.echo(f"warning: the model does not hold on the points it was learned from: {fault}{remedy}")
