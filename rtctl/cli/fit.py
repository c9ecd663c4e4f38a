"""`rtctl fit`: learn a friction model from measured points."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rtctl.cli import fit_checks, fit_learning, fit_places, fit_points, fit_told
from rtctl.cli.columns import text_of
from rtctl.cli.number import Number
from rtctl.cli.outputs import OutputFile, OutputFolder, errors_in_units_of, require_apart

if TYPE_CHECKING:
    from rtctl.friction.logs.other_programs import Average
    from rtctl.friction.model import FrictionModel
    from rtctl.friction.points import FrictionPoints

_File = click.Path(dir_okay=False, path_type=Path)
_POSITIVE = Number(min=0, min_open=True, max=1e9)


@click.command("fit")
@click.argument("points", type=_File, nargs=-1, required=True)
@fit_points.options
@fit_places.options
@click.option("--out", type=OutputFile(), help="model file to write (JSON); needed unless --judge")
@click.option("--judge", "judged", type=_File, help="judge this model by the points; nothing is learned")
@click.option(
    "--rig", default="mock", callback=fit_checks.rig_name, help="name of the rig the points were measured on"
)
@click.option("--C", "c", type=_POSITIVE, help="bound on the dual coefficients; default: by cross-validation")
@click.option(
    "--epsilon",
    "epsilon_nm",
    type=_POSITIVE,
    help="half width of the epsilon tube, N m; default 0.005, of friction below 0.25 a 50th of the largest",
)
@click.option(
    "--fade",
    "fade_rad_s",
    type=_POSITIVE,
    help="fade beyond the trained range, rad/s; default a tenth of it; a late drive has a longer one",
)
@click.option(
    "--ladder",
    "climb",
    is_flag=True,
    help="compare every formula, machine and kernel; same as --search halving",
)
@click.option(
    "--search",
    type=click.Choice(["none", "halving", "full"]),
    help="hyper-parameters: successive halving, or every combination of the papers' grids; default none",
)
@fit_checks.KERNEL
@click.option(
    "--symmetric",
    type=click.Choice(["auto", "yes", "no"]),
    default="auto",
    help="one curve for both directions: by evidence, always, or never (with --search)",
)
@click.option(
    "--tolerance",
    type=Number(0, 50),
    metavar="PERCENT",
    help="held-out errors below this much of the largest friction count as equal, so that the fewest "
    "numbers decide; 0: one standard error alone; default 0.5",
)
@click.option(
    "--max-support-vectors",
    type=click.IntRange(1, 2000),
    metavar="N",
    help="most support vectors of one curve; machines that need more are left out",
)
@click.option(
    "--no-mean", "one_rung", is_flag=True, help="write the chosen rung alone, never the mean of the rungs"
)
@click.option(
    "--folds",
    "held_out",
    type=click.Choice(["auto", "speed", "time", "log", "lap", "turn"]),
    default="auto",
    help="what cross-validation holds out together; auto: whole logs where there are several, time (or "
    "laps of a motion that repeats itself) for samples of one, else speed",
)
@click.option(
    "--keep-outliers", is_flag=True, help="use points that are far from their neighbours in speed, too"
)
@click.option(
    "--by-load",
    is_flag=True,
    help="the model carries what the torque through the gear adds (columns load_nm, motor_nm), and its "
    "curve is that without load",
)
@click.option(
    "--backend",
    type=click.Choice(["loky", "dask", "threading", "sequential"]),
    default="loky",
    help="what runs the search; dask uses a cluster (DASK_SCHEDULER_ADDRESS), or a local one",
)
@click.option("--jobs", type=click.IntRange(1, 4096), help="workers of the search; default all cores")
@click.option(
    "--temperature",
    type=(float, float),
    callback=fit_checks.temperatures,
    metavar="MIN MAX",
    help="range of temperature the points were measured in, degrees C; default the temperature_c column",
)
@click.option(
    "--presliding",
    "presliding_rad",
    type=Number(min=0, min_open=True, max=1),
    metavar="RAD",
    help="presliding length (break-away torque over initial slope), rad; default: what the points file says",
)
@click.option("--plot", type=OutputFile(picture=True), help="draw points and learned curve (PNG)")
@click.option(
    "--report",
    "report_dir",
    type=OutputFolder(),
    help="write report.html with figures and tables there; runs --search halving unless told otherwise",
)
@click.option(
    "--test",
    "test_points",
    type=_File,
    help="points to judge the fit by, in the report, with the columns of POINTS; its bound knows them, too",
)
@click.option("--config", type=_File, help="rig file, for plausible units and the recommended gain and cap")
@click.option("--json", "as_json", is_flag=True, help="one JSON object with every figure, for scripts")
def command(  # longer than 50 lines: the steps from points to report, in their order
    points: tuple[Path, ...],
    *,
    columns: tuple[str, ...],
    map_file: Path | None,
    average: Average,
    delimiter: str | None,
    decimal: str | None,
    lead_m: float | None,
    places: Path | None,
    sweep: Path | None,
    turn: float | None,
    ripple_turn: float | None,
    out: Path | None,
    judged: Path | None,
    rig: str,
    c: float | None,
    epsilon_nm: float | None,
    fade_rad_s: float | None,
    climb: bool,
    search: str | None,
    kernel: str,
    symmetric: str,
    tolerance: float | None,
    max_support_vectors: int | None,
    one_rung: bool,
    held_out: str,
    keep_outliers: bool,
    by_load: bool,
    backend: str,
    jobs: int | None,
    temperature: tuple[float, float] | None,
    presliding_rad: float | None,
    plot: Path | None,
    report_dir: Path | None,
    test_points: Path | None,
    config: Path | None,
    as_json: bool,
) -> None:
    """Learn the friction of a rig: one spline-kernel epsilon-SVR per direction, compiled exactly.

    With --ladder, every formula (Coulomb, Coulomb + viscous, Tustin, Gaussian, Lorentzian) and
    support-vector machine (epsilon, nu; each kernel of --kernel) is compared by cross-validation in
    blocks of speed or time. Written is the simplest within one standard error of the best, or, where errors
    are larger than --tolerance, the mean of the rungs by what each errs.

    POINTS is a CSV file with the columns velocity_rad_s and friction_torque_nm (both signed), and for
    break-away points at zero velocity optionally direction (+1 or -1). At least 8 points per direction.
    Files of other programs, several too: --column velocity=NAME:UNIT --column torque=NAME:UNIT:SCALE, and
    --average."""
    from rtctl.cli import fit_judge, fit_report
    from rtctl.friction import artefact
    from rtctl.friction.learn import grids, hold_out

    read = partial(
        fit_points.read,
        columns=columns,
        map_file=map_file,
        average=average,
        text=text_of(delimiter, decimal),
        lead_m=lead_m,
    )
    if judged is not None:
        fit_judge.require_alone(click.get_current_context())
        if sweep is not None:
            # standard output belongs to the JSON object
            fit_places.tell_shift(judged, sweep, err=as_json)
        fit_judge.run(judged, read(points, of_speeds=False), as_json=as_json)
        return
    # here, not by click: --judge writes nothing
    if out is None:
        raise click.UsageError("Missing option '--out'.")
    require_apart(out, (*points, map_file, places, sweep, test_points, config), plot)
    fixed = c is not None or epsilon_nm is not None
    # options that only a comparison has ask for one
    asked = climb or one_rung or kernel != "all" or tolerance is not None or max_support_vectors is not None
    strategy = _strategy(search, asked=asked, fixed=fixed, reported=report_dir is not None)
    plan = fit_report.prepare(report_dir, test_points, config, rig, read)
    measured = read(points)
    fit_report.require_plausible(plan, measured)
    fit_points.tell_doubts(measured, known=plan.loaded is not None, alone=strategy == "none")
    lead = turn or fit_places.turn_of(measured.motion, lead_m, plan.loaded)
    with errors_in_units_of(measured.motion):
        over = fit_places.read(places, sweep, measured.motion, lead)
    measured, plan, under = fit_learning.apart_from_load(measured, plan, held_out, by_load=by_load)
    measured = fit_points.without_outliers(measured, keep=keep_outliers)
    families = grids.families_of(kernel, measured.motion)
    if measured.motion == "linear":
        fit_checks.require_of_linear(families, kernel, strategy if search else None)
        # without a search tube and C are fixed in N m and rad/s (`fit_checks.require_of_linear`)
        strategy = "halving" if strategy == "none" else strategy
    folds = hold_out.way_for(measured, held_out)
    options: dict[str, Any] = {
        "search": strategy,
        "kernel": kernel,
        "symmetric": symmetric,
        "folds": held_out,
    }
    options |= {
        "tolerance_share": grids.RESOLUTION_SHARE if tolerance is None else tolerance / 100,
        "max_support_vectors": max_support_vectors,
        "mean": not one_rung,
        "C": c,
        "epsilon_nm": epsilon_nm,
    }
    # -1: all cores (joblib)
    searched = {"families": families, "backend": backend, "n_jobs": jobs or -1, "folds": folds}
    with errors_in_units_of(measured.motion):
        ladder, model = fit_learning.curves(measured, rig, fade_rad_s, options, searched)
        model, over_turn, turn_body = fit_places.learn(model, over, ripple_turn)
    model = fit_learning.with_what_is_known(model, measured, temperature, presliding_rad, plan.test)
    model = replace(model, load=under[1] if under else None)
    # before pictures and report: a figure that cannot be drawn must not cost the model
    artefact.save(model, out)
    beside = fit_learning.beside(model, measured, folds, under)
    _draw(plot, model, measured)
    page = fit_report.write(plan, measured, model, ladder, options, folds, beside)
    learned = fit_told.Learned(
        model, measured, ladder, folds, over_turn, turn_body, beside, plan.loaded, out, plot, page
    )
    fit_told.tell_json(learned) if as_json else fit_told.tell(learned)


def _draw(plot: Path | None, model: FrictionModel, measured: FrictionPoints) -> None:
    if plot is not None:
        from rtctl.friction.learn import report_figure

        report_figure.draw(model, measured, plot)


def _strategy(search: str | None, *, asked: bool, fixed: bool, reported: bool) -> str:
    """How the grids are searched: as said, else by what else is asked for; none where C or epsilon are fixed.

    Raises
    ------
    UsageError
        Options that contradict each other."""
    strategy = search or ("halving" if asked or (reported and not fixed) else "none")
    if strategy != "none" and fixed:
        raise click.UsageError("--C and --epsilon fix what a search chooses; drop them, or use --search none")
    if strategy == "none" and asked:
        raise click.UsageError(
            "--search none compares nothing; drop it, or --ladder, --kernel, --tolerance, "
            "--max-support-vectors and --no-mean"
        )
    return strategy
