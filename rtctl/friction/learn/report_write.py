"""The report of a fit: one HTML page that needs nothing else, its figures as PNG, its numbers as JSON.

    report.html    figures inline, no script, no network
    *.png          the same figures
    report.json    the same numbers, in SI units

Built in a folder beside the wanted one and renamed, so that it is whole or not there."""

from __future__ import annotations

import json
import os
import platform
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hw.motion import named, speed_scale
from hw.outside import MOST_TABLE_BYTES, json_of, read_bounded
from rtctl.errors import DataError
from rtctl.friction import gain as report_gain
from rtctl.friction.gain import Gains
from rtctl.friction.kind_table import is_machine
from rtctl.friction.learn import (
    report_figures,
    report_measured_range,
    report_page,
    report_sentences,
    report_tables,
)
from rtctl.friction.learn.hold_out import HELD_OUT
from rtctl.friction.learn.report_evidence import EXTRA_COLUMNS, Evidence
from rtctl.friction.learn.report_page import Picture

if TYPE_CHECKING:
    from rtctl.rig_file.config import LoadedConfig

KIND = "rtctl friction report"
HEADER = "report.json"
PAGE = "report.html"
PAPERS = ("epsilon-rbf", "epsilon-spline")
"""Families whose curves are always shown when they were learned, as in the papers."""


def require_place(folder: Path) -> None:
    """Refuse a folder that holds anything but a report of ours.

    Raises
    ------
    DataError
        Naming what is in the way."""
    if not folder.exists():
        return
    found = {item.name for item in folder.iterdir()} if folder.is_dir() else {folder.name}
    # an empty folder is nobody's
    if not found:
        return
    try:
        document = json_of(read_bounded(folder / HEADER, MOST_TABLE_BYTES))
        # only what that very report wrote: a picture that somebody put beside it stays
        ours = set(document["files"]) if document["kind"] == KIND else set()
    except (OSError, ValueError, TypeError, KeyError):
        ours = set()
    strange = sorted(found - ours - {HEADER}) if ours else sorted(found)
    if strange:
        raise DataError(f"{folder}: holds {strange[0]}, which no report wrote; choose another --report")


def write(
    folder: Path,
    evidence: Evidence,
    options: Mapping[str, Any] | None = None,
    loaded: LoadedConfig | None = None,
) -> None:
    """Write the report of a fit.

    Parameters
    ----------
    options : Mapping, optional
        How the fit was asked for; shown as provenance.
    loaded : LoadedConfig, optional
        Rig file for the recommended gain; without it only the model's own figures are given.

    Raises
    ------
    DataError
        `folder` holds something else, or cannot be written."""
    # before the pictures: they take seconds, and the folder may be somebody's
    require_place(folder)
    gains = report_gain.recommend(evidence.model, loaded)
    pictures = _pictures(evidence)
    document = _document(evidence, gains, options or {}, pictures)
    files = {f"{picture.name}.png": picture.png for picture in pictures}
    files[PAGE] = report_page.page(evidence, gains, document, pictures).encode()
    files[HEADER] = (
        json.dumps(named(document, evidence.points.motion), indent=1, allow_nan=False) + "\n"
    ).encode()
    try:
        _replace(folder, files)
    except OSError as error:
        raise DataError(
            f"{folder}: cannot write the report: {error.strerror}; free space or choose another --report"
        ) from error


def _replace(folder: Path, files: Mapping[str, bytes]) -> None:
    folder = folder.absolute()
    folder.parent.mkdir(parents=True, exist_ok=True)
    # beside it and not in /tmp: a rename is whole only within one disk; by process: two may write at once
    new, old = (folder.parent / f".{folder.name}.{os.getpid()}.{end}" for end in ("new", "old"))
    try:
        new.mkdir()
        for name, content in files.items():
            (new / name).write_bytes(content)
        if folder.exists():
            folder.rename(old)
        new.rename(folder)
    finally:
        if old.exists() and not folder.exists():  # the second rename failed: the old report stays
            old.rename(folder)
        for left in (new, old):
            shutil.rmtree(left, ignore_errors=True)


def _pictures(evidence: Evidence) -> list[Picture]:
    unit, _ = speed_scale(evidence.points.motion, float(np.abs(evidence.points.velocity_rad_s).max()))
    families = [name for name in dict.fromkeys((*PAPERS, evidence.chosen)) if evidence.of(name)]
    found = [
        Picture(
            f"curve_{name}",
            f"{name}{' (the reported model)' if name == evidence.chosen else ''}: friction in N m against "
            f"speed in {unit}, points, learned "
            f"curve{', epsilon tube and support vectors' if is_machine(name) else ''}. Left: every speed; "
            f"right: below {evidence.boundary_rad_s:.3g} rad/s.{report_measured_range.said(evidence.points)}",
            report_figures.curves(evidence, name),
        )
        for name in families
    ]
    against = "Residuals in mN m, model minus measured, of the reported model against"
    found += [
        Picture(
            "ladder",
            "Held-out RMSE in mN m of every model that was not refused, with 95 % confidence intervals; "
            "red: the reported model.",
            report_figures.ladder(evidence),
        ),
        Picture(
            "residuals_speed",
            f"{against} speed in {unit} (linear below the slowest run, then logarithmic)."
            f"{' Shaded: the tube.' if is_machine(evidence.chosen) else ''}",
            report_figures.residuals(evidence),
        ),
    ]
    for name in evidence.extra:
        mean = " (mean over the places a point was measured at)" if name == "position_rad" else ""
        caption = f"{against} {EXTRA_COLUMNS[name]}{mean}, training points."
        found.append(
            Picture(
                f"residuals_{name.split('_')[0]}", caption, report_figures.residuals_against(evidence, name)
            )
        )
    return found


def _document(
    evidence: Evidence, gains: Gains, options: Mapping[str, Any], pictures: Sequence[Picture]
) -> dict[str, Any]:
    model, test = evidence.model, evidence.test
    learned = {
        family: [
            {
                "direction": one.direction,
                "epsilon_nm": one.epsilon_nm,
                "speed_rad_s": one.curve.support_vectors.tolist(),
                "dual_coef": one.curve.dual_coef.tolist(),
                "bounded": one.bounded.tolist(),
            }
            for one in evidence.of(family)
        ]
        for family in evidence.families
    }
    return {
        "kind": KIND,
        "schema": 1,
        "files": [PAGE, HEADER, *(f"{picture.name}.png" for picture in pictures)],
        "rig": model.rig,
        "chosen": evidence.chosen,
        "explanation": model.selection,
        "said": report_sentences.headline(evidence),
        "folds": evidence.folds,
        "boundary_rad_s": evidence.boundary_rad_s,
        "ladder": report_tables.ladder_rows(evidence),
        "errors": report_tables.error_rows(evidence),
        "errors_overall": report_tables.overall_rows(evidence),
        "prediction_on": "test points" if test else f"held-out {HELD_OUT[evidence.folds]}",
        "model": report_tables.model_rows(evidence),
        "support_vectors": learned,
        "gain": asdict(gains),
        "residuals_against": ["speed", *evidence.extra],
        "provenance": {
            "date": datetime.now(UTC).isoformat(timespec="seconds"),
            "model_created": model.created,
            "points": Path(evidence.points.source).name,
            "points_sha256": evidence.points.sha256,
            "test_points": Path(test.source).name if test else None,
            "test_points_sha256": test.sha256 if test else None,
            "versions": {**model.versions, "system": platform.system()},
            "options": dict(options),
        },
    }
