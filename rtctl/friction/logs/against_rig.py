"""What a log says against the figures of its rig: inertia, guaranteed friction, and the steps of the
encoder."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.row_noise import step_of
from rtctl.rounded import down

if TYPE_CHECKING:
    from rtctl.friction.logs.regression import JointFit
    from rtctl.rig_file.axis_tables import AxisTable

INERTIA_FACTOR, INERTIA_SURELY = 1.5, 1.15
"""An inertia further from that of the rig file is worth a word: whatever its interval, and where that leaves
the rig file's out."""

_DEGREE, _GON, _TURN, _INCH, _FOOT = math.pi / 180, math.pi / 200, 2 * math.pi, 0.0254, 0.3048

_LOOKS_AS = {
    "rotary": {
        1 / _DEGREE: "degrees read as rad",
        1 / _GON: "gon read as rad",
        1 / _TURN: "turns read as rad",
        _DEGREE: "rad read as degrees",
        _DEGREE / _GON: "gon read as degrees",
        _GON / _DEGREE: "degrees read as gon",
        _TURN: "rad read as turns",
        _TURN / _DEGREE: "degrees read as turns",
        _DEGREE / _TURN: "turns read as degrees",
    },
    "linear": {
        1 / _INCH: "inches read as m",
        1e-3 / _INCH: "inches read as mm",
        _INCH: "m read as inches",
        1 / _FOOT: "feet read as m",
    },
}
"""Steps of a recorded position against those of the encoder -> the unit that explains them. A whole number of
them is none: counts before quadrature, or of a converter that interpolates."""

SAME_STEP = 1e-3
"""Share within which the two agree: digits of a file are near one of these by chance in one log of two
hundred."""


def against_rig(fit: JointFit, axis: AxisTable, path: Path | str) -> tuple[str, ...]:
    """What the parameters found say about the rig file: an inertia far off, less damping than it promises."""
    found, notes = fit.symmetric.parameters, []
    inertia, viscous = found["inertia_kgm2"], found["viscous_nms_rad"]
    ratio = inertia.value / axis.inertia_kgm2
    far = max(ratio, 1 / ratio) if ratio > 0 else np.inf
    if far > INERTIA_FACTOR or (far > INERTIA_SURELY and not inertia.holds(axis.inertia_kgm2)):
        notes.append(
            f"{path}: inertia_kgm2 = {axis.inertia_kgm2:g}, the log says {inertia.value:.3g}: a unit or a "
            "scale of the log (torque, torque constant, gear ratio, position, time) or the rig file is "
            "wrong"
        )
    if viscous.high <= 0.0:
        notes.append(
            f"friction falls with speed in this log ({viscous.low:.3g} to {viscous.high:.3g} N m s/rad): "
            "its motion is on the flank of a Stribeck peak, and tells neither viscous friction nor whether "
            "viscous_nms_rad is kept; record faster motion besides"
        )
    elif viscous.high < axis.viscous_nms_rad:
        notes.append(
            f"{path}: viscous_nms_rad = {axis.viscous_nms_rad:g} promises more damping than the log shows "
            f"(at most {down(viscous.high)}); the stability proof rests on it: lower it"
        )
    coulomb = found["coulomb_nm"]
    if coulomb.high < axis.dry_friction_nm:
        notes.append(
            f"{path}: dry_friction_nm = {axis.dry_friction_nm:g} promises more dry friction than the log "
            f"shows (at most {down(coulomb.high)} N m): lower it, or a dead band or a scale of the torque "
            "makes that of the log too small"
        )
    return tuple(notes)


def against_encoder(logs: Sequence[Sequence[AxisLog]], counts_per_rev: float, motion: str) -> tuple[str, ...]:
    """The warning that positions of logs (stretches of each) go by steps of the encoder in another unit.

    `counts_per_rev` are counts of 2 pi of the coordinate, 1 where nobody gave them; `motion` is "rotary" or
    "linear"."""
    if counts_per_rev == 1.0:
        return ()
    own, told = 2 * math.pi / counts_per_rev, []
    for log in (one for stretches in logs for one in stretches):
        ratio = step_of(log) / own
        for factor, cause in _LOOKS_AS[motion].items():
            # 360 degrees of a turn are a whole number, as counts are
            if abs(ratio / factor - 1) < SAME_STEP:
                told.append(
                    f"{log.source}: column position: its steps are {ratio:.5g} times those of the encoder "
                    f"({own:.4g} rad), as of {cause}: correct its unit, or the counts a turn"
                )
    return tuple(dict.fromkeys(told))
