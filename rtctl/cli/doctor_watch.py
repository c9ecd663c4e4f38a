"""`rtctl doctor --watch`: late ticks of a running rig and their causes, as they come."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import click

from rtctl.cli.json_text import json_text

if TYPE_CHECKING:
    from rtctl.client import RigClient

SILENT_S = 3.0
"""Health comes once a second: after so long without one the daemon has ended, or stands."""


def watch(client: RigClient, seconds: float | None, *, as_json: bool) -> int:
    """Show what `late` of each health says that is new, until `seconds` have passed or Ctrl-C; then the sums.

    Returns
    -------
    int
        Late ticks seen."""
    began = time.monotonic()
    end = began + (float("inf") if seconds is None else seconds)
    first: dict[str, Any] | None = None
    before: dict[str, Any] = {}
    heard = began
    try:
        with client.health() as healths:
            while (now := time.monotonic()) < end:
                health = healths.receive(min(0.2, max(end - now, 0.0)))
                if health is None:
                    if now - heard > SILENT_S:
                        click.echo("no data: the daemon has ended, or cannot be reached", err=True)
                        heard = now
                    continue
                heard, late = now, health.get("late")
                if late is None:
                    continue
                if first is None or late["ticks"] < before["ticks"]:  # another run of the daemon
                    first = before = late
                    _greet(late, as_json=as_json)
                if late["ticks"] > before["ticks"]:
                    click.echo(json_text(late) if as_json else _line(now - began, before, late))
                before = late
    except KeyboardInterrupt:
        click.echo("", err=True)
    return _sums(first, before, as_json=as_json)


def _greet(late: dict[str, Any], *, as_json: bool) -> None:
    if not as_json:
        click.echo(
            f"a tick is late above {late['above_us']:g} us; {late['ticks']} were so far. Ctrl-C ends this"
        )


def _line(at_s: float, before: dict[str, Any], late: dict[str, Any]) -> str:
    """What is new in words, by cause, with the worst that was told last; `at_s` since this looks on."""
    risen = _risen(before, late)
    causes = ", ".join(f"{cause} {count}" for cause, count in risen.items())
    newest = late["newest"] or {}
    named = f" ({newest['name']})" if newest.get("name") else ""
    worst = (
        f"; worst told {newest['worst_us']:.0f} us, tick {newest['worst_tick']}: {newest['cause']}{named}"
        if newest
        else ""
    )
    return f"{at_s:8.1f} s  {late['ticks'] - before['ticks']:>6} late: {causes}{worst}"


def _risen(before: dict[str, Any], late: dict[str, Any]) -> dict[str, int]:
    risen = {cause: count - before["causes"].get(cause, 0) for cause, count in late["causes"].items()}
    return dict(sorted(((c, n) for c, n in risen.items() if n), key=lambda one: -one[1]))


def _sums(first: dict[str, Any] | None, last: dict[str, Any], *, as_json: bool) -> int:
    if first is None:
        click.echo("no health came: the rig tells nothing of late ticks", err=True)
        return 0
    count, causes = int(last["ticks"] - first["ticks"]), _risen(first, last)
    if as_json:
        click.echo(json_text({"ticks": count, "causes": causes}))
    else:
        click.echo(f"{count} late ticks" + "".join(f"\n  {n:>6}  {cause}" for cause, n in causes.items()))
    return count
