"""Numbers of the frames that stop a board which drops what is not newer than the frame before."""

from __future__ import annotations


def stop_numbers(span: int) -> tuple[int, ...]:
    """Sequence numbers, one a frame, that such a board obeys whatever number it saw last.

    A stop may come from a process that never heard the daemon's count. A board takes a frame that is ahead
    of the last by less than half of `span`, the number of values of its counter. Of frames a quarter apart
    one is always so, and every later one: the last number is the board's then, and a count that begins anew
    at 0 or 1 is ahead of it. A span below 4 has no quarter: its numbers follow each other."""
    quarter = max(1, span // 4)
    return tuple(k * quarter % span for k in range(4))
