"""Scripted faults outside compiled code: filling a schedule into a record, and what only Python can do.

Runs in the loop process: no pydantic here. Schedules come validated and dumped from `hw.fault_options`."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hw.channels import places
from hw.fault_kinds import KINDS
from hw.generator import seed_words
from hw.interface import BackendError, LinkLost, Rig
from hw.jit import bound, compiled, records
from hw.scripted_faults import FAULTS, IN_READ, IN_WRITE, inject, memory_fields, schedule_fields

FAULT_STREAM = 0x6661756C7473
"""Turns a device's seed into that of its faults' own stream."""

_COLUMNS = ("channel", "effect", "axis", "from_tick", "ticks", "every_ticks", "probability", "value")


def fill_schedule(params: np.ndarray, faults: Sequence[Mapping[str, Any]], rig: Rig) -> None:
    """Write the schedule `faults` (dumped `FaultOptions`) into the one-row record `params`.

    Times become whole ticks of `rig.period_s`, never less than one.

    Raises
    ------
    BackendError
        More than `FAULTS` faults, or one on an axis that the rig does not have."""
    p = params[0]
    if len(faults) > FAULTS:
        raise BackendError(f"faults: {len(faults)} given; a schedule holds at most {FAULTS}")
    for name in _COLUMNS:
        p["fault_" + name][:] = 0
    for k, fault in enumerate(faults):
        kind = KINDS[fault["channel"], fault["kind"]]
        axes = places(fault["channel"], rig.n_axes)
        axis = -1 if fault["axis"] is None else fault["axis"]
        if axis >= axes:
            raise BackendError(f"faults[{k}].axis: {axis} is not there; must be below {axes}")
        p["fault_channel"][k], p["fault_effect"][k], p["fault_axis"][k] = kind.channel, kind.effect, axis
        p["fault_from_tick"][k] = _ticks(fault, "at", rig.period_s, least=0)
        p["fault_ticks"][k] = _ticks(fault, "for", rig.period_s)
        p["fault_every_ticks"][k] = _ticks(fault, "every", rig.period_s)
        p["fault_probability"][k], p["fault_value"][k] = fault["probability"], fault["value"]
    p["fault_count"] = len(faults)


def _ticks(fault: Mapping[str, Any], name: str, period_s: float, least: int = 1) -> int:
    """Ticks from `name`_ticks (or `name`_tick) or `name`_s; 0 stays 0."""
    given = fault["at_tick"] if name == "at" else fault[name + "_ticks"]
    if given is not None:
        return int(given)
    seconds = fault[name + "_s"]
    # a fault of less than a period acts for one tick: one of none would never act, with nothing said
    return max(least, round(seconds / period_s)) if seconds else 0


def raise_or_stall(state: np.ndarray, period_s: float) -> None:
    """After `read`: what a schedule wants of Python in this tick.

    A stall blocks here until the loop has missed its slots for certain, half a period beyond the last.

    Raises
    ------
    LinkLost
        The schedule has `raise_read` due."""
    s = state[0]
    if s["fault_stall_ticks"] > 0:
        # half a period beyond: a slot that is begun at its very end counts as missed on every machine
        time.sleep((int(s["fault_stall_ticks"]) + 1.5) * period_s)
    if s["fault_raise"] == IN_READ:
        raise LinkLost("scripted fault: the link was lost in read")


def raise_in_write(state: np.ndarray) -> None:
    """After `write`: raises LinkLost when the schedule has `raise_write` due."""
    if state[0]["fault_raise"] == IN_WRITE:
        raise LinkLost("scripted fault: the link was lost in write")


@compiled
def _inject_at_slot(tick: np.ndarray, state: np.ndarray, params: np.ndarray) -> None:
    """`inject`, with time counted in the loop's slots from the first one seen."""
    s = state[0]
    if s.started == 0:
        s.started = 1
        s.first_tick = tick[0].tick
    inject(tick[0], s, params[0], tick[0].tick - s.first_tick)


class SampleScript:
    """Scripted faults of a device that is not compiled itself: they act on the samples it has put into a
    tick.

    Parameters
    ----------
    faults
        Dumped `FaultOptions`.
    rig
        As the device sees it.
    seed
        Of the faults' chance."""

    def __init__(self, faults: Sequence[Mapping[str, Any]], rig: Rig, seed: int) -> None:
        slots = [("started", "<i8"), ("first_tick", "<i8")]
        facts = [("period_s", "<f8"), ("count_rad", "<f8", (rig.n_axes,))]
        params = np.zeros(1, np.dtype([*facts, *schedule_fields()]))
        state = np.zeros(1, np.dtype([*slots, *memory_fields(rig.n_axes)]))
        params["period_s"] = self._period_s = rig.period_s
        params["count_rad"] = 2 * np.pi / rig.encoder_counts_per_rev
        state["fault_rng"] = seed_words(seed ^ FAULT_STREAM)
        fill_schedule(params, faults, rig)
        self._params, self._state = records(params), records(state)

    def bind(self, tick: np.ndarray) -> None:
        """Compile (or load) for ticks like `tick`, which is the one acted on from now on."""
        self._inject = bound(_inject_at_slot, records(tick), self._state, self._params)

    def after_read(self) -> None:
        """Act on the sample in the tick: `link_faults` cleared, the device's own count. Raises LinkLost."""
        self._inject()
        raise_or_stall(self._state, self._period_s)

    def before_write(self) -> bool:
        """Whether what is sent arrives. Raises LinkLost where the schedule says so."""
        raise_in_write(self._state)
        return not self._state[0]["fault_unplugged"]
