"""From measured points to a model: what `rtctl fit` learns, and what it adds that is known besides."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rtctl.friction.learn.ladder import Ladder
    from rtctl.friction.model import FrictionModel
    from rtctl.friction.points.measured import FrictionPoints


def curves(
    measured: FrictionPoints,
    rig: str,
    fade_rad_s: float | None,
    options: dict[str, Any],
    searched: dict[str, Any],
) -> tuple[Ladder | None, FrictionModel]:
    """The curves as `options` (those of the command) ask for them; the ladder is None where nothing is compared."""
    from rtctl.cli import ladder_report
    from rtctl.friction.learn import fit
    from rtctl.friction.learn.ladder import Options

    if options["search"] == "none":
        epsilon_nm = options["epsilon_nm"] or fit.EPSILON_NM
        fixed = {"c": options["C"], "epsilon_nm": epsilon_nm, "fade_rad_s": fade_rad_s}
        return None, fit.fit_points(measured, rig=rig, folds=searched["folds"], **fixed)
    taken = {name: options[name] for name in ("symmetric", "tolerance_share", "max_support_vectors")}
    wanted = Options(strategy=options["search"], **taken, **searched)
    return ladder_report.climb(measured, wanted, rig, fade_rad_s)


def with_what_is_known(
    model: FrictionModel,
    measured: FrictionPoints,
    temperature: tuple[float, float] | None,
    presliding_rad: float | None,
    test: FrictionPoints | None,
) -> FrictionModel:
    """The model with the range of temperature, the time an evaluation takes here, and the evidence for its bounds."""
    from rtctl.friction.learn.point_evidence import with_evidence
    from rtctl.friction.timing import evaluation_ns

    low, high = temperature or measured.temperature_range_c or (None, None)
    model = replace(
        model, temperature_min_c=low, temperature_max_c=high, evaluation_ns=evaluation_ns(model.record())
    )
    return with_evidence(model, measured, presliding_rad, test)
