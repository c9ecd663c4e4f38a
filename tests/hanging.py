"""Devices that hang, and the others beside them, without a clock between them."""

import threading
from types import SimpleNamespace

from patience import until

from hw import every_device

LONG_S = 10.0
"""So long that calling devices one after the other is a failure, and ends."""


class Hang:
    """What a device does that hangs, until `end`.

    Whoever calls several devices, and may wait `most_s` for them, waits here for as long as a loaded machine
    takes to bring each of the others to its end.
    """

    def __init__(self, monkeypatch, most_s):
        self.came_back, self._over, threads = False, threading.Event(), []
        self._threads = threads

        class Thread(threading.Thread):
            def join(self, seconds):
                assert 0.0 <= seconds <= most_s
                until(lambda: self in threads or not self.is_alive(), "a device")

        of_threads = SimpleNamespace(Thread=Thread, stack_size=threading.stack_size)
        monkeypatch.setattr(every_device, "threading", of_threads)
        monkeypatch.setattr(every_device, "STOP_TIMEOUT_S", most_s)

    def __call__(self):
        self._threads.append(threading.current_thread())
        self.came_back = not self._over.wait(LONG_S)

    def end(self):
        self._over.set()
