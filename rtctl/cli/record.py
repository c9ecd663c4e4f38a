"""`rtctl record`: every tick of a rig that runs already, into MCAP files."""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rtctl.cli.json_text import end_with
from rtctl.cli.number import Number
from rtctl.cli.outputs import OutputFolder
from rtctl.cli.rig_argument import is_rig_file, only_rig, rig_argument, runtime_option

if TYPE_CHECKING:
    from rtctl.client.capture import Capture, Run
    from rtctl.recording.limits import Limits
    from rtctl.recording.recorder import Recorder

START_S = 5.0
"""Longest wait for a daemon that runs: it says once a second what it is."""

SHOW_S = 1.0


@click.command("record")
@rig_argument
@click.option(
    "--out", type=OutputFolder(), help="folder; default: that of [record] in CONFIG; of RIG its state folder"
)
@click.option(
    "--for",
    "seconds",
    type=Number(min=0, min_open=True),
    help="end with the tick so many seconds after the first",
)
@runtime_option
@click.option("--json", "as_json", is_flag=True, help="end with one JSON object on stdout")
def command(
    rig: str | None, out: Path | None, seconds: float | None, runtime_dir: Path | None, *, as_json: bool
) -> None:
    """Record a rig that runs, from now until Ctrl-C; the rig runs on.

    To record from the very first tick, say `record = true` in the rig file, or `rtctl run --record FOLDER`.
    Files open in PlotJuggler and Foxglove; see rtctl info, export, replay."""
    from rtctl.client.capture import Capture
    from rtctl.errors import RecordingError
    from rtctl.wire.protocol import client_directory, endpoints_in

    name, folder, limits = _target(rig or only_rig(runtime_dir), out)
    with Capture(endpoints_in(client_directory(name, runtime_dir))) as capture:
        # before any file: a wrong name must not leave an empty recording
        _await(capture, name)
        done = _record(capture, folder, limits, math.inf if seconds is None else seconds)
    for status in done:
        if not as_json:
            click.echo(_line(status) + f", in {status['folder']}")
    broken = [status["broken"] for status in done if status["broken"]]
    if as_json:
        end_with({"recordings": done}, RecordingError if broken else 0)
    if broken:
        raise RecordingError(f"the recording is broken: {broken[0]}")


def _target(rig: str, out: Path | None) -> tuple[str, Path, Limits | None]:
    """Name of the rig, folder, and limits of its file."""
    from rtctl.recording.state_folder import recording_folder, state_folder

    # a name alone: the daemon may be of a file that is not here
    if not is_rig_file(rig):
        return rig, out or state_folder(rig) / "recordings", None
    from rtctl.recording.limits import Limits
    from rtctl.rig_file.config import load

    loaded = load(rig)
    table = loaded.config.record
    return (
        loaded.config.rig.name,
        out or recording_folder(loaded),
        None if table is None else Limits.of(table),
    )


def _await(capture: Capture, name: str) -> None:
    from rtctl.errors import NoReplyError

    deadline = time.monotonic() + START_S
    while capture.run is None:
        if time.monotonic() > deadline:
            raise NoReplyError(f"no daemon runs the rig {name!r}; start it with: rtctl run CONFIG")
        try:
            capture.receive(0.2)
        except NoReplyError as error:
            raise NoReplyError(f"no daemon runs the rig {name!r}; start it with: rtctl run CONFIG") from error


def _record(capture: Capture, folder: Path, limits: Limits | None, seconds: float) -> list[dict[str, Any]]:
    """Record run after run for `seconds` of ticks, until Ctrl-C, or until a daemon stays silent."""
    from rtctl.errors import NoReplyError

    done: list[dict[str, Any]] = []
    end: float | None = None
    try:
        # another run of the daemon goes into files of its own
        while (end is None or time.monotonic() < end) and capture.run is not None:
            run, recorder = capture.run, _recorder(capture.run, folder, limits)
            end = time.monotonic() + seconds if end is None else end  # waiting for the daemon does not count
            try:
                seconds = _one_run(capture, run, recorder, seconds, end)
                end = end if seconds > 0 else 0.0
            finally:
                # whatever ended it: files without an end are told as cut off
                recorder.close("recording ended")
                done.append({**recorder.status(), "lost": run.lost})
    except KeyboardInterrupt:
        click.echo("", err=True)
    except NoReplyError as error:
        click.echo(f"rtctl: {error}", err=True)
    return done


def _recorder(run: Run, folder: Path, limits: Limits | None) -> Recorder:
    from rtctl.recording.recorder import Recorder
    from rtctl.recording.setup import Setup

    return Recorder(folder, Setup.unpacked(run.setup), limits)


def _one_run(capture: Capture, run: Run, recorder: Recorder, seconds: float, end: float) -> float:
    """Record until `seconds` after the run's first tick, or where no ticks come until `end`; the seconds that
    are left."""
    due = time.monotonic() + SHOW_S
    tty = sys.stderr.isatty()
    first_ns, left_s = None, seconds
    while capture.run is run and left_s > 0:
        now = time.monotonic()
        # by the ticks' own time: on a loaded machine many wait here, from before now and after `end`
        batch = capture.receive(max(0.01, min(0.5, end - now)))
        if batch is not None and len(batch.rows):
            times_ns = batch.rows["time_ns"]
            first_ns = int(times_ns[0]) if first_ns is None else first_ns
            count = int((times_ns - first_ns < 1e9 * seconds).sum())
            recorder.observe(
                batch.first_row, batch.rows[:count], batch.events, batch.commands, state=batch.state
            )
            left_s = seconds - 1e-9 * (int(times_ns[-1]) - first_ns + int(run.setup["about"]["period_ns"]))
        elif now >= end:
            return 0.0
        if tty and now > due:
            due = now + SHOW_S
            click.echo("\r" + _line({**recorder.status(), "lost": run.lost}), err=True, nl=False)
    return left_s


def _line(status: dict[str, Any]) -> str:
    text = f"{status['ticks']} ticks, {status['bytes'] / 1e6:.1f} MB, {status['files']} file(s), "
    text += f"{status['dropped']} dropped, {status['lost']} lost on the way"
    return text + (f", BROKEN: {status['broken']}" if status["broken"] else "")
