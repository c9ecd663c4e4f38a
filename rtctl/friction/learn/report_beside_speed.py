"""What fit and report say of load and temperature: judged by what was held out; load is deployed where that
was asked for."""

from __future__ import annotations

import math
from typing import Any

from rtctl.friction.learn.beside_speed import LoadRung, LoadVerdict
from rtctl.friction.learn.warmth import Warmth

NOT_DEPLOYED = "judged, not deployed: the law goes by speed and place"
DEPLOYED = (
    "the model carries it, its curve is that without load, and the law goes by it as friction.load_gain says"
)


def sentences(load: LoadVerdict, warmth: Warmth, *, deployed: bool = False) -> list[str]:
    """One of load, one of temperature; each says why where nothing can be said. `deployed`: the model carries
    the load."""
    return [
        f"Load: {load.reason}."
        if load.chosen is None
        else _of_load(load, load.chosen, DEPLOYED if deployed else NOT_DEPLOYED),
        f"Temperature: {warmth.reason}." if warmth.reason else _of_warmth(warmth),
    ]


def _of_load(load: LoadVerdict, chosen: LoadRung, use: str) -> str:
    terms = chosen.terms
    plain = load.of("coulomb_viscous").rmse_nm
    # chosen as everywhere: the plainest within chance of the best, which need not err least
    if not terms.told:
        return (
            f"Load: over {load.span_nm:.3g} N m friction does not depend on it: no form with load errs less "
            f"than {terms.rung} by more than chance."
        )
    told = ", ".join(f"{name} {value:.3g} +- {_error(error)}" for name, (value, error) in terms.told.items())
    return (
        f"Load: friction grows with it by the form {terms.rung} ({told}), which errs "
        f"{1e3 * chosen.rmse_nm:.3g} mN m held out, Coulomb + viscous {1e3 * plain:.3g} mN m "
        f"({100 * load.less_share:.0f} % less); {use}."
    )


def _of_warmth(warmth: Warmth) -> str:
    parts = [f"dry friction {_per_k(warmth.dry_per_k)}"]
    if warmth.viscous_per_k is not None:
        parts.append(f"viscous {_per_k(warmth.viscous_per_k)}")
    return (
        f"Temperature: {' and '.join(parts)}, about {warmth.middle_c:.0f} degC over {warmth.span_k:.0f} K; "
        f"{NOT_DEPLOYED}{warmth.caution and '; '}{warmth.caution}."
    )


def _per_k(scale: tuple[float, float]) -> str:
    return f"{100 * scale[0]:+.2f} +- {_error(100 * scale[1])} % per K"


def _error(error: float) -> str:
    return "unknown" if math.isnan(error) else f"{error:.2g}"


def body(load: LoadVerdict, warmth: Warmth) -> dict[str, Any]:
    """Figures for scripts: N m, shares, per K; standard errors beside each number, null where unknown."""
    chosen = load.chosen
    known = {
        "span_nm": load.span_nm,
        "reason": load.reason,
        "form": chosen and chosen.terms.rung,
        "coefficients": _told(chosen.terms.told) if chosen else {},
        "held_out_rmse_nm": {one.terms.rung: one.rmse_nm for one in load.rungs},
    }
    heat = {
        "span_k": warmth.span_k,
        "reason": warmth.reason,
        "middle_c": warmth.middle_c,
        "dry_per_k": _pair(warmth.dry_per_k),
        "viscous_per_k": warmth.viscous_per_k and _pair(warmth.viscous_per_k),
        "caution": warmth.caution,
    }
    return {"load": known, "temperature": heat}


def _told(told: dict[str, tuple[float, float]]) -> dict[str, list[float | None]]:
    return {name: _pair(each) for name, each in told.items()}


def _pair(each: tuple[float, float]) -> list[float | None]:
    return [each[0], None if math.isnan(each[1]) else each[1]]
