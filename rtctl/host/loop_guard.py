"""Stops the devices of a loop that cannot do so itself: one that died, is dying, is late or stands still."""

from __future__ import annotations

import time
from collections.abc import Iterable
from contextlib import nullcontext

from rtctl.errors import LoopDiedError
from rtctl.host.loop_process import LoopProcess
from rtctl.host.safe_stop import SafeStop
from rtctl.host.stall_watch import StallWatch, Verdict
from rtctl.rig_file.config import LoadedConfig
from rtctl.rt.shared_memory import Memory


class LoopGuard:
    """Watches one loop process for its host.

    Making it imports and compiles what a stop needs: make it once the loop process is on its way.

    Attributes
    ----------
    look_s : float
        Longest time between two calls of `look`, s."""

    def __init__(self, loaded: LoadedConfig, loop: LoopProcess, memory: Memory, period_s: float) -> None:
        motor = not loaded.config.simulated
        # without real-time rights a late loop is ordinary, and no reason to cut the torque
        rights = loaded.config.loop.realtime in ("require", "prefer")
        self._watch = StallWatch(period_s, motor=motor, punctual=motor and rights)
        self._loop, self._memory = loop, memory
        self._virtual = loaded.config.loop.clock == "virtual"
        # made now, not when it is needed: to import and compile a driver takes longer than a motor may run on
        self._stop: SafeStop | None = SafeStop(loaded)
        self._told_at = -1  # tick after which the devices were told to stop
        self.look_s = self._watch.look_s

    def know(self, modules: Iterable[str]) -> None:
        """Have a stop need nothing that is not there yet; `modules` is what the loop imported to open its
        devices."""
        if self._stop is not None:
            self._stop.know(modules)

    def look(self) -> None:
        """Stop the devices of a loop that is dying or late; end one that stalls (on a wall clock) without an
        excuse.

        Raises LoopDiedError for a loop that was ended."""
        head, loop = int(self._memory.header[0]["head"]), self._loop
        excused = loop.opening or loop.ended is not None or self._virtual
        verdict = self._watch.look(head, time.monotonic(), excused=excused)
        # asked of a silent loop only: `dying` opens a file of /proc
        dying = self._watch.is_silent and loop.dying
        if (dying or verdict) and self._told_at != head and self._stop is not None:
            self._told_at = head  # once a silence
            with loop.out_of_the_way() if dying else nullcontext():
                self._stop.tell()
        if verdict is Verdict.STALLED:
            loop.kill()
            # SIGKILL is carried out at once, unless a driver of the kernel holds the process
            loop.wait(1.0)
            raise LoopDiedError(
                f"the loop stopped advancing at tick {head}; it was killed: {self.make_safe()}"
            )

    def make_safe(self) -> str:
        """Stop the devices of a loop that cannot have done so itself, once; says what became of them."""
        # taken away first: the end of the run asks once more, and a device is not to be opened twice
        stop, self._stop = self._stop, None
        if stop is None or not self._loop.left_torque:
            return ""
        stopped = stop.now()
        return "; ".join(one.text() for one in stopped) or "no actuator but simulated ones"
