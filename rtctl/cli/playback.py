"""`rtctl playback`: the controller over a recorded log."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hw.motion import HANDLE_M, named, words
from hw.playback.text_rows import is_number
from rtctl.cli.columns import unit_of
from rtctl.cli.json_text import json_text
from rtctl.cli.number import Number
from rtctl.cli.outputs import OutputFile, errors_in_units_of, require_apart
from rtctl.cli.progress import on_a_terminal
from rtctl.cli.unread import refuse_unread

if TYPE_CHECKING:
    from rtctl.simulation.playback_job import Job

# a warning about a log is one of both commands, and this one lacks what some of them name
_OF_IDENTIFY = re.compile(r"--(?:torque-delay|keep-offset|offset-is-zero|by-load|gear-ratio|rate-hz)\b")


def _column(ctx: click.Context, param: click.Parameter, text: str | None) -> dict[str, Any] | None:
    """Read NAME[:UNIT][:SCALE[:OFFSET]]; a name may hold colons."""
    if text is None:
        return None
    parts = text.split(":")
    numbers: list[float] = []
    # from the end, as a name may hold colons; a third number belongs to the name
    while len(parts) > 1 and len(numbers) < 2 and is_number(parts[-1]):
        try:
            numbers.insert(0, float(parts.pop()))
        except ValueError as error:  # 1,5 is one in a log
            raise click.BadParameter(f"{text!r}: write scale and offset as 1.5", ctx, param) from error
    unit = unit_of(parts[-1]) if len(parts) > 1 else None
    name = ":".join(parts if unit is None else parts[:-1])
    if not name or (len(parts) > 1 and (not parts[-1] or is_number(parts[-1]))):
        raise click.BadParameter(f"{text!r} is not NAME[:UNIT][:SCALE[:OFFSET]]", ctx, param)
    scaled = dict(zip(("scale", "offset"), numbers, strict=False))
    return {"column": name, **({"unit": unit} if unit else {}), **scaled}


_NUMBER = Number(1e-9, 1e9)
_OF_A_LOG_ALONE = {
    "time", "position", "motor_torque", "hand_torque", "torque_limit_nm", "lever_m", "counts_per_rev"
}  # fmt: skip
_OF_LEARNING = {"save_model", "plot", "presliding_rad", "train_share", "epsilon_nm"}


@click.command("playback")
@click.argument("config", required=False, type=click.Path(path_type=Path))
@click.option("--log", type=click.Path(path_type=Path), help="log to run over; default: the one CONFIG names")
@click.option(
    "--fit-from",
    type=click.Path(path_type=Path),
    multiple=True,
    help="learn friction from this log of free motion (same columns); may be given several times",
)
@click.option("--time", callback=_column, metavar="COLUMN", help="time column, s")
@click.option("--position", callback=_column, metavar="COLUMN", help="joint angle, rad")
@click.option("--motor-torque", callback=_column, metavar="COLUMN", help="motor torque at the link, N m")
@click.option(
    "--hand-torque", callback=_column, metavar="COLUMN", help="torque of the hand on the joint, N m"
)
@click.option("--inertia-kgm2", type=_NUMBER, help="inertia; default: CONFIG's, or by regression in each log")
@click.option("--fit-inertia", is_flag=True, help="inertia by regression in each log, also with CONFIG")
@click.option("--torque-limit-nm", type=_NUMBER, default=1.0, help="without CONFIG")
@click.option("--lever-m", type=_NUMBER, default=0.1, help="without CONFIG")
@click.option("--counts-per-rev", type=_NUMBER, default=100_000.0, help="without CONFIG")
@click.option(
    "--bias",
    type=click.Choice(["midpoint", "zero"]),
    default="midpoint",
    help="zero of the torque sensor: half way between the directions, in each log; or as recorded",
)
@click.option(
    "--train-share",
    type=Number(0.1, 1.0),
    default=1.0,
    show_default=False,
    help="train on the first part only",
)
@click.option("--cutoff-hz", type=Number(0.1, 1e4), default=20.0, help="low-pass of what is learned from")
@click.option(
    "--speed-min-rad-s",
    "--speed-min-m-s",
    "speed_min_rad_s",
    type=Number(0, 100),
    help="slower is told apart; default 0.03 rad/s, of a linear axis 1.5 % of the largest",
)
@click.option(
    "--epsilon-nm",
    "--epsilon-n",
    "epsilon_nm",
    type=_NUMBER,
    help="tube of the regression; default 0.001 N m, of a linear axis 0.01 N",
)
@click.option(
    "--presliding",
    "presliding_rad",
    type=Number(min=0, min_open=True, max=1),
    metavar="RAD",
    help="presliding length of the learned model, rad; default: what the turns in --fit-from tell",
)
@click.option("--save-model", type=OutputFile(), help="keep the learned model in this file")
@click.option("--plot", type=OutputFile(picture=True), help="write a figure (PNG)")
@click.option("--json", "as_json", is_flag=True, help="one JSON object on stdout")
def command(config: Path | None, *, as_json: bool, **options: Any) -> None:  # noqa: ANN401 - passed on
    """Run the real control loop over a recorded log and report what compensation would have done.

    Friction is learned from --fit-from, or CONFIG's model is used. The rig and the columns come from CONFIG
    (a rig file whose device is playback), or from --time, --position, ... A COLUMN is
    NAME[:UNIT][:SCALE[:OFFSET]], in the unit named below where it says none; a negative scale turns a sign.
    Nothing moves: hand and motion stay the recorded ones. See docs/playback.md."""
    if not (config or all(options[name] for name in ("log", "fit_from", "time", "position"))):
        raise click.UsageError(
            "give CONFIG, or --log, --fit-from, --time and --position with a torque column"
        )
    require_apart(options["save_model"], (config, options["log"], *options["fit_from"]), options["plot"])
    if config:
        refuse_unread(_OF_A_LOG_ALONE, f"means nothing with a rig file: it stands in {config}")
    # an option that is not read would be believed to have counted
    if not options["fit_from"]:
        refuse_unread(_OF_LEARNING, "is about the model that is learned: give --fit-from, too")
    from rtctl.recording.as_columns import register
    from rtctl.rig_file.config import load
    from rtctl.simulation.playback_job import Job, run

    register()
    job = Job(config=config, **options)
    # a log that is played back has one axis
    motion = load(config).config.axis[0].motion if config else "rotary"
    with errors_in_units_of(motion), on_a_terminal(quiet=as_json, motion=motion) as bar:
        result = run(job, bar)
    result_lines = _lines(result, job)
    click.echo(json_text(named(result, motion)) if as_json else words("\n".join(result_lines), motion))


def _lines(result: dict[str, Any], job: Job) -> list[str]:
    log = result["log"]
    lines = [f"log      {log['file']} ({log['samples']} friction samples, {result['rate_hz']:.6g} Hz)"]
    lines += [_dynamics(log), *_warnings(result["warnings"])]
    for each in result["fit"]["logs"] if "fit" in result else ():
        lines += [f"fit from {each['file']}", _dynamics(each)]
    if "fit" in result:
        fit = result["fit"]
        lines.append(
            f"model    {fit['points']} points, support vectors {fit['support_vectors']} (forward, backward)"
        )
        lines.append(f"         presliding length: {_presliding(fit['presliding'], result['motion'])}")
        lines += _warnings(fit["warnings"])
    for name, title in (("held_out", "held-out part of the training logs"), ("prediction", "the log")):
        if name in result:
            lines.append(_prediction(title, result[name]))
    lines += _interaction(result["interaction"]) if "interaction" in result else []
    lines += [f"figure   {job.plot}"] if job.plot else []
    return lines


def _warnings(texts: list[str]) -> list[str]:
    others = ", ".join(sorted({option for text in texts for option in _OF_IDENTIFY.findall(text)}))
    told = f"         ({others}: of `rtctl identify --log`, whose points `rtctl fit` reads)"
    return [*(f"warning  {text}" for text in texts), *([told] if others else [])]


def _presliding(found: dict[str, Any] | None, motion: str) -> str:
    from rtctl.friction.presliding import Presliding

    if found is None:
        # 5 mrad, which are .5 mm at a handle: what is assumed where nobody measured (decision 0067)
        taken = 5.0 * (HANDLE_M if motion == "linear" else 1.0)
        return f"not told by these logs: taken for {taken:g} mrad, so less help near reversals (--presliding)"
    return str(Presliding(**found))


def _dynamics(log: dict[str, Any]) -> str:
    found = log["regression"]
    return (
        f"         regression: inertia {found['inertia_kgm2']:.4g} kg m^2, "
        f"viscous {found['viscous_nms_rad']:.4g} N m s/rad, "
        f"levels {1e3 * found['level_forward_nm']:+.1f} / {1e3 * found['level_backward_nm']:+.1f} mN m, "
        f"residual {1e3 * found['rms_nm']:.2f} mN m\n"
        f"         taken: inertia {log['inertia_kgm2']:.4g} kg m^2, bias {1e3 * log['bias_nm']:+.1f} mN m"
    )


def _prediction(title: str, found: dict[str, Any]) -> str:
    if found.get("trained_on_it"):
        title += " (which is among the training logs)"
    return (
        f"friction of {title}: RMS {1e3 * found['friction_rms_nm']:.2f} mN m, "
        f"error {1e3 * found['rmse_nm']:.2f} mN m\n"
        f"         (forward {1e3 * found['rmse_forward_nm']:.2f}, backward "
        f"{1e3 * found['rmse_backward_nm']:.2f}; one curve for both directions "
        f"{1e3 * found['rmse_symmetric_nm']:.2f}), {100 * found['in_range_share']:.1f} % in the trained "
        "range"
    )


def _interaction(found: dict[str, Any]) -> list[str]:
    ended = (
        f"{found['first_fault']} at {found['stopped_at_s']:.3f} s"
        if found["first_fault"]
        else "the end of the log"
    )
    lines = [
        f"loop     {found['ticks']} ticks up to {ended}, {found['counted_ticks']} of them counted (full "
        "authority)",
        f"         faults: {found['faults']}; torque limited in {found['limited_ticks']} ticks; "
        f"{100 * found['in_range_share']:.1f} % in the trained range",
        "RMS, mN m     share   hand felt   feed-forward     left   reduction | inertia   friction   "
        "friction left",
    ]
    for name in ("all", "forward", "backward", "slow"):
        part = found[name]
        milli = {key: 1e3 * value for key, value in part.items()}
        lines.append(
            f"  {name:<10} {100 * part['share']:5.1f} %   {milli['hand_rms_nm']:9.2f}   "
            f"{milli['feedforward_rms_nm']:12.2f}   {milli['left_rms_nm']:6.2f}   "
            f"{100 * part['reduction']:7.1f} % | {milli['inertia_rms_nm']:7.2f}   "
            f"{milli['friction_rms_nm']:8.2f}   {milli['friction_left_rms_nm']:13.2f}"
        )
    lines.append("left = hand minus feed-forward: what the hand would have felt, had it moved the same way")
    return lines
