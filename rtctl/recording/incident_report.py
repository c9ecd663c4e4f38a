"""An incident in words and numbers. Pure."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from hw.motion import name as own_name
from hw.motion import unit as own_unit
from rtctl.control.vocabulary import State
from rtctl.recording.incident import Incident
from rtctl.wire.fault_words import sentence

COLUMNS = (
    ("position_rad", "rad"),
    ("velocity_rad_s", "rad/s"),
    ("hand_torque_nm", "N m"),
    ("torque_wanted_nm", "N m"),
    ("torque_applied_nm", "N m"),
    ("current_a", "A"),
)
# denser towards the transition, where a tick counts
AROUND = (-200, -100, -50, -20, -10, -5, -4, -3, -2, -1, 0, 1, 2, 3, 5, 10, 20, 50)
"""Rows of the table, relative to the transition."""


def trigger_row(incident: Incident) -> int:
    """Row of the transition; the last one when the run ended without any."""
    if len(incident.ticks) == 0:
        return 0
    found = np.flatnonzero(incident.ticks["tick"] == incident.trigger["tick"])
    # a loop that died has no tick of its end
    return int(found[0]) if len(found) else len(incident.ticks) - 1


def summary(incident: Incident) -> list[str]:
    """Lines: what, when, why, and the signals around it, one block per axis."""
    trigger, about, ticks = incident.trigger, incident.about, incident.ticks
    when = datetime.fromtimestamp(trigger["timestamp"], UTC)
    what = f"{trigger['from']} -> {trigger['to']}" if "to" in trigger else "the run ended"
    texts = {event["name"]: sentence(event) for event in incident.events if event["event"] == "fault"}
    cause = trigger.get("cause") or "unknown"
    lines = [
        f"{about.get('rig', '?')}: {what}, cause {cause}",
        *([f"  {texts[cause]}"] if cause in texts else []),
        f"  {when:%Y-%m-%d %H:%M:%S.%f} UTC, monotonic {trigger['monotonic_s']:.6f} s, tick "
        f"{trigger['tick']}, rtctl {about.get('version', '?')}, config {about.get('config_sha256', '')[:12]}",
        f"  {len(ticks)} ticks kept" + _gaps(ticks),
    ]
    motions = motions_of(incident)
    for name, values in extremes(incident).items():
        for motion in dict.fromkeys(motions):
            own = [value for value, of in zip(values, motions, strict=False) if of == motion]
            lines.append(f"  largest |{own_name(name, motion)}| {max(own):.6g}" if own else "")
    for axis, label in enumerate(about.get("axes", range(_axes(ticks)))):
        lines += ["", *_table(incident, axis, str(label), motions[axis])]
    return lines


def motions_of(incident: Incident) -> list[str]:
    """Motion of each axis; incidents that do not say are of rotary ones."""
    return list(incident.about.get("motion", ["rotary"] * _axes(incident.ticks)))


def extremes(incident: Incident) -> dict[str, list[float]]:
    """Largest magnitude over the window of the signals of the table, per axis; not-finite values left out."""
    found: dict[str, list[float]] = {}
    for name, _ in COLUMNS:
        values = np.abs(incident.ticks[name])
        # a sensor that is not there shows NaN, and would be the largest of all
        values = np.where(np.isfinite(values), values, 0.0)
        found[name] = values.max(axis=0).tolist() if len(values) else []
    return found


def _axes(ticks: np.ndarray) -> int:
    return int(ticks["position_rad"].shape[1])


def _gaps(ticks: np.ndarray) -> str:
    missed = int((np.diff(ticks["tick"]) - 1).sum()) if len(ticks) > 1 else 0
    return f", {missed} slots missed by the loop among them" if missed else ""


def _table(incident: Incident, axis: int, label: str, motion: str) -> list[str]:
    ticks, zero = incident.ticks, trigger_row(incident)
    head = f"{label:<8}{'state':>10}{'faults':>8}" + "".join(
        f"{own_name(name, motion):>19}" for name, _ in COLUMNS
    )
    units = f"{'':<26}" + "".join(f"{own_unit(unit, motion):>19}" for _, unit in COLUMNS)
    shown = (offset for offset in AROUND if 0 <= zero + offset < len(ticks))
    return [head, units, *(_row(ticks[zero + offset], offset, axis) for offset in shown)]


def _row(tick: np.void, offset: int, axis: int) -> str:
    numbers = "".join(f"{tick[name][axis]:>19.6g}" for name, _ in COLUMNS)
    return f"{offset:<+8d}{State(int(tick['state'])).name:>10}{int(tick['faults']):>8x}{numbers}"
