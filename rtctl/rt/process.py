"""What the loop process does, instructed by one JSON line on stdin (`rtctl.rt.birth` has come before).

It answers with JSON lines on stdout: `ready` before the first cycle, `ended` after the last; in between only
`note` and `opening`, while a device is lost, and `words` of the devices, while the rig is disabled.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
import time
import traceback
from importlib import import_module
from typing import Any

import numpy as np

from hw.claims import Claims
from hw.code_cache import on_compiled
from hw.interface import Backend, BackendError, Rig
from hw.rig import Member, compose
from rtctl.rt import early, realtime
from rtctl.rt.clock import Clock, VirtualClock, WallClock
from rtctl.rt.loop import Stop, run_loop, warm_up
from rtctl.rt.replug import Replug
from rtctl.rt.shared_memory import Memory
from rtctl.rt.speech import Speech


def _say(kind: str, **body: Any) -> None:  # noqa: ANN401
    with contextlib.suppress(BrokenPipeError):  # the host is gone: nobody is left to be told
        os.write(1, (json.dumps({"message": kind, **body}) + "\n").encode())


def _mention(kind: str, **body: Any) -> bool:  # noqa: ANN401
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
    _mention("note", text=text)


def _words(body: dict[str, Any]) -> bool:
    return _mention("words", **body)


def _compiled(functions: int) -> None:
    _mention("compiling", functions=functions)


def _opening(begun: bool) -> None:
    """Have the host wait for a device that is being opened: no tick is made meanwhile."""
    _mention("opening", begun=begun)


def _rig(data: dict[str, Any]) -> Rig:
    arrays = {name: np.array(value, dtype=float) for name, value in data.items() if isinstance(value, list)}
    return Rig(n_axes=data["n_axes"], period_s=data["period_s"], **arrays)


def _open(order: dict[str, Any], members: list[Member], claims: Claims) -> Backend | None:
    try:
        for member in members:
            claims.take(member.label, member.claims)
        backend = compose(members, _rig(order["rig"]))
        backend.open()
    except BackendError as error:
        _say("ended", reason="device", detail=str(error))
        return None
    return backend


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


def main(memory_fd: int) -> int:
    """Run one loop from order to end. Returns the exit status: 0 shut down, 1 anything else."""
    stop = _stopped_by_signals()
    line = sys.stdin.readline()
    if not line:  # the host has died before it said what to do
        return 1
    order = json.loads(line)
    memory = Memory.attach(memory_fd)
    on_compiled.append(_compiled)
    began = time.monotonic()
    members = [Member.from_dict(device) for device in order["devices"]]
    for reader in order["log_readers"]:
        import_module(reader).register()
    claims = Claims()  # given back when this process ends
    backend = _open(order, members, claims)
    if backend is None:
        return 1
    device = Replug(backend, _note, _opening, Speech(backend, members, _words).listen)
    warm_up(memory, device)
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
    if not granted and order["realtime"] == "require" and not virtual:
        backend.stop()
        backend.close()
        _say("ended", reason="realtime", detail="real-time rights were refused")
        return 1
    try:
        run_loop(device, memory, clock, stop, waiver=not granted and not virtual)
    except Exception as error:  # noqa: BLE001 - the one allowed: whatever it was, the actuator is stopped; say it and end
        _say("ended", reason="error", detail=f"{type(error).__name__}: {error}", trace=traceback.format_exc())
        return 1
    finally:
        backend.close()
        for fd in held:
            os.close(fd)
    modules = sorted({name.partition(".")[0] for name in sys.modules})
    _say("ended", reason="shutdown" if stop.requests < 2 else "cut", detail="", modules=modules)
    return 0
