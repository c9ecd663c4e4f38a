"""`rtctl doctor`: is this machine, and this rig, fit to run?"""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rtctl.cli.colour import coloured
from rtctl.cli.invocation import as_run
from rtctl.cli.json_text import end_with
from rtctl.cli.number import Number
from rtctl.cli.rig_argument import connect, runtime_option
from rtctl.cli.unread import refuse_unread

if TYPE_CHECKING:
    from rtctl.host.machine_line import Line

_COLOURS = {"ok": "green", "warn": "yellow", "fail": "red"}


@click.command("doctor")
@click.argument("config", required=False, type=click.Path(path_type=Path))
@click.option(
    "--timing",
    "seconds",
    type=Number(0.1, 600),
    default=5.0,
    help="seconds of the wake-up measurement on the loop's core",
)
@click.option(
    "--watch", is_flag=True, help="follow a running rig instead: its late ticks, and why they were late"
)
@click.option("--for", "--seconds", "watch_s", type=Number(0.1, 1e6), help="end --watch after so long")
@runtime_option
@click.option("--no-timing", is_flag=True, help="leave the wake-up measurement out")
@click.option("--json", "as_json", is_flag=True, help="one JSON object on stdout")
def command(
    config: Path | None,
    seconds: float,
    *,
    watch: bool,
    watch_s: float | None,
    runtime_dir: Path | None,
    no_timing: bool,
    as_json: bool,
) -> None:
    """Check this machine, and the rig of CONFIG: kernel, rights, devices, versions, model, wake-ups.

    Nothing is changed, opened or armed. Each line is ok, warn or fail, with the command or line that puts it
    right. Exit code 1 when a line fails. With --watch a rig that runs is followed, of CONFIG or the only one.
    """
    if watch:
        refuse_unread({"seconds", "no_timing"}, "means nothing with --watch")
    else:
        refuse_unread({"watch_s", "runtime_dir"}, "counts with --watch alone")
    if watch:
        from rtctl.cli.doctor_watch import watch as follow

        # None: a rig on another machine is asked there, by its own doctor
        with connect(None if config is None else str(config), runtime_dir, None, None) as client:
            follow(client, watch_s, as_json=as_json)
        return
    from rtctl.host import machine_wakeup
    from rtctl.host.machine_examine import examine
    from rtctl.host.service_steps import install_command

    def _say(line: Line) -> None:
        click.echo(
            f"{coloured(f'{line.status:<4}', _COLOURS[line.status])}  {line.check:<22}{as_run(line.found)}"
        )
        if line.fix:
            click.echo(f"      {'':<22}-> {as_run(line.fix)}")

    # each line is said as it comes: the wake-ups alone take seconds
    report = examine(
        None if config is None else str(config),
        0.0 if no_timing else seconds,
        say=(lambda _line: None) if as_json else _say,
        install=install_command(config),
        measuring=lambda s: click.echo(f"measuring wake-ups for {s:g} s ...", err=True),
    )
    if as_json:
        body = {
            "ok": report.ok,
            "lines": [line.as_dict() for line in report.lines],
            "wakeup": None if report.wakeups is None else asdict(report.wakeups),
        }
        end_with(body, 0 if report.ok else 1)
    for line in machine_wakeup.histogram(report.wakeups) if report.wakeups else []:
        click.echo(f"      {line}")
    failed = sum(line.status == "fail" for line in report.lines)
    warned = sum(line.status == "warn" for line in report.lines)
    click.echo(f"{failed} failed, {warned} to improve, {len(report.lines) - failed - warned} ok")
    sys.exit(0 if report.ok else 1)
