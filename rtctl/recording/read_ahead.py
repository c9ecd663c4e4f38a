"""An iterator that works ahead in a thread of its own, so that two steps of reading a recording share two
cores."""

from __future__ import annotations

import queue
import threading
from collections.abc import Generator, Iterator
from typing import TypeVar

T = TypeVar("T")

DEPTH = 2
"""Items that may be ready before they are asked for: two chunks of half a second."""


def ahead(items: Iterator[T], depth: int = DEPTH) -> Generator[T, None, None]:
    """Give the items of an iterator in order, fetched up to `depth` ahead; its exceptions come where they
    would have.

    What takes the time in `items` must let other threads run (decompression, checksums, compiled code with
    `nogil`). When the caller goes no further the thread ends with the item it is at."""
    ready: queue.Queue[tuple[T | None, BaseException | None]] = queue.Queue(depth)
    left = threading.Event()

    def put(item: T | None, error: BaseException | None) -> None:
        while not left.is_set():
            try:
                ready.put((item, error), timeout=0.1)  # now and then it looks whether the caller has gone
            except queue.Full:
                continue
            return

    def work() -> None:
        end: BaseException = StopIteration()
        try:
            for item in items:
                put(item, None)
                if left.is_set():
                    return
        except BaseException as error:  # noqa: BLE001 - raised again by the caller, below
            end = error
        finally:
            # closed by the thread that runs it: a generator cannot be closed from another one while it runs
            if isinstance(items, Generator):
                items.close()
            # in any case: whoever waits for the next item would wait for ever
            put(None, end)

    thread = threading.Thread(target=work, name="ahead", daemon=True)
    thread.start()
    try:
        while True:
            item, error = ready.get()
            if error is None:
                yield item  # type: ignore[misc] # None only beside an error
            elif isinstance(error, StopIteration):
                return
            else:
                raise error
    finally:
        left.set()
        thread.join()  # the file is closed before the caller goes on
