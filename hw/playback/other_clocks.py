"""What else a table says of its time: a rate or a step above the header, and a clock of the wall, or seconds
since 1970, beside the rows.

A time that is another one by a factor changes the inertia by its square, and nothing in a balance of torques
tells it; two clocks in one file do."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hw.interface import Options
from hw.playback.cells import number, read_words
from hw.playback.stamps import resolution
from hw.playback.text_rows import cells_of, some_lines

APART, DECIMATED = 0.02, 0.5
"""Share by which two clocks must differ to be told; a step of half or twice the other one is of rows that a
logger left out, and no clock."""

SURELY = 3.0
"""Steps of the coarser clock, over all of the log, by which they must differ."""

EPOCH_S = (9.4e8, 2.3e9)
"""Seconds since 1970 of the years from 1999 to 2042."""

_WORD = r"(?:sampl(?:e|es|ing)?|scan|acquisition|logg?ing|logger|record(?:ing)?|data|abtast|mess)"
_RATE = rf"(?:{_WORD}[ _-]?(?:rate|freq(?:uency)?|frequenz)|fs|f_s)"
_STEP = (
    rf"(?:{_WORD}[ _-]?(?:interval|period|periode|time|step|zeit|intervall)"
    r"|delta[ _]?[tx]|dt|(?:x[ _]?)?increment)"
)
_SAID = re.compile(
    rf"\W*(?:(?P<rate>{_RATE})|(?P<step>{_STEP}))\s*(?:[\[(]\s*(?P<of>[^\])]*)[\])])?\W*?[\s=:,;|\"]\W*?"
    r"(?P<value>\d*[.,]?\d+(?:[eE][-+]?\d+)?)(?:\W*(?P<unit>[^\W\d][\w/]*))?",
    re.IGNORECASE,
)

_UNITS = {
    "rate": {"": 1.0, "hz": 1.0, "khz": 1e3, "mhz": 1e6, "s/s": 1.0, "sps": 1.0, "1/s": 1.0},
    "step": {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "\u00b5s": 1e-6, "ns": 1e-9},
}


@dataclass(frozen=True)
class Clock:
    """Another word of a table on its time: where it stands, and s from row to row, or from the first to the
    last row with the step of that clock."""

    where: str
    step_s: float = 0.0
    lasted_s: float = 0.0
    coarse_s: float = 0.0


def above(
    lines: Sequence[str], names: Sequence[str] = (), settings: Sequence[Sequence[str]] = ()
) -> tuple[Clock, ...]:
    """The step that the lines above a header say, or rows of settings below its names, where it is one."""
    found = {}
    below = [f"{name}: {cell}" for row in settings for name, cell in zip(names, row, strict=False)]
    for line in (*lines, *below):
        match = _SAID.match(line)
        if match is None or re.fullmatch(r"\d{1,3},\d{3}", match["value"]):  # a thousand, or one
            continue
        kind = "rate" if match["rate"] else "step"
        factor = _UNITS[kind].get((match["of"] or match["unit"] or "").strip().lower())
        value = float(match["value"].replace(",", ".")) * (factor or 0.0)
        if value > 0:
            found[1 / value if kind == "rate" else value] = line.strip()[:60]
    return (
        tuple(Clock(f"the line {line!r}", step_s) for step_s, line in found.items())
        if len(found) == 1
        else ()
    )


def beside(
    names: Sequence[str], body: Sequence[str], delimiter: str | None, wanted: Collection[int], marks: str
) -> tuple[Clock, ...]:
    """Columns that nobody wanted with dates, times of day or seconds since 1970."""
    lines = [*some_lines(body), body[-1]]
    rows = [cells_of(line, delimiter) for line in lines]
    found = []
    for k, name in enumerate(names):
        cells = [row[k] for row in rows if k < len(row)]
        if k in wanted or len(cells) < len(rows):
            continue
        stamps = _seconds(cells, marks)
        if stamps is not None and stamps[-1] > stamps[0] and (np.diff(stamps) >= 0).all():
            lasted_s = float(stamps[-1] - stamps[0])
            found.append(Clock(f"column {name!r}", 0.0, lasted_s, resolution(stamps)))
    return tuple(found)


def _seconds(cells: Sequence[str], marks: str) -> np.ndarray | None:
    numbers = [number(cell, marks) for cell in cells]
    if None not in numbers:
        stamps = np.array(numbers, float)
        for scale in (1.0, 1e-3, 1e-6, 1e-9):
            if EPOCH_S[0] < scale * stamps.min() and scale * stamps.max() < EPOCH_S[1]:
                return scale * stamps
        return None
    if not all(":" in cell for cell in cells):  # `0.5 s` is a number with a unit, and no time of day
        return None
    words = read_words(cells, marks)
    return None if words is None else words.numbers


def told(path: Path, options: Options, time_s: np.ndarray | None, clocks: Sequence[Clock]) -> tuple[str, ...]:
    """Warnings that the time of the rows (n,), or the rate in the options, is not that of another clock of
    the file."""
    notes = []
    for clock in clocks:
        if time_s is None:
            name, step_s, lasted_s = "the rate that is given", 1 / float(options["rate_hz"]), 0.0
        else:
            name, step_s = f"column {options['time']['column']!r}", float(np.median(np.diff(time_s)))
            lasted_s = float(time_s[-1] - time_s[0])
        mine, other = (step_s, clock.step_s) if clock.step_s else (lasted_s, clock.lasted_s)
        times = other / mine if mine > 0 else 1.0
        unsure = SURELY * clock.coarse_s / max(clock.lasted_s, 1e-300)
        if DECIMATED < times < 1 / DECIMATED and abs(times - 1) > max(APART, unsure):
            what = "the rows are {:.6g} s apart" if clock.step_s else "the log lasts {:.6g} s"
            notes.append(
                f"{path}: by {clock.where} {what.format(other)}, by {name} {mine:.6g} s: one of the two is "
                f"wrong, and by the other one the inertia would be {times**2:.3g} times as large, viscous "
                f"friction {times:.3g} times; give the right time (the scale of its column, or --rate-hz)"
            )
    return tuple(notes)
