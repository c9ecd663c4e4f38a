"""What a model file says of place: the kernel of friction over a turn, and the conservative part; absent from
models of speed alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.friction.document import ModelDocument, PlaceDocument
from rtctl.friction.kind_harmonics import Harmonics
from rtctl.friction.kind_place import PlaceKernel
from rtctl.friction.kind_spline import UNIT
from rtctl.friction.model import FrictionModel


def body(model: FrictionModel) -> dict[str, Any]:
    """Keys of the file beside those of every model; none for a model of speed alone."""
    out: dict[str, Any] = {}
    if model.place is not None:
        out["place"] = {name: getattr(model.place, name) for name in PlaceDocument.model_fields}
    if model.conservative is not None:
        part = model.conservative
        out["conservative"] = {
            "period_rad": part.period_rad,
            "orders": part.orders.astype(int).tolist(),
            "cos": part.cos.tolist(),
            "sin": part.sin.tolist(),
        }
    return out


def parts(document: ModelDocument) -> dict[str, Any]:
    """Kernel and conservative part of a file, as fields of a `FrictionModel`."""
    place, part = document.place, document.conservative
    return {
        "place": None
        if place is None
        else PlaceKernel(place.period_rad, place.orders, place.share, place.decay, _unit(document)),
        "conservative": None
        if part is None or not len(part.orders) == len(part.cos) == len(part.sin)  # `refusal` says so
        else Harmonics(
            part.period_rad, np.array(part.orders, dtype=float), np.array(part.cos), np.array(part.sin)
        ),
    }


def _unit(document: ModelDocument) -> float:
    """The speed that counts as 1: a parameter of the curves."""
    return document.branches.forward.parameters.get(UNIT, 1.0)


def refusal(document: ModelDocument, model: FrictionModel) -> tuple[str, str] | None:
    """Key and what is wrong with what a file says of place; None when it can be believed."""
    part = document.conservative
    if part is not None and model.conservative is None:
        return "conservative", "orders, cos and sin differ in number"
    if part is not None and len(set(part.orders)) != len(part.orders):
        return "conservative.orders", "an order is there twice"
    for name, branch in zip(("forward", "backward"), model.branches, strict=True):
        wanted = 0 if model.place is None else len(branch.support_vectors)
        if len(branch.support_places) != wanted:
            return f"branches.{name}.support_places", f"has {len(branch.support_places)} places, not {wanted}"
        if model.place is not None and branch.kind != "spline":
            return "kind", "only a spline may have a kernel of place"
        # the unit is read off the forward branch alone
        if model.place is not None and branch.parameters.get(UNIT, 1.0) != model.place.unit_rad_s:
            return f"branches.{name}.parameters", f"{UNIT} differs between the directions"
        try:
            tables = branch.place_tables(model.place)
        except ValueError as error:
            return f"branches.{name}.support_places", str(error)
        if tables is None:
            continue
        speeds = branch.curve.extreme_speeds(branch.speed_max_rad_s)
        if not (branch.magnitude(speeds) + tables.over_turn(speeds).min(axis=1) > 0).all():
            return f"branches.{name}.dual_coef", "the friction is not positive at some place"
    return None
