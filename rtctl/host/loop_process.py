"""Starting, watching and ending the loop process. The host's only handle on it besides shared memory."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import IO, Any, NamedTuple, cast

import numpy as np

from rtctl.errors import DeviceError, LoopDiedError, RealtimeError
from rtctl.host.waiting_loop import WaitingLoop
from rtctl.rig_file.config import LoadedConfig
from rtctl.rt.shared_memory import Memory

OPEN_TIMEOUT_S = 20.0
"""Longest excuse for a lost device that is being opened again: a CANopen drive is set up in seconds."""

_FLAGS, _PF_EXITING = 5, 0x4
"""Place of a task's flags in /proc/PID/stat, counted after its state, and the flag of a task that is
ending."""

_ERRORS = {"device": DeviceError, "realtime": RealtimeError}

ASIDE_S = 0.005
"""How long the kernel's workers have for a stop, before a loop that dies takes its core back."""


def is_dying(pid: int) -> bool:
    """Whether a process is being taken apart by the kernel, has ended, or is gone.

    Asked up to a thousand times in a second. Not through `Path`: it interns the parts of a name, and the
    interpreter's table of interned strings keeps the place of each one it drops until it is full and doubled
    (1.9 MB)."""
    try:
        descriptor = os.open(f"/proc/{pid}/stat", os.O_RDONLY | os.O_CLOEXEC)
    except (FileNotFoundError, ProcessLookupError):
        return True
    except OSError:  # no descriptors left: nothing is known
        return False
    try:
        # the name stands in brackets and may hold spaces and brackets itself: count from the last one
        # (proc(5))
        state, *rest = os.read(descriptor, 4096).decode("ascii", "replace").rpartition(")")[2].split()
    except OSError:  # ESRCH: reaped between open and read
        return True
    finally:
        os.close(descriptor)
    # Z: ended and not reaped yet; X: being removed
    return state in "ZX" or bool(int(rest[_FLAGS]) & _PF_EXITING)


class Compiling(NamedTuple):
    """How far a loop process is with compiling."""

    functions: int
    """Done so far."""
    most: int
    """There are no more than these."""
    first: bool
    """Nothing was there compiled when the process began: this version has not been started here."""


def order_of(loaded: LoadedConfig, log_readers: Sequence[str] = ()) -> bytes:
    """What a loop process is told of its rig: one line of JSON."""
    config = loaded.config
    rig = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in asdict(config.hardware()).items()
    }
    order = {
        "devices": [asdict(member) for member in loaded.members()],
        "log_readers": list(log_readers),
        "rig": rig,
        "clock": config.loop.clock,
        "realtime": config.loop.realtime,
        "priority": config.loop.priority,
        "cpu": config.loop.cpu,
        "early_us": config.loop.early_us,
    }
    return (json.dumps(order) + "\n").encode()


def _threads() -> list[int]:
    return [int(task.name) for task in Path("/proc/self/task").iterdir()]


class LoopProcess:
    """The running loop: `messages()` drains what it said, `ended` holds its last word."""

    def __init__(
        self,
        loaded: LoadedConfig,
        memory: Memory,
        lock_fd: int | None = None,
        log_readers: Sequence[str] = (),
        waiting: WaitingLoop | None = None,
    ) -> None:
        """Start it, or have the one that is `waiting` begin. It keeps `lock_fd` open: the rig's lock lasts as
        long as anybody drives the rig.

        `log_readers` are modules whose `register` teaches it to read logs that `hw` does not know."""
        self.ended: dict[str, Any] | None = None
        self._file = loaded.path
        self.grants: list[dict[str, Any]] = []
        self.ready = False
        self.opened_by: list[str] = []
        """Modules that it imported to open its devices."""
        self._opening_until = 0.0
        self.compiling: Compiling | None = None
        """What it has compiled so far, for want of those of an earlier start; None: nothing."""
        self._left: dict[int, set[int]] = {}
        self._notes: list[str] = []
        self._words: list[dict[str, Any]] = []
        self.compile_s = 0.0
        # a line may come in two reads
        self._pending = b""
        waiting = waiting or WaitingLoop()
        self._process = waiting.process
        self._stdout = cast("IO[bytes]", self._process.stdout)
        # `poll` reads until there is nothing: at a pipe that waits, the host would wait with it
        os.set_blocking(self._stdout.fileno(), False)
        descriptors = (memory.fd,) if lock_fd is None else (memory.fd, lock_fd)
        waiting.prepare(order_of(loaded, log_readers))
        waiting.begin(*descriptors)

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def opening(self) -> bool:
        """Whether a lost device is being opened again: the loop makes no ticks, and no torque, meanwhile."""
        return time.monotonic() < self._opening_until

    def fileno(self) -> int:
        """Descriptor that becomes readable when the loop says something or ends."""
        return self._stdout.fileno()

    def poll(self) -> bool:
        """Take in what the loop has said. False once the process has ended and all it said is here."""
        alive = self._process.poll() is None  # before reading: what it says and then ends is still read
        while True:
            try:
                # the descriptor itself: a Python file would keep part of a line in its buffer, where no poll
                # sees it
                data = os.read(self._stdout.fileno(), 65536)
            except BlockingIOError:
                break
            if not data:
                break
            self._pending += data
        *lines, self._pending = self._pending.split(b"\n")
        for line in lines:
            self._hear(json.loads(line))
        return alive

    @property
    def dying(self) -> bool:
        """Whether the kernel is taking it apart, which lasts 10 to 40 ms before anybody is told of its
        end."""
        return is_dying(self.pid)

    @contextlib.contextmanager
    def out_of_the_way(self) -> Iterator[None]:
        """For a loop that is taken apart: meanwhile it has no priority. For 20 to 30 ms nothing else would
        run on its core, the kernel's workers among them, which carry a stop to a terminal or an adapter."""
        before = None
        with contextlib.suppress(OSError):  # it is gone, or another user's
            before = os.sched_getscheduler(self.pid), os.sched_getparam(self.pid)
            os.sched_setscheduler(self.pid, os.SCHED_OTHER, os.sched_param(0))
        try:
            yield
            time.sleep(ASIDE_S)
        finally:
            # what it holds is opened afresh once it has ended: without, that is five times as late beside a
            # load
            with contextlib.suppress(OSError):
                if before is not None:
                    os.sched_setscheduler(self.pid, *before)

    @property
    def core(self) -> int:
        """The core that it keeps to; -1: it runs on several, or is gone."""
        with contextlib.suppress(OSError):
            taken = os.sched_getaffinity(self.pid)
            return taken.pop() if len(taken) == 1 else -1
        return -1

    def leave_it_its_core(self) -> None:
        """Run on the other cores, with every thread that is there by now, ZeroMQ's among them: what they do
        in the kernel for each subscriber a loop waits for, and a loop that dies is taken apart for 30 ms, at
        its priority and on its core."""
        core = self.core
        for thread in _threads() if core >= 0 else ():
            with contextlib.suppress(OSError):  # it has ended
                allowed = os.sched_getaffinity(thread)
                # on a machine with one core there is nowhere to go
                if others := allowed - {core}:
                    os.sched_setaffinity(thread, others)
                    self._left[thread] = allowed

    def _come_back(self) -> None:
        """Run on all cores again: what this process starts inherits its own, and the loop of its next run
        would share one with its host."""
        for thread in _threads():
            with contextlib.suppress(OSError):
                if cores := self._left.pop(thread, None):
                    os.sched_setaffinity(thread, cores)

    def _hear(self, message: dict[str, Any]) -> None:
        if message["message"] == "ready":
            self.ready, self.grants, self.compile_s = True, message["grants"], message["compile_s"]
        elif message["message"] == "opened":
            self.opened_by = message["by"]
        elif message["message"] == "note":
            self._notes.append(message["text"])
        elif message["message"] == "words":
            self._words.append(message)
        elif message["message"] == "compiling":
            # by its first word: later it may have loaded what the host has compiled meanwhile
            first = message["first"] if self.compiling is None else self.compiling.first
            self.compiling = Compiling(message["functions"], message["most"], first)
        elif message["message"] == "opening":
            # bounded: a loop that dies in a driver would be excused for ever
            self._opening_until = time.monotonic() + OPEN_TIMEOUT_S if message["begun"] else 0.0
        elif message["message"] == "ended":
            self.ended = message

    def take_notes(self) -> list[str]:
        """What the loop has said about its devices since this was asked last."""
        notes, self._notes = self._notes, []
        return notes

    def take_words(self) -> list[dict[str, Any]]:
        """What the devices have said of themselves since this was asked last, oldest first
        (`rtctl.rt.speech`)."""
        words, self._words = self._words, []
        return words

    @property
    def left_torque(self) -> bool:
        """After the end: it may not have stopped its devices."""
        # no last word, or one of trouble on the way out: either may have left the devices as they were
        return self.ended is None or self.ended["reason"] == "error"

    def raise_if_failed(self, aftermath: str = "check the device") -> None:
        """After the end: raise the named error of what went wrong, or return when it was asked to end.

        `aftermath` says what was done about the torque of a loop that died."""
        if self.ended is None:
            code = self._process.poll()
            raise LoopDiedError(
                f"the loop process died without a word (exit status {code}); torque was on its own: "
                f"{aftermath}"
            )
        if self.ended["reason"] not in ("shutdown", "cut"):  # `cut` is a second Ctrl-C, which was asked for
            error = _ERRORS.get(self.ended["reason"], LoopDiedError)
            raise error(f"{self.ended['reason']}: {self._file}: {self.ended['detail']}")

    def terminate(self) -> None:
        """Ask it to ramp down."""
        self._process.terminate()

    def cut(self) -> None:
        """Have it drop the torque now. A signal of its own: two pending SIGTERMs would merge into one."""
        self._process.send_signal(signal.SIGUSR1)

    def kill(self) -> None:
        """End it now, whatever it does."""
        self._process.kill()

    def wait(self, seconds: float) -> bool:
        """Wait for its end. True when it has ended."""
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return False
        self.poll()
        return True

    def close(self) -> None:
        """Make sure it is gone and release the pipe."""
        if self._process.poll() is None:
            self._process.kill()
            # else it stays a zombie for as long as this process lives
            self._process.wait()
        self._stdout.close()
        self._come_back()
