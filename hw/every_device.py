"""Calls an action on every device, even if one device raises an exception or hangs."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence

from hw.interface import BackendError
from hw.refusals import raised_by

# the stop of the last device must not wait for the first one that hangs
STOP_TIMEOUT_S = 0.1
"""How long to wait for a device that hangs."""

_STACK_BYTES = 256 * 1024
"""Stack of a stopping thread. With locked memory the default stack of 8 MB would have to be filled before it
starts."""


def reach_all(
    actions: Sequence[Callable[[], None]], wait_s: float | None = None, stack_bytes: int = _STACK_BYTES
) -> list[Exception | None]:
    """Call all at once and wait a moment: none can keep the others from being called.

    Parameters
    ----------
    actions
        One of each device.
    wait_s
        How long to wait for all of them, s; None: `STOP_TIMEOUT_S`.
    stack_bytes
        Stack of each thread; 0: what the system gives, for an action that may import or compile.

    Returns what each raised, in their order; None where it raised nothing. Of one that has not come back
    nobody knows what it did: a BackendError that says so."""
    wait_s = STOP_TIMEOUT_S if wait_s is None else wait_s
    hangs = BackendError(f"has not come back after {wait_s:g} s")
    raised: list[Exception | None] = [hangs] * len(actions)

    def _quietly(number: int) -> None:
        raised[number] = raised_by(actions[number])

    # of the whole process: put back below, whatever happens
    before = threading.stack_size(stack_bytes)
    waiting = []
    try:
        for number in range(len(actions)):
            # daemon: a stop that hangs for ever must not keep the process from ending
            thread = threading.Thread(target=_quietly, args=(number,), daemon=True)
            try:
                thread.start()
            except RuntimeError:  # no more threads: one after the other is better than not at all
                _quietly(number)
            else:
                waiting.append(thread)
    finally:
        threading.stack_size(before)
    # one for all: eight devices that hang take as long as one
    deadline = time.monotonic() + wait_s
    for thread in waiting:
        thread.join(max(deadline - time.monotonic(), 0.0))
    # a copy: one that comes back later changes nothing that was told
    return list(raised)
