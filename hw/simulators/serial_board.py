"""A board that is not there: `python -m hw.simulators.serial_board --link PATH`, a process behind a pty.

It runs the reference firmware (`serial_firmware`) around the simulated rig (`mock_backend`), either
on its own clock or, with `--step`, one cycle per command packet. On standard input (`--control`) it takes one
order per line and answers each with one line, `ok ...` or `error ...`:

    flip N | drop N | duplicate N | stall N     damage the next N state packets (stall: N silent cycles)
    unplug | plug                               the pty vanishes, or comes back under the same link
    cycles N | sample                           with --step: N cycles without a command; the newest sample
    estop 0|1, fault 0|1, noforce 0|1, novelocity 0|1, nomoment 0|1    inputs of the board
    identity NAME                               be another board from now on
    reset                                       power-up: sequence, clock, counter and plant start over
    quit

It ends on SIGTERM, and with its parent."""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import gc
import os
import select
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from hw.simulators.serial_line import Damage, Line
from hw.simulators.serial_observation import Observation
from hw.simulators.serial_rig import Simulation, read_described, read_rig

_PR_SET_PDEATHSIG = 1  # linux/prctl.h and sys/mman.h
_MCL_CURRENT, _MCL_FUTURE = 1, 2

REALTIME_PRIORITY = 70


class Control:
    """Orders on standard input."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation, self._pending, self.ended = simulation, b"", False
        # looked at in every cycle: an order that does not come must not stop the clock of the board
        os.set_blocking(0, False)

    def poll(self) -> None:
        """Carry out the orders that have come, answering each."""
        with contextlib.suppress(BlockingIOError):
            data = os.read(0, 65536)
            if not data:
                self.ended = True
            self._pending += data
        *lines, self._pending = self._pending.split(b"\n")
        for line in lines:
            _say(self._carry_out(line.decode(errors="replace").split()))

    def _carry_out(self, words: list[str]) -> str:
        order, value = (*words, "", "")[:2]
        simulation, damage = self.simulation, self.simulation.line.damage
        inputs = {"estop": "estop", "fault": "drive_fault", "noforce": "force_missing"}
        inputs |= {"novelocity": "velocity_missing", "nomoment": "moment_missing"}
        if order in ("flip", "drop", "duplicate", "stall") and value.isdecimal():
            setattr(damage, f"next_{order}s", int(value))
        elif order in inputs and value in ("0", "1"):
            setattr(simulation.board, inputs[order], value == "1")
        elif order == "cycles" and value.isdecimal():
            for _ in range(int(value)):
                step(simulation)
        elif order == "sample":
            simulation.send()
        elif order == "unplug":
            simulation.line.unplug()
        elif order == "plug":
            simulation.line.plug()
        elif order == "identity" and value:
            simulation.name = simulation.board.serial_number = value
        elif order == "reset":
            simulation.power_up()
            simulation.sense()
        elif order == "quit":
            self.ended = True
        else:
            return f"error unknown order {' '.join(words)!r}"
        return f"ok {simulation.slot}"


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


@dataclass
class Ending:
    """Set by SIGTERM and SIGINT; `fd` becomes readable then."""

    fd: int
    asked: bool = False


def _watch_signals() -> Ending:
    reader, writer = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    ending = Ending(reader)

    def _end(_signal: int, _frame: object) -> None:
        ending.asked = True

    signal.signal(signal.SIGTERM, _end)
    signal.signal(signal.SIGINT, _end)
    # Python resumes a `select` after a handler (PEP 475): what ends the wait is this byte
    signal.set_wakeup_fd(writer)
    return ending


def _die_with_parent(parent: int) -> None:
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    # the signal is sent at the parent's death: a parent that died before has none to send
    if os.getppid() != parent:  # it died before the line above
        sys.exit(1)


def step(simulation: Simulation) -> None:
    """Drive the motor over one period, then measure and send."""
    simulation.apply()
    simulation.advance()
    simulation.sense()
    simulation.send()


def run_on_clock(simulation: Simulation, control: Control | None, ending: Ending) -> None:
    """Cycle on an absolute grid; a late process skips slots, as the board's clock would have gone on."""
    period_ns = round(simulation.rig.period_s * 1e9)
    start, slot, passed = time.monotonic_ns(), 0, 1
    while not ending.asked and not (control and control.ended):
        # from the start, not from the last cycle: lateness does not add up
        wait_ns = start + slot * period_ns - time.monotonic_ns()
        if wait_ns > 0:
            time.sleep(wait_ns * 1e-9)
        if control:
            control.poll()
        simulation.advance(passed)
        simulation.listen()
        simulation.sense()
        simulation.send()
        simulation.apply()
        passed = max((time.monotonic_ns() - start) // period_ns - slot, 1)
        slot += passed


def run_in_step(simulation: Simulation, control: Control | None, ending: Ending) -> None:
    """Drive the motor for one period per command, then send the next sample; an identify gets the newest."""
    simulation.sense()
    while not ending.asked and not (control and control.ended):
        waited = [
            ending.fd,
            *([0] if control else []),
            *([simulation.line.fd] if simulation.line.fd >= 0 else []),
        ]
        ready = select.select(waited, [], [])[0]
        if control and 0 in ready:
            control.poll()
        if simulation.line.fd not in ready:
            continue
        taken = simulation.listen()
        if taken.identifies:
            simulation.send()
        # once for all that came in one read: of these commands only the newest was ever in force
        if taken.commands or taken.stops:
            step(simulation)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m hw.simulators.serial_board", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--link", type=Path, required=True, help="symbolic link to make to the pty")
    parser.add_argument("--rig", type=Path, help="rig file: axes, rate, and its mock device as the plant")
    parser.add_argument(
        "--rate-hz", type=float, help="board cycles per second (default: the rig file's, 1000)"
    )
    parser.add_argument("--identity", help="serial number of the board (default SIM-0001; described: 1)")
    parser.add_argument(
        "--described", type=Path, help="rig file: speak as its serial-described or serial-lines device"
    )
    parser.add_argument("--first-count", type=int, default=0, help="encoder count at joint angle 0")
    parser.add_argument("--step", action="store_true", help="one cycle per command instead of a clock")
    parser.add_argument(
        "--realtime", action="store_true", help="run by SCHED_FIFO, as on time as a real board"
    )
    parser.add_argument("--control", action="store_true", help="take orders on standard input")
    parser.add_argument(
        "--observe", type=Path, help="file for what the motor gets (hw.simulators.serial_observation)"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the damage")
    parser.add_argument("--flip-share", type=float, default=0.0, help="of state packets with one bit flipped")
    parser.add_argument("--drop-share", type=float, default=0.0, help="of state packets lost")
    parser.add_argument("--duplicate-share", type=float, default=0.0, help="of state packets sent twice")
    parser.add_argument(
        "--command-flip-share", type=float, default=0.0, help="of commands with a bit flipped"
    )
    parser.add_argument("--delay-packets", type=int, default=0, help="state packets leave this many late")
    return parser.parse_args()


def _be_on_time() -> None:
    """Below the control loop's own default priority, above everything ordinary; no garbage collector, no
    paging."""
    gc.collect()
    # what there is by now is never looked through again, whatever collects
    gc.freeze()
    gc.disable()
    ctypes.CDLL(None).mlockall(_MCL_CURRENT | _MCL_FUTURE)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(REALTIME_PRIORITY))
    except OSError as error:
        sys.stderr.write(
            f"no real-time priority: {error.strerror}; ulimit -r {REALTIME_PRIORITY} would give it\n"
        )


def main() -> int:
    """Run until SIGTERM, the parent's death, `quit`, or the end of the orders. Returns 0."""
    parent = os.getppid()
    arguments = _arguments()
    _die_with_parent(parent)
    ending = _watch_signals()
    rig, options = read_rig(arguments.rig, arguments.rate_hz)
    damage = Damage(
        flip_share=arguments.flip_share,
        drop_share=arguments.drop_share,
        duplicate_share=arguments.duplicate_share,
        command_flip_share=arguments.command_flip_share,
        delay_packets=arguments.delay_packets,
    )
    line = Line(arguments.link, damage, arguments.seed)
    described = read_described(arguments.described) if arguments.described else None
    name = arguments.identity or ("1" if described else "SIM-0001")
    simulation = Simulation(rig, options, line, name, arguments.first_count, described)
    if arguments.observe:
        simulation.observation = Observation.create(arguments.observe, rig.n_axes)
    control = Control(simulation) if arguments.control else None
    line.plug()
    if arguments.realtime:
        _be_on_time()
    _say(f"ready {arguments.link}")
    try:
        (run_in_step if arguments.step else run_on_clock)(simulation, control, ending)
    finally:
        # on record, too: who looks at the motor afterwards finds it let go and not as it was
        simulation.board.hold()
        simulation.apply()
        line.unplug()
    return 0


if __name__ == "__main__":
    sys.exit(main())
