"""`rtctl bench`: what this machine and this code do, each figure beside its reference."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rtctl.cli.json_text import json_text
from rtctl.cli.number import Number
from rtctl.cli.outputs import OutputFile

if TYPE_CHECKING:
    from tests.bench.row import Row

BENCHMARKS = Path(__file__).parents[2] / "tests" / "bench"
"""Benchmarks stand in a checkout, beside the tests: they need simulated attackers and other people's
programs, a service does not."""

GROUPS = (
    "friction",
    "safety",
    "feel",
    "virtual",
    "start",
    "cycle",
    "wakeup",
    "streams",
    "flood",
    "attacks",
    "io",
    "recording",
    "view",
)
# hours, root, or other people's searches: none of the ten minutes of the whole
ON_REQUEST = ("soak", "deaths", "scheduler", "drift", "blame", "ladder")
LOADS = ("cpu", "disk", "network", "memory")


@click.command("bench")
@click.argument("groups", nargs=-1, type=click.Choice(GROUPS + ON_REQUEST))
@click.option("--quick", is_flag=True, help="shorter runs: a look, not a measurement")
@click.option(
    "--minutes",
    type=Number(0.3, 1440),
    help="length of a soak (60), of wakeup (about 2), of streams (1, and as much of cyclictest), or "
    "simulated of drift (600)",
)
@click.option(
    "--load",
    "loads",
    multiple=True,
    type=click.Choice(LOADS),
    help="wakeup: measure under this load too; repeatable",
)
@click.option(
    "--apart",
    is_flag=True,
    help="wakeup: each load also with the core of the loop left alone, as isolation would",
)
@click.option(
    "--cpu",
    type=click.IntRange(min=-1),
    default=-1,
    show_default=False,
    help="wakeup: core of the loop and of cyclictest, an isolated one too; -1: as the daemon chooses",
)
@click.option(
    "--picture", type=OutputFile(picture=True), help="wakeup: histograms beside cyclictest's, as PNG or SVG"
)
@click.option(
    "--rig-seconds",
    type=Number(0.5, 3600.0),
    default=10.0,
    help="how long io watches a composed rig at 1 kHz",
)
@click.option("--json", "as_json", is_flag=True, help="one JSON object, its rows as they are measured")
def command(
    groups: tuple[str, ...],
    *,
    quick: bool,
    minutes: float | None,
    loads: tuple[str, ...],
    apart: bool,
    cpu: int,
    picture: Path | None,
    rig_seconds: float,
    as_json: bool,
) -> None:
    """Measure side by side: friction evaluation, safety machine, feel of a 60 Hz program, virtual time,
    start, cycle, wake-up, telemetry streams, floods, STOP under attack, device I/O, recording, live view;
    and, only when asked for, soak: hours of subscribers that come and go, and of floods; deaths: a hundred
    killed loops, and how soon a simulated board was without torque; scheduler: SCHED_DEADLINE beside
    SCHED_FIFO; drift: false alarms of the watch over the friction in ten simulated hours; blame: ticks made
    late on purpose, and whether their cause is named; ladder: both searches of the ladder of models beside
    plain GridSearchCV (quick: on a tenth of its grids).

    Only in a checkout: benchmarks are not installed with the package.

    Give GROUPS to run only some. The whole takes about ten minutes and wants an otherwise idle machine;
    wakeup and streams need cyclictest (Debian rt-tests), friction the extra rtctl[bench].
    Exit code 0 whatever the figures are; `ok` in each row says whether its target was met. Rows come as they
    are measured; Ctrl-C ends the bench after those of the rounds that are over (exit code 130)."""
    from rtctl.errors import ConfigError, RtctlError

    if not BENCHMARKS.is_dir():
        raise ConfigError(
            f"rtctl bench: {BENCHMARKS} is not there: the benchmarks are in a checkout of rtctl, not in an "
            "installed package; run `make bench`, or `.venv/bin/rtctl bench` after `make setup-bench`, in "
            "the checkout"
        )

    # after the check above: an installed package has no `tests`
    from tests.bench.groups import Wakeups, measurements

    report = _Json() if as_json else _Text()
    measured = measurements(
        quick=quick, minutes=minutes, rig_seconds=rig_seconds, asked=Wakeups(loads, apart, cpu, picture)
    )
    try:
        for name in groups or GROUPS:
            click.echo(f"measuring {name} ...", err=True)
            try:
                report.rows(measured[name]())
            # a machine without cyclictest, or an extra that is not installed, costs its group alone
            except (RtctlError, ModuleNotFoundError) as error:
                report.skipped[name] = str(error)
    # Ctrl-C, too: the JSON object is closed, and what was measured so far can be read
    finally:
        report.end()


class _Text:
    """A table for each group, each row as soon as it is measured: what comes later cannot lose it."""

    def __init__(self) -> None:
        self.skipped: dict[str, str] = {}

    def rows(self, measured: Iterable[Row]) -> None:
        from tests.bench.row import table

        for line in table(measured):
            click.echo(line)

    def end(self) -> None:
        for name, why in self.skipped.items():
            click.echo(f"not measured: {name}: {why}", err=True)


class _Json(_Text):
    """One JSON object, its rows written as they come, and closed whatever happens."""

    def __init__(self) -> None:
        super().__init__()
        self._before = '{"rows": ['

    def rows(self, measured: Iterable[Row]) -> None:
        for row in measured:
            click.echo(self._before + json_text(row), nl=False)
            self._before = ",\n"

    def end(self) -> None:
        click.echo(
            # without a row the object was not even opened
            ("" if self._before == ",\n" else self._before) + f'], "skipped": {json_text(self.skipped)}}}'
        )
