"""`rtctl evidence`: the ladder on data sets on disk, as a page."""

from __future__ import annotations

from pathlib import Path

import click

from rtctl.cli import fit_checks
from rtctl.cli.json_text import json_text
from rtctl.cli.outputs import OutputFile, require_apart


@click.command("evidence")
@click.argument("description", type=click.Path(dir_okay=False, path_type=Path))
@click.option(
    "--data",
    type=click.Path(file_okay=False, path_type=Path),
    help="folder that the description's files are in; default: the description's own",
)
@click.option("--out", type=OutputFile(), help="page to write (Markdown); default: stdout")
@click.option("--search", type=click.Choice(["halving", "full"]), default="halving", help="as of rtctl fit")
@fit_checks.KERNEL
@click.option("--jobs", type=click.IntRange(1, 4096), help="workers of the search; default all cores")
@click.option("--json", "as_json", is_flag=True, help="one JSON object on stdout, in place of a page there")
def command(
    description: Path,
    *,
    data: Path | None,
    out: Path | None,
    search: str,
    kernel: str,
    jobs: int | None,
    as_json: bool,
) -> None:
    """Compare every rung of the ladder on every data set of a description, each judged by what it never saw.

    DESCRIPTION is a TOML file of data sets (docs/evidence.toml is the one of docs/evidence.md). Everything is
    learned anew without each fold, so a set takes five times as long as a ladder. Of several files one that
    cannot be read is left out, and the page says why."""
    from dataclasses import asdict

    from rtctl.friction.learn import grids, hold_out
    from rtctl.friction.learn.ladder import Options
    from rtctl.friction.learn.report_evidence_page import page
    from rtctl.friction.learn.report_evidence_sets import judge_set
    from rtctl.friction.logs.data_sets import LEFT_OUT, read_description, read_set
    from rtctl.recording.as_columns import register
    from rtctl.whole_files import whole

    register()
    require_apart(out, (description,))
    sets = read_description(description)
    folder = data or description.parent
    # all of them first: a file that is missing is told before hours of learning
    read = [read_set(one, description.parent if one.beside else folder) for one in sets]
    found = []
    for one, (points, notes) in zip(sets, read, strict=True):
        click.echo(f"{one.name}: {len(points.direction)} points", err=True)
        for note in notes:
            if note.startswith(LEFT_OUT):
                click.echo(f"{one.name}: {note}", err=True)
        options = Options(
            families=grids.families(kernel),
            strategy=search,
            # -1: all cores (joblib)
            n_jobs=jobs or -1,
            folds=hold_out.way_for(points),
        )
        # a page is for others, who have other folders
        told = [note.replace(f"{folder.absolute()}/", "").replace(f"{folder}/", "") for note in notes]
        found.append(judge_set(one.name, one.source, points, told, options))
    text = page(found, f"rtctl evidence {description} --data DATA --out {out or 'PAGE'}")
    if out is not None:
        # hours of learning: a page that was there stays until the new one is whole
        with whole(out) as new:
            new.write_text(text, encoding="utf-8")
    if as_json:
        click.echo(json_text({"sets": [asdict(one) for one in found]}, indent=2))
    else:
        click.echo(f"page: {out}" if out else text)
