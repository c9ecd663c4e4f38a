"""`rtctl experiment`: the experiments of both papers, with and without compensation, as a report."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rtctl.cli.json_text import json_text
from rtctl.cli.number import Number
from rtctl.cli.outputs import OutputFolder, errors_in_units_of
from rtctl.cli.progress import Bar
from rtctl.simulation.family import FAMILY

if TYPE_CHECKING:
    from rtctl.experiments.report import Outcome
    from rtctl.rig_file.config import LoadedConfig

NAMES = (
    "free-motion",
    "spring",
    "friction-model",
    "identification",
    "point-to-point",
    "tracking",
    "stability-map",
    "admittance",
    "policies",
    "papers",
)


@click.command("experiment")
@click.argument("name", type=click.Choice(NAMES))
@click.argument("config", type=click.Path(path_type=Path))
@click.option("--out", type=OutputFolder(), required=True, help="folder of the report")
@click.option("--simulate", is_flag=True, help="the simulated rig in this process, as fast as it goes")
@click.option("--seeds", type=click.IntRange(1, 1000), default=10, help="runs of everything, simulated")
@click.option(
    "--points",
    type=click.Path(dir_okay=False, path_type=Path),
    help="measured friction points (CSV) to learn the models from; default those beside the rig's model",
)
@click.option(
    "--model",
    "models",
    multiple=True,
    help="compare only this friction model with none (point-to-point, tracking; may be repeated); default: "
    "all",
)
@click.option(
    "--case",
    "cases",
    multiple=True,
    help="run only this step or reference, as 'step 100 mrad' or 'sine 0.5 Hz' (point-to-point, tracking; "
    "may be repeated); default: all",
)
@click.option(
    "--seconds",
    type=Number(1, 3600),
    default=12.0,
    help="of each measurement on the loop: whole periods of the hand's motion",
)
@click.option(
    "--resume",
    is_flag=True,
    help="go on with the runs an earlier start kept in --out (point-to-point, tracking on a rig)",
)
@click.option(
    "--plant",
    type=click.Choice(sorted(FAMILY)),
    help="this joint of the mock's family instead of the rig file's (docs/plants.md); simulated",
)
@click.option("--yes", is_flag=True, help="do not ask whether a hand is ready at the real rig")
@click.option("--runtime-dir", type=click.Path(), help="folder of sockets and lock, instead of the default")
@click.option("--json", "as_json", is_flag=True, help="one JSON object on stdout")
def command(
    name: str,
    config: Path,
    *,
    out: Path,
    simulate: bool,
    seeds: int,
    points: Path | None,
    models: tuple[str, ...],
    cases: tuple[str, ...],
    seconds: float,
    resume: bool,
    plant: str | None,
    yes: bool,
    runtime_dir: str | None,
    as_json: bool,
) -> None:
    """Run experiment NAME on the rig of CONFIG: the same task with and without friction compensation.

    With --simulate everything runs on the simulated rig, over several seeds, with confidence intervals.
    Without it, free-motion and spring run once through the real loop of the rig, mock or real, while a hand
    moves it; point-to-point and tracking move it by themselves, through the same loop, gate and guards, with
    nobody at the handle. 'papers' is every experiment on one page (simulated).

    --out gets report.html (needs nothing else), its figures as PNG and report.json."""
    from rtctl.experiments import registry, report
    from rtctl.experiments.order import Order
    from rtctl.rig_file.config import load
    from rtctl.simulation.family import with_plant

    # every experiment: options of some of them are for those alone
    papers = name == registry.PAPERS
    # else figures of all cases would be read as those of one
    if (models or cases) and not papers and not registry.EXPERIMENTS[name].hands_off:
        raise click.UsageError(f"--model and --case belong to point-to-point and tracking, not to {name}")
    loaded = load(config) if plant is None else with_plant(load(config), plant)
    # a page with both papers needs seeds, and a plant of the family is no rig that stands here
    simulate = simulate or papers or plant is not None
    if name in ("free-motion", "spring"):
        _require_help(loaded)  # before a person is asked to stand there
    if not simulate and not loaded.config.simulated and not yes:
        _ask(name, loaded, seconds)
    # all that is said on the way is written for a joint
    motion = loaded.config.axis[0].motion
    bar = Bar(quiet=as_json, motion=motion)
    order = Order(
        loaded, seeds, simulate, points, seconds, runtime_dir, bar, bar.notice, _known(models), cases, out,
        resume, plant or ""
    )  # fmt: skip
    # after whoever was asked has answered: a person's time is none of the experiment's
    began = time.monotonic()
    try:
        with errors_in_units_of(motion):
            outcomes = registry.papers(order) if papers else [registry.EXPERIMENTS[name].run(order)]
    finally:
        # so that an error begins on a line of its own
        bar.end()
    took_s = time.monotonic() - began
    # what a reader of the report needs to do it again
    facts = {
        "rig": loaded.config.rig.name,
        "rig file": f"{loaded.path.name}, sha256 {loaded.sha256}",
        **({} if plant is None else {"plant": f"{plant}: {FAMILY[plant].text}"}),
        "run": f"simulated, {seeds} seeds" if simulate else _on_loop(name, seconds),
        "took": f"{took_s:.0f} s",
    }
    title = "The experiments of both papers" if papers else outcomes[0].title
    # before anything is shown: what is told names the page
    page = report.write(out, outcomes, title, facts)
    _show(outcomes, page, took_s, as_json=as_json)


def _on_loop(name: str, seconds: float) -> str:
    from rtctl.experiments.registry import EXPERIMENTS

    return (
        "on the loop, each case once" if EXPERIMENTS[name].hands_off else f"on the loop, {seconds:g} s each"
    )


def _known(models: tuple[str, ...]) -> tuple[str, ...]:
    """The models asked for. Raises BadParameter for one that is not compared, or none to compare with."""
    if models:
        from rtctl.experiments.models import COMPARED, SVR

        for name in models:
            if name not in COMPARED:
                raise click.BadParameter(f"{name!r}: one of {', '.join(COMPARED)}", param_hint="--model")
        if not set(models) & set(SVR):
            said = f"the others are compared with the best of {', '.join(SVR)}: name one of these, too"
            raise click.BadParameter(said, param_hint="--model")
    return models


def _require_help(loaded: LoadedConfig) -> None:
    """Raise ConfigError where the rig file compensates nothing: both halves would be the same."""
    from rtctl.errors import ConfigError

    axis = loaded.config.axis[0]
    if axis.friction.policy == "off" or (not axis.friction.model and axis.friction.policy != "observer"):
        raise ConfigError(
            f"{loaded.path}: axis {axis.name} compensates no friction, so that there is nothing to compare: "
            "name a model of `rtctl fit` in [axis.friction] model, with a policy that is not off"
        )


def _ask(name: str, loaded: LoadedConfig, seconds: float) -> None:
    from rtctl.experiments.registry import EXPERIMENTS

    if EXPERIMENTS[name].hands_off:
        click.echo(
            f"Rig {loaded.config.rig.name} will arm and MOVE BY ITSELF for minutes, friction model after "
            "friction model. Nobody may touch the handle; torque on the force sensor stops it. Ctrl-C "
            "ramps down.",
            err=True,
        )
        click.confirm(
            "Is the rig free to move, nobody at it, and the emergency stop within reach?",
            abort=True,
            err=True,
        )
        return
    click.echo(
        f"Rig {loaded.config.rig.name} will arm and give torque. Somebody has to rest a hand on the handle "
        f"until it is armed, then move it in the same way for {2 * seconds + 5:.0f} s: first without, then "
        "with compensation.",
        err=True,
    )
    click.confirm("Is the hand ready, and the emergency stop within reach?", abort=True, err=True)


def _show(outcomes: list[Outcome], page: Path, took_s: float, *, as_json: bool) -> None:
    from rtctl.experiments.report import document_of

    if as_json:
        found = {one.name: document_of(one) for one in outcomes}
        click.echo(json_text({"report": str(page), "took_s": took_s, "experiments": found}))
        return
    for one in outcomes:
        click.echo(f"{one.title}: {one.key}\n")
        for target in one.targets:
            text, bound, measured, verdict = target.cells()
            click.echo(f"  {text}: {measured} ({bound}): {verdict}")
        if one.targets:
            click.echo("")
    click.echo(f"report: {page}  ({took_s:.0f} s)")
