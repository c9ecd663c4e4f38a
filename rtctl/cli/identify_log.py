"""`rtctl identify --log`: inertia and friction from recordings, without moving anything."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hw.motion import name, named, of_units, words
from rtctl.cli.columns import held_columns, own_columns, tables, text_of, text_options
from rtctl.cli.identify_log_text import (
    fit_lines,
    reversal_lines,
    ungeared,
    unheld,
    units_line,
    units_of,
    units_to_confirm,
)
from rtctl.cli.json_text import json_text
from rtctl.cli.number import Number
from rtctl.cli.outputs import OutputFolder, errors_in_units_of
from rtctl.cli.progress import on_a_terminal
from rtctl.errors import ConfigError

if TYPE_CHECKING:
    from rtctl.friction.logs.log_input import Gearing
    from rtctl.friction.points import FrictionPoints
    from rtctl.friction.presliding import Presliding
    from rtctl.rig_file.axis_tables import AxisTable

ROLES = {
    "time": "time",
    "position": "position",
    "current": "current",
    "torque": "motor_torque",
    "external": "hand_torque",
    "velocity": "velocity",
    "temperature": "temperature",
}
"""Name on the command line -> role of the playback reader."""

OWN_LINEAR = {"position_m": "m", "motor_torque_n": "N", "hand_torque_n": "N"}
"""Columns of a linear axis in a recording of rtctl's own, and what they are in."""

_POSITIVE = Number(min=0, max=1e9, min_open=True)


@click.command("identify")
@click.option(
    "--log",
    "logs",
    type=click.Path(path_type=Path),
    multiple=True,
    required=True,
    help="text, npz, MATLAB, HDF5, JSON, TDMS, Parquet or MCAP (docs/logs.md); may be repeated",
)
@click.option(
    "--column", "columns", multiple=True, metavar="ROLE=NAME[:UNIT[:SCALE]]", help=f"ROLE: {', '.join(ROLES)}"
)
@click.option("--map", "map_file", type=click.Path(path_type=Path), help="the same as TOML, a table per role")
@text_options
@click.option("--rate-hz", type=_POSITIVE, help="rate of logs without a time column")
@click.option(
    "--config", type=click.Path(path_type=Path), help="rig file: gearing, and limits the log must keep to"
)
@click.option("--axis", type=click.IntRange(0, 7), default=0, help="number of its axis")
@click.option("--torque-constant", type=_POSITIVE, help="N m/A, for a current; default: of --config, or 1")
@click.option(
    "--gear-ratio",
    type=_POSITIVE,
    help="of the gear behind a motor whose current or torque was recorded; default: for a current that of "
    "--config, or 1",
)
@click.option("--gear-efficiency", type=Number(0.01, 1), help="default: likewise")
@click.option("--counts-per-rev", type=_POSITIVE, help="for a position in counts; default: of --config, or 1")
@click.option(
    "--lead-m",
    type=Number(min=0, max=10, min_open=True),
    help="of a screw, m a turn: a log of its angle and torque is told in m and N; default: of --config",
)
@click.option(
    "--torque-delay",
    type=Number(-1, 1),
    help="motor torque late by, s; default: half a period, or none where that is seen",
)
@click.option("--cutoff-hz", type=Number(0.1, 1e4), help="low-pass; default: 20, or a fifth of a lower rate")
@click.option(
    "--speed-min-rad-s",
    "--speed-min-m-s",
    "speed_min",
    type=Number(0, 100),
    help="slower rows are left out; default 0.03 rad/s, of a linear axis 1.5 % of the largest",
)
@click.option("--keep-offset", is_flag=True, help="leave the offset in the friction samples")
@click.option("--offset-is-zero", is_flag=True, help="the offset is surely the zero of the torque's sensor")
@click.option("--by-load", is_flag=True, help="points by speed and load of two torques, for fit --by-load")
@click.option("--out", type=OutputFolder(), help="folder for points.csv and regression.json")
@click.option("--json", "as_json", is_flag=True, help="one JSON object on stdout")
def command(  # longer than 50 lines: the steps are in order of the work
    logs: tuple[Path, ...],
    *,
    columns: tuple[str, ...],
    map_file: Path | None,
    delimiter: str | None,
    decimal: str | None,
    rate_hz: float | None,
    config: Path | None,
    axis: int,
    torque_delay: float | None,
    cutoff_hz: float | None,
    speed_min: float | None,
    keep_offset: bool,
    offset_is_zero: bool,
    by_load: bool,
    out: Path | None,
    as_json: bool,
    **gearing: float | None,
) -> None:
    """Find inertia, viscous and Coulomb friction and offset in recordings of a joint in motion.

    Every torque on the joint must be mapped: the motor's (torque or current), and the hand's (external) if
    one was on the rig. Several logs are one regression, each with an offset of its own. Columns in m or mm
    and N are of a linear axis."""
    from rtctl.friction.logs.against_rig import against_encoder, against_rig
    from rtctl.friction.logs.loads import with_load
    from rtctl.friction.logs.log_checks import diagnose
    from rtctl.friction.logs.log_input import options_of, samples
    from rtctl.friction.logs.log_points import read_in_time
    from rtctl.friction.logs.logs import level_points
    from rtctl.friction.logs.plausibility import (
        ANY_LINEAR,
        Limits,
        doubtful_friction,
        doubtful_offsets,
        doubtful_parameters,
    )
    from rtctl.friction.logs.regression import joint_fit
    from rtctl.friction.logs.reversal_memory import reversals_of_logs
    from rtctl.friction.logs.temperatures import with_temperature
    from rtctl.recording.as_columns import register

    if keep_offset and offset_is_zero:
        raise click.UsageError("--keep-offset leaves in the points what --offset-is-zero takes out; drop one")
    if by_load and not out:
        raise click.UsageError("--by-load is about the points that --out DIR writes: give that, too")
    rig_axis = _axis(config, axis)
    register()
    if rig_axis and not (columns or map_file) and all(log.suffix == ".mcap" for log in logs):
        columns = own_columns(rig_axis)
    mapped = _tables(logs[0], columns, map_file)
    known, warmth = dict(mapped), mapped.pop("temperature", None)
    taken = () if config else ungeared(mapped, gearing)
    unsaid, unknown = ((), ()) if config else unheld(mapped, gearing)
    behind = (gearing["gear_ratio"] or 1.0) * (gearing["gear_efficiency"] or 1.0)
    if (torque := mapped.get("motor_torque")) and behind != 1:  # the reader wants it at the joint
        mapped["motor_torque"] = {**torque, "scale": torque.get("scale", 1.0) * behind}
    geared = _gearing(gearing, rig_axis, of_units(table.get("unit") for table in mapped.values()))
    motion = geared.motion
    any_axis = ANY_LINEAR if motion == "linear" else Limits()
    limits = Limits.of_axis(rig_axis, str(config)) if rig_axis else any_axis
    with errors_in_units_of(motion), on_a_terminal(quiet=as_json, motion=motion) as bar:
        bar(0.0, "reading, and how far the joint bends at rest")
        options = [options_of(log, mapped, rate_hz, text_of(delimiter, decimal)) for log in logs]
        found = read_in_time(options, geared, torque_delay, limits, cutoff_hz, speed_min)
        read, signals, cutoff_hz, slowest = found.logs, found.signals, found.cutoff_hz, found.speed_min_rad_s
        parts = [stretches[0] for stretches in read]
        bar(0.6, "what is wrong with the logs, the balance")
        told = (*diagnose(read, signals), *against_encoder(read, geared.counts_per_rev, motion))
        fit = joint_fit(signals)
        doubtful = (*doubtful_parameters(fit, limits), *doubtful_friction(fit))
        warnings = [*taken, *unsaid, *fit.warnings, *found.notes, *told, *doubtful]
        # in a balance with a hand's sensor the offset is the zero of that, too
        if not (keep_offset or offset_is_zero or "hand_torque" in mapped):
            warnings += doubtful_offsets(fit)
        if rig_axis:
            warnings += against_rig(fit, rig_axis, str(config))
        fit = replace(fit, warnings=tuple(words(each, motion) for each in warnings))
        document: dict[str, Any] = {"logs": [{"file": part.source, "sha256": part.sha256} for part in parts]}
        bar(0.7, "what memory of a turn is worth")
        turned = reversals_of_logs([part for one in read for part in one], cutoff_hz, slowest)
        document |= {**asdict(fit), "cutoff_hz": cutoff_hz, "torque_delay_s": list(found.torque_delays_s)}
        document |= {"units": units_of(known), "taken": found.taken, "motion": motion}
        document["cannot_tell"] = untold = tuple(words(one, motion) for one in (*found.untold, *unknown))
        silent = {column for part in parts for column in part.unsaid}
        document["to_confirm"] = asked = () if config else units_to_confirm(known, silent, fit, motion)
        document["presliding"] = asdict(found.bent) if found.bent else None
        document["reversals"] = asdict(turned) if turned else None
        if out:
            sha256 = hashlib.sha256("".join(part.sha256 for part in parts).encode()).hexdigest()
            sliding = samples(signals, fit, sha256, remove_offset=not keep_offset, zero_known=offset_is_zero)
            sliding = with_load(sliding, signals) if by_load else sliding
            sliding = with_temperature(sliding, signals, found.options, warmth) if warmth else sliding
            _write(out, level_points(sliding), found.bent, document, motion)
    lines = [*fit_lines(fit, found.bent, signals.radian, motion), *reversal_lines(turned)]
    lines = [words(line, motion) for line in lines] + [f"warning: {text}" for text in fit.warnings]
    lines += [f"taken: {text}" for text in found.taken]
    lines += [f"friction points: {out / 'points.csv'}"] if out else []
    lines += [f"cannot be told: {text}" for text in untold]
    lines = [*(f"please confirm: {text}" for text in asked), *lines, units_line(known)]
    click.echo(json_text(named(document, motion)) if as_json else "\n".join(lines))


def _axis(config: Path | None, axis: int) -> AxisTable | None:
    from rtctl.rig_file.config import load

    if config is None:
        if axis:
            raise click.UsageError("--axis is a number in --config RIG; give that, or leave --axis out")
        return None
    axes = load(config).config.axis
    if axis >= len(axes):
        raise ConfigError(
            f"{config}: there is no axis {axis}, it has {len(axes)}; give --axis 0 to {len(axes) - 1}"
        )
    return axes[axis]


def _gearing(given: Mapping[str, float | None], axis: AxisTable | None, motion: str) -> Gearing:
    """What the command line says, else the rig file, else 1; `motion` is what the columns say."""
    from rtctl.friction.logs.log_input import Gearing

    rig = (
        {
            "torque_constant": axis.torque_constant_nm_a,
            "gear_ratio": axis.gear_ratio,
            "gear_efficiency": axis.gear_efficiency,
            "counts_per_rev": axis.encoder_counts_per_rev,
        }
        if axis
        else {}
    )
    given_lead_m = given["lead_m"]
    value = {key: number or rig.get(key, 1.0) for key, number in given.items() if key != "lead_m"}
    value["torque_constant_nm_a"] = value.pop("torque_constant")
    lead_m = given_lead_m or (axis.lead_m if axis else 0.0)
    moves = axis.motion if axis else "linear" if lead_m else motion
    if axis and given_lead_m and moves != "linear":
        raise ConfigError(
            f"--lead-m {given_lead_m:g}: axis {axis.name} of the rig file is rotary; leave it out"
        )
    return Gearing(**value, motion=moves, lead_m=lead_m).of_screw()


def _tables(log: Path, columns: tuple[str, ...], map_file: Path | None) -> dict[str, dict[str, Any]]:
    """Option tables of the reader, by its roles."""
    given = tables(columns, map_file, tuple(ROLES))
    if "position" not in given or not {"current", "torque", "external"} & set(given):
        raise ConfigError(
            "map position and a torque: --column position=NAME:UNIT --column torque=NAME:UNIT"
            + held_columns(log)
        )
    for table in given.values():  # a recording of rtctl's own says by its names that an axis is linear
        unit = OWN_LINEAR.get(str(table.get("column")).partition(".")[0])
        if unit and "unit" not in table:
            table["unit"] = unit
    return {ROLES[role]: table for role, table in given.items()}


def _write(
    out: Path, points: FrictionPoints, bent: Presliding | None, document: dict[str, Any], motion: str
) -> None:
    from rtctl.whole_files import write_together

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    columns = ["presliding_rad", "presliding_spread_rad", "presliding_ramps"] if bent else []
    beside = points.columns
    always = ["velocity_rad_s", "friction_torque_nm", "direction", "std_nm", "count"]
    writer.writerow([name(column, motion) for column in (*always, *beside, *columns)])
    # One length for all the log: it stands in the first row, and once.
    length = [repr(bent.length_rad), repr(bent.spread_rad), bent.ramps] if bent else []
    for v, f, d, std, n, *more in zip(
        points.velocity_rad_s,
        points.friction_nm,
        points.direction,
        points.std_nm,
        points.count,
        *beside.values(),
        strict=True,
    ):
        # repr gives the digits that are read as the same number again
        known = ["" if math.isnan(value) else repr(float(value)) for value in more]
        writer.writerow(
            # in the points friction is a magnitude; in the file it has the sign of the motion
            [repr(float(v)), repr(float(f * d)), int(d), repr(float(std)), int(n), *known, *length]
        )
        length = [""] * len(columns)
    rows = text.getvalue().encode()
    document["points_sha256"] = hashlib.sha256(rows).hexdigest()
    write_together(  # both or none: the second holds the hash of the first
        out, {"points.csv": rows, "regression.json": json_text(named(document, motion), indent=1).encode()}
    )
