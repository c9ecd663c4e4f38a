"""What a file says itself about the unit of a column, in a unit row, in an attribute or in the column's name,
against what it is read in."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hw.interface import BackendError

# `grad` is German for a degree; the 400th of a turn, which it is elsewhere, is `gon` here
SPELT = {
    "°": "deg", "degree": "deg", "degrees": "deg", "grad": "deg", "radian": "rad", "radians": "rad",
    "turn": "rev", "turns": "rev", "rotations": "rev", "count": "counts", "inc": "counts", "qc": "counts",
    "ticks": "counts",
    "sec": "s", "seconds": "s", "minutes": "min", "hours": "h", "d": "days", "day": "days", "msec": "ms",
    "usec": "us", "µs": "us", "μs": "us",
    "ncm": "N cm", "cnm": "N cm", "dnm": "dN m", "µnm": "uN m", "μnm": "uN m", "unm": "uN m", "gcm": "g cm",
    "gfcm": "g cm", "knm": "kN m", "ozin": "oz in", "lbin": "lb in", "lbft": "lb ft", "kgcm": "kg cm",
    "µrad": "urad", "μrad": "urad", "µm": "um", "μm": "um", "micron": "um", "microns": "um",
    "µm/s": "um/s", "μm/s": "um/s", "arc-min": "arcmin", "gon": "gon", "cnt": "counts", "cts": "counts",
    "cnt/s": "counts/s", "counts/sec": "counts/s", "inc/s": "counts/s", "cnt/sec": "counts/s",
    "nm": "N m", "mnm": "mN m", "nmm": "mN m", "n mm": "mN m", "revolutions": "rev", "revolution": "rev",
    "amp": "A", "amps": "A", "ampere": "A", "1/min": "rpm", "min-1": "rpm", "rad/sec": "rad/s",
    "deg/sec": "deg/s", "°/s": "deg/s",
    "umdr": "rev", "umdr.": "rev", "umdrehungen": "rev", "u/min": "rpm", "r/min": "rpm", "tr/min": "rpm",
    "grad/s": "deg/s", "sek": "s", "sekunden": "s",
    "mikrosekunden": "us", "millisekunden": "ms", "volt": "V", "volts": "V", "percent": "%", "prozent": "%",
    "pct": "%", "0.1%": "‰", "0.1 %": "‰", "permille": "‰", "per mille": "‰", "permil": "‰", "promille": "‰",
    "lsb": "counts", "lb": "lbf", "pounds": "lbf", "inch": "in", "inches": "in", "ips": "in/s",
    "°c": "degC", "celsius": "degC", "deg c": "degC", "°f": "degF", "fahrenheit": "degF", "kelvin": "K",
    "arms": "A", "aeff": "A", "apk": "A",
    "degré": "deg", "degrés": "deg", "gradi": "deg", "grados": "deg", "graus": "deg", "град": "deg",
    "度": "deg", "ラジアン": "rad", "弧度": "rad",
    "secondes": "s", "secondi": "s", "segundos": "s", "с": "s", "秒": "s", "мс": "ms", "毫秒": "ms",
    "ミリ秒": "ms", "мкс": "us", "微秒": "us",
    "мм": "mm", "毫米": "mm", "ミリメートル": "mm", "мкм": "um", "微米": "um", "米": "m", "メートル": "m",
    "н": "N", "牛": "N", "牛顿": "N", "ニュートン": "N", "кн": "kN", "千牛": "kN", "н м": "N m",
    "牛 米": "N m", "牛米": "N m", "мн м": "mN m", "об/мин": "rpm", "转/分": "rpm", "回転/分": "rpm",
    "а": "A", "安": "A",
}  # fmt: skip
"""Other spellings, in small letters -> ours."""

_WORDS = {
    "pound": "lb", "pounds": "lb", "lbs": "lb", "lbf": "lb", "ounce": "oz", "ounces": "oz", "ozf": "oz",
    "inch": "in", "inches": "in", "foot": "ft", "feet": "ft", "kgf": "kg", "newton": "n", "newtons": "n",
    "meter": "m", "meters": "m", "metre": "m", "metres": "m", "millinewton": "mn",
}  # fmt: skip
"""Words that a unit of two is made of."""

_BETWEEN = re.compile(r"[\s.\-*_·⋅×・･∙•]+")
"""What stands between them: `N.m`, `lbf-in`, `Pound inches`."""

SCALED = {
    "kN m": (1000.0, "N m"), "dN m": (0.1, "N m"), "uN m": (1e-6, "N m"), "g cm": (9.80665e-5, "N m"),
    "oz in": (0.00706155, "N m"), "lb in": (0.1129848, "N m"),
    "lb ft": (1.355818, "N m"), "kg cm": (0.0980665, "N m"), "lbf": (4.448222, "N"), "kgf": (9.80665, "N"),
    "daN": (10.0, "N"), "cm": (10.0, "mm"), "cm/s": (10.0, "mm/s"), "um/s": (0.001, "mm/s"),
    "in": (25.4, "mm"), "ft": (0.3048, "m"), "in/s": (25.4, "mm/s"),
    "mrad": (0.001, "rad"), "urad": (1e-6, "rad"), "mdeg": (0.001, "deg"), "arcmin": (1 / 60, "deg"),
    "gon": (0.9, "deg"), "mrad/s": (0.001, "rad/s"), "mdeg/s": (0.001, "deg/s"),
}  # fmt: skip
"""Units that a scale makes one of ours: how much of which."""

OTHERS = ("V", "mV", "%", "\u2030", "kg", "bar", "Pa", "MPa", "psi", "counts/s", "K", "degF", *SCALED)
"""Units that no column is read in without a scale: a scope's volts, a share of a nominal torque, a balance's
kilograms, a cylinder's pressure, ounces and inches."""

_KNOWN = {unit.lower(): unit for unit in ("s", "ms", "us", "ns", "min", "h", "days", "rad", "deg", "rev",
    "counts", "rad/s", "deg/s", "rev/s", "rpm", "A", "mA", "N m", "mN m", "N cm", "N", "mN", "kN", "m", "mm",
    "um", "m/s", "mm/s", "degC", *OTHERS)}  # fmt: skip

_LENGTHS = ("m", "mm", "um", "m/s", "mm/s")

_BRACKETS = re.compile(r"[\[(（［【]([^\])）］】]{1,20})[\])）］】]\s*$")
_SUFFIX = re.compile(
    r"_(rad_s|deg_s|rev_s|mm_s|um_s|mm|um|cm|kn|mn|ms|us|ns|rad|deg|mrad|rev|counts|rpm|nm|mnm|ncm|ma"
    r"|inch(?:es)?|lbf?|kgf|(?:ozf?|lbf?|kgf?)[-_]?(?:in|ft|cm)|(?:in|ft)[-_]lbf?|percent|pct|per_?mille|promille)$",
    re.IGNORECASE,
)

_OF_LENGTH = re.compile(r"_(in(?:_s)?)$", re.IGNORECASE)
"""Inches, where a length is read: `torque_in` is what goes in."""

_KIND_OF_MEAN = re.compile(r"(?<=.)\s*\b(?:of\s.*|rated.*|nominal.*|rms|peak|pk|eff|mean|avg)$")
"""What a unit is of: `A RMS`, `% of rated torque`."""

_TIMES = re.compile(r"(\d*[.,]?\d+(?:e-?\d+)?)\s*\*?\s*([^\d\s.,].*)")
"""A unit of so many others: `0.01A`."""

_BEHIND = re.compile(r"(?:\b(?:in|en)\s+|\s/\s*(?!min$)|,\s+)(\S{1,20})$|/(?!min$)(\S{2,6})$")
"""What stands behind a name without brackets: `angle in deg`, `M / Nm`, `M/Nm`, `angle, deg`; a single letter
only behind a blank, and `U/min` is no time."""

_SAME = {"Nm": "N m", "mNm": "mN m", "Ncm": "N cm"}


_ATTRIBUTES = {"unit", "units", "unit_string", "ni_unitdescription", "ni_channelunit"}
"""What HDF5, Arrow and TDMS files keep the unit of a column under, in small letters."""


def unit_of(attributes: Mapping[Any, Any]) -> str:
    """Unit that the attributes of a column say, text or bytes; "" without any."""
    told = {_text(key).lower(): _text(value) for key, value in attributes.items()}
    return next((told[key] for key in sorted(_ATTRIBUTES & told.keys()) if told[key]), "")


def units_beside(arrays: Mapping[str, Any], words: Mapping[str, str], between: str = ".") -> dict[str, str]:
    """Units that words say which stand in one structure with an array, by paths: `Y(2).Unit` is that of
    `Y(2).Data`, and of nothing where several arrays are beside it."""
    told: dict[str, str] = {}
    for path, word in words.items():
        stem, _, field = path.rpartition(between)
        if field.lower() in _ATTRIBUTES and stem:
            beside = [name for name in arrays if name.rpartition(between)[0] == stem]
            # one number is a rate or a flag, one of several arrays the time
            series = [name for name in beside if np.size(arrays[name]) > 1]
            told |= {series[0]: word} if len(series) == 1 else {}
    return told


def _text(word: object) -> str:
    return word.decode(errors="replace") if isinstance(word, bytes) else str(word)


def said_unit(name: str, row: str) -> str:
    """Unit that a unit row or a name in brackets, with an ending or with words behind it says, in our
    spelling; "" without any, the text where it is none of ours."""
    inside = _BRACKETS.search(name)
    ending = _SUFFIX.search(name)
    text = row.strip(" []()") or (inside[1] if inside else "") or (ending[1] if ending else "")
    if not text and (behind := _BEHIND.search(name)):
        return _ours((behind[1] or behind[2]).strip("()")) or ""
    return _ours(text) or text.strip()


def says_unit(name: str, row: str, used: str) -> bool:
    """Whether the file says a unit of a column that is read in `used`; an ending is believed that is the
    letter of this one alone (`force_n`), and before a name of an axis, too (`force_n.carriage`)."""
    bare = name.partition(".")[0]
    return bool(said_unit(name, row) or said_unit(bare, "")) or bare.lower().endswith(f"_{used.lower()}")


def _ours(text: str) -> str | None:
    plain = _KIND_OF_MEAN.sub("", text.strip().lower())
    words = [_WORDS.get(word, word) for word in _BETWEEN.split(plain)]
    turned = words[::-1] if words[0] in {"in", "ft"} else words
    for spelt in (plain, plain.replace("_", "/"), " ".join(turned) if len(words) == 2 else ""):
        if found := SPELT.get(spelt) or _KNOWN.get(spelt):
            return found
    return None


def unread(unit: str) -> str:
    """How a column in one of `OTHERS` is given."""
    factor, base = SCALED.get(unit, (0.0, ""))
    if base:
        return f"{unit} needs a scale: give {factor:.7g} {base} (:{base}:{factor:.7g} behind its name)"
    return (
        f"{unit} needs a scale: give the unit that the column is read in, and how much of it one {unit} is "
        "(:Nm:0.024 behind its name, of per cent of 2.4 N m)"
    )


def require_unit(path: Path, name: str, row: str, column: Mapping[str, Any], units: tuple[str, ...]) -> None:
    """Refuse a column that is read in another unit than the file says; in one of `units`, or of another
    quantity. A scale other than +-1 says that somebody knows better.

    Raises
    ------
    BackendError
        Names column, both units and the remedy."""
    said, used = said_unit(name, row), column.get("unit", units[0])
    if not said and used in _LENGTHS and (inches := _OF_LENGTH.search(name)):
        said = _ours(inches[1]) or ""
    # -1 turns a sign and says nothing of units
    if abs(column.get("scale", 1.0)) != 1 or (said == "K" and column.get("offset")):
        return
    times = _TIMES.fullmatch(said)
    unit = (_ours(times[2]) if times else None) or said
    if unit not in _KNOWN.values() or (not times and said == _SAME.get(used, used)):
        return
    factor, base = SCALED.get(unit, (1.0, unit))
    factor *= float(times[1].replace(",", ".")) if times else 1.0
    what = f"{path}: column {name!r} is read in {used}, the file says {said}"
    if base in units and factor != 1:
        raise BackendError(
            f"{what}, which needs a scale: give {factor:.7g} {base} (:{base}:{factor:.7g} behind its name)"
        )
    if said in units:
        raise BackendError(
            f"{what}; give the unit {said} (:{said} behind its name), or rename the column if the file is "
            "wrong"
        )
    raise BackendError(
        f"{what}, which is another quantity; map another column, or give the scale that makes {used} of it "
        "(a torque constant, a gear ratio, the rated torque by 100 or by 1000; of a temperature the "
        "offset in --map; where it is exactly 1, take the unit out of the file)"
    )
