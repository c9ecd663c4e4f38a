"""A Chromium without a window, driven over its debugging pipe: just enough to time a page.

The pipe speaks JSON, each message ended by a zero byte: file descriptor 3 takes commands, 4 gives answers
(https://chromedevtools.github.io/devtools-protocol).
"""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rtctl.errors import DataError
from tests.bench.child import end

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ANSWER_S = 30.0
POLL_S = 0.02

_PLACE_PIPES = """
import fcntl, os, sys
ends = [fcntl.fcntl(int(end), fcntl.F_DUPFD, 10) for end in sys.argv[1:3]]
for place, end in zip((3, 4), ends):
    os.dup2(end, place)
os.execv(sys.argv[3], sys.argv[3:])
"""
"""Puts the pipes where the browser expects them, whatever their numbers are (a shell may know those up to 9
only)."""


class Browser:
    """A running browser; see `browser()`."""

    def __init__(self, orders: int, answers: int) -> None:
        self._orders, self._answers = orders, answers
        self._pending = b""
        self._number = 0

    def ask(self, method: str, session: str | None = None, **params: Any) -> dict[str, Any]:
        """Send a command and wait for its answer. Raises DataError when it refuses or falls silent."""
        self._number += 1
        order: dict[str, Any] = {"id": self._number, "method": method, "params": params}
        if session:
            order["sessionId"] = session
        os.write(self._orders, json.dumps(order).encode() + b"\0")
        deadline = time.monotonic() + ANSWER_S
        while True:
            message = self._next(deadline)
            if message.get("id") != self._number:
                continue  # an event
            if "error" in message:
                raise DataError(f"the browser refused {method}: {message['error'].get('message')}")
            result: dict[str, Any] = message["result"]
            return result

    def page(self, url: str, width: int = 1280, height: int = 900) -> str:
        """Open a page in a tab of its own; returns its session."""
        target = self.ask(
            "Target.createTarget", url="about:blank", newWindow=True, width=width, height=height
        )["targetId"]
        session: str = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.ask("Page.navigate", session, url=url)
        return session

    def evaluate(self, session: str, expression: str) -> Any:
        """Value of a JavaScript expression in the page."""
        answer = self.ask("Runtime.evaluate", session, expression=expression, returnByValue=True)
        return answer["result"].get("value")

    def wait_for(self, session: str, expression: str) -> Any:
        """Value of an expression once it is neither null nor false."""
        deadline = time.monotonic() + ANSWER_S
        while (value := self.evaluate(session, expression)) in (None, False):
            if time.monotonic() > deadline:
                raise DataError(f"the page never came to {expression}")
            time.sleep(POLL_S)
        return value

    def close(self, session: str) -> None:
        """Close a page."""
        self.ask("Page.close", session)

    def _next(self, deadline: float) -> dict[str, Any]:
        while b"\0" not in self._pending:
            ready, _, _ = select.select([self._answers], [], [], max(0.0, deadline - time.monotonic()))
            data = os.read(self._answers, 1 << 16) if ready else b""
            if not data:
                raise DataError("the browser fell silent")
            self._pending += data
        raw, _, self._pending = self._pending.partition(b"\0")
        message: dict[str, Any] = json.loads(raw)
        return message


def installed() -> str | None:
    """Path of a Chromium of this machine."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


@contextmanager
def browser(program: str) -> Iterator[Browser]:
    """Start it with an empty profile, and end it."""
    orders_out, orders_in = os.pipe()
    answers_out, answers_in = os.pipe()
    with tempfile.TemporaryDirectory(prefix="rt", ignore_cleanup_errors=True) as profile:
        options = ["--headless=new", "--remote-debugging-pipe", "--no-first-run", "--disable-extensions"]
        options += ["--disable-background-networking", "--disable-gpu", f"--user-data-dir={profile}"]
        options += ["--no-sandbox"] if os.geteuid() == 0 else []  # it refuses to run as root otherwise
        process = subprocess.Popen(
            [
                sys.executable,
                "-I",
                "-S",
                "-c",
                _PLACE_PIPES,
                str(orders_out),
                str(answers_in),
                program,
                *options,
            ],
            pass_fds=(orders_out, answers_in),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(orders_out)
        os.close(answers_in)
        try:
            yield Browser(orders_in, answers_out)
        finally:
            end(process)
            os.close(orders_in)
            os.close(answers_out)
