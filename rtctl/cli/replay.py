"""`rtctl replay`: recorded samples through the control law again."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hw.motion import words
from rtctl.cli.json_text import end_with
from rtctl.cli.outputs import OutputFile
from rtctl.cli.recording_argument import RecordingFile

if TYPE_CHECKING:
    from rtctl.recording.reader import RecordingReader
    from rtctl.recording.replay import Verdict


@click.command("replay")
@click.argument("file", type=RecordingFile())
@click.option("--config", type=click.Path(path_type=Path), help="what this rig file would have done instead")
@click.option("--plot", type=OutputFile(picture=True), help="with --config: overlay of both, PNG")
@click.option("--json", "as_json", is_flag=True, help="one JSON object")
def command(file: Path, config: Path | None, plot: Path | None, *, as_json: bool) -> None:
    """Send the recorded samples of FILE through the compiled law and compare everything it writes, bit for
    bit.

    Parts of the recording that lie before FILE are used too. With --config the law of another rig file gets
    the same samples and commands: the motion stays the recorded one. Exit code 10 when the results differ,
    14 when ticks or commands are missing from the recording: what comes after them was not looked at."""
    from rtctl.recording.reader import RecordingReader, with_earlier_parts

    if plot is not None and config is None:
        raise click.UsageError("--plot shows the difference to --config: give both")
    # up to this part alone: what comes after it does not change what was decided in it
    reader = RecordingReader(with_earlier_parts(file))
    if config is not None:
        _other(reader, config, plot, as_json=as_json)
    else:
        _same(reader, as_json=as_json)


def _same(reader: RecordingReader, *, as_json: bool) -> None:
    from rtctl.errors import DataError, RecordingError, ReplayDiffersError
    from rtctl.recording.replay import Replay
    from rtctl.recording.setup import law_key

    replay = Replay(reader)
    verdict = replay.check()
    # what was not compared is not the same
    if not verdict.ticks:
        raise DataError(
            f"{reader.parts[0]}: no tick to replay{': ' if verdict.stopped else ''}{verdict.stopped}"
        )
    # without other sources a difference is a fault of this machine or file, so that is said
    same_law = reader.about.get("law_key") == law_key()
    text = (
        f"{verdict.ticks} ticks, {verdict.span_s:.3f} s of the rig in {verdict.took_s:.3f} s "
        f"({verdict.span_s / verdict.took_s:.0f}x; the law alone "
        # max: of a tick or two the law takes less than the clock can show
        f"{verdict.span_s / max(verdict.law_s, 1e-9):.0f}x)"
    )
    remark = "" if same_law else "; recorded with other sources of the law"
    if as_json:
        body = {**asdict(verdict), "same_law_sources": same_law}
        bad = RecordingError if verdict.stopped else 0
        end_with(body, bad if verdict.first is None else ReplayDiffersError)
    click.echo(text)
    if missing := reader.missing_fields():
        click.echo(f"recorded before the tick had {', '.join(missing)}: not compared")
    if verdict.first is None:
        same = f"state and torque are the same bit for bit, and so is every field of the law{remark}"
        click.echo(words(same, _motion(reader)))
    if verdict.first is not None:
        fields = ", ".join(
            # six: a law that differs does so in most fields
            f"{name} in {n}"
            for name, n in sorted(verdict.differing.items(), key=lambda x: -x[1])[:6]
        )
        raise ReplayDiffersError(
            f"the law now gives something else{remark}: first {verdict.first}; ticks: {fields}"
        )
    _require_whole(verdict)


def _motion(reader: RecordingReader) -> str:
    # a sentence about the whole rig: of both motions it is that of a joint
    return "linear" if set(reader.motions) == {"linear"} else "rotary"


def _require_whole(verdict: Verdict) -> None:
    """Refuse to call a recording with gaps replayed: what comes after the first was not looked at."""
    from rtctl.errors import RecordingError

    if verdict.stopped:
        raise RecordingError(f"stopped early, after {verdict.ticks} ticks: {verdict.stopped}")


def _other(reader: RecordingReader, config: Path, plot: Path | None, *, as_json: bool) -> None:
    from hw.motion import name as own_name
    from hw.motion import unit
    from rtctl.errors import RecordingError
    from rtctl.recording.compare import compare, numbers, plot_comparison
    from rtctl.rig_file.config import load

    comparison = compare(reader, load(config))
    found = numbers(comparison)
    if plot is not None:
        plot_comparison(comparison, plot, (reader.about.get("config_file", "recorded"), config.name))
    if as_json:
        verdict = comparison.verdict
        body = {"ticks": verdict.ticks, "stopped": verdict.stopped, **found}
        end_with(body, RecordingError if verdict.stopped else 0)
    active = found.pop("active_s")
    click.echo(
        f"{comparison.verdict.ticks} ticks; ACTIVE {active['recorded']:.3f} s, with {config.name} "
        f"{active['other']:.3f} s"
    )
    # each once, in the order of the axes
    units = " or ".join(dict.fromkeys(unit("N m", motion) for motion in reader.motions))
    click.echo(f"{f'RMS, {units}':<24}{'axis':<10}{'recorded':>12}{'other':>12}{'difference':>12}")
    for name, values in found.items():
        for k, axis in enumerate(comparison.axes):
            row = "".join(f"{values[which][k]:>12.5f}" for which in ("recorded", "other", "difference"))
            click.echo(f"{own_name(name, reader.motions[k]):<24}{axis:<10}{row}")
    said = (
        "the motion and the hand are the recorded ones: a rig that had felt these torques would have moved "
        "otherwise"
    )
    click.echo(words(said, _motion(reader)))
    _require_whole(comparison.verdict)
