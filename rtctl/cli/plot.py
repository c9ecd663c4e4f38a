"""`rtctl plot` and `rtctl compare`: pictures and numbers of recordings."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hw.motion import name as own_name
from rtctl.cli.json_text import json_text
from rtctl.cli.number import Number
from rtctl.cli.outputs import OutputFile
from rtctl.cli.recording_argument import RecordingFile

if TYPE_CHECKING:
    from rtctl.recording.panels import Run

_FILE = RecordingFile()
_FROM = click.option("--from", "from_s", type=Number(0), default=0.0, help="s from the first tick")
_TO = click.option(
    "--to",
    "to_s",
    type=Number(0),
    default=math.inf,
    show_default=False,
    help="s from the first tick; default: the end",
)
_FIELDS = click.option(
    "--fields", help="tick fields, separated by commas, one panel each; default: the usual ones"
)


@click.command("plot")
@click.argument("file", type=_FILE)
@click.option("--out", type=OutputFile(picture=True), help="picture to write; default: FILE with .png")
@_FROM
@_TO
@_FIELDS
@click.option("--json", "as_json", is_flag=True, help="one JSON object")
def command(
    file: Path, out: Path | None, from_s: float, to_s: float, fields: str | None, *, as_json: bool
) -> None:
    """Draw the recording in FILE: motion, torques, energies, timing, state (PNG)."""
    from rtctl.recording.panels import plot_runs

    target = out or file.with_suffix(".png")
    plot_runs([_run(file, from_s, to_s)], target, _names(fields))
    click.echo(json_text({"picture": target}) if as_json else f"{target}")


@click.command("compare")
@click.argument("a", type=_FILE)
@click.argument("b", type=_FILE)
@click.option("--plot", type=OutputFile(picture=True), help="also draw both on one time axis (PNG)")
@_FROM
@_TO
@_FIELDS
@click.option("--json", "as_json", is_flag=True, help="one JSON object")
def compare(
    a: Path, b: Path, plot: Path | None, from_s: float, to_s: float, fields: str | None, *, as_json: bool
) -> None:
    """Compare two recordings: what the hand felt, what the motor did, how punctual the loop was.

    Torques are RMS over the ticks in ACTIVE with full authority. (The same samples through another rig file:
    `rtctl replay FILE --config OTHER`.)"""
    from rtctl.recording.panels import figures, plot_runs

    if fields is not None and plot is None:
        raise click.UsageError("--fields are the panels of --plot: give both")
    runs = [_run(file, from_s, to_s) for file in (a, b)]
    found = [figures(run) for run in runs]
    if plot is not None:
        plot_runs(runs, plot, _names(fields))
    if as_json:
        click.echo(json_text({"a": {"file": str(a), **found[0]}, "b": {"file": str(b), **found[1]}}))
        return
    for letter, file, one in (("A", a, found[0]), ("B", b, found[1])):
        rested = "" if one["work_s"] else "  (never ACTIVE with full authority: no RMS)"
        click.echo(f"{letter}  {file}{rested}")
    click.echo(f"{'':36}{'A':>24}{'B':>24}{'change':>10}")
    for key in found[0]:
        for text in _lines(key, found[0][key], found[1][key], runs[0]):
            click.echo(text)
    if plot is not None:
        click.echo(f"picture: {plot}")


def _lines(key: str, one: object, two: object, run: Run) -> list[str]:
    """Rows of the table: one per axis, with the name that the figure has on an axis of this motion."""
    if not key.endswith("_rms") or not isinstance(one, list) or not isinstance(two, list):
        return [_line(key, one, two)]
    n = max(len(one), len(two))
    names = [f"{own_name(key.removesuffix('_rms'), run.motion(i))}_rms" for i in range(n)]
    if n > 1:
        names = [f"{name} {run.axes[i] if i < len(run.axes) else i}" for i, name in enumerate(names)]
    return [
        _line(name, one[i] if i < len(one) else None, two[i] if i < len(two) else None)
        for i, name in enumerate(names)
    ]


def _line(name: str, one: object, two: object) -> str:
    def text(value: object) -> str:
        if isinstance(value, list):
            return ", ".join(value) or "none"
        # NaN: nothing of it was measured
        if value is None or value != value:
            return "-"
        return f"{value:.6g}" if isinstance(value, float) else str(value)

    change = ""
    # of nothing nothing is a share
    if isinstance(one, float) and isinstance(two, float) and one:
        change = f"{100 * (two / one - 1):+.1f} %"
    return f"{name:36}{text(one):>24}{text(two):>24}{change:>10}"


def _names(fields: str | None) -> tuple[str, ...]:
    return tuple(name.strip() for name in fields.split(",") if name.strip()) if fields else ()


def _run(file: Path, from_s: float, to_s: float) -> Run:
    from rtctl.errors import DataError
    from rtctl.recording.panels import Run
    from rtctl.recording.reader import RecordingReader, all_parts

    reader = RecordingReader(all_parts(file))
    rows = reader.read().rows
    if len(rows) == 0:
        raise DataError(f"{file}: holds no tick")
    return Run(file.stem, rows, reader.axes, reader.motions).between(from_s, to_s)
