"""`rtctl monitor`: the live state of a running rig in the terminal."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rtctl.cli.json_text import json_text
from rtctl.cli.monitor_text import NO_DATA_S
from rtctl.cli.number import Number
from rtctl.cli.rig_argument import connect, reach_options

if TYPE_CHECKING:
    from rtctl.cli.monitor_text import Shown
    from rtctl.client import RigClient, RigState

# drawn anew five times a second on a terminal; elsewhere a line a second, and silence is told within LOOK_S
REFRESH_S = 0.2
LINE_S = 1.0
LOOK_S = 0.1

_HOME_AND_CLEAR = "\x1b[H\x1b[J"


@click.command("monitor")
@reach_options
@click.option("--rig", "named", hidden=True, help="the same as RIG; of versions before")
@click.option("--json", "as_json", is_flag=True, help="one JSON object per state sample")
@click.option("--for", "seconds", type=Number(min=0, min_open=True), help="end after this many seconds")
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
    """Show state, faults with their causes, torques, latency and losses of a running rig. Ctrl-C ends it; the
    rig runs on.

    What is shown ages: when no sample comes for half a second it says NO DATA, and goes on when the daemon is
    back. Exit code 12 when there is no data at the end of --for."""
    from rtctl.errors import NoReplyError

    try:
        with connect(rig or named, runtime_dir, address, key) as client:
            end = math.inf if seconds is None else time.monotonic() + seconds
            with Watch(client) as watch:
                # both until the end that was asked for, whatever comes or does not
                (_json if as_json else _show)(watch, end)
                # before the streams close: silence is of what was heard, not of the end
                silent_s = watch.silent_s
            if silent_s >= NO_DATA_S:
                raise NoReplyError(
                    f"no data for {silent_s:.1f} s: the daemon has ended, or cannot be reached"
                )
    except KeyboardInterrupt:
        click.echo("", err=True)


class Watch:
    """What is known of the rig of a connected client now. Telemetry may cease and come back, from another run
    of the daemon too."""

    def __init__(self, client: RigClient) -> None:
        from rtctl.wire.fault_names import FaultPlaces

        self._client = client
        self.hello = client.hello()
        self._places = FaultPlaces()
        self._states, self._healths, self._events = client.states(), client.health(), client.events()
        self._came = time.monotonic()
        self.health: dict[str, Any] | None = None
        self.sample: RigState | None = None

    def __enter__(self) -> Watch:
        return self

    def __exit__(self, *_exception: object) -> None:
        for stream in (self._states, self._healths, self._events):
            stream.close()

    def receive(self, timeout_s: float) -> RigState | None:
        """The next sample; None when none comes within `timeout_s`."""
        # the one that is waited for; events and health are taken as they are there
        sample = self._states.receive(timeout_s)
        while (event := self._events.receive(0)) is not None:
            self._places.take_event(event)
        # one a second: more cannot wait here
        if (health := self._healths.receive(0)) is not None:
            self.health = health
            self._places.take_health(health)
        if sample is None:
            return None
        self._came = time.monotonic()
        # another run of the daemon, maybe of an edited rig file: names and axes are asked anew
        if self.sample is not None and sample.session != self.sample.session:
            self._greet_again()
        self.sample = sample
        return sample

    def _greet_again(self) -> None:
        """The daemon was restarted, maybe with another rig file."""
        from rtctl.errors import ClientError

        self.health = None
        with contextlib.suppress(ClientError):  # it dies again: the old names stay until it is back
            self.hello = self._client.hello()

    @property
    def silent_s(self) -> float:
        """For how long nothing new has been known of the rig, s: no sample came, or only old ones."""
        silent_s = time.monotonic() - self._came
        if self.sample is not None:
            age_s = self.sample.as_of(time.monotonic()).age_s
            # samples may come and be old; NaN: on a virtual clock none has an age
            silent_s = max(silent_s, age_s) if math.isfinite(age_s) else silent_s
        return silent_s

    def shown(self) -> Shown | None:
        """What to draw now; None before the first sample."""
        from rtctl.cli.monitor_text import Shown

        if self.sample is None:
            return None
        sample = self.sample
        # each is one bit: their sum is all of them
        bits = sum(sample.faults)
        return Shown(
            sample.as_of(time.monotonic()),
            self.silent_s,
            self._states.lost,
            self.health,
            self._places.entries(bits),
            self._places.cause(int(sample.state), int(sample.fields["fault_first"])),
        )


def _json(watch: Watch, end: float) -> None:
    """Every sample; while there is none, once a second an object that says so."""
    told = 0.0
    while (left_s := end - time.monotonic()) > 0:
        sample = watch.receive(min(REFRESH_S, left_s))
        if sample is not None:
            click.echo(json_text(_plain(sample)))
        elif watch.silent_s >= NO_DATA_S and time.monotonic() - told >= LINE_S:
            told = time.monotonic()
            click.echo(json_text({"state": None, "no_data_s": round(watch.silent_s, 3)}))


def _plain(sample: RigState) -> dict[str, Any]:
    """A sample with names for numbers."""
    # names in place of bits, as programs in other languages want them
    faults = [fault.name for fault in sample.faults]
    return {**sample.fields, "age_s": sample.age_s, "state": sample.state.name, "faults": faults}


def _show(watch: Watch, end: float) -> None:
    """Refresh a table in place on a terminal; elsewhere write a line now and then, and at once when data
    cease."""
    from rtctl.cli.monitor_text import line, table

    # a pipe gets lines, which stay; only a terminal can be drawn anew
    tty = sys.stdout.isatty()
    due, was_silent = 0.0, False
    while (left_s := end - time.monotonic()) > 0:
        watch.receive(min(LOOK_S, left_s))
        shown = watch.shown()
        if shown is None:
            # before the first sample there is nothing that could be drawn
            if watch.silent_s >= NO_DATA_S and time.monotonic() >= due:
                due = time.monotonic() + LINE_S
                click.echo(f"NO DATA for {watch.silent_s:.1f} s; waiting for the daemon")
            continue
        silent = bool(shown.no_data)
        # that data ceased or are back is told at once
        if time.monotonic() < due and silent == was_silent:
            continue
        due, was_silent = time.monotonic() + (REFRESH_S if tty else LINE_S), silent
        if tty:
            click.echo(_HOME_AND_CLEAR + "\n".join(table(watch.hello, shown)))
        else:
            click.echo(line(watch.hello, shown))
