"""Tables of a report: rows of text, computed from the evidence. The page escapes and lays them out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hw.motion import speed_scale
from rtctl.friction.gain import Gains, told
from rtctl.friction.learn.certainty import standard_error
from rtctl.friction.learn.fit import compile_error_nm
from rtctl.friction.learn.hold_out import HELD_OUT
from rtctl.friction.learn.report_evidence import REGIMES, Errors, Evidence, Learned, interval_nm


@dataclass(frozen=True)
class Table:
    """Caption, header and cells."""

    caption: str
    header: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]


def error_rows(evidence: Evidence) -> list[dict[str, Any]]:
    """Mean and largest absolute error (N m) per family, direction and regime; None where there is no
    point."""
    return [
        {
            "family": one.family,
            "direction": one.direction,
            "regime": regime,
            **_mean_max("training", evidence.regime(regime, one.trained)),
            **_mean_max("prediction", evidence.regime(regime, one.judged)),
        }
        for one in evidence.learned
        for regime in REGIMES
    ]


def _mean_max(name: str, errors: Errors) -> dict[str, Any]:
    size = np.abs(errors.error_nm)
    return {
        f"{name}_points": len(size),
        f"{name}_mean_error_nm": float(size.mean()) if len(size) else None,
        f"{name}_max_error_nm": float(size.max()) if len(size) else None,
    }


def ladder_rows(evidence: Evidence) -> list[dict[str, Any]]:
    """Held-out RMSE (N m) and its confidence interval of every rung; None for a refused one."""
    return [
        {
            "family": rung.family,
            "held_out_rmse_nm": None if rung.refused else rung.rmse_nm,
            "interval_nm": None if rung.refused else list(interval_nm(rung)),
            "terms": [score.n_terms for score in rung.scores],
            "tried": rung.tried,
            "failed": sum(rung.failures.values()),
            "refused": rung.refused,
        }
        for rung in evidence.rungs
    ]


def overall_rows(evidence: Evidence) -> list[dict[str, Any]]:
    """Mean and largest absolute error (N m) per family over all speeds of both directions, and their
    ratio."""
    rows: list[dict[str, Any]] = []
    for family in evidence.families:
        both = evidence.of(family)
        trained = np.abs(np.concatenate([one.trained.error_nm for one in both]))
        judged = np.abs(np.concatenate([one.judged.error_nm for one in both]))
        rows.append(
            {
                "family": family,
                "training_mean_error_nm": float(trained.mean()),
                "training_max_error_nm": float(trained.max()),
                "prediction_mean_error_nm": float(judged.mean()),
                "prediction_max_error_nm": float(judged.max()),
                "prediction_rmse_nm": float(np.sqrt(np.mean(judged**2))),
                "prediction_se_nm": standard_error(judged),
                # a curve through its own points has no error there, and no ratio
                "prediction_over_training": float(judged.mean() / trained.mean()) if trained.any() else None,
            }
        )
    return rows


def overall(evidence: Evidence) -> Table:
    """Training and prediction error per model, all speeds of both directions together."""
    rows = []
    for row in overall_rows(evidence):
        ratio = row["prediction_over_training"]
        cells = [mnm_cell(row[f"{use}_{what}"]) for use in ("training", "prediction") for what in _STATISTICS]
        cells.append(mnm_cell(row["prediction_rmse_nm"]))
        rows.append((row["family"], *cells, "-" if ratio is None else f"{ratio:.2f}"))
    caption = (
        "Absolute errors over all speeds and both directions, mN m. A prediction error much above the "
        "training error means that noise was learned; of a formula, too, on test points, that friction is "
        "another one there."
    )
    header = ("model", "train mean", "max", "predict mean", "max", "RMS", "predict / train")
    return Table(caption, header, rows)


def errors(evidence: Evidence) -> Table:
    """Training and prediction errors per kernel and regime, as Tables I and II of Bi et al."""
    judged = (
        "the test points"
        if evidence.test
        else f"{HELD_OUT[evidence.folds]} held out of training (no test points given)"
    )
    caption = (
        f"Absolute errors, mN m: mean and largest. Prediction: on {judged}. Low speed is below "
        f"{evidence.boundary_rad_s:.3g} rad/s, the geometric middle of the measured speeds."
    )
    header = ("model", "direction", "regime", "train n", "mean", "max", "predict n", "mean", "max")
    keys = [f"{use}_{what}" for use in ("training", "prediction") for what in ("points", *_STATISTICS)]
    rows = []
    for row in error_rows(evidence):
        cells = [str(row[key]) if key.endswith("points") else mnm_cell(row[key]) for key in keys]
        rows.append((row["family"], f"{row['direction']:+d}", row["regime"], *cells))
    return Table(caption, header, rows)


SMALL_NM = 1e-5
"""Torque below which three digits behind the point of a mN m are too few: errors of a finger's joint."""

_STATISTICS = ("mean_error_nm", "max_error_nm")


def ladder(evidence: Evidence) -> Table:
    """Every rung: held-out error with confidence interval, size, what failed."""
    caption = (
        "Every model that was compared. Held-out RMSE with its 95 % confidence interval, both directions "
        "together; numbers: support vectors or parameters of each direction."
    )
    header = ("model", "held-out RMSE, mN m", "95 % interval, mN m", "numbers", "tried", "failed", "note")
    rows = []
    for row in ladder_rows(evidence):
        low, high = row["interval_nm"] or (None, None)
        numbers = " + ".join(f"{n:.1f}".removesuffix(".0") for n in row["terms"])
        note = _reported(evidence) if row["family"] == evidence.chosen else ""
        if row["family"] in evidence.lost:
            note = f"{evidence.lost[row['family']]} when trained on all points"
        if row["refused"]:
            numbers, note = "-", f"refused: {row['refused']}"
        span = "-" if low is None else f"{mnm_cell(low)} to {mnm_cell(high)}"
        cells = (
            mnm_cell(row["held_out_rmse_nm"]),
            span,
            numbers,
            str(row["tried"]),
            str(row["failed"]),
            note,
        )
        rows.append((row["family"], *cells))
    return Table(caption, header, rows)


def _reported(evidence: Evidence) -> str:
    """What the row of the reported model says beside its figures, which are of two curves, as all others'."""
    found = evidence.ladder
    if found is None or not found.symmetric or found.symmetric_rung is None:
        return "reported model"
    return f"reported model, of one curve for both directions: {mnm_cell(found.symmetric_rung.rmse_nm)} mN m"


def support_vectors(family: str, both: list[Learned], motion: str = "rotary") -> Table:
    """Speed, dual coefficient and kind of each support vector of one family."""
    names = [f"{one.direction:+d}" for one in both]
    # one curve of both directions: its vectors are of either, and would stand there twice
    if len(both) > 1 and np.array_equal(both[0].curve.dual_coef, both[1].curve.dual_coef):
        both, names = both[:1], ["both"]
    count = " and ".join(
        f"{len(one.limit)} (direction {name})" for one, name in zip(both, names, strict=True)
    )
    caption = (
        f"Support vectors of {family}: {count}. Bounded: the coefficient is at its limit, the point lies "
        "outside the tube; free: on its edge. The rest of the points say nothing more."
    )
    top = max((float(one.curve.support_vectors.max()) for one in both if len(one.limit)), default=1.0)
    unit, factor = speed_scale(motion, top)
    header = ("direction", f"speed, {unit}", "dual coefficient", "limit", "kind")
    rows = []
    for one, name in zip(both, names, strict=True):
        order = np.argsort(one.curve.support_vectors, kind="stable")
        for i in order:
            kind = "bounded" if one.bounded[i] else "free"
            cells = (f"{one.curve.dual_coef[i]:.6g}", f"{one.limit[i]:.6g}", kind)
            rows.append((name, f"{factor * one.curve.support_vectors[i]:.6g}", *cells))
    return Table(caption, header, rows)


def model(evidence: Evidence) -> Table:
    """What the written model is, per direction."""
    rows = []
    for name, own in model_rows(evidence).items():
        label, values = _label(name), own
        if label.endswith(", rad/s"):
            unit, factor = speed_scale(evidence.points.motion, max(x or 0.0 for x in own))
            label, values = label.replace("rad/s", unit), [None if x is None else factor * x for x in own]
        rows.append((label, *("-" if x is None else f"{x:.4g}" for x in values)))
    caption = (
        f"The written model ({evidence.model.kind}). Compile error: largest difference between learned and "
        "compiled curve at 4001 speeds; its bound is proved for every speed of the trained range."
    )
    return Table(caption, ("figure", "direction +1", "direction -1"), rows)


def model_rows(evidence: Evidence) -> dict[str, list[float | None]]:
    """Figures of both branches; units in the names."""
    branches = evidence.model.branches
    names = list(dict.fromkeys(name for branch in branches for name in branch.hyper_parameters))
    found: dict[str, list[float | None]] = {
        "support_vectors": [float(branch.source.n_support_vectors) for branch in branches],
        **{name: [branch.hyper_parameters.get(name) for branch in branches] for name in names},
    }
    for name in _BRANCH:
        found[name] = [float(getattr(branch, name)) for branch in branches]
    for name in ("test_max_error_nm", "single_max_error_nm"):
        found[name] = [getattr(branch, name) for branch in branches]
    bands = [branch.band for branch in branches]
    found["band_least_nm"] = [None if band is None else min(band.half_width_nm) for band in bands]
    found["band_most_nm"] = [None if band is None else band.widest_nm for band in bands]
    found["place_spread_nm"] = [branch.place_spread_nm for branch in branches]
    for name in ("presliding_rad", "presliding_spread_rad"):
        found[name] = [getattr(evidence.model, name)] * len(branches)
    found["compile_error_nm"] = [compile_error_nm(branch) for branch in branches]
    found["compile_bound_nm"] = [branch.rounding_bound_nm for branch in branches]
    return found


_BRANCH = (
    "speed_max_rad_s",
    "n_points",
    "train_mean_error_nm",
    "train_max_error_nm",
    "validation_rmse_nm",
    "validation_max_error_nm",
    "friction_min_nm",
    "friction_max_nm",
    "viscous_nms_rad",
    "secant_damping_nms_rad",
    "slope_damping_nms_rad",
)


def gains(found: Gains) -> Table:
    """Recommended gain and cap, per axis of the rig file."""
    rows = [
        (
            axis.axis,
            told(axis.gain),
            f"{axis.cap_nm:.4g}",
            f"{axis.margin_nm:+.4g}",
            told(axis.gain_uncapped),
            told(axis.gain_sampled_data),
            f"{axis.margin_at_zero_nm:+.4g}",
        )
        for axis in found.axes
    ]
    header = (
        "axis",
        "gain",
        "cap, N m",
        "margin, N m",
        "gain without the cap",
        "gain, sampled-data test",
        "margin at gain 0, N m",
    )
    caption = (
        f"Recommended compensation with {found.config}: the largest gain, and the cap on the feed-forward, "
        "that pass the two-line test, whatever sign or delay error the feed-forward has. Without the cap "
        "(a force gate then has to exclude sign errors) and by the sampled-data test (whole curve) for "
        "comparison."
    )
    return Table(caption, header, rows)


def mnm_cell(value_nm: float | None) -> str:
    """A torque in N m as mN m: three digits behind the point, three that count of a small joint, a dash for
    None."""
    if value_nm is None:
        return "-"
    small = 0 < abs(value_nm) < SMALL_NM
    return f"{1e3 * value_nm:.3g}" if small else f"{1e3 * value_nm:.3f}"


def _label(name: str) -> str:
    """Turn a name with its unit into words and unit."""
    for suffix, unit in (("_nms_rad", "N m s/rad"), ("_rad_s", "rad/s"), ("_rad", "rad"), ("_nm", "N m")):
        if name.endswith(suffix):
            return f"{name.removesuffix(suffix).replace('_', ' ')}, {unit}"
    return name.replace("_", " ")
