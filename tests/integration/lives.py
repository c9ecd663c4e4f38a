"""Sixty daemons in a minute: real hosts and loops, forked from a process that has imported and compiled
already.

`python lives.py CONFIG` is that process. It takes one JSON order per line, `{"start": ...}` or
`{"poll": pid}`, and answers each with one line. What is forked is the daemon's own code, `Host` and
`rtctl.rt.__main__`; only the interpreter's start is left out, and the rig is ready and armed sooner
(`QUICK`).
"""

import contextlib
import ctypes
import gc
import json
import os
import signal
import subprocess
import sys
import traceback
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

from hw.rig import compose
from rtctl.check import law_plan as plan
from rtctl.errors import FaultError, RtctlError
from rtctl.host import waiting_loop
from rtctl.host.safe_stop import SafeStop
from rtctl.host.supervisor import Host
from rtctl.recording.law_arrays import LawArrays
from rtctl.recording.law_runner import LawRunner
from rtctl.rig_file.config import load
from rtctl.rt import __main__ as rt
from rtctl.rt.clock import WallClock
from rtctl.rt.loop import warm_up
from rtctl.rt.shared_memory import Memory

FOLLOWING = (
    "rtctl.host.exchange.gateway", "rtctl.host.preparation", "rtctl.host.run_record", "rtctl.host.reload",
    "rtctl.host.exchange.device_words", "rtctl.host.exchange.friction_watch",
    "rtctl.host.exchange.late_counters",
    "rtctl.host.exchange.late_tasks", "rtctl.host.exchange.late_watch",
    "rtctl.host.exchange.rig_description",
    "rtctl.host.exchange.streams", "rtctl.host.view_process", "rtctl.recording.setup",
    "rtctl.recording.state_folder", "rtctl.rt.process",
)  # fmt: skip
"""What a host imports only once its loop has begun, and a loop as it begins; here it is there before the
fork."""

QUICK = {
    "READY_S": 0.1,
    "SOFT_START_S": 0.3,
    "MIN_SOFT_START_TICKS": 10,
    "ARMING_PART_S": 0.06,
    "STALE_LIMIT_TICKS": 6,
    "LATE_LIMIT_TICKS": 30,
}
"""Life is short here: ready after 0.1 s; parts of the test pulse that are several ticks at 100 Hz; and a rig
that survives the lateness of a machine that runs six rigs and other tests. The board's time to live is as
ever."""

_PR_SET_PDEATHSIG = 1


def say(text):
    os.write(1, (text + "\n").encode())


class Forked:
    """`subprocess.Popen` as far as `WaitingLoop` and `LoopProcess` use it."""

    def __init__(self, _command, *, stdin, stdout, pass_fds, env):
        said_read, said_write = os.pipe()
        self.returncode = None
        self.pid = os.fork()
        if self.pid == 0:
            self._become_the_loop(said_write, pass_fds)
        os.close(said_write)
        self.stdout = os.fdopen(said_read, "rb", buffering=0)

    @staticmethod
    def _become_the_loop(said, pass_fds):
        try:
            os.dup2(said, 1)
            for fd in [int(one.name) for one in Path("/proc/self/fd").iterdir()]:
                if fd > 2 and fd not in pass_fds:
                    try:
                        os.close(fd)
                    except OSError:
                        continue
            # punctual; without the locked memory of a fork's 500 MB
            with contextlib.suppress(PermissionError):
                os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
            signal.set_wakeup_fd(-1)  # of the host: a new program would not have it
            sys.argv = ["rtctl.rt", str(pass_fds[0]), str(os.getppid())]
            os._exit(rt.main())
        except BaseException:  # noqa: BLE001 - a forked process must end here
            traceback.print_exc()
            os._exit(70)

    def _reap(self, options):
        if self.returncode is None:
            pid, status = os.waitpid(self.pid, options)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode

    def poll(self):
        return self._reap(os.WNOHANG)

    def wait(self, timeout=None):
        if timeout is None:
            return self._reap(0)
        for _ in range(int(timeout * 1000)):
            if self.poll() is not None:
                return self.returncode
            signal.sigtimedwait([], 0.001)
        raise subprocess.TimeoutExpired("the loop", timeout)

    def send_signal(self, number):
        if self.poll() is None:
            os.kill(self.pid, number)

    def terminate(self):
        self.send_signal(signal.SIGTERM)

    def kill(self):
        self.send_signal(signal.SIGKILL)


def host_main(config, folder, said):
    """One daemon, from its start to its end; its last words go to `said`. Never returns."""
    code = 70
    try:
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        out = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND, 0o600)
        null = os.open(os.devnull, os.O_RDONLY)
        for fd, to in ((null, 0), (out, 1), (out, 2)):
            os.dup2(fd, to)
        for name, value in QUICK.items():
            setattr(plan, name, value)
        waiting_loop.subprocess = SimpleNamespace(
            Popen=Forked, PIPE=subprocess.PIPE, DEVNULL=subprocess.DEVNULL
        )
        try:
            with Host(load(Path(config)), runtime_dir=folder, announce=say) as host:
                summary = host.run()
            say(json.dumps({"state": summary["state"], "fault_first": summary["fault_first"]}))
            code = FaultError.exit_code if summary["fault_first"] else 0
        except RtctlError as error:
            say(json.dumps({"error": type(error).__name__, "message": str(error)}))
            code = error.exit_code
    except BaseException:  # noqa: BLE001 - a forked process must end here
        traceback.print_exc()
    os._exit(code)


def nursery(config):
    """Serve orders until standard input ends."""
    loaded = load(Path(config))
    made = plan.build(loaded)
    memory = Memory.create(made.n_axes, 8, made.period_ns)
    backend = compose(list(loaded.members()), loaded.config.hardware())
    warm_up(memory, backend)
    SafeStop(loaded)
    WallClock()
    for name in FOLLOWING:
        import_module(name)
    LawRunner(LawArrays(made.params, made.model, made.command), made.n_axes)  # the record's own
    memory.close()
    gc.freeze()  # else each life looks through what it was born with, and has a copy of all that made
    say("ready")
    for line in sys.stdin:
        order = json.loads(line)
        if "poll" in order:
            pid, status = os.waitpid(order["poll"], os.WNOHANG)
            answer = os.waitstatus_to_exitcode(status) if pid else None
        else:
            answer = os.fork()
            if answer == 0:
                host_main(*order["start"])
        say(json.dumps(answer))


if __name__ == "__main__":
    nursery(sys.argv[1])
