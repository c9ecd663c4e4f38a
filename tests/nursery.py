"""Programs of this project that are forked instead of started: `Program` is `subprocess.Popen` for commands
`python -m MODULE ...`.

A start of `rtctl run` takes 1.7 s of a core, 1.4 s of it imports and the loading of compiled code, of host
and loop. A *nursery* is a process that has done so; it forks a child for each command, in which the module
runs as `python -m` would run it: with the environment, folder, streams and signals of the caller. The host
that is born so forks its loop in the same way. The kernel makes the child the caller's, as any other.

What is about the start, the interpreter, the installation, a memory or an exit that Python has a part in,
stays with `subprocess`.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import fcntl
import gc
import io
import json
import os
import runpy
import signal
import socket
import subprocess
import sys
import threading
import traceback
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from types import FunctionType, SimpleNamespace

TESTS = Path(__file__).resolve().parent
CONFIGS = TESTS.parent / "configs"
READ_AT_IMPORT = ("PYTHON", "NUMBA", "LD_", "OPENBLAS", "OMP_", "HOME", "RTCTL_CACHE", "XDG_CACHE", "CACHE_")
"""Names of variables begin so that what runs, or was imported, looks at no more."""
RIGS = "mock.toml", "serial.toml"
"""Shipped rigs whose compiled code is there before the fork."""

_PR_SET_CHILD_SUBREAPER = 36
_MOST_BYTES = 1 << 20
_MOST_DESCRIPTORS = 16
_OF_STDOUT = sys.stdout.errors  # by the locale

at_birth_of_a_loop = []
"""Called in each loop that is forked from this process, before anything else."""


class Forked(subprocess.Popen):
    """A child of this very process, which has one thread and has imported what the child needs."""

    def _execute_child(
        self, args, executable, preexec_fn, _close_fds, pass_fds, cwd, env, _info, _flags, shell,
        p2cread, p2cwrite, c2pread, c2pwrite, errread, errwrite,
        _restore_signals, gid, gids, uid, umask, start_new_session, process_group,
    ):  # fmt: skip
        command = [os.fsdecode(word) for word in args]
        if any(one is not None for one in (preexec_fn, gid, gids, uid)) or shell or umask >= 0:
            raise ValueError("what is born cannot be made like this: use subprocess")
        if command[:2] != [sys.executable, "-m"]:
            raise ValueError(f"only `python -m` is born here, not {command}")
        order = {
            "command": command[2:],
            "env": dict(os.environ if env is None else env),
            "cwd": str(Path.cwd() / (cwd or "")),
            "session": start_new_session,
            "group": process_group,
            "cores": sorted(os.sched_getaffinity(0)),
            "ignored": [number for number in signal.valid_signals() if is_ignored(number)],
            "held": sorted(signal.pthread_sigmask(signal.SIG_BLOCK, ())),
        }
        streams = [own if own >= 0 else n for n, own in enumerate((p2cread, c2pwrite, errwrite))]
        try:
            self.pid = self._birth(order, streams, pass_fds)
            self._child_created = True
        finally:
            self._close_pipe_fds(p2cread, p2cwrite, c2pread, c2pwrite, errread, errwrite)

    def _birth(self, order, streams, pass_fds):
        pid = os.fork()
        if pid == 0:
            live(order, streams, {fd: fd for fd in pass_fds}, at_birth_of_a_loop)
        return pid


class Program(Forked):
    """A child forked by a nursery: by `nursery`, or by the one that all tests of a session share.

    `first` is Python that the child runs before it begins.
    """

    def __init__(self, command, *, nursery=None, first="", **more):
        self._nursery, self._first = nursery or shared(), first
        super().__init__(command, **more)

    def _birth(self, order, streams, pass_fds):
        order |= {"first": self._first, "kept": pass_fds}
        return self._nursery.bear(order, [*streams, *pass_fds])


run = FunctionType(subprocess.run.__code__, {**vars(subprocess), "Popen": Program})
"""`subprocess.run`, of a `Program`."""
run.__kwdefaults__ = subprocess.run.__kwdefaults__


class Nursery:
    """A process that forks programs. It ends with this one, or when it is closed."""

    def __init__(self):
        self._lock = threading.Lock()
        self._line, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._environment = read_at_import(os.environ)
        code = "import sys; sys.path.insert(1, sys.argv[1]); import nursery; nursery.serve(int(sys.argv[2]))"
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-c", code, TESTS, str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                pass_fds=(theirs.fileno(),),
            )

    def bear(self, order, descriptors):
        """Fork a child of the caller, with three streams and what the order numbers; its process id."""
        if changed := read_at_import(order["env"]).items() ^ self._environment.items():
            raise ValueError(f"what is born has read these already: {sorted(changed)}; use subprocess")
        with self._lock, _adopting():
            socket.send_fds(self._line, [json.dumps(order).encode()], descriptors)
            pid = int(self._line.recv(64) or 0)
            self._line.recv(64)  # its first parent has gone: it is ours
        assert pid, "the nursery has ended"
        return pid

    def close(self):
        """What was born there lives on."""
        self._line.close()
        self._process.wait()


@cache
def shared():
    return Nursery()  # of this session


@contextlib.contextmanager
def _adopting():
    """Have the kernel make this process the parent of a grandchild whose own one ends."""
    prctl = ctypes.CDLL(None).prctl
    prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    try:
        yield
    finally:
        prctl(_PR_SET_CHILD_SUBREAPER, 0, 0, 0, 0)


def read_at_import(environment):
    """The part of an environment that a running process looks at no more."""
    return {name: value for name, value in environment.items() if name.startswith(READ_AT_IMPORT)}


def is_ignored(number):
    return signal.getsignal(number) is signal.SIG_IGN and number not in (signal.SIGPIPE, signal.SIGXFSZ)


def live(order, streams, keep, first=()):
    """Be the program of this order, from its first instruction to its end. Never returns."""
    code = 1
    try:
        become(order, streams, keep)
        for one in first:
            one()
        exec(order.get("first", ""), {})
        code = code_of(order["command"][0])
        threading._shutdown()
        atexit._run_exitfuncs()
    except BaseException:  # noqa: BLE001 - a forked process must end here
        traceback.print_exc()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(code)


def become(order, streams, keep):
    """Take over what a program has of those who start it, and nothing else; `keep`: number there -> here."""
    if order["session"]:
        os.setsid()
    if order["group"] >= 0:
        os.setpgid(0, order["group"])
    wanted = {**dict(enumerate(streams)), **keep}
    above = max(*wanted, *wanted.values()) + 1  # no number that is to be given is in use there
    copies = [fcntl.fcntl(fd, fcntl.F_DUPFD, above) for fd in wanted.values()]
    for fd, number in zip(copies, wanted, strict=True):
        os.dup2(fd, number)
    for fd in [int(one.name) for one in Path("/proc/self/fd").iterdir()]:
        if fd not in wanted:
            with contextlib.suppress(OSError):  # that of the list itself
                os.close(fd)
    os.environ.clear()
    os.environ.update(order["env"])
    os.chdir(order["cwd"])
    sys.path[0] = order["cwd"]
    sys.argv = ["-m", *order["command"][1:]]
    os.sched_setaffinity(0, order["cores"])
    signal.set_wakeup_fd(-1)
    for number in signal.valid_signals() - {signal.SIGKILL, signal.SIGSTOP}:
        ignored = number in (*order["ignored"], signal.SIGPIPE, signal.SIGXFSZ)
        signal.signal(number, signal.SIG_IGN if ignored else signal.SIG_DFL)
    if signal.SIGINT not in order["ignored"]:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.pthread_sigmask(signal.SIG_SETMASK, order["held"])  # a nursery may begin while a host holds some
    sys.stdout, sys.stderr = text_stream(1), text_stream(2)


def text_stream(fd):
    """As Python makes them when it starts."""
    at_once = bool(os.environ.get("PYTHONUNBUFFERED"))
    raw = open(fd, "wb", buffering=0 if at_once else -1, closefd=False)  # noqa: SIM115 - for good
    by_line = not at_once and (fd == 2 or raw.isatty())
    errors = "backslashreplace" if fd == 2 else _OF_STDOUT
    return io.TextIOWrapper(raw, "utf-8", errors, line_buffering=by_line, write_through=at_once)


def code_of(module):
    """Run it as `python -m` does; its exit status."""
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    except SystemExit as ended:
        if ended.code is None or isinstance(ended.code, int):
            return (ended.code or 0) & 0xFF
        sys.stderr.write(f"{ended.code}\n")
        return 1
    return 0


def load_all():
    """Import what programs do, and load the compiled code of `RIGS`: no thread and no device is begun."""
    from rtctl import host, rt
    from rtctl.check import stability_report
    from rtctl.host import waiting_loop
    from rtctl.host.preparation import compile_rig
    from rtctl.host.safe_stop import SafeStop
    from rtctl.rig_file.config import load
    from rtctl.rt.clock import WallClock

    for room in (host, rt):  # much of it is imported only once a host, or a loop, has begun
        for one in walk_packages(room.__path__, f"{room.__name__}."):
            if not one.name.endswith("__main__"):
                import_module(one.name)
    for rig in RIGS:
        loaded = load(CONFIGS / rig)
        stability_report.examine(loaded, telling=False)
        compile_rig(loaded)
        SafeStop(loaded)
    WallClock()
    import_module("rtctl.cli.run")
    waiting_loop.subprocess = makes_loops(popen_of_a_loop)
    gc.collect()
    gc.freeze()  # else each child looks through what it was born with, and has a copy of all that made


def makes_loops(popen):
    return SimpleNamespace(Popen=popen, PIPE=subprocess.PIPE, DEVNULL=subprocess.DEVNULL)  # of `waiting_loop`


def popen_of_a_loop(command, **more):
    """A host begins with its loop; what has threads by then starts it, as ever."""
    return (Forked if threads() == 1 else subprocess.Popen)(command, **more)


def threads():
    return sum(1 for _ in Path("/proc/self/task").iterdir())


def serve(line_fd):
    """Be a nursery, until whoever made it closes the line."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # of a terminal, say; the line says when to end
    load_all()
    assert threads() == 1, "a fork takes one thread with it"
    with socket.socket(fileno=line_fd) as line:
        while True:
            text, descriptors, _, _ = socket.recv_fds(line, _MOST_BYTES, _MOST_DESCRIPTORS)
            if not text:
                return
            born, bearing = os.pipe()  # ends when all others of this birth have let go
            if (middle := os.fork()) == 0:
                pid = os.fork()
                if pid == 0:
                    os.close(bearing)
                    os.read(born, 1)
                    order = json.loads(text)
                    live(order, descriptors[:3], dict(zip(order["kept"], descriptors[3:], strict=True)))
                line.send(str(pid).encode())
                os._exit(0)
            os.waitpid(middle, 0)
            line.send(b"gone")
            for fd in (born, bearing, *descriptors):
                os.close(fd)
