"""The host process: starts the loop, owns every socket, watches, and makes the rig safe when it ends.

One thread, one poller: signals, the loop's words, client requests, and every `telemetry.batch_ms` the new
ticks. Ctrl-C or SIGTERM ramps the torque down; a second one cuts it."""
# longer than 300 lines: one process with one thread; what it does is in the rooms beside, in which order is
# here

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import zmq

from rtctl.check import law_plan as planning
from rtctl.check import stability_report
from rtctl.check.verdict import Outcome, named
from rtctl.errors import FaultError, LoopDiedError, RtctlError, TerminatedError
from rtctl.host.exchange.run_statistics import RunStatistics
from rtctl.host.heartbeat import Heartbeat, promised_ticks
from rtctl.host.loop_guard import LoopGuard
from rtctl.host.loop_process import Compiling, LoopProcess
from rtctl.host.notices import Notices
from rtctl.host.notify import Notifier
from rtctl.host.outlet import streams_that_never_wait
from rtctl.host.signals import Signals
from rtctl.host.speaker import Speaker
from rtctl.host.waiting_loop import WaitingLoop, require_one_version, require_threads
from rtctl.recording.state_folder import state_folder
from rtctl.rig_file.config import LoadedConfig
from rtctl.rt.early import MARGIN, Look
from rtctl.rt.shared_memory import CommandWriter, Memory, RingReader
from rtctl.wire.endpoints import RuntimeDirectory, kept_alone
from rtctl.wire.entrances import Access
from rtctl.wire.freed_memory import Heap
from rtctl.wire.intruders import Resident
from rtctl.wire.openings import Openings

if TYPE_CHECKING:
    from rtctl.host.exchange.rig_description import RigDescription

FIRST_TOLD_S, TELL_EVERY_S = 2.0, 10.0
"""When a person who waits for the start is told why, and how often."""

READY_TIMEOUT_S = 300.0  # without another function compiled: a first start on a slow or busy machine goes on
# a ramp takes 50 ms, and a device that is being opened is excused
STOP_TIMEOUT_S = 2.0

EPOCH_BITS = 31
"""The first epoch of a daemon is a random number of so many bits: what a client asks by the epoch of one that
has ended is void with the next one."""

LOOK_S = 1.0
"""How often the sockets are looked for: a daemon that no new client can reach could not be stopped by one."""

KEEPING_UP_S = 1e-3
"""Between two batches for an observer that gives orders, on a virtual clock."""
MOST_TICKS = 256
"""Taken from the ring in one turn, on a wall clock: after a standstill of the host there are thousands, and
the memory that they need at once would stay with the process for as long as it lives (0.9 MB for 2,000 of one
axis)."""


class Observer(Protocol):
    """Something in the host that follows the ticks and may give commands (demo, recorder, auto-arm)."""

    def __call__(self, host: Host, rows: np.ndarray) -> None:
        """Look at a batch of new ticks (may be empty)."""


def _why_waiting(loop: Compiling | None, host: int) -> str:
    """What a start waits for: the loop has compiled so much, and the host's own process `host` functions."""
    if loop is None and not host:
        return "the loop process is not ready yet: it loads what it needs, then opens the devices"
    told = [f"{loop.functions} functions of the loop so far, of at most {loop.most}"] if loop else []
    told += [f"{host} of the host"] if host else []
    only = (
        "on the first start of a version only, about a minute"
        if loop is not None and loop.first
        else "what no start before this one needed"
    )
    return f"compiling for this machine, {only}: {'; '.join(told)}"


class Host:
    """One rig's host. A context manager: entering starts the loop, leaving stops it and cleans up.

    Parameters
    ----------
    loaded
        The validated rig file.
    observers
        Called in order with every batch of ticks.
    runtime_dir
        Where sockets and lock live; default see `rtctl.wire.endpoints`.
    record_to
        Record into this folder, whatever the rig file says.
    model
        Friction model of the first axis for its programs, shape (1,), dtype `MODEL`, in place of the rig
        file's.
    notices
        Where changes of state, faults and a broken recording are said as they happen; None: nowhere.
    announce
        Receives one-line notes for a person (starting, compiling, real-time rights refused). It may print:
        while the host lives, nothing that this process writes to stdout or stderr makes it wait
        (`rtctl.host.outlet`).
    waiting
        A loop process that was started already and becomes this rig's; None: one is started on entering."""

    def __init__(
        self,
        loaded: LoadedConfig,
        *,
        observers: Sequence[Observer] = (),
        runtime_dir: str | None = None,
        announce: Callable[[str], None] = lambda _text: None,
        notices: Notices | None = None,
        record_to: Path | None = None,
        model: np.ndarray | None = None,
        waiting: WaitingLoop | None = None,
    ) -> None:
        self.loaded = loaded
        self.read_last = loaded.config  # by SIGHUP: its environments are in force
        self.observers = list(observers)
        self.announce = announce
        self.speaker = Speaker(notices)
        self.statistics = RunStatistics()
        self._runtime_dir = runtime_dir
        self._record_to = record_to
        self._model = model
        self._waiting = waiting
        self._finished = False
        self._lost, self._look_at_s = "", 0.0
        self._tell_at_s = FIRST_TOLD_S
        self._ending_since: float | None = None
        self._streams = ExitStack()

    def __enter__(self) -> Host:
        with self._waiting or WaitingLoop() as waiting:
            self._check()
            self.began = time.monotonic()
            self.plan = planning.build(self.loaded)
            if self._model is not None:
                self.plan.model[0] = self._model[0]
            # holds the lock that keeps a second daemon off the rig (decision 0001)
            self.runtime = RuntimeDirectory.acquire(self.loaded.config.rig.name, self._runtime_dir)
            try:
                name = self.loaded.config.rig.name
                self._streams.enter_context(kept_alone(name, state_folder(name)))
                self._start(waiting)
            except BaseException:
                self._close()
                raise
        return self

    def _check(self) -> None:
        report = stability_report.examine(self.loaded, telling=False)
        report.require()
        self._not_proved = tuple(named(report.verdicts, Outcome.NOT_PROVED))
        if self._not_proved:
            rows = "; ".join(self._not_proved)
            self.announce(f"warning: not proved (rtctl check says what that means): {rows}")

    def _start(self, waiting: WaitingLoop) -> None:
        # before the loop drives a rig: a signal must not end this process without ending the loop
        self.signals = Signals()
        self._streams.enter_context(streams_that_never_wait())
        self.notifier = Notifier()
        plan = self.plan
        self.memory = Memory.create(plan.n_axes, plan.ring_rows, plan.period_ns)
        self.memory.params[:] = plan.params
        self.memory.model[:] = plan.model
        # from_start: events begin at the first tick, which the loop makes before this process follows
        self.reader = RingReader(self.memory, from_start=True)
        virtual = self.loaded.config.loop.clock == "virtual"
        self._most_ticks = self.memory.ring_rows if virtual else MOST_TICKS
        self.writer = CommandWriter(self.memory)
        # sent before there is a loop: its first look finds the environments of the rig file, not zeros
        self.writer.command[:] = plan.command
        self.writer.command["epoch"] = secrets.randbits(EPOCH_BITS) or 1
        self.writer.send()
        endpoints, openings = self.runtime.endpoints, Openings.of(self.loaded)
        if openings.group is not None:
            self.runtime.open_to(openings.group)
        require_threads()
        self.context = zmq.Context()
        resident = None if virtual else self._streams.enter_context(closing(Resident()))
        self.access = Access(self.context, endpoints, openings, Notices(), resident=resident)
        readers = self._log_readers()
        self.loop = LoopProcess(self.loaded, self.memory, self.runtime.lock_fd, readers, waiting)
        # who finds the rig locked is told of both: either may be the one that still holds it
        self.runtime.note_holder(self.loop.pid)
        self._attach()

    def _log_readers(self) -> list[str]:
        """What the loop needs beyond `hw` to read a log that is played back; nothing is imported for other
        rigs."""
        members = self.loaded.members()
        if all(member.kind != "playback" for member in members):
            return []
        from rtctl.recording.as_columns import log_readers

        return log_readers(members)

    def _attach(self) -> None:
        """Follow and serve the loop. What that needs is imported here, while the loop opens its devices."""
        from rtctl.host.exchange.device_words import DeviceWords
        from rtctl.host.exchange.force_zero import ForceZero
        from rtctl.host.exchange.friction_watch import FrictionWatch
        from rtctl.host.exchange.gateway import Gateway
        from rtctl.host.exchange.rig_description import describe_run
        from rtctl.host.exchange.streams import Telemetry
        from rtctl.host.preparation import Preparation
        from rtctl.host.run_record import RunRecord
        from rtctl.recording.law_arrays import LawArrays

        plan, endpoints = self.plan, self.runtime.endpoints
        self.preparation = Preparation(plan.n_axes)
        self.guard = LoopGuard(self.loaded, self.loop, self.memory, plan.period_s)
        rig = describe_run(self.loaded, plan.params, self._not_proved)
        self._batch_s = rig.batch_s
        self.words = DeviceWords(rig)
        tables = [axis.friction.drift for axis in self.loaded.config.axis]
        self.friction = FrictionWatch(rig, plan.params, plan.model, tables, state_folder(rig.name))
        self.zero = ForceZero(rig, state_folder(rig.name))
        self.telemetry = Telemetry(
            self.context, endpoints, rig, access=self.access, words=self.words, friction=self.friction
        )
        self.gateway = Gateway(
            self.context,
            endpoints,
            self.writer,
            rig,
            self.reader.latest,
            access=self.access,
            book=self.telemetry.book,
            friction=self.friction,
            zero=self.zero,
            motors=self.telemetry.motors,
            announce=self.announce,
            refused=self.speaker.refused,
        )
        self.telemetry.commands = self.gateway.counts
        # before whatever loads the law: it would be compiled in here, and its compiler stay for good
        self._wait_for(self.preparation.done)
        law = LawArrays(plan.params, plan.model, plan.command)
        kept = self._record_to, self.words, self.friction, self.zero
        self.record = RunRecord(self.loaded, rig, law, self.writer, self.telemetry, *kept)
        self._serve(rig)

    def _serve(self, rig: RigDescription) -> None:
        """From the first tick on: tell what was granted, watch late ticks, begin the record and open the
        view."""
        from rtctl.host.view_process import ViewProcess
        from rtctl.recording.setup import setup_of
        from rtctl.wire.event_words import cut_off_line

        self._wait_for(self._ticking)  # clients are answered once there is a tick to speak of
        # not earlier: the loop says what it imported once its devices are open
        self.guard.know(self.loop.opened_by)
        for grant in self.loop.grants:
            if grant["required"] and not grant["granted"]:
                self.announce(f"warning: {grant['right']} refused: {grant['detail']}")
        self.loop.leave_it_its_core()
        self._watch_late()
        self.telemetry.set_realtime(self.loop.grants)
        self.telemetry.early = Look(self.memory.early_ns).told
        self.record.begin(setup_of(self.loaded, self.plan, rig.session, rig.start_wall_ns, self.loop.grants))
        if (cut_off := self.record.flight.cut_off) is not None:
            self.announce(f"{cut_off_line(cut_off)}: rtctl events {rig.name}")
        self.view = ViewProcess.of(self.loaded, self.runtime, self.loop.core)
        # last: what this process and the loop import late they have imported by now
        require_one_version()
        self.notifier.ready()

    def _watch_late(self) -> None:
        """Follow late ticks and their causes; on a virtual clock there are none."""
        from rtctl.host.exchange.late_counters import Counters
        from rtctl.host.exchange.late_exits import exits
        from rtctl.host.exchange.late_tasks import Tasks
        from rtctl.host.exchange.late_trace import trace
        from rtctl.host.exchange.late_watch import LateWatch

        pid, core = self.loop.pid, self.loop.core
        seen = self.loaded.config.loop.clock != "virtual"
        counters, tasks = (Counters(pid, core), Tasks(pid, exits=exits())) if seen else (None, None)
        watched = trace(pid) if seen else None
        self.late = LateWatch(counters, tasks, self.plan.period_ns, self._early_ns, watched)
        self._streams.enter_context(closing(self.late))
        self.telemetry.set_late(self.late)
        self.record.flight.set_late(self.late)

    def _early_ns(self) -> int:
        return int(self.memory.early_ns[MARGIN])

    def _ticking(self) -> bool:
        # ready says that the devices are open, a tick that the law runs
        return self.loop.ready and int(self.memory.header[0]["head"]) > 0

    def _wait_for(self, ready: Callable[[], bool]) -> None:
        """Wait for what is being compiled or opened, telling a person when it takes long."""
        before, since_s = None, 0.0
        while True:
            # first: what a part of another version says, or dies of, is told as what it is
            require_one_version()
            if ready():
                return
            if not self.loop.poll():
                self.loop.raise_if_failed()
            waited = time.monotonic() - self.began
            so_far = self.loop.compiling, self.preparation.compiled()
            if so_far != before:
                before, since_s = so_far, waited
            if waited > self._tell_at_s:
                self._tell_at_s = waited + TELL_EVERY_S
                self.announce(_why_waiting(*so_far))
            if self.signals.ends:
                raise TerminatedError if self.signals.terminated else KeyboardInterrupt
            if waited - since_s > READY_TIMEOUT_S:
                raise LoopDiedError(
                    f"the loop process was not ready after {waited:.0f} s, and nothing was compiled for "
                    f"{READY_TIMEOUT_S:g} s; what was compiled is kept: start again"
                )
            time.sleep(0.005)

    # -- running

    def run(self, seconds: float | None = None) -> dict[str, Any]:
        """Serve until `seconds` have passed, a signal, `finish()`, or the end of the loop.

        Returns the closing summary. Raises LoopDiedError, DeviceError or RealtimeError: the loop failed."""
        from rtctl.host import reload
        from rtctl.host.exchange.gateway import PAUSE_S

        poller = zmq.Poller()
        self.gateway.register(poller)
        # the end of a pipe wakes, too: of a loop that is killed the host hears at once
        poller.register(self.loop.fileno(), zmq.POLLIN)
        poller.register(self.signals.fileno(), zmq.POLLIN)
        end = None if seconds is None else time.monotonic() + seconds
        next_batch, heap = time.monotonic(), Heap()
        heart = Heartbeat(self.writer, promised_ticks(self.loaded.config))
        while True:
            # first in a turn: it says that the turn before came to its end, STOPs and all
            heart.beat(time.monotonic())
            wait_s = min(next_batch - time.monotonic(), self.guard.look_s)
            # never below 0: a negative time would wait for ever
            if self.signals.fileno() in dict(poller.poll(max(0, round(wait_s * 1e3)))):
                self.signals.drain()
            if self.gateway.serve():
                time.sleep(PAUSE_S)  # a flood waits in its senders
            alive = self.loop.poll()
            # before anything else of this turn: the torque is on its own
            aftermath = "" if alive else self.guard.make_safe()
            for note in self.loop.take_notes():
                self.announce(f"device {note}")
            now = time.monotonic()
            if now >= next_batch or not alive:
                self._batch()
                # a dead loop's last ticks are in shared memory, and tell why it died
                while self.reader.waiting and not alive:
                    self._batch()
                next_batch = (
                    # still behind: on with it in the next turn, which looks at the loop first
                    now if self.reader.waiting > self._most_ticks else max(next_batch + self._batch_s, now)
                )
                heap.look(now)
            if not alive:
                break
            ended = self.loop.ended is not None
            if ended or self.signals.ends or self._finished or (end is not None and now >= end):
                self._begin_end(now)
            if self.signals.hangups:
                self.signals.hangups = 0
                reload.reload(self)
            self.guard.look()
            self._look_for_sockets(now)
        self.loop.raise_if_failed(aftermath)
        return self._end_of_record()

    def _end_of_record(self) -> dict[str, Any]:
        self.record.finish()
        self.speaker.tell([], self.record.broken())
        if self._lost:
            raise RtctlError(self._lost)
        return self.summary()

    def _look_for_sockets(self, now: float) -> None:
        if now < self._look_at_s or self._lost:
            return
        self._look_at_s = now + LOOK_S
        if why := self.runtime.lost():
            self._lost = (
                f"no client could reach the rig to stop it, so it was stopped: {why}; keep the folder of "
                "sockets where nothing removes it (RTCTL_RUNTIME_DIR, or `rtctl service install`)"
            )
            self.finish()

    def _batch(self) -> None:
        rows = self.reader.read(self._most_ticks)
        self.loop.poll()  # after the ticks: the words that belong to a fault are there before it is read
        for said in self.loop.take_words():
            self.words.hear(said)
        self.statistics.update(rows)
        self.late.follow(rows, time.monotonic_ns())
        self.gateway.latency.observe(rows)
        # before the record: events of this batch tell the warning that stopped it
        if self.friction.follow(rows):
            self.gateway.stop()
        if (change := self.friction.changes()) is not None:
            self.writer.command["friction_change"] = change
            self.writer.send()
        events = self.record.keep(self.reader.next - len(rows), rows)
        self.speaker.tell(events, self.record.broken())
        self.telemetry.publish(rows, self.reader.overwritten)
        self.notifier.alive(int(self.memory.header[0]["head"]), excused=self.loop.opening)
        if len(rows):
            last = rows[-1]
            self.notifier.status(int(last["state"]), int(last["faults"]), int(last["fault_first"]))
        for observer in self.observers:
            observer(self, rows)
        if self.view is not None and self._ending_since is None:  # a rig that ends starts no view anew
            for text in self.view.news():
                self.announce(text)

    def finish(self) -> None:
        """Ask the run to end: torque ramps down, then `run` returns."""
        self._finished = True

    def _begin_end(self, now: float) -> None:
        """Ask the loop to shut down; insist when it does not."""
        if self._ending_since is None:
            self._ending_since = now
            self.notifier.stopping()
            self.writer.command["shutdown_count"] += 1
            self.writer.send()
        if self.loop.opening:
            self._ending_since = now  # it looks at requests once per tick
        if self.signals.ends > 1:
            self.signals.ends = 1  # so that each further signal cuts once more
            self.loop.cut()
        if now - self._ending_since > STOP_TIMEOUT_S:
            self.loop.kill()

    # -- commands of the host itself (the gateway serves everybody else)

    def arm(self, epoch: int) -> None:
        """Ask the law to arm in `epoch`, that of the tick in which somebody decided to: a stop since then
        voids it. Raises FaultError where the force sensor was tared under a hand."""
        if self.zero.taring(int(self.writer.command["tare_count"][0])):
            return  # the law would not arm yet either
        if why := self.zero.refusal():
            raise FaultError(why)
        self.writer.command["epoch"] = epoch
        self.writer.command["arm_count"] += 1
        self.writer.send()

    def set_compensation(self, share: float) -> None:
        """Share of the configured friction feed-forward, 0 to 1, on all axes."""
        self.writer.command["compensation"] = share
        self.writer.send()

    def keep_up(self) -> None:
        """For an observer that gives orders: a virtual clock runs ahead of it by one batch, as far as a wall
        clock does."""
        if self.loaded.config.loop.clock == "virtual":
            self.memory.header["ahead_rows"] = max(1, round(self._batch_s / self.plan.period_s))
            self._batch_s = KEEPING_UP_S

    def summary(self) -> dict[str, Any]:
        """The closing summary: what ran, how punctually, what was published, which faults."""
        return {
            "rig": self.loaded.config.rig.name,
            **self.statistics.summary(),
            "telemetry": self.telemetry.counts(),
            "overwritten": self.reader.overwritten,
            "realtime": self.loop.grants,
            "early_us": round(int(self.memory.early_ns[MARGIN]) / 1e3, 1),
            **self.record.summary(),
        }

    # -- end

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close(error)

    def _end_loop(self, loop: LoopProcess) -> None:
        """However it fares: no loop is left behind, and no torque."""
        if loop.poll():
            loop.terminate()
            loop.wait(1.0)
        loop.close()
        if hasattr(self, "guard") and (done := self.guard.make_safe()):
            self.announce(done)

    def _close(self, error: BaseException | None = None) -> None:
        if hasattr(self, "loop"):
            self._end_loop(self.loop)  # the torque first; the rest may take its time
        if (view := getattr(self, "view", None)) is not None:
            view.close()
        record = getattr(self, "record", None)
        if record is not None:
            record.close(error)
        for name in ("preparation", "gateway", "telemetry", "access"):
            part = getattr(self, name, None)
            if part is not None:
                part.close()
        if hasattr(self, "signals"):
            self.signals.close()
        if hasattr(self, "context"):
            self.context.destroy(linger=0)  # a start that failed half way leaves sockets open
        if hasattr(self, "memory"):
            self.memory.close()
        if hasattr(self, "runtime"):
            self.runtime.release()
        if hasattr(self, "notifier"):
            self.notifier.close()
        self._streams.close()
