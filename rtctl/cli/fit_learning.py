"""From measured points to a model: what `rtctl fit` learns, and what it adds that is known besides."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rtctl.cli.fit_report import Plan
    from rtctl.friction.learn.beside_speed import LoadVerdict
    from rtctl.friction.learn.ladder import Ladder
    from rtctl.friction.learn.warmth import Warmth
    from rtctl.friction.load import Load
    from rtctl.friction.model import FrictionModel
    from rtctl.friction.points import FrictionPoints


def curves(
    measured: FrictionPoints,
    rig: str,
    fade_rad_s: float | None,
    options: dict[str, Any],
    searched: dict[str, Any],
) -> tuple[Ladder | None, FrictionModel]:
    """The curves as `options` (those of the command) ask for them; the ladder is None where nothing is
    compared."""
    from rtctl.cli import ladder_report
    from rtctl.friction.learn import fit
    from rtctl.friction.learn.ladder import Options

    if options["search"] == "none":
        fixed = {"c": options["C"], "epsilon_nm": options["epsilon_nm"], "fade_rad_s": fade_rad_s}
        return None, fit.fit_points(measured, rig=rig, folds=searched["folds"], **fixed)
    taken = {name: options[name] for name in ("symmetric", "tolerance_share", "max_support_vectors", "mean")}
    wanted = Options(strategy=options["search"], **taken, **searched)
    return ladder_report.climb(measured, wanted, rig, fade_rad_s)


Under = tuple["LoadVerdict", "Load"]
"""What was found of load, and what of it the model carries."""


def apart_from_load(
    measured: FrictionPoints, plan: Plan, held_out: str, *, by_load: bool
) -> tuple[FrictionPoints, Plan, Under | None]:
    """Points and test points of a gear without load, and what load adds; all as it is where that is not asked
    for."""
    if not by_load:
        return measured, plan, None
    from rtctl.friction.learn import beside_speed, hold_out, unloaded

    verdict = beside_speed.judge_load(measured, hold_out.way_for(measured, held_out))
    load = unloaded.load_of(measured, verdict)
    # test points, too: they are judged by the curve without load
    if plan.test is not None:
        plan = replace(plan, test=unloaded.without_load(plan.test, load))
    return unloaded.without_load(measured, load), plan, (verdict, load)


def beside(
    model: FrictionModel, measured: FrictionPoints, folds: str, under: Under | None
) -> tuple[LoadVerdict, Warmth]:
    """What friction depends on beside the speed; of load what was found before it was taken off."""
    from rtctl.friction.learn import beside_speed, warmth

    if under is None:
        return beside_speed.judge(model, measured, folds)
    return under[0], warmth.judge_temperature(model, measured)


def with_what_is_known(
    model: FrictionModel,
    measured: FrictionPoints,
    temperature: tuple[float, float] | None,
    presliding_rad: float | None,
    test: FrictionPoints | None,
) -> FrictionModel:
    """The model with the range of temperature, the time an evaluation takes here, and the evidence for its
    bounds."""
    from rtctl.friction.learn.point_evidence import with_evidence
    from rtctl.friction.timing import evaluation_ns

    # what a person says counts before the column
    low, high = temperature or measured.temperature_range_c or (None, None)
    model = replace(
        model, temperature_min_c=low, temperature_max_c=high, evaluation_ns=evaluation_ns(model.record())
    )
    return with_evidence(model, measured, presliding_rad, test)
