"""A torque of whole steps (percent of a rated one, a converter's): rounded, or cut off towards zero.

A drive that makes a whole number of its torque by cutting off its digits, as C does, tells every torque too
small by half a step on average, and so the friction; rounding to the nearest or the next lower step does not,
but for a zero. The two differ where the torque brakes: there a cut torque opposes the friction by too little,
too. So half a step times the sign of the torque is one more column: 1 of it is missing of a cut torque, none
of a rounded one."""

from __future__ import annotations

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.logs.balance_faults import TOLD_CHANGE
from rtctl.friction.logs.least_squares import Columns, solve
from rtctl.friction.logs.offsets import OffsetColumns
from rtctl.friction.logs.regressors import Regressors

HALF = 0.5
"""What parts one of that column from none."""


def of_whole_steps(
    signals: Regressors, columns: Columns, offset: OffsetColumns, coulomb_nm: float
) -> tuple[np.ndarray, tuple[str, ...]]:
    """By how much inertia, viscous and Coulomb friction, (3,), may be wrong since nobody knows how the torque
    was made whole, and the warning where that is much of the Coulomb friction."""
    half_nm, rows = 0.5 * signals.torque_step_nm, signals.sliding
    if not half_nm:
        return np.zeros(3), ()
    missing = half_nm * np.sign(signals.torque_nm)
    try:
        found = solve(signals, {**columns, "cut": missing}, offset, offset.drift).parameters["cut"]
    except DataError:  # no row in which the torque brakes
        found = None
    # 0 as well: an interval that leaves both out is of friction of another law, and tells neither
    if found is not None and found.holds(0.0) and found.low > -HALF and found.high < HALF:
        return np.zeros(3), ()  # rounded, surely
    matrix = np.column_stack([*columns.values(), offset.drift])[rows]
    moved = np.abs(np.linalg.lstsq(matrix, missing[rows], rcond=1e-9)[0][:3])
    if half_nm <= TOLD_CHANGE * coulomb_nm:
        return moved, ()
    return moved, (
        f"{signals.source}: the torque is of whole steps of {signals.torque_step_nm:.3g} N m: if its digits "
        "were cut off and not rounded, which this log does not tell, all of the torque is too small by half "
        f"a step, {100 * half_nm / coulomb_nm:.0f} % of the Coulomb friction; record more digits, or add "
        "half a step to what is not 0",
    )
