"""Rotary and linear axes: the one table of their units, from which everything takes its own that a person
reads or writes.

Inside, every axis has generalised coordinates under the names of a rotary one: of a linear axis `_rad` is m,
`_nm` N and `_kgm2` kg, so that power is force times velocity as it is torque times angular velocity
(docs/decisions/0034)."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping
from decimal import Decimal
from typing import Any, Literal

Motion = Literal["rotary", "linear"]

LINEAR_UNITS = {
    "N m s/rad": "N s/m",
    "N m/rad^2": "N/m^2",
    "N m/rad": "N/m",
    "N m/s": "N/s",
    "mN m": "mN",
    "N m": "N",
    "1/(N m)": "1/N",
    "kg m^2": "kg",
    "rad/s^2": "m/s^2",
    "mrad/s": "mm/s",
    "rad/s": "m/s",
    "mrad": "mm",
    "rad": "m",
}
"""Unit of a rotary axis -> the same of a linear one, the longest first; every other unit is that of both."""

LINEAR_ENDINGS = {
    "nms_rad": "ns_m",
    "nm_rad2": "n_m2",
    "nm_rad": "n_m",
    "nm_s": "n_s",
    "rad_s2": "m_s2",
    "rad_s": "m_s",
    "kgm2": "kg",
    "nm": "n",
    "rad": "m",
    "rad_s3": "m_s3",
}
"""Ending of a name that carries its unit, of a rotary axis -> of a linear one, the longest first."""

HANDLE_M = 0.1
"""Where a number that was chosen for a joint is chosen for no axis in particular, a linear one has it as it
is at a handle so far from the joint: .01 rad is 1 mm, .05 N m is .5 N, a hand of .02 kg m^2 is one of 2
kg."""

_AT_HANDLE = {
    "nms_rad": HANDLE_M**-2,
    "nm_rad": HANDLE_M**-2,
    "kgm2": HANDLE_M**-2,
    "nm_s": 1 / HANDLE_M,
    "nm": 1 / HANDLE_M,
    "rad_s2": HANDLE_M,
    "rad_s": HANDLE_M,
    "rad": HANDLE_M,
}
"""Ending of a name that carries its unit -> factor of its number, the longest first."""

LENGTH_UNITS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
SPEED_UNITS = {"m/s": 1.0, "mm/s": 1e-3}
FORCE_UNITS = {"N": 1.0, "mN": 1e-3, "kN": 1e3}

# not within a longer unit (rad of `rad/s^3`), a name, a path or quotes: those are not of this axis
_WORDS = re.compile(
    r"(?<![\w/^'])(" + "|".join(re.escape(one) for one in LINEAR_UNITS) + r")(?![\w/^]| s/rad)"
)

_NAMES = re.compile(r"(?<![\w/^'-])[a-z][a-z0-9]*(?:_[a-z0-9]+)+(?![\w/.-]*[/.]\w)(?!\w)")
"""Names with their unit, not those that are part of a path, nor those in quotes: they are somebody's own."""


_TORQUE = re.compile(r"(?<![\w'./=-])([Tt])orque(s?)(?![\w'=-]|s? constant|s? on (?:the|its) screw)(?!\.\w)")
"""The word, where it is no name of a column, option or key, nor of a motor's or a screw's torque."""

SMALL_M_S = 0.1
"""Speeds below this are told in mm/s."""

_SPEEDS = re.compile(
    r"(?<![\w.])(?:(?P<low>\d[\d.]*(?:e[+-]?\d+)?)(?P<to> to ))?"
    r"(?P<high>\d[\d.]*(?:e[+-]?\d+)?) m/s(?![\w/^])"
)
"""One speed, or two of a range."""


def speed_scale(motion: str, largest: float) -> tuple[str, float]:
    """Unit in which a person reads speeds of up to `largest`, and what they are multiplied by: mm/s of a slow
    linear axis."""
    if motion == "linear" and abs(largest) < SMALL_M_S:
        return "mm/s", 1e3
    return unit("rad/s", motion), 1.0


def _in_mm_s(found: re.Match[str]) -> str:
    """The same speeds in mm/s, digit by digit, where the larger one is small."""
    low, high = found["low"], found["high"]
    # decimal, not float: the digits that were written stay, .010 m/s is 10 mm/s and .0101 10.1
    if not 0 < Decimal(high) < Decimal(str(SMALL_M_S)):
        return found[0]
    return f"{_thousandfold(low) + found['to'] if low else ''}{_thousandfold(high)} mm/s"


def _thousandfold(text: str) -> str:
    return f"{Decimal(text).scaleb(3):f}"


def of_units(units: Iterable[object]) -> Motion:
    """Motion that the units of some columns are of: linear where one is of a length, a speed or a force."""
    return "linear" if {*LENGTH_UNITS, *SPEED_UNITS, *FORCE_UNITS} & set(units) else "rotary"


def of_axes(axes: Iterable[Mapping[str, Any]]) -> Motion:
    """Motion in which a rig as a whole is told of, by the `motion` of its axes (as `hello` has them): linear
    where all of them are."""
    return "linear" if all(axis.get("motion") == "linear" for axis in axes) else "rotary"


def unit(rotary: str, motion: str) -> str:
    """Unit of an axis, by that of a rotary one."""
    return LINEAR_UNITS.get(rotary, rotary) if motion == "linear" else rotary


def words(text: str, motion: str) -> str:
    """A text about one axis, written for a rotary one, with the units of this one, the names of keys and
    columns that end with them, and forces for torques.

    A speed below `SMALL_M_S` is told in mm/s, with the digits that it has."""
    if motion != "linear":
        return text
    # units first: `N m` of a torque would no longer be found behind `force`
    own = _WORDS.sub(lambda found: LINEAR_UNITS[found[0]], text)
    own = _TORQUE.sub(lambda found: f"{'F' if found[1] == 'T' else 'f'}orce{found[2]}", own)
    own = own.replace("joint angle", "position")
    return _SPEEDS.sub(_in_mm_s, _NAMES.sub(lambda found: name(found[0], motion), own))


def name(rotary: str, motion: str) -> str:
    """Name of a key or column for people, whose ending says its unit, by that of a rotary axis."""
    if motion == "linear":
        for ending, own in LINEAR_ENDINGS.items():
            # the longest first: `nm_rad` ends with `rad`, too
            if rotary == ending or rotary.endswith(f"_{ending}"):
                return rotary[: len(rotary) - len(ending)] + own
    return rotary


def at_handle(rotary: str) -> float:
    """Factor of a number chosen for a rotary axis, by its name there, to what it is at a handle `HANDLE_M`
    from the joint."""
    return next((by for ending, by in _AT_HANDLE.items() if rotary.endswith(f"_{ending}")), 1.0)


def own_size(rotary: str, number: float, motion: str) -> float:
    """A number chosen for a rotary axis, by its name there, on an axis of this motion: a linear one has it as
    it is at a handle."""
    return number * at_handle(rotary) if motion == "linear" else number


def named(document: object, motion: str) -> object:
    """A document of plain values whose keys end with their units, with the keys of this motion."""
    if isinstance(document, Mapping):
        return {name(str(key), motion): named(value, motion) for key, value in document.items()}
    if isinstance(document, list | tuple):
        return [named(value, motion) for value in document]
    return document


def rotary_named(document: object, motion: str, known: Collection[str]) -> object:
    """A document that `named` wrote, with the names that it had before: those of `known`."""
    if isinstance(document, Mapping):
        return {
            rotary_name(str(key), motion, known): rotary_named(value, motion, known)
            for key, value in document.items()
        }
    if isinstance(document, list | tuple):
        return [rotary_named(value, motion, known) for value in document]
    return document


def rotary_name(own: str, motion: str, known: Iterable[str]) -> str:
    """The one of the `known` names that `own` stands for on an axis of this motion; `own` itself where there
    is none."""
    return {name(one, motion): one for one in known}.get(own, own)


def of_coordinate(motion: str, lead_m: float) -> tuple[float, float]:
    """Factors of a gear ratio and of encoder counts to those of the coordinate.

    A screw turns 2 pi / lead rad a m. Without a lead the motor pulls itself, its constant is in N/A, and the
    counts are of a metre."""
    if motion != "linear":
        return 1.0, 1.0
    # counts are of 2 pi of the coordinate: of 2 pi m, where a turn is of 2 pi rad
    return 2 * math.pi / lead_m if lead_m else 1.0, 2 * math.pi / (lead_m or 1.0)


def coordinate_units(
    rotary: Mapping[str, float], own: Mapping[str, float], motion: str, lead_m: float
) -> dict[str, float]:
    """Units of position or velocity of an axis, factors to its coordinate (rad, or m): with a lead (m a
    turn), those of its screw too."""
    if motion != "linear":
        return dict(rotary)
    turned = {text: factor * lead_m / (2 * math.pi) for text, factor in rotary.items()} if lead_m else {}
    return {**own, **turned}


def effort_units(rotary: Mapping[str, float], motion: str, lead_m: float) -> dict[str, float]:
    """Units of the torque or force on an axis, factors to its effort (N m, or N): with a lead, a torque on
    its screw too."""
    if motion != "linear":
        return dict(rotary)
    turned = {text: factor * 2 * math.pi / lead_m for text, factor in rotary.items()} if lead_m else {}
    return {**FORCE_UNITS, **turned}
