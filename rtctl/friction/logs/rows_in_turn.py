"""Rows that are not one after the other of one axis: two axes or devices in turn, and a slower log brought to
a higher rate by holding its rows."""

from __future__ import annotations

import numpy as np

from rtctl.errors import DataError

AXES_MOST = 8
"""Most axes that are looked for in turn."""

NEARER = 10.0
"""Rows of several axes in turn: a row is so many times nearer to the last one of its axis than to the one
before it (medians)."""

ALIKE = 0.8
"""Share of the runs of equal rows that are of one length where rows were held."""

HELD_MIN = 2
"""Least length of such runs."""


def require_one_axis(where: str, position_rad: np.ndarray) -> None:
    """Refuse a position of several axes in turn.

    Raises
    ------
    DataError
        Says how many, and what to do."""
    moves = [float(np.median(np.abs(position_rad[n:] - position_rad[:-n]))) for n in range(1, AXES_MOST + 1)]
    axes = int(np.argmin(moves)) + 1
    if axes > 1 and moves[axes - 1] * NEARER < moves[0]:
        raise DataError(
            f"{where}: column position: every row goes on from the one {axes} rows before it and not from "
            f"the last: rows of {axes} axes or devices in turn; keep the rows of one (and their stamps), or "
            "export a column for each"
        )


def held(columns: list[np.ndarray]) -> tuple[np.ndarray, int]:
    """Rows that only repeat the row before in every column, where nearly all rows stand equally often: their
    marks (n,), and how often; none and 1 elsewhere."""
    same = np.logical_and.reduce([np.diff(column) == 0 for column in columns])
    repeats = np.concatenate([[False], same])
    lengths = np.diff(np.append(np.flatnonzero(~repeats), len(repeats)))
    times = int(np.median(lengths))
    if times < HELD_MIN or float(np.mean(lengths == times)) < ALIKE:
        return np.zeros(len(repeats), bool), 1
    return repeats, times
