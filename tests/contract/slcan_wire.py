"""Emulated slcan adapters behind ptys, all on one CAN bus: what one is told to send, the others show.

`python slcan_wire.py` serves two in a process of its own until its standard input closes.
"""

import contextlib
import os
import pty
import select
import sys
import threading
import tty


class SlcanWire:
    def __init__(self, n=2):
        self._ends = []
        for _ in range(n):
            near, far = pty.openpty()
            tty.setraw(near)
            tty.setraw(far)
            os.set_blocking(near, False)
            self._ends.append({"fd": near, "far": far, "left": b"", "open": False})
        self.ports = [os.ttyname(end["far"]) for end in self._ends]
        self._stop_read, self._stop_write = os.pipe()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        fds = [end["fd"] for end in self._ends]
        while True:
            ready, _, _ = select.select([*fds, self._stop_read], [], [])
            if self._stop_read in ready:
                return
            for end in self._ends:
                if end["fd"] in ready:
                    end["left"] += os.read(end["fd"], 4096)
                    *lines, end["left"] = end["left"].split(b"\r")
                    for line in lines:
                        self._line(end, line)

    def _line(self, end, line):
        kind = line[:1]
        if kind in (b"O", b"C"):
            end["open"] = kind == b"O"
            self._show(end, b"\r")
        elif kind in (b"t", b"T", b"r", b"R") and end["open"]:
            self._show(end, b"z\r" if kind in b"tr" else b"Z\r")
            for other in self._ends:
                if other is not end and other["open"]:
                    self._show(other, line + b"\r")
        elif kind == b"S" and line != b"S7":
            self._show(end, b"\r")
        elif line:
            self._show(end, b"\x07")

    def _show(self, end, raw):
        with contextlib.suppress(BlockingIOError):  # nobody reads there: it is lost
            os.write(end["fd"], raw)

    def say(self, number, raw):
        """Bytes out of an adapter, whatever they are."""
        os.write(self._ends[number]["fd"], raw)

    def unplug(self, number):
        """The adapter is gone: its port hangs up."""
        self.close()

    def close(self):
        if self._thread is not None:
            os.write(self._stop_write, b"x")
            self._thread.join()
            self._thread = None
            for end in self._ends:
                os.close(end["fd"])
                os.close(end["far"])
            os.close(self._stop_read)
            os.close(self._stop_write)


def main():
    wire = SlcanWire()
    sys.stdout.write(" ".join(wire.ports) + "\n")
    sys.stdout.flush()
    sys.stdin.read()
    wire.close()


if __name__ == "__main__":
    main()
