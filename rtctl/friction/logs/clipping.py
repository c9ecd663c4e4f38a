"""Whether a torque was cut off by its sensor or drive: it stays at its largest value although the balance
wants more there.

A torque may stay at one value for honest reasons: a joint that accelerates evenly, or slides at one speed,
wants one. So equal values are no fault by themselves: the balance, fitted where the torque is smaller, must
contradict them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.logs.balance import Balance
from rtctl.friction.logs.dynamics import Plateau
from rtctl.friction.logs.intervals import covariance, time_blocks
from rtctl.friction.logs.torque_faults import LEVELS_MIN, longest_run

# equal values are no fault by themselves: an even acceleration wants an even torque (decision 0063)
RUN = 20
"""As many equal extreme values in a row may be a signal that was cut off, unless it has few levels anyway."""

TOP_SHARE = 0.8
"""Torques below this share of the largest are not clipped."""

BEYOND_TOP, BEYOND_ROWS = 1.1, 0.01
"""Without equal values, clipped is a torque that the motion wants further than its largest value by this
factor, in this share of the rows."""

FLAT_SLOPE = 0.5
"""Slope of the recorded torque against the wanted one, near the largest value: 1 where it is not clipped."""

AT_TOP, AT_LEVEL = 0.9, 0.98
"""Share of the largest torque from which on a row is one of the largest, and one of a run of equal values."""

SHORT, SHORT_AT_LEVEL = 0.06, 0.02
"""Least share of the largest torque that is missing on these rows, on average."""

SURELY = 3.0
"""Standard errors of what is wanted by which it must be missing."""

BETTER = 0.85
"""Largest share of what the balance leaves over, RMS, that is left when what is wanted ends at the largest
and the smallest torque."""

FAR_BETTER = 0.3
"""The same from which on it is clipped although what is wanted there is hardly known."""

ROWS_LEAST, BELOW_LEAST = 60, 0.15
"""Fewest rows, and least share of them, that say what is wanted."""


class ClippedError(DataError):
    """A torque that was cut off."""


def plateaus(signal: np.ndarray, where: str) -> tuple[Plateau, ...]:
    """Runs of equal largest or smallest values of a torque (N m) that otherwise changes from row to row."""
    if len(np.unique(signal)) < LEVELS_MIN:
        return ()  # a coarse or resting signal repeats its extremes by nature
    # how long a value stands that is no extreme: what the column does anyway
    between = (signal > signal.min()) & (signal < signal.max())
    held = longest_run((np.diff(signal) == 0) & between[1:])[1]
    # as long everywhere: a torque of a slower bus
    found = []
    for side, extreme in ((1.0, signal.max()), (-1.0, signal.min())):
        begin, length = longest_run(signal == extreme)
        if length >= RUN and held < length - 1:
            found.append(Plateau(where, float(extreme), side, begin + 1, length))
    return tuple(found)


@dataclass(frozen=True)
class _Top:
    """What the balance says of the largest torques of a column on one side: shares of the largest, but
    `slope` and `better`."""

    level_nm: float
    wanted_nm: float
    short: float
    error: float
    beyond: float
    slope: float
    scatter: float
    better: float
    judged: bool = True
    """Whether there are rows enough with a smaller torque."""


def require_unclipped(balance: Balance, seen: Sequence[tuple[int, Plateau]], source: str) -> None:
    """Refuse a torque that stays near its largest values although the motion wants more: clipped, whatever
    noise is on top.

    Parameters
    ----------
    seen
        Runs of equal extreme values, each with the number of its log.

    Raises
    ------
    ClippedError
        Names the column, where it ends and how far it was wanted.

    Notes
    -----
    The balance is fitted on rows below `TOP_SHARE` of the largest torque. Rows of the largest are chosen by
    what was recorded: noise of it is selected upwards, which looks like the contrary of a torque that was cut
    off."""
    for log, plateau in seen:
        found = _of_plateau(balance, log, plateau)
        # hardly any smaller torque: all of the log is at its limit, and nothing says what was wanted
        if found is not None and (not found.judged or _contradicted(found, SHORT_AT_LEVEL)):
            wants = (
                f"wants {found.wanted_nm:.3g} N m there on average"
                if found.judged
                else "hardly has a smaller torque"
            )
            raise ClippedError(
                f"{plateau.where}: clipped at {plateau.level_nm:.4g} N m for {plateau.rows} samples from "
                f"row {plateau.row} on: the motion {wants}; raise the range of the sensor, or move less "
                "briskly"
            )
    for name, column in columns(balance).items():
        for side in (1.0, -1.0):
            found = _at_top(balance, column, side)
            if found is not None and found.judged and _contradicted(found, SHORT) and _is_flat(found):
                raise ClippedError(
                    f"{source}: {name}: looks clipped at about {found.level_nm:.3g} N m: the motion wants "
                    f"{found.wanted_nm:.3g} N m on average where it stays there; raise the range of the "
                    "sensor or the limit of the drive, or move less briskly"
                )


def columns(balance: Balance) -> dict[str, np.ndarray]:
    """The torques that are mapped, by their name in a message."""
    if balance.external is None:
        return {"torque": balance.torque}
    return {"motor torque": balance.torque - balance.external, "external torque": balance.external}


def _contradicted(found: _Top, least: float) -> bool:
    surely = found.short > SURELY * found.error or found.better < FAR_BETTER
    return surely and found.short > least and found.better < BETTER


def _is_flat(found: _Top) -> bool:
    return found.beyond > BEYOND_ROWS and found.slope < FLAT_SLOPE and found.scatter < 1 - TOP_SHARE


def _of_plateau(balance: Balance, log: int, plateau: Plateau) -> _Top | None:
    named = columns(balance)
    column = next(iter(named.values())) if len(named) == 1 else named[plateau.where.rsplit(": ", 1)[-1]]
    # about the middle: a sensor's zero would make one side of an even range the larger one
    middle = float(np.median(column))
    signal = plateau.side * (column - middle)
    top = plateau.side * (plateau.level_nm - middle)
    return _compared(balance, column, plateau.side, (signal > AT_LEVEL * top) & (balance.log == log), top)


def _at_top(balance: Balance, column: np.ndarray, side: float) -> _Top | None:
    signal = side * (column - float(np.median(column)))
    # noise on a torque that was cut off goes beyond its limit in a few rows
    top = float(np.quantile(signal, 0.995))
    return _compared(balance, column, side, signal > AT_TOP * top, top)


def _compared(
    balance: Balance, column: np.ndarray, side: float, at_top: np.ndarray, top: float
) -> _Top | None:
    """What the rows `at_top` lack of what is wanted there by all rows with a smaller torque; None where
    hardly any row is at the top."""
    others, middle = balance.torque - column, float(np.median(column))
    signal = side * (column - middle)
    # rows near the top would teach the balance that it ends there
    below = np.abs(signal) < TOP_SHARE * top
    if at_top.sum() < RUN:
        return None
    if top <= 0 or below.sum() < max(ROWS_LEAST, BELOW_LEAST * len(below)):
        return _Top(
            level_nm=side * top + middle, wanted_nm=math.nan, short=0.0, error=math.inf, beyond=0.0,
            slope=1.0, scatter=1.0, better=1.0, judged=False
        )  # fmt: skip
    matrix = np.hstack([balance.motion, balance.nuisance])
    found = np.linalg.lstsq(matrix[below], balance.torque[below], rcond=1e-9)[0]
    wanted = side * (matrix @ found - others - middle)
    rest = balance.torque - matrix @ found
    # numbered anew: a block of which no row is left would count as one that has no error
    blocks = np.unique(time_blocks(balance.signals)[below], return_inverse=True)[1]
    # no slow columns taken off: the drift is one of the columns here
    spread = covariance(matrix[below], rest[below], blocks, 0)
    mean = matrix[at_top].mean(axis=0)
    beyond = wanted > BEYOND_TOP * top
    # by what is wanted: rows chosen by the record would be those whose noise points up
    near = wanted > AT_TOP * top
    slope = float(np.polyfit(wanted[near], signal[near], 1)[0]) if near.sum() > RUN else 1.0
    bottom = float(np.quantile(signal, 0.005))
    # all rows and both ends, so that a fit of small torques that went wrong elsewhere does not pass for
    # clipping
    cut = float(np.sqrt(np.mean((signal - np.clip(wanted, bottom, top)) ** 2)))
    return _Top(
        level_nm=side * top + middle,
        wanted_nm=side * float(wanted[at_top].mean()) + middle,
        short=float((wanted - signal)[at_top].mean()) / top,
        error=float(np.sqrt(max(0.0, mean @ spread @ mean))) / top,
        beyond=float(beyond.mean()) if beyond.sum() >= RUN else 0.0,
        slope=slope,
        scatter=float(np.std(rest[below])) / top,
        better=cut / max(balance.fit().rest, 1e-300),
    )
