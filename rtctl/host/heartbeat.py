"""The host's sign of life to the loop: whoever could not pass on a STOP must not be what a powered rig waits
for.

It goes the way a STOP goes, through the command mailbox, and is written by the turn that would have read the
STOP: nothing else that the host still does (a thread of its own, a flood it works on) counts as life. The law
compares its age with what was promised (`rtctl.control.intake.host_fault`); commands are recorded, so a
replay sees the same."""

from __future__ import annotations

import math

from rtctl.rig_file.config import Config
from rtctl.rt.shared_memory import CommandWriter

BEAT_S = 0.04

SILENCE_S = 0.2
"""Longest silence of the host while powered; five beats."""

LENIENT_S = 2.0
"""Silence that is borne on a simulated rig that may be late: nobody holds it, and ordinary machines keep
processes waiting."""


def promised_ticks(config: Config) -> int:
    """Within how many ticks the host of this rig promises its next beat; 0 promises nothing (virtual
    clock)."""
    if config.loop.clock == "virtual":
        return 0
    # in ticks: the law has no clock but its grid, and a replay none at all
    return round((LENIENT_S if config.may_be_late else SILENCE_S) * config.loop.rate_hz)


class Heartbeat:
    """Beats into the command mailbox, every `BEAT_S` at most.

    Parameters
    ----------
    writer
        The host's end of the mailbox.
    ticks
        What is promised, from the first beat on; 0: it does not beat at all."""

    def __init__(self, writer: CommandWriter, ticks: int) -> None:
        self._writer, self._ticks = writer, ticks
        # the first beat is at once, or never
        self._next_s = -math.inf if ticks > 0 else math.inf

    def beat(self, now_s: float) -> None:
        """Show life, if it is time; `now_s` on a clock that never goes back, s."""
        if now_s < self._next_s:
            return
        # from now, not from when it was due: beats that were missed are not caught up
        self._next_s = now_s + BEAT_S
        # the command goes whole: a beat repeats what is in force, counters and all
        command = self._writer.command
        command["beat_ticks"] = self._ticks
        command["beat_count"] += 1
        self._writer.send()
