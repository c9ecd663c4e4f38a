"""`rtctl doctor --watch`: late ticks of a running rig and their causes, as they come."""

from __future__ import annotations

import time
from collections import Counter
from typing import TYPE_CHECKING, Any

import click

from rtctl.cli.json_text import json_text
from rtctl.errors import NoReplyError

if TYPE_CHECKING:
    from rtctl.client import RigClient

SILENT_S = 3.0
"""Health comes once a second: after so long without one the daemon has ended, or stands."""


def watch(client: RigClient, seconds: float | None, *, as_json: bool) -> None:
    """Show what `late` of each health says that is new, until `seconds` have passed or Ctrl-C; then the sums,
    of all runs of the daemon meanwhile.

    Raises NoReplyError where none came, or the rig has no late ticks to tell of."""
    began = time.monotonic()
    end = began + (float("inf") if seconds is None else seconds)
    before: dict[str, Any] = {}
    count, causes = 0, Counter[str]()
    heard, came = began, False
    try:
        with client.health() as healths:
            while (now := time.monotonic()) < end:
                health = healths.receive(min(0.2, max(end - now, 0.0)))
                if health is None:
                    if now - heard > SILENT_S:
                        click.echo("no data: the daemon has ended, or cannot be reached", err=True)
                        # said once in that time, not at every look
                        heard = now
                    continue
                heard, came, late = now, True, health.get("late")
                if late is None:
                    continue
                if not before:
                    _greet(late, as_json=as_json)
                    before = late
                elif late["ticks"] < before["ticks"]:  # another run of the daemon: all of its ticks are new
                    _greet(late, as_json=as_json)
                    before = {"ticks": 0, "causes": {}}
                if late["ticks"] > before["ticks"]:
                    click.echo(json_text(late) if as_json else _line(now - began, before, late))
                    count += late["ticks"] - before["ticks"]
                    causes.update(_risen(before, late))
                before = late
    except KeyboardInterrupt:
        click.echo("", err=True)
    if not before:
        raise NoReplyError(
            "the rig tells nothing of late ticks: it runs on a virtual clock"
            if came
            else f"no health came in {time.monotonic() - began:.1f} s, and a daemon tells it once a second: "
            "none runs this rig, or it cannot be reached"
        )
    _sums(count, causes, as_json=as_json)


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


def _sums(count: int, causes: Counter[str], *, as_json: bool) -> None:
    most_first = dict(causes.most_common())
    if as_json:
        click.echo(json_text({"ticks": count, "causes": most_first}))
    else:
        click.echo(f"{count} late ticks" + "".join(f"\n  {n:>6}  {cause}" for cause, n in most_first.items()))
