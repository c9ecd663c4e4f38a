"""`rtctl info`: what stands in a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from rtctl.cli.json_text import json_text
from rtctl.cli.recording_argument import RecordingFile


@click.command("info")
@click.argument("file", type=RecordingFile())
@click.option("--json", "as_json", is_flag=True, help="one JSON object")
def command(file: Path, *, as_json: bool) -> None:
    """Show rig, versions, duration, losses and states of the recording in FILE, over all its parts."""
    from rtctl.recording.overview import overview
    from rtctl.recording.reader import RecordingReader, all_parts

    found = overview(RecordingReader(all_parts(file)))
    click.echo(json_text(found) if as_json else "\n".join(_lines(found)))


def _lines(found: dict[str, Any]) -> list[str]:
    from hw.outside import shown

    about = found["about"]

    def told(name: str) -> str:
        return shown(about.get(name, "?"))

    lines = [
        f"rig {told('rig')} ({', '.join(found['axes'])}) at {float(about['rate_hz']):g} Hz, rtctl "
        f"{told('version')}, config {told('config_file')} {told('config_sha256')[:12]}",
        f"{found['ticks']} ticks, {found['duration_s']:.3f} s, slots {found['first_tick']} to "
        f"{found['last_tick']}",
        f"{len(found['files'])} file(s), {found['bytes'] / 1e6:.2f} MB, {found['commands']} commands, "
        + (", ".join(f"{n} {shown(name)}" for name, n in found["events"].items()) or "no")
        + " events",
        "states: " + ", ".join(f"{name} {s:.3f} s" for name, s in found["states_s"].items()),
        f"faults: {', '.join(found['faults']) or 'none'}",
        f"lost ticks: {found['lost']}   slots the loop missed: {found['missed']}",
        "replay: " + ("yes" if found["replayable"] else "no, it begins in the middle of a run"),
    ]
    if found["waiver"] or found["realtime_waivers"]:
        lines.append(f"WAIVER: ran without real-time rights: {', '.join(found['realtime_waivers'])}")
    if found["not_recorded"]:
        lines.append(f"recorded before the tick had {', '.join(found['not_recorded'])}")
    lines += [f"CUT OFF: {part} has no end; every whole chunk was read" for part in found["cut_off"]]
    # these texts are out of files that anybody may have written
    lines += [f"LEFT OUT: {shown(why, 500)}" for why in found["left_out"].values()]
    lines += [f"DAMAGED: {note}" for note in found["damaged"]]
    if found["bad_chunks"]:
        lines.append(f"DAMAGED: {found['bad_chunks']} chunk(s) left out")
    for name, end in found["ends"].items():
        if end.get("broken"):
            lines.append(
                f"BROKEN while recording {name}: {shown(end['broken'], 500)}; "
                f"{shown(end.get('dropped', '?'))} ticks dropped"
            )
    return [
        *lines,
        "attachments: " + ", ".join(f"{shown(n)} ({size} B)" for n, size in found["attachments"].items()),
    ]
