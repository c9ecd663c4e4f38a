"""The daemon's own live view (`view = true`): a process of its own that the rig does not need.

It is a client like any other. When it dies the rig runs on, and it is started again, ever more rarely while
it keeps dying. It reads a pipe that ends with this process, so it never outlives the daemon. The daemon
listens for it: an address that is told is of this rig's page, and of no other rig's."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import secrets
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from rtctl.rig_file.config import LoadedConfig
from rtctl.wire.endpoints import RuntimeDirectory, private_umask
from rtctl.wire.protocol import VIEW_NAME

HOST = "127.0.0.1"
RETRY_S = (1.0, 60.0)
"""First and longest wait before it is started again; doubled each time."""

SETTLED_S = 60.0
"""A view that has lived this long begins with the first wait again."""

WAITING = 128
"""Browsers that may wait for the page, as of `ViewServer`."""

MOST_BYTES = 65_536
"""Most bytes of the page's words that are read at a time."""


class ViewProcess:
    """Starts the page's server, starts it again when it ends, and never waits for it.

    Parameters
    ----------
    folder
        The rig's runtime folder; the operator's address is kept there, for this user's eyes only.
    port
        TCP port on 127.0.0.1.
    avoid_core
        The loop's core: the view leaves it alone where it can; -1: it may be anywhere.
    clock_s
        For tests."""

    def __init__(
        self, folder: Path, port: int, avoid_core: int = -1, clock_s: Callable[[], float] = time.monotonic
    ) -> None:
        self.url = f"http://{HOST}:{port}/"
        self.operator_file = folder / VIEW_NAME
        self._port = port
        self._order = {"folder": str(folder), "avoid_core": avoid_core}
        self._listening: socket.socket | None = None
        # one for all starts of the page: an address that a person keeps open outlives its crash
        self._key = secrets.token_urlsafe(12)
        self._clock_s = clock_s
        self._process: subprocess.Popen[bytes] | None = None
        self._started_s = self._retry_at_s = 0.0
        self._wait_s = RETRY_S[0]
        self._pending = b""
        self._news: list[str] = []
        self._write_address()
        self._start()

    @classmethod
    def of(cls, loaded: LoadedConfig, runtime: RuntimeDirectory, loop_core: int) -> ViewProcess | None:
        """The view of this rig, if its file asks for one."""
        table = loaded.config.view
        return None if table is None else cls(runtime.path, table.port, loop_core)

    def describe(self) -> list[str]:
        """Lines that tell a person where to look; none without an address."""
        if self._listening is None:
            return []
        return [
            f"live view {self.url}   (anyone on this machine may look and STOP)",
            f"          for the operator, who may arm: the address in {self.operator_file}",
        ]

    def news(self) -> list[str]:
        """Look after it; what has come up since the last call. Takes microseconds while all is well."""
        process = self._process
        if process is None:
            if self._clock_s() >= self._retry_at_s:
                before = self._listening
                self._start()
                self._news += [] if before else self.describe()
        else:
            ended = process.poll()
            self._hear(process)
            if ended is not None:
                self._bury(process, ended)
        news, self._news = self._news, []
        return news

    def close(self) -> None:
        """End it at once: it keeps nothing. Idempotent."""
        process, self._process = self._process, None
        self._retry_at_s = float("inf")  # never again
        if process is not None:
            process.kill()
            process.wait()
            _close_pipes(process)
        self._stop_listening()
        self.operator_file.unlink(missing_ok=True)

    def _write_address(self) -> None:
        try:
            with private_umask():
                # made anew under the umask: the key is for this user, and an older file may have had other
                # rights
                self.operator_file.unlink(missing_ok=True)
                self.operator_file.write_text(f"{self.url}#key={self._key}\n")
        except OSError as error:  # a rig needs no page
            self._news.append(f"the operator's address cannot be written: {error}; the rig runs on")

    def _listens(self) -> bool:
        """Whether browsers that come wait for the page; why they do not is told."""
        try:
            if self._listening is None:
                self._listening = socket.socket()
                self._listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # of TIME_WAIT
                self._listening.bind((HOST, self._port))
            self._listening.listen(WAITING)
        except OSError as error:
            self._stop_listening()
            # whoever opens that address sees, and stops, another rig
            other = "; what answers there is not this rig: give it another [view] port"
            taken = other if error.errno == errno.EADDRINUSE else ""
            self._lose(f"cannot listen on {HOST}:{self._port}: {error.strerror}{taken}")
            return False
        return True

    def _stop_listening(self) -> None:
        listening, self._listening = self._listening, None
        if listening is not None:
            listening.close()

    def _start(self) -> None:
        if not self._listens():
            return
        assert self._listening is not None
        served = self._listening.fileno()
        # the key goes by stdin: arguments stand in /proc for everybody to read
        order = json.dumps({**self._order, "listening": served, "key": self._key}) + "\n"
        try:
            process = subprocess.Popen(
                [sys.executable, "-m", "rtctl.client.view"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                # one pipe for both: its last line says why it ended
                stderr=subprocess.STDOUT,
                pass_fds=(served,),
                start_new_session=True,  # Ctrl-C is for the rig
                # threads of OpenBLAS would wait for each other beside the loop, for matrices of some rows
                env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
            )
        except OSError as error:
            self._refuse()
            self._lose(f"cannot be started: {error}")
            return
        assert process.stdin is not None
        assert process.stdout is not None
        # the host never waits for what the page says
        os.set_blocking(process.stdout.fileno(), False)
        with contextlib.suppress(BrokenPipeError):  # it has died already: seen at the next look
            os.write(process.stdin.fileno(), order.encode())
        self._process, self._started_s, self._pending = process, self._clock_s(), b""

    def _hear(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout is not None
        with contextlib.suppress(BlockingIOError):
            # the end of it: a page that prints without end must not fill the host
            self._pending = (self._pending + os.read(process.stdout.fileno(), MOST_BYTES))[-MOST_BYTES:]

    def _refuse(self) -> None:
        """Nobody waits at an address where nobody answers: who presses STOP there is told at once."""
        if self._listening is not None:
            with contextlib.suppress(OSError):
                self._listening.shutdown(socket.SHUT_RDWR)  # bound it stays

    def _bury(self, process: subprocess.Popen[bytes], status: int) -> None:
        self._process = None
        self._refuse()
        _close_pipes(process)
        if self._clock_s() - self._started_s > SETTLED_S:
            self._wait_s = RETRY_S[0]
        said = self._pending.decode(errors="replace").strip().splitlines()
        self._lose(f"ended with status {status}" + (f": {said[-1]}" if said else ""))

    def _lose(self, why: str) -> None:
        self._news.append(f"the live view {why}; the rig runs on, next try in {self._wait_s:g} s")
        self._retry_at_s = self._clock_s() + self._wait_s
        # a port that is taken stays so: to try every second would cost a start of Python each time
        self._wait_s = min(2 * self._wait_s, RETRY_S[1])


def _close_pipes(process: subprocess.Popen[bytes]) -> None:
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(BrokenPipeError):
                pipe.close()
