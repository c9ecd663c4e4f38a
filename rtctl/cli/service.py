"""`rtctl service`: the rig as a systemd service."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import click

from rtctl.cli.invocation import as_run
from rtctl.cli.json_text import json_text

_ROOT = click.option(
    "--root",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("/"),
    show_default=False,
    help="write below this folder instead of into the system (packaging); nothing is started",
)
_JSON = click.option("--json", "as_json", is_flag=True, help="the steps as one JSON object on stdout")
_DRY = click.option("--dry-run", is_flag=True, help="say what would be done, and do nothing")


@click.group("service")
def command() -> None:
    """Install, remove and look at the rig as a systemd service."""


@command.command("install", short_help="make the rig of CONFIG a service")
@click.argument("config", type=click.Path(path_type=Path))
@click.option("--no-start", is_flag=True, help="enable it for the next boot, but do not start it now")
@click.option(
    "--command", "starter", metavar="TEXT", help="how the unit starts rtctl, when not by this very Python"
)
@_ROOT
@_DRY
@_JSON
def install(
    config: Path, root: Path, starter: str | None, *, no_start: bool, dry_run: bool, as_json: bool
) -> None:
    """Make the rig of CONFIG a service: sudo rtctl service install my-rig.toml.

    Copies the rig file (and its friction models) to /etc/rtctl, the unit to /etc/systemd/system, makes the
    user `rtctl`, compiles what the rig needs (a minute, once), enables and starts rtctl@NAME. Doing it again
    changes only what differs; a daemon that runs goes on as it was started. The rig starts unarmed."""
    from rtctl.check import stability_report
    from rtctl.host import service_steps as service
    from rtctl.rig_file.config import load

    loaded = load(config)
    # a daemon would refuse such a file at every start
    stability_report.examine(loaded, telling=False).require()
    if root == Path("/") and not dry_run:
        _require_root()
    made = service.plan(loaded, root, starter or service.own_command(), start=not no_start)
    steps: list[str] = []
    # before: what is started here begins with what is put there here
    runs_on = made.live and not dry_run and _is_active(f"rtctl@{made.name}.service")
    # standard output is one object then
    service.apply(made, steps.append if as_json else click.echo, _run, dry_run=dry_run)
    if as_json:
        told = {"rig": made.name, "dry_run": dry_run, "steps": steps, "runs_as_before": runs_on}
        click.echo(json_text(told))
    elif made.live and not dry_run:
        click.echo(as_run(f"rtctl@{made.name} is installed; see: rtctl service status {made.name}"))
        if runs_on:
            # by a person: a hand may be on it
            click.echo(
                f"it runs on as it was started, with the rig file, models and rtctl of then; with nobody at "
                f"the rig: sudo systemctl restart rtctl@{made.name}"
            )


@command.command("uninstall", short_help="stop rig NAME, remove its service")
@click.argument("name")
@click.option("--purge", is_flag=True, help="also delete its rig file, event log and recordings")
@_ROOT
@_DRY
@_JSON
def uninstall(name: str, root: Path, *, purge: bool, dry_run: bool, as_json: bool) -> None:
    """Stop rig NAME and remove its service. Its rig file and data stay, unless --purge.

    With the last rig the unit, the udev rules and the compiled cache go too."""
    from rtctl.host import service_steps as service

    if root == Path("/") and not dry_run:
        _require_root()
    # by the rig files, which an uninstallation without --purge leaves: they may come back
    known = service.installed(root)
    others = [rig for rig in known if rig != name]
    commands, paths = service.removal(name, root, last=not others, purge=purge)
    steps: list[str] = []
    say = steps.append if as_json else click.echo
    for step in commands:
        say(f"{'would run' if dry_run else 'run'} {' '.join(step)}")
        if not dry_run:
            # a rig that does not run, or was never enabled, is removed all the same
            _run(step, check=False)
    # once it is stopped: a unit that runs would make its folders anew
    for path in paths:
        say(f"{'would remove' if dry_run else 'remove'} {path}")
        if not dry_run:
            _remove(path)
    if root == Path("/") and not dry_run:
        _run(["systemctl", "daemon-reload"])
    if as_json:
        click.echo(json_text({"rig": name, "dry_run": dry_run, "steps": steps}))
    # not by the commands: systemd is asked to stop whatever name is given, and a wrong one fails silently
    if name not in known and not paths:
        there = f"; there are {', '.join(known)}" if known else ""
        click.echo(f"nothing of rig {name!r} is installed{there}", err=True)


@command.command("status", short_help="systemd's view of rig NAME")
@click.argument("name")
def status(name: str) -> None:
    """Show systemd's view of rig NAME: state, first fault, last journal lines."""
    sys.exit(_pass(["systemctl", "--no-pager", "status", f"rtctl@{name}.service"]))


@command.command("logs", short_help="the journal of rig NAME")
@click.argument("name")
@click.option("-f", "--follow", is_flag=True, help="go on showing new lines")
@click.option("-n", "--lines", type=click.IntRange(1), default=100, help="newest lines")
def logs(name: str, lines: int, *, follow: bool) -> None:
    """Show the journal of rig NAME."""
    more = ["-f"] if follow else []
    sys.exit(_pass(["journalctl", "--no-pager", "-u", f"rtctl@{name}.service", "-n", str(lines), *more]))


def _is_active(unit: str) -> bool:
    """Whether systemd runs this unit now."""
    return subprocess.call(["systemctl", "is-active", "--quiet", unit]) == 0


def _require_root() -> None:
    if os.geteuid() != 0:
        raise click.UsageError("needs root: use sudo, or --root DIR or --dry-run to look first")
    if not shutil.which("systemctl"):
        raise click.UsageError(
            "there is no systemd here: use --root DIR to write the files for another machine"
        )


def _run(command: list[str], *, check: bool = True) -> None:
    """Run one step. What is missing on a small machine (udev) is said and passed over."""
    if shutil.which(command[0]) is None:
        # an installation without udev works for rigs without its devices, so that it goes on
        click.echo(f"  {command[0]} is not there: left out", err=True)
        return
    from rtctl.host.service_steps import COMPILER

    if command[0] == COMPILER:
        _compile(command)
        return
    # what it says is shown with its failure alone: steps that work say nothing worth reading
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode and check and command[0] != "udevadm":
        raise click.ClickException(f"{' '.join(command)}: {(done.stderr or done.stdout).strip()}")


def _compile(command: list[str]) -> None:
    """Have the service's code compiled before its first start; what it says is shown as it comes."""
    # with --json standard output is one object, and nothing else
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=sys.stderr, check=False)
    if done.returncode:
        click.echo(
            "  could not be compiled now: the service's first start does it, in about a minute", err=True
        )


def _pass(command: list[str]) -> int:
    if shutil.which(command[0]) is None:
        raise click.UsageError(f"{command[0]} is not there: this needs systemd")
    return subprocess.call(command)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():  # a link is removed, and what it leads to is somebody's
        shutil.rmtree(path)
    else:
        path.unlink()
