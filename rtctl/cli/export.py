"""`rtctl export`: a recording as npz, Parquet or CSV, or as MCAP with a message per tick."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Literal, get_args

import click

from rtctl.cli.json_text import json_text
from rtctl.cli.outputs import OutputFile, require_apart
from rtctl.cli.recording_argument import RecordingFile

Kind = Literal["npz", "parquet", "csv", "mcap"]
KINDS: tuple[Kind, ...] = get_args(Kind)


@click.command("export")
@click.argument("file", type=RecordingFile())
@click.option(
    "--to", "kind", type=click.Choice(KINDS), help="format; default: what the name of --out ends with"
)
@click.option("--out", type=OutputFile(), help="file to write; default: beside FILE")
@click.option("--fields", help="tick fields, separated by commas; default: all")
@click.option("--json", "as_json", is_flag=True, help="one JSON object")
def command(file: Path, kind: Kind | None, out: Path | None, fields: str | None, *, as_json: bool) -> None:
    """Write every tick of the recording in FILE, over all its parts, in another format.

    npz keeps the shape of per-axis fields, and of a rig with a linear axis their `units`; Parquet and CSV
    have a column `field.axis` for each. Parquet needs pyarrow: pip install 'rtctl[parquet]'. MCAP is a
    recording again, with a message for every tick, as Foxglove and PlotJuggler show them."""
    from rtctl.recording.export import export
    from rtctl.recording.reader import RecordingReader, all_parts

    if kind is None:
        ending = "" if out is None else out.suffix.lower().removeprefix(".")
        kind = next((one for one in KINDS if one == ending), None)
    if kind is None:
        raise click.UsageError(
            f"in which format? give --to, or --out with a name that ends with .{', .'.join(KINDS)}"
        )
    # `-ticks`: beside the recording, whose name it would have else
    target = out or file.with_name(f"{file.stem}-ticks.mcap" if kind == "mcap" else f"{file.stem}.{kind}")
    parts = all_parts(file)
    require_apart(target, parts)
    chosen = tuple(name.strip() for name in fields.split(",")) if fields else ()
    tty = sys.stderr.isatty()

    def progress(ticks: int) -> None:
        if tty:
            click.echo(f"\r{ticks} ticks", err=True, nl=False)

    reader = RecordingReader(parts)
    ticks = export(reader, kind, target, chosen, progress)
    if tty:
        click.echo("", err=True)
    missing = [name for name in reader.missing_fields() if not chosen or name in chosen]
    if as_json:
        click.echo(json_text({"file": target, "ticks": ticks, "not_recorded": missing}))
        return
    click.echo(f"{target}: {ticks} ticks")
    if missing:
        click.echo(f"recorded before the tick had {', '.join(missing)}: nan there, 0 in whole numbers")
