"""`rtctl monitor`: the live state of a running rig in the terminal."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rtctl.cli.json_text import json_text
from rtctl.cli.rig_argument import connect, reach_options

if TYPE_CHECKING:
    from rtctl.client import RigClient, RigState

REFRESH_S = 0.2
LINE_S = 1.0
SILENCE_S = 5.0
"""Telemetry may pause this long, for a restart of the daemon."""

_HOME_AND_CLEAR = "\x1b[H\x1b[J"


@click.command("monitor")
@reach_options
@click.option("--rig", "named", hidden=True, help="the same as RIG; of versions before")
@click.option("--json", "as_json", is_flag=True, help="one JSON object per state sample")
@click.option(
    "--for", "seconds", type=click.FloatRange(min=0, min_open=True), help="end after this many seconds"
)
def command(
    rig: str | None,
    runtime_dir: Path | None,
    address: str | None,
    key: Path | None,
    named: str | None,
    *,
    as_json: bool,
    seconds: float | None,
) -> None:
    """Show state, torques, latency and losses of a running rig. Ctrl-C ends it; the rig runs on."""
    try:
        with connect(rig or named, runtime_dir, address, key) as client:
            hello = client.hello()
            end = math.inf if seconds is None else time.monotonic() + seconds
            if as_json:
                _json(client, end)
            else:
                _show(client, hello, end)
    except KeyboardInterrupt:
        click.echo("", err=True)


def _samples(client: RigClient, end: float) -> Iterator[tuple[RigState, int]]:
    """Samples until `end`, each with the number lost so far. Silence means that the daemon is gone."""
    from rtctl.errors import NoReplyError

    with client.states() as states:
        while (left_s := end - time.monotonic()) > 0:
            sample = states.receive(min(SILENCE_S, left_s))
            if sample is not None:
                yield sample, states.lost
            elif left_s > SILENCE_S:
                raise NoReplyError(f"no telemetry for {SILENCE_S:g} s: the daemon has ended")


def _json(client: RigClient, end: float) -> None:
    for sample, _lost in _samples(client, end):
        click.echo(json_text(_plain(sample)))


def _plain(sample: RigState) -> dict[str, Any]:
    """A sample as JSON can say it: names for numbers, null for what is not finite."""
    fields = {name: _finite(value) for name, value in sample.fields.items()}
    return {
        **fields,
        "age_s": _finite(sample.age_s),
        "state": sample.state.name,
        "faults": [fault.name for fault in sample.faults],
    }


def _finite(value: Any) -> Any:  # noqa: ANN401
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return value if not isinstance(value, float) or math.isfinite(value) else None


def _show(client: RigClient, hello: dict[str, Any], end: float) -> None:
    """Refresh a table in place on a terminal; elsewhere write a line now and then."""
    tty = sys.stdout.isatty()
    health: dict[str, Any] | None = None
    due = 0.0
    with client.health() as healths:
        for sample, lost in _samples(client, end):
            health = healths.receive(0) or health
            if time.monotonic() < due:
                continue
            due = time.monotonic() + (REFRESH_S if tty else LINE_S)
            if tty:
                click.echo(_HOME_AND_CLEAR + "\n".join(table(hello, sample, health, lost)))
            else:
                click.echo(line(sample, health, lost))


def table(hello: dict[str, Any], sample: RigState, health: dict[str, Any] | None, lost: int) -> list[str]:
    """Lines of the live table."""
    faults = ", ".join(str(fault.name) for fault in sample.faults) or "none"
    lines = [
        f"{hello['rig']}   {hello['rate_hz']:g} Hz   rtctl {hello['version']}   Ctrl-C ends, the rig runs on",
        "",
        f"state   {sample.state.name:<10} authority {sample.authority:4.0%}   epoch {sample.epoch}",
        f"faults  {faults}",
        "",
        f"{'axis':<12}{'position':>12}{'velocity':>12}{'hand':>12}{'feed-fwd':>12}{'applied':>12}",
        f"{'':<12}{'rad':>12}{'rad/s':>12}{'N m':>12}{'N m':>12}{'N m':>12}",
    ]
    for a, axis in enumerate(hello["axes"]):
        values = (
            sample.position_rad[a],
            sample.velocity_rad_s[a],
            sample.hand_torque_nm[a],
            sample.feedforward_torque_nm[a],
            sample.torque_applied_nm[a],
        )
        lines.append(f"{axis['name']:<12}" + "".join(f"{value:>12.4f}" for value in values))
    lines += [
        "",
        *_latency(health),
        *([f"EVENT LOG BROKEN: {_broken(health, 'log')}"] if _broken(health, "log") else []),
        *([f"RECORDING BROKEN: {_broken(health, 'recording')}"] if _broken(health, "recording") else []),
        *[f"WARNING: {warning['text']}" for warning in _warnings(health)],
        f"missed {sample.missed_ticks}   lost here {lost}   age {sample.age_s * 1e3:.1f} ms",
    ]
    return lines


def _broken(health: dict[str, Any] | None, what: str) -> str:
    """Why the daemon could not write its event log (`log`) or its recording; empty while it can."""
    return ((health or {}).get(what) or {}).get("broken") or ""


def _warnings(health: dict[str, Any] | None) -> list[dict[str, str]]:
    """Warnings the daemon gives: nothing that stops the rig."""
    found: list[dict[str, str]] = (health or {}).get("warnings", [])
    return found


def _latency(health: dict[str, Any] | None) -> list[str]:
    if health is None or health["wakeup_us"] is None:
        return ["latency: once a second, wait ..."]
    names = list(health["wakeup_us"])
    lines = [f"{'us':<12}" + "".join(f"{name:>12}" for name in names)]
    lines += [
        f"{phase:<12}" + "".join(f"{health[f'{phase}_us'][n]:>12.1f}" for n in names)
        for phase in ("wakeup", "cycle")
    ]
    return [
        *lines,
        f"rate {health['measured_rate_hz']:.1f} Hz"
        + ("   WAIVER: no real-time rights" if health["waiver"] else ""),
    ]


def line(sample: RigState, health: dict[str, Any] | None, lost: int) -> str:
    """One plain line, for a log or a pipe."""
    faults = ",".join(str(fault.name) for fault in sample.faults) or "-"
    latency = "-"
    if health is not None and health["wakeup_us"] is not None:
        latency = f"{health['wakeup_us']['p50']:.1f}/{health['wakeup_us']['p99']:.1f}"
    return (
        f"{sample.timestamp:.3f} {sample.state.name} faults={faults} "
        f"position_rad={_vector(sample.position_rad)} velocity_rad_s={_vector(sample.velocity_rad_s)} "
        f"hand_torque_nm={_vector(sample.hand_torque_nm)} "
        f"feedforward_torque_nm={_vector(sample.feedforward_torque_nm)} wakeup_us_p50/p99={latency} "
        f"missed={sample.missed_ticks} lost={lost}"
        + "".join(f" {what}=BROKEN" for what in ("log", "recording") if _broken(health, what))
        + "".join(f" warning={warning['name']}:{warning['axis']}" for warning in _warnings(health))
    )


def _vector(values: tuple[float, ...]) -> str:
    return ",".join(f"{value:.4f}" for value in values)
