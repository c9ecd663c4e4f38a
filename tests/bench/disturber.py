"""What takes a core on request: `python -m tests.bench.disturber KIND CORE PRIORITY`, a spell for every line
that it reads.

| kind | what a spell is |
|---|---|
| `task` | this process computes on the core |
| `ended` | a child that was there for long computes on the core, and ends |
| `brief` | a child is begun, computes on the core, and ends |
| `flood` | datagrams to many listeners, delivered in softirqs of the core and sent from another one |

PRIORITY is that of SCHED_FIFO; 0: an ordinary task. A flood is one of a network of its own
(`unshare --net --mount`).
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import os
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rtctl.errors import RtctlError
from tests.bench.child import end

SPELL_S = 0.02
"""How long a spell takes the core."""

MADE = 0.9
"""Least share of a spell for which a task must have had the core: else somebody else had it, and who made a
tick late is not known."""

NAME = "rtctl-hog"
"""Of every task that computes."""

FIRST = -20
"""Niceness of an ordinary task that disturbs: what else the machine does has little of the core meanwhile."""

LISTENERS = 16
GROUP, PORT = "239.1.1.1", 5007

PR_SET_PDEATHSIG = 1

SIOCGIFFLAGS, SIOCSIFFLAGS, IFF_UP, IFF_MULTICAST = 0x8913, 0x8914, 0x1, 0x1000


@contextmanager
def disturber(kind: str, core: int, priority: int = 0, children: int = 0) -> Iterator[Callable[[], bool]]:
    """The process; what is yielded asks for one spell, and returns after it whether that was made as it
    should.

    `children` is how many spells `ended` may be asked for. Raises RtctlError where this user may not do that.
    """
    command = [
        sys.executable,
        "-m",
        "tests.bench.disturber",
        kind,
        *(str(number) for number in (core, priority, children)),
    ]
    if kind == "flood":
        command = ["unshare", "--net", "--mount", *command]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=Path(__file__).parents[2]
    )
    assert process.stdin is not None
    assert process.stdout is not None
    asked, done = process.stdin, process.stdout

    def spell() -> bool:
        asked.write(b"\n")
        asked.flush()
        answer = done.readline()
        if not answer:
            raise RtctlError(f"{kind}: the disturbing process has ended")
        return answer == b"made\n"

    try:
        if done.readline() != b"ready\n":
            raise RtctlError(f"{kind}: the disturbing process may not do that; run as root")
        yield spell
    finally:
        asked.close()
        done.close()
        end(process)


def _say(word: str) -> None:
    sys.stdout.write(f"{word}\n")
    sys.stdout.flush()


def _onto(core: int, priority: int) -> None:
    Path("/proc/self/comm").write_text(NAME)
    os.sched_setaffinity(0, {core})
    if priority:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    else:
        _first()


def _first() -> None:
    """Ahead of other ordinary tasks, and of other sessions where the kernel shares the time out among
    these.
    """
    os.nice(FIRST)
    with contextlib.suppress(OSError):
        os.setsid()
        Path("/proc/self/autogroup").write_text(str(FIRST))


def _compute() -> bool:
    """Compute for a spell; whether this task had the core for most of it."""
    began, ran = time.monotonic(), time.thread_time()
    while time.thread_time() - ran < SPELL_S:
        pass
    return MADE * (time.monotonic() - began) <= SPELL_S


def _child(core: int, priority: int, go: int) -> int:
    """A child that computes once the other end of the pipe `go` is written to (-1: at once), and ends."""
    pid = os.fork()
    if pid == 0:
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        _onto(core, priority)
        os._exit(int(not ((go < 0 or os.read(go, 1)) and _compute())))
    return pid


def _waited(pid: int) -> bool:
    return os.waitpid(pid, 0)[1] == 0


def _children(core: int, priority: int, count: int) -> Callable[[], bool]:
    """Children that are there, one of which computes and ends at each call."""
    waiting = []
    for _ in range(count):
        hears, tells = os.pipe()
        waiting.append((tells, _child(core, priority, hears)))
        os.close(hears)

    def spell() -> bool:
        tells, pid = waiting.pop()
        os.write(tells, b"\n")
        made = _waited(pid)
        os.close(tells)
        return made

    return spell


def _off(core: int) -> None:
    """Onto any core but this one, where there is another."""
    with contextlib.suppress(OSError):
        os.sched_setaffinity(0, os.sched_getaffinity(0) - {core})


def _network(core: int) -> None:
    """Bring up loopback in a network of its own, whose packets the core receives whoever sends them."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        request = struct.pack("16sh22x", b"lo", 0)
        (flags,) = struct.unpack_from("h", fcntl.ioctl(any_socket, SIOCGIFFLAGS, request), 16)
        more = struct.pack("16sh22x", b"lo", flags | IFF_UP | IFF_MULTICAST)
        fcntl.ioctl(any_socket, SIOCSIFFLAGS, more)
    subprocess.run(["mount", "-t", "sysfs", "sysfs", "/sys"], check=True)
    Path("/sys/class/net/lo/queues/rx-0/rps_cpus").write_text(f"{1 << core:x}")


def _flood(core: int) -> Callable[[], bool]:
    _network(core)
    _first()
    listeners = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(LISTENERS)]
    for listener in listeners:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((GROUP, PORT))
        member = socket.inet_aton(GROUP) + socket.inet_aton("127.0.0.1")
        listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
    source = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    source.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
    source.setblocking(False)

    def spell() -> bool:
        began = time.monotonic()
        while time.monotonic() - began < SPELL_S:
            with contextlib.suppress(BlockingIOError):
                source.sendto(b"x" * 64, (GROUP, PORT))
        for listener in listeners:  # empty for the next spell
            with contextlib.suppress(BlockingIOError):
                while listener.recv(128, socket.MSG_DONTWAIT):
                    pass
        return True

    return spell


def _spell_of(kind: str, core: int, priority: int, children: int) -> Callable[[], bool]:
    if kind == "task":
        _onto(core, priority)
        return _compute
    _off(core)
    if kind == "ended":
        return _children(core, priority, children)
    if kind == "brief":
        return lambda: _waited(_child(core, priority, -1))
    return _flood(core)


def main(kind: str, core: int, priority: int, children: int) -> None:
    """Disturb whenever a line comes."""
    try:
        spell = _spell_of(kind, core, priority, children)
    except (OSError, subprocess.CalledProcessError) as error:
        _say(f"refused: {error}")
        return
    _say("ready")
    for _ in sys.stdin:
        _say("made" if spell() else "shared")


if __name__ == "__main__":
    main(sys.argv[1], *(int(number) for number in sys.argv[2:5]))
