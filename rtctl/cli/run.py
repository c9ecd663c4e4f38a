"""`rtctl run`: the daemon."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rtctl.cli.json_text import end_with
from rtctl.cli.number import Number
from rtctl.cli.outputs import OutputFolder
from rtctl.terminal import Grade, graded

if TYPE_CHECKING:
    from rtctl.host.supervisor import Host
    from rtctl.host.waiting_loop import WaitingLoop


@contextmanager
def _told_to_systemd() -> Iterator[None]:
    """Leave an error that ends the daemon as its status."""
    from rtctl.errors import RtctlError

    try:
        yield
    except (RtctlError, OSError) as error:
        from rtctl.host.notify import Notifier

        with closing(Notifier()) as notifier:
            notifier.ended(error)
        raise


@click.command("run")
@click.argument("config", type=click.Path(path_type=Path))
@click.option("--for", "seconds", type=Number(0.01, 1e9), help="stop after this many seconds")
@click.option("--arm", is_flag=True, help="arm as soon as the rig is ready; simulated rigs only")
@click.option(
    "--faults",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="script these faults into the device, in place of the rig file's own; simulated rigs only "
    "(docs/faults.md)",
)
@click.option(
    "--record",
    "record_to",
    type=OutputFolder(),
    help="record every tick into this folder, whatever [record] says",
)
@click.option("--runtime-dir", type=click.Path(), help="folder of sockets and lock, instead of the default")
@click.option("--json", "as_json", is_flag=True, help="end with one JSON object on stdout")
@_told_to_systemd()
def command(
    config: Path,
    seconds: float | None,
    faults: Path | None,
    record_to: Path | None,
    runtime_dir: str | None,
    *,
    arm: bool,
    as_json: bool,
) -> None:
    """Run the rig of CONFIG: loop, telemetry, commands.

    The rig starts unarmed; a client arms it (see docs/protocol.md). Ctrl-C ramps the torque down and exits 0;
    a second Ctrl-C cuts it. Changes of state, faults with their place and remedy, and a recording that the
    disk refuses are said on stderr as they happen. The exit code is 11 when the run ended in a latched fault,
    14 when the recording has gaps because the disk refused it."""
    from rtctl.host.waiting_loop import WaitingLoop

    # first of all: what the loop imports is imported beside what this process does
    with WaitingLoop() as waiting, _host(config, faults, runtime_dir, record_to, waiting, arm=arm) as host:
        _collect_garbage()
        loaded = host.loaded
        if not as_json:
            click.echo(
                f"running {loaded.config.rig.name} at {loaded.config.loop.rate_hz:g} Hz; Ctrl-C to stop"
            )
            shown = host.view.describe() if host.view else []
            for line in (*host.runtime.describe(), *host.access.describe(), *shown):
                click.echo(f"  {line}")
            if scripted := loaded.scripted_faults:
                click.echo(f"  {scripted} scripted fault(s): this run is meant to go wrong")
            for grant in _grants(host.loop.grants):
                click.echo(f"  {grant}")
        summary = host.run(seconds)
    _tell_end(summary, as_json=as_json)


def _collect_garbage() -> None:
    """From now on, if the program was started without: not among what the start made, which stays."""
    if not gc.isenabled():
        gc.freeze()
        gc.enable()


def _announce(text: str) -> None:
    grade = Grade.WARNING if text.startswith("warning: ") else Grade.INFO
    click.echo(graded(f"rtctl: {text}", grade), err=True)


def _host(
    config: Path,
    faults: Path | None,
    runtime_dir: str | None,
    record_to: Path | None,
    waiting: WaitingLoop,
    *,
    arm: bool,
) -> Host:
    """The host of this rig file, not entered yet."""
    from rtctl.errors import ConfigError
    from rtctl.host.loop_process import order_of
    from rtctl.rig_file.config import load

    loaded = load(config, faults)
    # before anything is opened: nobody should be in front of a rig that arms by itself
    if arm and not loaded.config.simulated:
        raise ConfigError(
            f"{config}: --arm is for simulated rigs; a real rig is armed by its operator's client"
        )
    # else the host finds out what reads the log
    if all(member.kind != "playback" for member in loaded.members()):
        waiting.prepare(order_of(loaded))
    from rtctl.host.auto_arm import AutoArm
    from rtctl.host.notices import Notices
    from rtctl.host.supervisor import Host

    return Host(
        loaded,
        observers=[AutoArm()] if arm else [],
        runtime_dir=runtime_dir,
        announce=_announce,
        notices=Notices(),
        record_to=record_to,
        waiting=waiting,
    )


def _tell_end(summary: dict[str, Any], *, as_json: bool) -> None:
    """Show how it went; a latched fault, or a recording with gaps, is the exit code too."""
    from rtctl.errors import FaultError, RecordingError
    from rtctl.host.outlet import LAST_WORDS_S, streams_that_never_wait

    # both: most runs end in SHUTDOWN, whatever was latched before
    faulted = summary["state"] in ("FAULT", "ESTOP", "LOCKOUT") or summary["fault_first"]
    broken = (summary["recording"] or {}).get("broken")
    with streams_that_never_wait(LAST_WORDS_S):
        if as_json:
            end_with(summary, FaultError if faulted else RecordingError if broken else 0)
        click.echo("\n".join(_lines(summary)))
    if faulted:
        raise FaultError(f"the run ended with a latched fault: {_cause(summary)}")
    if broken:
        raise RecordingError(f"the recording has gaps: {summary['recording']['broken']}")


def _cause(summary: dict[str, Any]) -> str:
    """The fault that is latched, or the state that is."""
    return str(summary["fault_first"] or summary["state"])


def _grants(grants: list[dict[str, Any]]) -> list[str]:
    """One line per real-time right: granted or refused, and how or why."""
    return [
        f"{grant['right']:<16} {'granted' if grant['granted'] else 'REFUSED'}: {grant['detail']}"
        for grant in grants
    ]


def _lines(summary: dict[str, Any]) -> list[str]:
    if not summary["ticks"]:
        return ["no ticks"]
    wakeup, cycle, telemetry = summary["wakeup_us"], summary["cycle_us"], summary["telemetry"]
    return [
        f"state {summary['state']}, {summary['ticks']} ticks at {summary['rate_hz']} Hz, "
        f"{summary['missed_ticks']} missed",
        "wake-up us: " + ", ".join(f"{name} {value}" for name, value in wakeup.items()),
        "cycle us:   " + ", ".join(f"{name} {value}" for name, value in cycle.items()),
        f"telemetry: {telemetry['published']} messages, {telemetry['dropped']} dropped",
        f"faults: {', '.join(summary['faults']) or 'none'}",
        *_logged(summary["log"]),
        *_recorded(summary["recording"]),
    ]


def _logged(log: dict[str, Any]) -> list[str]:
    lost = f", {log['dropped']} events lost" if log["dropped"] else ""
    return (
        [f"EVENT LOG BROKEN: {log['broken']}{lost}"]
        if log["broken"]
        else [f"event log:{lost[1:]}"]
        if lost
        else []
    )


def _recorded(recording: dict[str, Any] | None) -> list[str]:
    if recording is None:
        return []
    lines = [
        f"recording: {recording['ticks']} ticks, {recording['bytes'] / 1e6:.1f} MB, {recording['dropped']} "
        f"dropped, {recording['files']} file(s) in {recording['folder']}"
    ]
    return lines + ([f"RECORDING BROKEN: {recording['broken']}"] if recording["broken"] else [])
