"""`rtctl events`: what happened to a rig, from its event log."""

from __future__ import annotations

import shlex
from datetime import datetime
from pathlib import Path
from typing import Any

import click

from hw.motion import words
from hw.outside import shown
from rtctl.cli.invocation import as_run
from rtctl.cli.json_text import json_text
from rtctl.cli.rig_argument import rig_argument, rig_of

# longest line: the words of a device may be of any length
MOST_LINE = 2000


@click.command("events")
@rig_argument
@click.option("--last", type=click.IntRange(0), default=50, help="so many of the newest")
@click.option("--follow", is_flag=True, help="then go on showing new ones; Ctrl-C ends")
@click.option("--state-dir", type=click.Path(path_type=Path), help="folder that holds one folder per rig")
@click.option("--json", "as_json", is_flag=True, help="the log's own lines, one JSON object each")
def command(rig: str | None, last: int, state_dir: Path | None, *, follow: bool, as_json: bool) -> None:
    """Show changes of state, faults and incidents of a rig, whether it runs now or not.

    The log is kept under $RTCTL_STATE_DIR, $STATE_DIRECTORY (systemd) or ~/.local/state/rtctl."""
    from rtctl.errors import DataError
    from rtctl.recording import event_log
    from rtctl.recording.state_folder import written_folder

    folder = written_folder(rig_of(rig), state_dir)
    # who follows may wait for the first run
    if not event_log.log_files(folder) and not follow:
        raise DataError(f"no event log in {folder}: the rig has not run for this user; see --state-dir")
    # before the log is read: an event that is written meanwhile is in one of both at least
    following = event_log.follow(folder) if follow else iter(())
    events, torn = event_log.read_events(folder, last)
    for event in events:
        click.echo(json_text(event) if as_json else line(event))
    if torn:
        click.echo(f"rtctl: {torn} line(s) cut off by a crash were skipped", err=True)
    try:
        for event in following:
            if event in events:  # written while the log was read: shown above
                continue
            events = []  # one that is new: so are all that follow
            click.echo(json_text(event) if as_json else line(event))
    except KeyboardInterrupt:
        click.echo("", err=True)


def line(event: dict[str, Any]) -> str:
    """One event as a line for a person."""
    try:
        when = datetime.fromtimestamp(event["timestamp"]).astimezone()
        head = f"{when:%Y-%m-%d %H:%M:%S}.{when.microsecond // 1000:03d} tick {event['tick']:>9}"
        # through `shown`: words of devices and clients may hold what a terminal obeys
        return shown(f"{head}  {_text(event)}", MOST_LINE)
    # a log of another version, or one that somebody edited
    except (KeyError, TypeError, ValueError, OverflowError, OSError):
        return shown(f"an event that this version cannot read: {json_text(event)}")


def _text(event: dict[str, Any]) -> str:
    from rtctl.wire.event_words import line_of
    from rtctl.wire.fault_words import sentence

    kind = event["event"]
    match kind:
        case "state":
            return (
                f"{event['from']} -> {event['to']}: {event.get('cause') or 'the law'} (command "
                f"{event.get('command_seq')})"
            )
        case "fault":
            first = " (first cause)" if event.get("first_cause") else ""
            return f"fault {sentence(event)}{first}{_left_out(event)}"
        case "fault_cleared":
            return f"fault {event['name']} is gone{_left_out(event)}"
        case "fault_repeated":
            return f"fault {event['name']}{_left_out(event)}"
        case "warning":
            return f"warning {event['name']}: {event['text']}"
        case "warning_cleared":
            return f"warning {event['name']} of axis {event['axis']} is gone"
        case "measured" | "late":
            return _measured(event) if kind == "measured" else _late(event)
        case "incident":
            file = shlex.quote(str(event["file"]))  # to be pasted, whatever the folder is called
            return as_run(f"incident of {event['ticks']} ticks: rtctl incident {file}")
        case "started":
            return (
                f"rtctl {event['version']} started, process {event['pid']}, config "
                f"{event['config_sha256'][:12]}{_cut_off(event)}"
            )
        case "ended":
            return f"ended{': ' if event['cause'] else ''}{event['cause']}"
        case "log_gap":
            return f"{event['lost']} events could not be written here"
        case _:
            return f"{line_of(event) or kind}{_left_out(event)}"


def _cut_off(event: dict[str, Any]) -> str:
    from rtctl.wire.event_words import cut_off_line

    last_s = event.get("cut_off")  # older logs do not tell
    return "" if last_s is None else f"; {cut_off_line(last_s)}"


def _left_out(event: dict[str, Any]) -> str:
    """A fault that flickers: how many of its events before this one were not written."""
    count = event.get("suppressed", 0)
    return f" ({count} like it before, not listed)" if count else ""


def _late(event: dict[str, Any]) -> str:
    named = f" ({event['name']})" if event["name"] else ""
    return (
        f"{event['ticks']} late tick(s), {event['worst_us']:.0f} us at most: {event['cause']}{named}, "
        f"{event['text']}{_left_out(event)}"
    )


def _measured(event: dict[str, Any]) -> str:
    return words(
        f"axis {event['axis']}: torque at least {event['delay_s'] * 1e3:.3g} ms late (lag "
        f"{event['lag_s'] * 1e3:.3g}), current {event['gain']:.3g} of what was sent, "
        f"{event['offset_nm']:+.3g} N m off; a sample every {event['sample_period_s'] * 1e3:.3g} ms",
        event.get("motion", "rotary"),
    )
