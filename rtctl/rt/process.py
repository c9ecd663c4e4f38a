"""What the loop process does, instructed by its host through a socket (`rtctl.rt.birth` has come before).

It is started before the host has read its rig file, and imports meanwhile. One JSON line says what rig it is
going to be: the law is loaded, or compiled, while the host proves that rig. The memory to share comes when it
is proved; only then is a device opened.

It answers with JSON lines on stdout: `opened`, with the modules that opening the devices imported, and
`ready` before the first cycle, `ended` after the last; in between only `note` and `opening`, while a device
is lost, and `words` of the devices, while the rig is disabled."""

from __future__ import annotations

import contextlib
import gc
import json
import os
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from hw import code_cache
from hw.claims import Claims
from hw.interface import Backend, BackendError, Rig
from hw.member import Member
from hw.refusals import DeviceMistakeError, mistake_of, raised_by, story_of, words_of
from hw.rig import compose
from rtctl.rt import early, realtime
from rtctl.rt.clock import Clock, VirtualClock, WallClock
from rtctl.rt.loop import Stop, prepare, run_loop, warm_up
from rtctl.rt.replug import Replug
from rtctl.rt.shared_memory import Memory
from rtctl.rt.speech import Speech, cut

NOTE_BYTES = 3000
"""Most bytes of a note as JSON: with what stands around it less than a pipe takes whole (PIPE_BUF, 4096)."""


def _say(kind: str, **body: object) -> None:
    with contextlib.suppress(BrokenPipeError):  # the host is gone: nobody is left to be told
        # by the descriptor, in one call: `print` would gather it, and a line of two writes may be torn
        os.write(1, (json.dumps({"message": kind, **body}) + "\n").encode())


def _mention(kind: str, **body: object) -> bool:
    """Tell the host something, without ever waiting for it; False when it did not take it."""
    os.set_blocking(1, False)
    try:
        _say(kind, **body)
    except OSError:
        return False
    finally:
        os.set_blocking(1, True)
    return True


def _note(text: str) -> None:
    # what a driver from outside says may be long, and a line that a full pipe takes in part is no message
    _mention("note", text=cut(text, NOTE_BYTES))


def _words(body: dict[str, Any]) -> bool:
    return _mention("words", **body)


def _compiled(_count: int) -> None:
    """Tell the host how far it is. What was compiled for several types counts once, as it does among those
    there are."""
    functions, most = len(set(code_cache.made_here)), len(code_cache.may_be_made)
    _mention("compiling", functions=functions, most=most, first=not code_cache.loaded_here)


def _leaving_with(host: int) -> Callable[[int], None]:
    """End this process where its host has gone. SIGTERM tells of that, but only asks a loop to ramp down, and
    what is left to compile takes minutes, in which nobody else could start the rig: its lock is held here."""

    def heard(_count: int) -> None:
        if os.getppid() != host:
            os._exit(1)

    return heard


def _opening(begun: bool) -> None:
    """Have the host wait for a device that is being opened: no tick is made meanwhile."""
    _mention("opening", begun=begun)


def _rig(data: dict[str, Any]) -> Rig:
    arrays = {name: np.array(value, dtype=float) for name, value in data.items() if isinstance(value, list)}
    return Rig(n_axes=data["n_axes"], period_s=data["period_s"], **arrays)


def _composed(order: dict[str, Any], members: list[Member]) -> Backend | BackendError:
    """The rig's backend, nothing of it open; or why there is none."""
    try:
        return compose(members, _rig(order["rig"]))
    except BackendError as error:
        return error


def _open(backend: Backend | BackendError, members: list[Member], claims: Claims) -> Backend | None:
    try:
        if isinstance(backend, BackendError):
            raise backend
        for member in members:
            # before anything is opened: a second daemon would disturb the first one's drive by asking
            claims.take(member.label, member.claims)
    except (BackendError, OSError) as error:
        _say("ended", reason="device", detail=words_of(error))
        return None
    before = set(sys.modules)
    if (refusal := raised_by(backend.open)) is not None:
        if not isinstance(refusal, BackendError | OSError):  # a mistake: nobody knows what it has left
            raised_by(backend.stop)
            refusal = mistake_of(_place(members), "open", refusal)
        _say("ended", reason="device", detail=words_of(refusal))
        return None
    _say("opened", by=sorted(set(sys.modules) - before))
    return backend


def _place(members: list[Member]) -> str:
    return " and ".join(member.place for member in members)


def _released(device: Replug) -> Exception | None:
    """Stop and close a device that is not going to be driven. Returns what it raised at that."""
    refusal = raised_by(device.stop)
    return raised_by(device.close) or refusal


def _warmed_up(device: Replug, memory: Memory) -> bool:
    """Whether all that the loop calls is compiled; a device whose code raises there is open, and released."""
    if (refusal := raised_by(lambda: warm_up(memory, device))) is None:
        return True
    left = _released(device)
    theirs = isinstance(refusal, BackendError | DeviceMistakeError) and not left
    detail = words_of(refusal) + (f"; not stopped: {words_of(left)}" if left else "")
    _say("ended", reason="device" if theirs else "error", detail=detail)
    return False


def _stopped_by_signals() -> Stop:
    """What SIGTERM raises by one, and SIGUSR1 to two at once."""
    stop = Stop()

    def _request(_signal: int, _frame: object) -> None:
        stop.requests += 1

    def _cut(_signal: int, _frame: object) -> None:
        stop.requests = 2

    signal.signal(signal.SIGTERM, _request)
    signal.signal(signal.SIGUSR1, _cut)
    return stop


def _told(line: socket.socket) -> Iterator[tuple[bytes, list[int]]]:
    """The lines that the host writes, each with all descriptors that have come so far; no more of them once
    the host is gone.

    Two lines may come as one: who read without taking descriptors would lose those of the second."""
    pending, descriptors = b"", []
    while True:
        more, came, _, _ = socket.recv_fds(line, 65536, 2, socket.MSG_CMSG_CLOEXEC)
        if not more:
            return
        # received once, in whatever message: kept for the line that they belong to
        descriptors += came
        *lines, pending = (pending + more).split(b"\n")
        for text in lines:
            yield text, descriptors


class _Proved(NamedTuple):
    """A rig that may be driven, and what is ready for it."""

    order: dict[str, Any]
    members: list[Member]
    backend: Backend | BackendError
    memory: Memory


def _proved(line: socket.socket, host: int) -> _Proved | None:
    """Prepare what the host says, and wait until that is proved; None where the host refuses the rig, or has
    died."""
    told = _told(line)
    text, _ = next(told, (b"", []))
    if not text:
        return None
    order = json.loads(text)
    leave = _leaving_with(host)
    code_cache.on_compiled += [_compiled, leave]
    members = [Member.from_dict(device) for device in order["devices"]]
    for reader in order["log_readers"]:
        # by name: what reads a kind of log stands above hw, which knows none of it
        import_module(reader).register()
    made = _composed(order, members)
    prepare(order["rig"]["n_axes"])
    code_cache.on_compiled.remove(leave)  # from here on there are devices, which are stopped first
    _, descriptors = next(told, (b"", []))
    if not descriptors:
        return None
    # the other one is the rig's lock: held as long as this process lives
    return _Proved(order, members, made, Memory.attach(descriptors[0]))


def _run(device: Replug, memory: Memory, clock: Clock, stop: Stop, *, waiver: bool) -> None:
    with contextlib.closing(device):  # one that fails to close is told like one that fails to run
        run_loop(device, memory, clock, stop, waiver=waiver)


def main(line_fd: int, host: int) -> int:
    """Run one loop of the process `host`. Returns the exit status: 0 shut down, 1 anything else."""
    stop = _stopped_by_signals()
    gc.collect()  # while there is time
    gc.freeze()
    gc.enable()
    began = time.monotonic()
    with socket.socket(fileno=line_fd) as line:
        proved = _proved(line, host)
    if proved is None:
        return 1
    order, members, made, memory = proved
    claims = Claims()  # given back when this process ends
    backend = _open(made, members, claims)
    if backend is None:
        return 1
    device = Replug(backend, _note, _opening, Speech(backend, members, _words).listen, _place(members))
    if not _warmed_up(device, memory):
        return 1
    compile_s = time.monotonic() - began
    virtual = order["clock"] == "virtual"
    cores = len(os.sched_getaffinity(0))  # before this process keeps to one
    grants, held = (
        ([], [])
        if virtual or order["realtime"] == "off"
        else realtime.acquire(order["priority"], order["cpu"])
    )
    granted = bool(grants) and realtime.complete(grants)
    if not virtual:
        grants.append(
            early.choose(memory.early_ns, order["early_us"], order["rig"]["period_s"], cores, granted=granted)
        )
    _say("ready", grants=[grant.as_dict() for grant in grants], compile_s=round(compile_s, 3))
    clock: Clock = (
        VirtualClock(memory.header, lambda: stop.requests > 0) if virtual else WallClock(memory.early_ns)
    )
    # only here: `ready` has told what was refused, and with which remedy
    if not granted and order["realtime"] == "require" and not virtual:
        left = _released(device)
        more = f"; {words_of(left)}" if left else ""
        _say("ended", reason="realtime", detail=f"real-time rights were refused{more}")
        return 1

    error = raised_by(lambda: _run(device, memory, clock, stop, waiver=not granted and not virtual))
    for fd in held:
        os.close(fd)
    if error is not None:
        _say("ended", reason="error", detail=story_of(error))
        return 1
    modules = sorted({name.partition(".")[0] for name in sys.modules})
    _say("ended", reason="shutdown" if stop.requests < 2 else "cut", detail="", modules=modules)
    return 0
