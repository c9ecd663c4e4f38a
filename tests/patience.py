"""Waiting for what another thread or process does: as long as a loaded machine may take, and not a moment
longer.
"""

import time

PATIENCE_S = 60.0
"""A bound on what must come; nothing is judged by it. Beyond the longest standstill of a shared machine."""


def until(condition, what="it", seconds=PATIENCE_S):
    """The first true value of `condition`. AssertionError when none comes."""
    deadline = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < deadline, f"waited in vain for {what}"
        time.sleep(0.005)
    return value
