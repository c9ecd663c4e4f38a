"""Columns of a binary file that were saved as text: what stands in them is read as in a text table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hw.interface import BackendError
from hw.playback.cells import marks_of, number, read_cells
from hw.playback.text_table import Table


def spelt_out(path: Path, whole: Table, names: tuple[str, ...], decimal: str | None) -> Table:
    """The table with numbers for the wanted columns of text: decimal commas and marks between thousands,
    numbers with a unit behind each, times of day.

    Raises
    ------
    BackendError
        A wanted column of other words."""
    arrays = {name: np.asarray(whole.columns[name]).ravel() for name in names if name in whole.columns}
    texts = {
        name: [str(cell).strip() for cell in array]
        for name, array in arrays.items()
        if array.size and isinstance(array[0], str)
    }
    marks = marks_of(list(texts.values()), decimal, [cell for column in texts.values() for cell in column])
    columns, units = dict(whole.columns), dict(whole.units)
    for name, cells in texts.items():
        words = read_cells(cells, marks)
        if words is None:
            row = next((row for row, cell in enumerate(cells) if number(cell, marks) is None), 0)
            raise BackendError(
                f"{path}: {name!r} is text, and {cells[row][:40]!r} in row {row + 1} is not a number; save "
                "it as numbers, without the rows in which nothing was measured, or map another column"
            )
        columns[name] = words.numbers
        units |= {name: words.unit} if words.unit else {}
    return Table(columns, units, whole.step_s)
