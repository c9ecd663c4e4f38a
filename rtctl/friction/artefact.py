"""The friction model file: written atomically, and believed only after every check.

Data only: JSON, no code. Reading verifies, in this order, the JSON, the schema and bounds of every key,
the checksum and the exact spelling, the knots, the positivity of the curve, the self-test vectors
through the compiled coefficients, and that compile bound and passivity quantities are those of the curve.
One byte changed anywhere is refused.
"""

from __future__ import annotations

import json
import os
from functools import lru_cache
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from pydantic import ValidationError

from hw.motion import unit
from hw.outside import read_bounded, require_sane, shown
from hw.plain_words import explain, written
from rtctl.errors import ModelError
from rtctl.friction import band_document, place_document
from rtctl.friction.document import (
    FORMAT,
    SCHEMA,
    BranchDocument,
    ModelDocument,
    checksum,
    render,
)
from rtctl.friction.kinds.compile import TOLERANCE_SHARE, sampled_error
from rtctl.friction.kinds.cubic import PiecewiseCubic
from rtctl.friction.kinds.table import KINDS
from rtctl.friction.model import Branch, FrictionModel
from rtctl.rig_file.generated_document import ENDINGS
from rtctl.rig_file.tiny_numbers import LEAST_COMPUTED, too_small

__all__ = ["Branch", "FrictionModel", "load", "require_rig", "save"]

MAX_BYTES = 4_000_000
"""Largest file read: 1024 segments per branch at full precision need a tenth of it."""

_REMEDY = "fit the model again (rtctl fit) or restore the file from its source"

_SCALARS = (
    "n_points",
    "speed_max_rad_s",
    "friction_min_nm",
    "friction_max_nm",
    "viscous_nms_rad",
    "train_mean_error_nm",
    "train_rmse_nm",
    "train_max_error_nm",
    "validation_rmse_nm",
    "validation_max_error_nm",
    "hyper_parameters",
    "parameters",
    "intercept",
    "place_spread_nm",
    "test_max_error_nm",
    "single_max_error_nm",
    "sliding_doubt_nm",
)

UNITS = {ending: unit(ENDINGS[ending], "linear") for ending in ("rad", "rad_s", "nm", "nm_rad", "nms_rad")}
"""Which unit an ending of a key means in a model of a linear axis."""

_DERIVED = {
    "compile_bound_nm": "rounding_bound_nm",
    "friction_lower_nm": "friction_lower_nm",
    "secant_damping_nms_rad": "secant_damping_nms_rad",
    "slope_damping_nms_rad": "slope_damping_nms_rad",
}
"""Key of the file -> property of the branch it must equal."""

_WHOLE = (
    "temperature_min_c",
    "temperature_max_c",
    "evaluation_ns",
    "selection",
    "presliding_rad",
    "presliding_spread_rad",
    "presliding_ramps",
)


def _refuse(path: Path, key: str, what: str, remedy: str = _REMEDY) -> NoReturn:
    raise ModelError(f"{path}: {shown(key)}: {shown(what, 500)}; {remedy}")


def save(model: FrictionModel, path: str | Path) -> None:
    """Write a model file: temporary file, fsync, rename. The old file stays whole until the new one is.

    Raises
    ------
    ModelError
        A model that `load` would refuse, or a path that cannot be written.
    """
    path = Path(path)
    document = _document(model)
    try:
        document["sha256"] = checksum(document)
        text = render(document)
    except ValueError as error:
        _refuse(path, "(file)", "the model holds a number that is not finite", f"not written ({error})")
    _verified(path, text.encode())
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with temporary.open("w", encoding="utf-8", newline="\n") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        _refuse(path, "(file)", f"cannot write: {error.strerror}", "choose a folder you may write to")


def load(path: str | Path) -> FrictionModel:
    """Read a model file and verify everything in it.

    Raises
    ------
    ModelError
        Naming the file, the key, what is wrong and the remedy.
    """
    path = Path(path)
    try:
        raw = read_bounded(path, MAX_BYTES)
    except OSError as error:
        _refuse(
            path, "(file)", f"cannot read the model: {error.strerror}", "correct the path, or run rtctl fit"
        )
    return _verified(path, raw)


def require_rig(model: FrictionModel, rig: str, path: str | Path, motion: str = "rotary") -> None:
    """Refuse a model that was made for another rig, or for an axis of the other motion (ModelError)."""
    if model.motion != motion:
        remedy = f"identify this axis, or correct its motion in the rig file (now {motion!r})"
        _refuse(
            Path(path),
            "motion",
            f"the model was made for a {model.motion} axis, this one is {motion}",
            remedy,
        )
    if model.rig != rig:
        remedy = "identify this rig (rtctl fit --rig), or correct [rig] name"
        _refuse(Path(path), "rig", f"the model was made for rig {model.rig!r}, this is {rig!r}", remedy)


@lru_cache(maxsize=4)  # a start verifies the same file for its proofs and for the law
def _verified(path: Path, raw: bytes) -> FrictionModel:
    try:
        data = json.loads(raw.decode(), parse_constant=_not_a_number)
        require_sane(data)
    except (ValueError, RecursionError) as error:
        _refuse(path, "(file)", f"not a model file, or cut short: {error}")
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        _refuse(path, "format", f"this is not an {FORMAT}")
    if data.get("schema") != SCHEMA:
        _refuse(
            path,
            "schema",
            f"version {data.get('schema')!r} is not {SCHEMA}",
            "fit it with this rtctl version",
        )
    for key, value in too_small(data, LEAST_COMPUTED):
        _refuse(path, written(key), f"{value!r} is nearer to 0 than {LEAST_COMPUTED:g}")
    try:
        document = ModelDocument.model_validate(data)
    except ValidationError as error:
        told = explain(error, ModelDocument, data)[0]
        _refuse(path, told.where, told.text)
    if checksum(data) != document.sha256 or render(data).encode() != raw:
        _refuse(path, "sha256", "the checksum does not match: the file was edited or damaged")
    model = _model(document)
    for name, branch in zip(("forward", "backward"), model.branches, strict=True):
        _check_branch(path, f"branches.{name}", branch)
    wrong = place_document.refusal(document, model)
    if wrong is not None:
        _refuse(path, *wrong)
    _check_whole(path, model, document.friction_max_nm)
    for name, branch in zip(("forward", "backward"), model.branches, strict=True):
        _check_compiled(path, f"branches.{name}", branch, getattr(document.branches, name))
    return model


def _not_a_number(word: str) -> NoReturn:
    msg = f"{word} is not a number"
    raise ValueError(msg)


def _check_parameters(path: Path, key: str, branch: Branch) -> None:
    kind, p = KINDS[branch.kind], branch.parameters
    if not kind.has_parameters(p):
        _refuse(path, f"{key}.parameters", f"are not those of a {branch.kind} curve")
    if kind.is_formula and len(branch.support_vectors):
        _refuse(path, f"{key}.support_vectors", f"a {branch.kind} curve has none")
    for parameter in (one for one in kind.parameters if one.name in p):
        refusal = parameter.refusal(p[parameter.name])
        if refusal:
            _refuse(path, f"{key}.parameters", refusal)


def _check_compiled(path: Path, key: str, branch: Branch, document: BranchDocument) -> None:
    for name, derived in _DERIVED.items():
        stored, found = getattr(document, name), getattr(branch, derived)
        if name == "compile_bound_nm" and found < stored <= _most_table_error_nm(branch):
            continue  # an older proof was coarser: it holds all the same
        if not abs(stored - found) <= 1e-9 + 1e-6 * abs(found):
            _refuse(path, f"{key}.{name}", f"is {stored:.6g}, the curve itself gives {found:.6g}")
    seen = sampled_error(branch.source, branch.curve, branch.speed_max_rad_s)
    if not seen <= document.compile_bound_nm * (1 + 1e-6) + 1e-12:
        _refuse(
            path, f"{key}.coefficients", f"are off the learned curve by {seen:.3g} N m, more than was proved"
        )


def _most_table_error_nm(branch: Branch) -> float:
    """Bound of every table that was ever made, N m; 0 where the curve is compiled exactly."""
    if branch.source.exact is not None:
        return 0.0
    return TOLERANCE_SHARE * branch.friction_max_nm + 2 * branch.source.rounding(branch.speed_max_rad_s)


def _check_branch(path: Path, key: str, branch: Branch) -> None:
    _check_parameters(path, key, branch)
    knots, coefficients = branch.curve.knots, branch.curve.coefficients
    if len(knots) != len(coefficients) or len(branch.support_vectors) != len(branch.dual_coef):
        _refuse(
            path, key, "knots and coefficients, or support vectors and dual coefficients, differ in number"
        )
    if knots[0] != 0 or not (np.diff(knots) > 0).all() or knots[-1] > branch.speed_max_rad_s:
        _refuse(path, f"{key}.knots", "must begin at 0 and rise strictly within the trained range")
    wrong = band_document.refusal(branch.band)
    if wrong:
        _refuse(path, f"{key}.band", wrong)
    speeds = branch.curve.extreme_speeds(branch.speed_max_rad_s)
    values = branch.magnitude(speeds)
    if not (values > 0).all():
        at = speeds[int(np.argmin(values))]
        _refuse(path, f"{key}.coefficients", f"the friction is not positive at {at:.4g} rad/s")
    if not abs(values.max() - branch.friction_max_nm) <= 1e-9 * (1 + branch.friction_max_nm):
        _refuse(path, f"{key}.friction_max_nm", "is not the largest value of the curve")
    speeds = branch.curve.extreme_speeds(branch.speed_max_rad_s, branch.viscous_nms_rad)
    dry = branch.magnitude(speeds) - branch.viscous_nms_rad * speeds
    if not abs(dry.min() - branch.friction_min_nm) <= 1e-9 * (1 + branch.friction_max_nm):
        _refuse(path, f"{key}.friction_min_nm", "is not the least dry friction of the curve")


def _check_whole(path: Path, model: FrictionModel, friction_max_nm: float) -> None:
    if model.presliding_rad is None and (model.presliding_spread_rad is not None or model.presliding_ramps):
        _refuse(path, "presliding_rad", "is missing beside its own spread or number of ramps")
    if (model.presliding_spread_rad is None) != (model.presliding_ramps == 0):
        _refuse(path, "presliding_spread_rad", "and presliding_ramps must both be given, or neither")
    if friction_max_nm != model.friction_max_nm:
        _refuse(path, "friction_max_nm", "is not the larger of both branches")
    velocity, expected = model.self_test.T
    branch = (velocity < 0).astype(int)
    if not (np.abs(velocity) <= np.array([b.speed_max_rad_s for b in model.branches])[branch]).all():
        _refuse(path, "self_test", "a vector lies outside the trained range")
    if set(branch) != {0, 1}:
        _refuse(path, "self_test", "the vectors cover one direction only")
    error = np.abs(model.magnitude(velocity) - expected)
    bound = np.array([b.rounding_bound_nm for b in model.branches])[branch]
    if not (error <= bound).all():
        at = int(np.argmax(error - bound))
        _refuse(
            path,
            f"self_test.{at}",
            f"the compiled curve gives {model.magnitude(velocity[at]):.12g} N m at {velocity[at]:.6g} rad/s, "
            f"not {expected[at]:.12g}",
        )


def _document(model: FrictionModel) -> dict[str, Any]:
    def branch(b: Branch) -> dict[str, Any]:
        out = {name: getattr(b, name) for name in _SCALARS}
        out.update({name: getattr(b, derived) for name, derived in _DERIVED.items()})
        out |= band_document.body(b.band)
        out["support_vectors"] = b.support_vectors.tolist()
        out["dual_coef"] = b.dual_coef.tolist()
        if model.place is not None:
            out["support_places"] = b.support_places.tolist()
        out["knots"] = b.curve.knots.tolist()
        out["coefficients"] = b.curve.coefficients.tolist()
        return out

    return {
        "format": FORMAT,
        "schema": SCHEMA,
        "kind": model.kind,
        **({} if model.motion == "rotary" else {"motion": model.motion, "units": UNITS}),
        "rig": model.rig,
        "created": model.created,
        "versions": dict(model.versions),
        "data_sha256": model.data_sha256,
        **{name: getattr(model, name) for name in _WHOLE},
        **place_document.body(model),
        "friction_max_nm": model.friction_max_nm,
        "speed_fade_rad_s": model.speed_fade_rad_s,
        "branches": {"forward": branch(model.branches[0]), "backward": branch(model.branches[1])},
        "self_test": model.self_test.tolist(),
    }


def _model(document: ModelDocument) -> FrictionModel:
    def branch(d: BranchDocument) -> Branch:
        return Branch(
            support_vectors=np.array(d.support_vectors, dtype=float),
            dual_coef=np.array(d.dual_coef, dtype=float),
            support_places=np.array(d.support_places, dtype=float),
            curve=PiecewiseCubic(np.array(d.knots, dtype=float), np.array(d.coefficients, dtype=float)),
            kind=document.kind,
            band=band_document.part(d.band),
            **{name: getattr(d, name) for name in _SCALARS},
        )

    return FrictionModel(
        rig=document.rig,
        kind=document.kind,
        motion=document.motion,
        branches=(branch(document.branches.forward), branch(document.branches.backward)),
        speed_fade_rad_s=document.speed_fade_rad_s,
        data_sha256=document.data_sha256,
        created=document.created,
        versions=document.versions,
        **{name: getattr(document, name) for name in _WHOLE},
        **place_document.parts(document),
        self_test=np.array(document.self_test, dtype=float),
    )
