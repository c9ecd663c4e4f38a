"""`rtctl identify`: measure the friction of a rig by moving it."""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hw.motion import named, words
from rtctl.cli.identify_report import summary_of, tell, true_deviations
from rtctl.cli.json_text import end_with
from rtctl.cli.number import Number
from rtctl.cli.outputs import OutputFolder, errors_in_units_of, in_units_of
from rtctl.cli.progress import Bar

if TYPE_CHECKING:
    from rtctl.identify.dataset import Dataset
    from rtctl.identify.settings import Rig, Settings
    from rtctl.rig_file.config import LoadedConfig

LOG_MODULE = "rtctl.cli.identify_log"
"""Module whose `command` takes over when `--log` is given."""

WARNING = (
    "The rig of {rig} will move by itself: about {minutes:.0f} minutes, up to {speed}, over its whole "
    "travel.\nTake every hand and tool off it. Ctrl-C stops it at any moment and keeps what was measured."
)


def _options(  # longer than 50 lines: the table of options, an option a row
    command: Callable[..., None],
) -> Callable[..., None]:
    """Options that fill `Settings`; their names are its fields. Of a linear axis what is said in rad and N m
    is in m and N."""
    positive = Number(min=0, max=1e6, min_open=True)
    none_or_more = Number(min=0, max=1e6)
    levels = click.IntRange(2, 500)
    table: tuple[tuple[str, str, Any, Any, str], ...] = (
        ("--axis", "axis", click.IntRange(0, 7), 0, "number of the axis"),
        (
            "--speed-min",
            "speed_min_rad_s",
            positive,
            None,
            "lowest speed, rad/s; default 1/400 of the highest: 0.005 of 2",
        ),
        (
            "--speed-max",
            "speed_max_rad_s",
            positive,
            None,
            "highest speed, rad/s; default 2, within 80 % of the velocity limit, of a linear axis what "
            "crosses its travel in 2 s",
        ),
        # 54, 28 and 100 are the papers' (docs/references.md)
        ("--train", "train_levels", levels, 54, "speeds to train on, per direction"),
        ("--test", "test_levels", click.IntRange(0, 500), 28, "other speeds to test on, per direction"),
        ("--measurements", "measurements", click.IntRange(2, 10_000), 100, "measurements behind each point"),
        ("--spots", "spots", click.IntRange(1, 1000), 20, "places over which those of a point are spread"),
        ("--window", "window_s", Number(0.02, 10), 0.1, "seconds one measurement averages"),
        ("--warm-up", "warm_up_s", none_or_more, 30.0, "seconds of motion before the first point"),
        ("--bias", "bias_s", Number(0.5, 600), 5.0, "seconds at rest for the sensors' bias"),
        (
            "--ramp",
            "ramp_nm_s",
            positive,
            None,
            "steepest break-away ramp, N m/s; default a 40th of the torque limit in a second; slower where "
            "friction is small",
        ),
        (
            "--hand-limit",
            "hand_limit_nm",
            none_or_more,
            0.0,
            "hand torque that pauses, N m; 0: 2 % of the limit",
        ),
        (
            "--margin",
            "margin_rad",
            positive,
            None,
            "kept free at both ends of the travel, rad; default 0.05, of a linear axis what --speed-max "
            "passes in 25 ms",
        ),
        (
            "--lower",
            "lower_levels",
            click.IntRange(0, 8),
            4,
            "most halvings of --speed-min, after a peak below it",
        ),
        (
            "--ripple-per-turn",
            "ripple_per_turn",
            Number(0, 1e5),
            0.0,
            "periods of the gear's ripple per turn of the joint or screw (without a lead per m); 0: the "
            "gear ratio",
        ),
        (
            "--sweep",
            "sweep_rad_s",
            Number(0, 100),
            0.0,
            "speed of a slow turn each way at the end, rad/s, for cogging (rtctl fit --sweep); 0: none",
        ),
        ("--seed", "seed", click.IntRange(0, 2**31 - 1), 1, "of the order of the speeds and the places"),
    )
    for flag, name, kind, default, text in reversed(table):
        command = click.option(flag, name, type=kind, default=default, help=text)(command)
    return command


class _Identify(click.Command):
    """With `--log` the command line is that of identification from recordings, in its own module."""

    # which options there are depends on --log, and click parses all of them before a command could look
    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: object
    ) -> click.Context:
        if any(arg == "--log" or arg.startswith("--log=") for arg in args):
            other: click.Command = importlib.import_module(LOG_MODULE).command
            return other.make_context(info_name, args, parent, **extra)
        return super().make_context(info_name, args, parent, **extra)


@click.command("identify", cls=_Identify)
@click.argument("config", type=click.Path(path_type=Path))
@click.option("--out", type=OutputFolder(), required=True, help="folder of the data set")
@click.option("--simulate", is_flag=True, help="the simulated rig in this process, as fast as it goes")
@click.option("--resume", is_flag=True, help="continue the data set in --out")
@click.option("--yes", is_flag=True, help="do not ask whether the rig is free to move")
@click.option("--runtime-dir", type=click.Path(), help="folder of sockets and lock, instead of the default")
@click.option("--json", "as_json", is_flag=True, help="end with one JSON object on stdout")
@_options
def command(
    config: Path,
    *,
    out: Path,
    simulate: bool,
    resume: bool,
    yes: bool,
    runtime_dir: str | None,
    as_json: bool,
    **options: Any,  # noqa: ANN401 - passed on
) -> None:
    """Measure the friction of the rig of CONFIG by moving it: break-away and constant speeds, both
    directions.

    Nobody may touch the rig meanwhile. The data set holds points_train.csv and points_test.csv for
    `rtctl fit`, and the ticks behind every point. Exit code 130: stopped by Ctrl-C, continue with --resume.

    Recordings instead of a rig: rtctl identify --log FILE --column ROLE=NAME... (options: rtctl identify
    --log x --help)."""
    from rtctl.identify.dataset import Dataset
    from rtctl.identify.settings import rig_of, settings_of, without_feedforward
    from rtctl.rig_file.config import load

    # friction is to be measured, not what compensation leaves of it
    loaded = without_feedforward(load(config))
    settings = settings_of(loaded, options)
    rig = rig_of(loaded, settings)
    if rig.calmer > 1:
        click.echo(
            f"an elastic or late joint: its speed servo is {rig.calmer:.3g} times as slow as on one that is "
            "neither, or it would ring; speeds that do not become steady with it are left out",
            err=True,
        )
    if not simulate and not loaded.config.simulated and not yes:
        _ask(loaded, settings, rig.motion)
    make = Dataset.resume if resume else Dataset.create
    dataset = make(out, loaded, settings, simulated=loaded.config.simulated)
    began = time.monotonic()
    progress = Bar(quiet=as_json, motion=rig.motion, between_s=2.0)
    run = _simulated if simulate else _real
    try:
        with errors_in_units_of(rig.motion):
            complete = run(loaded, rig, settings, dataset, progress, runtime_dir)
    except KeyboardInterrupt:
        complete = False
    finally:
        progress.end()
    # of a real joint nobody knows the truth
    truth = true_deviations(loaded, rig.axis, dataset) if loaded.config.simulated else ()
    summary = summary_of(dataset, time.monotonic() - began, truth)
    if as_json:
        end_with(named(summary, rig.motion), 0 if complete else 130)
    with in_units_of(rig.motion):
        tell(dataset, summary, truth, complete=complete)
    if not complete:
        click.echo("rtctl: stopped; the points measured are kept, continue with --resume", err=True)
        sys.exit(130)


def _ask(loaded: LoadedConfig, settings: Settings, motion: str) -> None:
    speeds = 2 * (settings.train_levels + settings.test_levels)
    minutes = (speeds * (18 + 0.2 * settings.measurements) + 2 * 5 * settings.measurements) / 60
    speed = words(f"{settings.speed_max_rad_s:g} rad/s", motion)
    click.echo(WARNING.format(rig=loaded.config.rig.name, minutes=minutes, speed=speed), err=True)
    click.confirm("Is the rig free to move, and nobody touching it?", abort=True, err=True)


def _simulated(
    loaded: LoadedConfig, rig: Rig, settings: Settings, dataset: Dataset, progress: Bar, _folder: str | None
) -> bool:
    from rtctl.errors import HandOnRigError
    from rtctl.experiments.simulated_identification import drive
    from rtctl.identify.session import identify
    from rtctl.simulation.closed_loop import Simulation

    simulation = Simulation(loaded)
    steps = identify(rig, settings, dataset, progress.of, progress.notice)
    try:
        drive(simulation, steps, rig.axis, dataset.ticks)
    except HandOnRigError as why:
        key = f'{loaded.path}: kind = "none" in [[device.options.hand]]'
        raise HandOnRigError(f"{why}. The hand is simulated, too; {key} takes it off") from why
    return True


def _real(
    loaded: LoadedConfig,
    rig: Rig,
    settings: Settings,
    dataset: Dataset,
    progress: Bar,
    runtime_dir: str | None,
) -> bool:
    from rtctl.host.supervisor import Host
    from rtctl.identify.observer import Identifier
    from rtctl.identify.session import identify

    steps = identify(rig, settings, dataset, progress.of, progress.notice)
    identifier = Identifier(steps, rig.axis, dataset.ticks)
    with Host(loaded, observers=[identifier], runtime_dir=runtime_dir, announce=progress.notice) as host:
        host.run()
    return identifier.complete
