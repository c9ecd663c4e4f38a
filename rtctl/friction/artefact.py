"""The friction model file: written atomically, and believed only after every check.

Data only: JSON, no code. Reading verifies, in this order, the JSON, the schema and bounds of every key,
the checksum and the exact spelling, the knots, the positivity of the curve, the self-test vectors
through the compiled coefficients, and that compile bound and passivity quantities are those of the curve.
One byte changed anywhere is refused."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from pydantic import ValidationError

from hw.outside import read_bounded, require_sane
from hw.plain_words import explain, written
from rtctl.friction import mean_document, place_document
from rtctl.friction.artefact_checks import DERIVED, check_branch, check_compiled, check_whole, refuse
from rtctl.friction.band import Band
from rtctl.friction.document import FORMAT, SCHEMA, BranchDocument, ModelDocument, checksum, render
from rtctl.friction.kind_cubic import PiecewiseCubic
from rtctl.friction.load import Load
from rtctl.friction.model import Branch, FrictionModel
from rtctl.rig_file.tiny_numbers import LEAST_COMPUTED, too_small
from rtctl.whole_files import write_whole

__all__ = ["Branch", "FrictionModel", "load", "require_rig", "save"]

MAX_BYTES = 4_000_000
"""Largest file read: 1024 segments per branch at full precision need a tenth of it."""


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

UNITS = {"rad": "m", "rad_s": "m/s", "nm": "N", "nm_rad": "N/m", "nms_rad": "N s/m"}
"""Which unit an ending of a key means in a model of a linear axis."""
_WHOLE = (
    "temperature_min_c",
    "temperature_max_c",
    "evaluation_ns",
    "selection",
    "presliding_rad",
    "presliding_spread_rad",
    "presliding_ramps",
)


def save(model: FrictionModel, path: str | Path) -> None:
    """Write a model file: temporary file, fsync, rename. The old file stays whole until the new one is.

    Raises
    ------
    ModelError
        A model that `load` would refuse, or a path that cannot be written."""
    path = Path(path)
    document = _document(model)
    try:
        document["sha256"] = checksum(document)
        text = render(document)
    except ValueError as error:
        refuse(path, "(file)", "the model holds a number that is not finite", f"not written ({error})")
    _verified(path, text.encode())  # before the old file is replaced
    try:
        write_whole(path, text.encode())
        folder = os.open(path.parent, os.O_RDONLY)  # the new name is on the disk once the folder is
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
    except OSError as error:
        refuse(path, "(file)", f"cannot write: {error.strerror}", "choose a folder you may write to")


def load(path: str | Path) -> FrictionModel:
    """Read a model file and verify everything in it.

    Raises
    ------
    ModelError
        Naming the file, the key, what is wrong and the remedy."""
    path = Path(path)
    try:
        raw = read_bounded(path, MAX_BYTES)
    except OSError as error:
        refuse(
            path, "(file)", f"cannot read the model: {error.strerror}", "correct the path, or run rtctl fit"
        )
    return _verified(path, raw)


def content(path: Path | None) -> bytes:
    """Bytes of a model file, whatever they say; empty where there is none."""
    try:
        return b"" if path is None else read_bounded(path, MAX_BYTES)
    except OSError:
        return b""


def require_rig(model: FrictionModel, rig: str, path: str | Path, motion: str = "rotary") -> None:
    """Refuse a model that was made for another rig, or for an axis of the other motion (ModelError)."""
    if model.motion != motion:
        remedy = f"identify this axis, or correct its motion in the rig file (now {motion!r})"
        refuse(
            Path(path),
            "motion",
            f"the model was made for a {model.motion} axis, this one is {motion}",
            remedy,
        )
    if model.rig != rig:
        remedy = "identify this rig (rtctl fit --rig), or correct [rig] name; rtctl init renames a rig"
        refuse(Path(path), "rig", f"the model was made for rig {model.rig!r}, this is {rig!r}", remedy)


@lru_cache(maxsize=4)  # a start verifies the same file for its proofs and for the law
def _verified(path: Path, raw: bytes) -> FrictionModel:
    try:
        # Python reads NaN and Infinity, which no JSON has
        data = json.loads(raw.decode(), parse_constant=_not_a_number)
        require_sane(data)
    except (ValueError, RecursionError) as error:
        refuse(path, "(file)", f"not a model file, or cut short: {error}")
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        refuse(path, "format", f"this is not an {FORMAT}")
    if data.get("schema") != SCHEMA:  # before the keys: those of another version are others
        refuse(
            path,
            "schema",
            f"version {data.get('schema')!r} is not {SCHEMA}",
            "fit it with this rtctl version",
        )
    for key, value in too_small(data, LEAST_COMPUTED):
        refuse(path, written(key), f"{value!r} is nearer to 0 than {LEAST_COMPUTED:g}")
    try:
        document = ModelDocument.model_validate(data)
    except ValidationError as error:
        told = explain(error, ModelDocument, data)[0]
        refuse(path, told.where, told.text)
    # the spelling, too: of a key that is there twice the reader keeps the last, unseen by the checksum
    if checksum(data) != document.sha256 or render(data).encode() != raw:
        refuse(path, "sha256", "the checksum does not match: the file was edited or damaged")
    model = _model(document)
    for name, branch in zip(("forward", "backward"), model.branches, strict=True):
        check_branch(path, f"branches.{name}", branch)
    wrong = place_document.refusal(document, model)
    if wrong is not None:
        refuse(path, *wrong)
    check_whole(path, model, document.friction_max_nm)
    for name, branch in zip(("forward", "backward"), model.branches, strict=True):
        check_compiled(path, f"branches.{name}", branch, getattr(document.branches, name))
    return model


def _not_a_number(word: str) -> NoReturn:
    raise ValueError(f"{word} is not a number")


def _document(model: FrictionModel) -> dict[str, Any]:
    def branch(b: Branch) -> dict[str, Any]:
        out = {name: getattr(b, name) for name in _SCALARS}
        out.update({name: getattr(b, derived) for name, derived in DERIVED.items()})
        out |= {} if b.band is None else {"band": asdict(b.band)}
        out["support_vectors"] = b.support_vectors.tolist()
        out["dual_coef"] = b.dual_coef.tolist()
        out |= mean_document.body(b.parts)
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
        **({} if model.load is None else {"load": model.load.body()}),
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
            parts=mean_document.parts(d.parts),
            band=None if d.band is None else Band(**d.band.model_dump()),
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
        load=None if document.load is None else Load(**document.load.model_dump()),
        self_test=np.array(document.self_test, dtype=float),
    )
