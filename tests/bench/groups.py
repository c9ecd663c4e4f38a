"""What measures each group of `rtctl bench`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import click

from rtctl.simulation.shipped_files import shipped_config
from tests.bench.row import Row


class Wakeups(NamedTuple):
    """What is asked of `wakeup`: the options of its own."""

    loads: tuple[str, ...] = ()
    apart: bool = False
    cpu: int = -1
    picture: Path | None = None


def _wakeup(*, quick: bool, minutes: float | None, asked: Wakeups) -> Iterator[Row]:
    from tests.bench import wakeup

    seconds = 2.0 if quick else 5.0
    conditions = wakeup.Conditions(asked.loads, asked.apart, asked.cpu)
    rounds = wakeup.rounds_in(minutes, seconds, conditions) if minutes else (1 if quick else 4)
    return wakeup.rows(shipped_config("mock.toml"), rounds, seconds, conditions, asked.picture)


def measurements(
    *, quick: bool, minutes: float | None, rig_seconds: float, asked: Wakeups
) -> dict[str, Callable[[], Iterable[Row]]]:
    """What measures each group; nothing is measured yet."""
    wakeups = {"wakeup": lambda: _wakeup(quick=quick, minutes=minutes, asked=asked)}
    return _without_clock(quick, minutes) | _with_clock(quick, minutes, rig_seconds) | wakeups


def _without_clock(quick: bool, minutes: float | None) -> dict[str, Callable[[], Iterable[Row]]]:
    """Groups that compute and simulate."""
    from tests.bench import drift, feel, ladder, safety, virtual
    from tests.bench import friction_evaluation as friction
    from tests.bench import friction_in_law as in_law

    mock = shipped_config("mock.toml")
    short = 0.2 if quick else 1.0
    return {
        "friction": lambda: [
            *in_law.rows(mock.parent / "friction" / "mock-places.json"),
            *friction.rows(mock.parent / "friction" / "mock.json"),
        ],
        "safety": lambda: safety.rows(mock, 60 * short),
        "feel": lambda: feel.rows(mock, 20 * short),
        "virtual": lambda: virtual.rows(mock, shipped_config("mock-triangle.toml"), 20 * short),
        "ladder": lambda: ladder.rows(mock, quick=quick),
        "drift": lambda: drift.rows(mock, minutes or 600.0, lambda text: click.echo(text, err=True)),
    }


def _with_clock(
    quick: bool, minutes: float | None, rig_seconds: float
) -> dict[str, Callable[[], Iterable[Row]]]:
    """Groups that run daemons, devices and loads of this machine."""
    from tests.bench import (
        attacks,
        blame,
        deaths,
        flood,
        io,
        loop,
        recording,
        scheduler,
        soak,
        streams,
        view,
    )

    mock = shipped_config("mock.toml")
    short = 0.2 if quick else 1.0
    return {
        "start": lambda: loop.start_rows(mock, 1 if quick else 5),
        "cycle": lambda: loop.cycle_rows(mock, 1 if quick else 4, 10 * short),
        "flood": lambda: flood.rows(mock, 10 * short, 1 if quick else 2),
        "attacks": lambda: attacks.rows(mock, 1 if quick else 5),
        "soak": lambda: soak.rows(mock, minutes or 60.0, lambda text: click.echo(text, err=True)),
        "blame": lambda: blame.rows(mock, 6 if quick else 40),
        "io": lambda: io.rows(short, rig_seconds),
        "view": lambda: view.rows(mock, 30 * short, 3 if quick else 10),
        "deaths": lambda: deaths.rows(
            shipped_config("serial.toml"), mock, 5 if quick else 100, lambda text: click.echo(text, err=True)
        ),
        "scheduler": lambda: chain.from_iterable(
            scheduler.rows(rate_hz, 10 * short, 80, 3) for rate_hz in (1000.0, 4000.0)
        ),
        "recording": lambda: recording.rows(
            shipped_config("mock-10khz.toml"), 2 if quick else 6, 60 * short / 2
        ),
        "streams": lambda: streams.rows(
            shipped_config("mock-10khz.toml"), 20 * short, 3 * max(1, round(minutes or 1))
        ),
    }
