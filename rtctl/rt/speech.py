"""What the devices say of themselves, told to the host while no torque can flow.

Words are strings: making them takes memory and microseconds that the cycle of a powered rig has not got. So
they are made in ticks whose actuator is disabled only: in the first one after a CUT, before that tick is
recorded (the host then has the words when it sees the fault), when the faults change, and now and then."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from hw.interface import Backend
from hw.member import Member
from hw.rig import said
from hw.rig_device import Said
from rtctl.control.vocabulary import Fault

EVERY_TICKS = 50
"""Ticks at rest between two looks."""

_SPARE = 2
"""Looks at once at faults that change, between two regular ones: words are those of the fault only in its own
tick, but a fault that flickers must not fill the pipe. A fault that was not there at any look since the last
regular one is always looked at: others that flicker before it must not cost it its words."""

_STALE = int(Fault.STALE)

MOST_LETTERS, MOST_BYTES = 200, 400
"""Most letters of one axis' words, and most bytes of them as JSON: a message of eight axes then fits into a
pipe whole, or not at all."""


def cut(text: str, most_bytes: int) -> str:
    """As much of a text, from its beginning, as so many bytes of JSON hold."""
    # a letter beyond ASCII has six bytes there, and beyond the first plane twelve
    while len(json.dumps(text)) > most_bytes:
        text = text[: len(text) * 9 // 10]
    return text


class Speech:
    """Tells what is new in the devices' words.

    Parameters
    ----------
    backend
        Of the rig, as the loop reads it.
    members
        Its devices, in the order of the rig file.
    tell
        Given one device's words when they changed; returns False when they could not be passed on."""

    def __init__(
        self, backend: Backend, members: Sequence[Member], tell: Callable[[dict[str, Any]], bool]
    ) -> None:
        self._backend, self._members, self._tell = backend, members, tell
        self._told: dict[str, Said] = {}
        self._tick: np.ndarray | None = None
        self._wait = self._before = self._looked_at = 0
        self._spare = _SPARE

    def listen(self, tick: np.ndarray) -> None:
        """After every `write`: speak if no torque can flow and something may be new."""
        if tick is not self._tick:
            self._bind(tick)
        # with torque no strings are made; the first tick without is looked at at once
        if self._enabled[0]:
            self._wait = 0
            return
        now = self._faults[0]
        # between two regular looks only for a fault that is new
        if self._wait:
            self._wait -= 1
            if now == self._before or not (self._spare or now & ~self._looked_at):
                return
            self._spare -= bool(self._spare)
            self._looked_at |= now
        else:
            self._spare, self._looked_at = _SPARE, now
        self._wait, self._before = EVERY_TICKS, now
        stale = bool(self._before & _STALE)
        # what could not be told is told at the next look: `_told` keeps what has arrived
        for one in said(self._backend, self._members, tick, stale=stale):
            if one != self._told.get(one.label) and self._tell(message(one, int(tick["tick"][0]))):
                self._told[one.label] = one

    def _bind(self, tick: np.ndarray) -> None:
        row: Any = tick.view(np.ndarray)
        self._enabled, self._faults = row["enabled"].data, row["faults"].data
        self._tick = tick


def message(one: Said, tick: int) -> dict[str, Any]:
    """One device's words in `tick`, as JSON can carry them."""
    words = [[cut(word.text[:MOST_LETTERS], MOST_BYTES), word.faults, word.silent] for word in one.words]
    return {
        "tick": tick,
        "device": one.label,
        "axes": list(one.axes),
        "faults": one.faults,
        "stale": one.stale,
        "words": words,
    }
