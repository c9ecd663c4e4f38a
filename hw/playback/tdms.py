"""Channels of a TDMS file of LabVIEW, by group and channel: `Motion/Angle`; the time of one that has a rate
of its own is `Motion/Angle/time`."""

from __future__ import annotations

import io
import struct
from collections.abc import Collection, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from hw.interface import BackendError
from hw.playback.text_table import Table
from hw.playback.units import unit_of

CLOCK = "/time"
"""Behind the name of a channel: its time, s since its own first sample."""

NO_STEP_S = 1.0
"""Step that LabVIEW writes where nobody told it one: it says nothing."""

_BEGINS, _STEP = "wf_start_time", "wf_increment"


def read_tdms(path: Path, raw: bytes, names: Sequence[str], most: int) -> Table:
    """Arrays of the named channels (of all others none) and what the file says of their units; at most `most`
    bytes of them.

    Raises
    ------
    BackendError
        npTDMS is not installed, no sound file, more samples than a file of its size has, channels that began
        at different instants or of different steps."""
    if find_spec("nptdms") is None:
        raise BackendError(
            f"{path}: TDMS needs npTDMS: install rtctl with its extra `tdms` (pip install 'rtctl[tdms]'), or "
            "export the channels as CSV"
        )
    try:
        with import_module("nptdms").TdmsFile.open(io.BytesIO(raw)) as file:
            channels = {f"{g.name}/{c.name}": c for g in file.groups() for c in g.channels()}
            # a channel may itself be called `time`: its own name goes before the clock of another one
            wanted = {
                name: channels.get(name if name in channels else name.removesuffix(CLOCK))
                for name in dict.fromkeys(names)
            }
            _require_one_clock(path, {name: one for name, one in wanted.items() if one is not None})
            # 8 bytes a sample: what a float64 of it takes, whatever the file packs it as
            # lengths stand in the head of the file: asked before a sample is unpacked
            if 8 * sum(len(one) for one in wanted.values() if one is not None) > most:
                raise BackendError(f"{path}: unpacks to more than a log does; cut it into parts")
            found = {
                name: channels[name][:]
                if name in channels
                else np.arange(len(one)) * float(one.properties[_STEP])
                for name, one in wanted.items()
                if one is not None and (name in channels or _STEP in one.properties)
            }
            others = [*channels, *(name + CLOCK for name, one in channels.items() if _STEP in one.properties)]
            clocks = found.keys() - channels.keys()
            steps = [one.properties[_STEP] for one in wanted.values() if one and _STEP in one.properties]
            step_s = next((float(step) for step in steps if step != NO_STEP_S), 0.0)
            return Table(dict.fromkeys(others, np.zeros(0)) | found, _units(wanted, found, clocks), step_s)
    except (AttributeError, IndexError, OverflowError, RuntimeError, TypeError, struct.error) as error:
        raise BackendError(
            f"{path}: not a sound .tdms file ({str(error)[:200]}); copy or save it again"
        ) from error


def _require_one_clock(path: Path, wanted: dict[str, Any]) -> None:
    """Row by row, channels of their own rates are of the same instants only if they began together."""
    clocks = {
        name: (one.properties.get(_BEGINS), one.properties.get("wf_start_offset", 0.0), one.properties[_STEP])
        for name, one in wanted.items()
        if _STEP in one.properties
    }
    # also of one step: begun a second apart, row k of both is not one instant
    if len(set(clocks.values())) > 1:
        told = ", ".join(
            f"{name!r} from {start} on, each {step:g} s" for name, (start, _, step) in clocks.items()
        )
        raise BackendError(f"{path}: channels of different clocks ({told}); resample them onto one")


def _units(wanted: dict[str, Any], found: dict[str, np.ndarray], clocks: Collection[str]) -> dict[str, str]:
    said = {name: "s" for name in found if name in clocks or found[name].dtype.kind == "M"}
    told = {name: unit_of(wanted[name].properties) for name in found.keys() - said.keys()}
    return said | {name: unit for name, unit in told.items() if unit}
