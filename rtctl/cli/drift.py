"""`rtctl drift`: is the friction still what was learned?"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from rtctl.cli.json_text import json_text
from rtctl.cli.number import Number
from rtctl.cli.recording_argument import RecordingFile


@click.command("drift")
@click.argument("file", type=RecordingFile())
# both defaults are those of [axis.friction.drift], by which a running rig warns
@click.option(
    "--warn",
    "warn_share",
    type=Number(0.05, 0.5),
    default=0.1,
    help="change that is warned of, a share of the dry friction",
)
@click.option(
    "--window",
    "window_s",
    type=Number(10, 300),
    default=24.0,
    metavar="S",
    help="seconds of sliding that one estimate is made of",
)
@click.option("--json", "as_json", is_flag=True, help="one JSON object")
def command(file: Path, warn_share: float, window_s: float, *, as_json: bool) -> None:
    """Compare the friction in the recording FILE, over all its parts, with the model that it ran with.

    Needs an ordinary motion with a force sensor: strokes that are long against the bristles. A running
    rig says the same by itself (docs/friction.md)."""
    from rtctl.friction.drift_recorded import over_ticks
    from rtctl.recording.reader import RecordingReader, all_parts
    from rtctl.rig_file.friction_tables import DriftTable

    reader = RecordingReader(all_parts(file))
    law = reader.law()
    table = DriftTable(warn_share=warn_share, window_s=window_s)
    # one chunk at a time: a recording of a day fits into no memory
    rows = (batch.rows for batch in reader.batches())
    missing = [*reader.missing_fields(), *law.missing]
    found = over_ticks(law.params, law.model, reader.axes, rows, table, missing)
    # by name, not by place: axes that cannot be watched (no model) are left out of what was found
    motions = dict(zip(reader.axes, reader.motions, strict=True))
    found = [{**one, "motion": motions[one["axis"]]} for one in found]
    body = {"file": str(file), "axes": found, "left_out": [str(why) for why in reader.left_out.values()]}
    click.echo(json_text(body) if as_json else "\n".join(_lines(body)))


def _lines(body: dict[str, Any]) -> list[str]:
    from hw.motion import unit
    from hw.outside import shown

    lines = [f"LEFT OUT: {shown(why, 500)}" for why in body["left_out"]]
    for axis in body["axes"]:
        lines += [f"axis {shown(axis['axis'])}: dry friction, as a factor of what was learned"]
        # too little motion: no factor, and none of 1 either
        if axis["factor"] is None:
            lines.append(
                f"  not told: {axis['seconds']:.0f} s of sliding in {axis['strokes']} strokes; move to and "
                "fro, each stroke many presliding lengths long"
            )
            continue
        offset = "offset, m" + unit("N m", axis["motion"])
        lines.append(f"{'time, s':>10}{'factor':>20}{'forward':>20}{'backward':>20}{offset:>22}")
        lines += [_row(f"{one['time_s']:.0f}", one) for one in axis["history"]]
        lines.append(_row("end", axis))
        if axis["place_trust"] > 0:
            lines.append(f"  by place, trusted by {100 * axis['place_trust']:.0f} %")
        lines += [f"  WARNING: {axis[key]}" for key in ("warning", "stop") if axis[key]]
    return lines


def _row(when: str, one: dict[str, Any]) -> str:
    cells = [_cell(one[name]) for name in ("factor", "forward", "backward")]
    return f"{when:>10}" + "".join(f"{cell:>20}" for cell in cells) + f"{_cell(one['offset_nm'], 1e3, 1):>22}"


def _cell(found: dict[str, float], scale: float = 1.0, digits: int = 3) -> str:
    half = 0.5 * (found["high"] - found["low"])
    return f"{scale * found['value']:.{digits}f} +- {scale * half:.{digits}f}"
