"""The facts that stand in a recording as texts, checked before anything is built on them."""

from __future__ import annotations

import math
from collections.abc import Mapping

from hw.outside import json_of, shown
from rtctl.tick import MOST_AXES

MOST_DIGITS = 18
"""Most digits of a whole number: it is then below 2^63."""

# a tick of 1 us to 10 s: rig files have 50 us to 10 ms; 2^62 ns is in 2116, and its sum with the time of a
# loop stays below 2^63
_WHOLE = {"n_axes": (1, MOST_AXES), "period_ns": (1_000, 10**10), "start_wall_ns": (0, 2**62),
    "began_wall_ns": (0, 2**62)}  # fmt: skip
"""Key -> bounds of a whole number. Beyond them nothing that is built on it makes sense."""

_DEFAULTS = {"session": "0", "first_row": "0", "period_ns": "1000000", "start_wall_ns": "0"}
"""In place of a fact that is damaged; what it stands for is then not exact, and said so."""


def sound(told: Mapping[str, str], n_axes: int) -> tuple[dict[str, str], list[str]]:
    """Facts that can be relied on, and notes of what was put in place of a damaged one.

    Parameters
    ----------
    told
        As they stand in the file; empty where they are lost.
    n_axes
        By the ticks themselves, 0: not known.

    Returns
    -------
    about
        Empty where nothing says that this is a recording.
    notes
        One line for each fact replaced."""
    about, notes = dict(told), []
    if not _whole(about.get("n_axes", ""), _WHOLE["n_axes"]):
        # neither facts nor ticks say what this file is
        if not 1 <= n_axes <= MOST_AXES:
            return {}, []
        notes.append(f"n_axes is {shown(about.get('n_axes', 'missing'))}; the ticks have {n_axes} axes")
        about["n_axes"] = str(n_axes)
    for name, default in _DEFAULTS.items():
        bounds = _WHOLE.get(name, (0, 2**62))
        if not _whole(about.get(name, ""), bounds):
            notes.append(f"{name} is {shown(about.get(name, 'missing'))}; {default} is taken in its place")
            about[name] = default
    # both say the same; the period is what times are made of
    if not _is_rate(about.get("rate_hz", "")):
        about["rate_hz"] = repr(1e9 / int(about["period_ns"]))
        notes.append(f"rate_hz is no rate; {about['rate_hz']} is taken in its place")
    if "motion" in about and not _are_motions(texts(about, "motion"), int(about["n_axes"])):
        # units would be guessed otherwise: said, as whoever reads it may know better
        notes.append(f"motion is {shown(about['motion'])}; rotary axes are taken in its place")
        del about["motion"]
    # without a note: it is in the names of files alone
    if "began_wall_ns" in about and not _whole(about["began_wall_ns"], _WHOLE["began_wall_ns"]):
        del about["began_wall_ns"]
    return about, notes


def axis_names(about: Mapping[str, str]) -> list[str]:
    """Names of the axes; numbers where they are damaged."""
    names = texts(about, "axes")
    n_axes = int(about["n_axes"])
    return names if len(names) == n_axes else [str(k) for k in range(n_axes)]


def texts(about: Mapping[str, str], name: str) -> list[str]:
    """A fact that is a JSON list of texts; empty where it is anything else."""
    try:
        found = json_of(about.get(name, "[]"))
    except ValueError:
        return []
    return [shown(item) for item in found] if isinstance(found, list) else []


def _whole(text: str, bounds: tuple[int, int]) -> bool:
    low, high = bounds
    # a nineteenth digit: 2^62 has it
    return text.isascii() and text.isdecimal() and len(text) <= MOST_DIGITS + 1 and low <= int(text) <= high


def _are_motions(found: list[str], n_axes: int) -> bool:
    return len(found) == n_axes and set(found) <= {"rotary", "linear"}


def _is_rate(text: str) -> bool:
    try:
        return 1e-3 <= float(text) <= 1e6 and math.isfinite(float(text))
    except ValueError:
        return False
