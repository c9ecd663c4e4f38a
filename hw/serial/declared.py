"""How late a board on a serial port is at worst, for `rtctl check`. Plain arithmetic; imports no driver.

A board sends its state at least once a period and takes a command at the begin of its next cycle, so with a
cycle no longer than the loop's period a sample is at most one period old, and a command waits at most one
more. Both frames besides need their time on the wire (ten bits a byte; a USB board is faster). Board and loop
have clocks of their own: of all that up to one period may come and go."""

from __future__ import annotations

from hw.interface import Options, Rig, Timing

_STATE_BYTES, _STATE_AXIS_BYTES = 30, 14
"""A state packet with velocities and its framing, and what each axis adds."""
_COMMAND_BYTES, _COMMAND_AXIS_BYTES = 12, 4


def _timing(wire_bytes: int, options: Options, rig: Rig) -> list[Timing]:
    # ten bits a byte: start, eight of data, stop
    delay_s = 2 * rig.period_s + 10 * wire_bytes / float(options.get("baud") or 921_600)
    return [Timing(delay_s=delay_s, sample_period_s=rig.period_s, jitter_s=rig.period_s)] * rig.n_axes


def timing(options: Options, rig: Rig) -> list[Timing]:
    """Timing of a board that speaks rtctl-frame."""
    axes = (_STATE_AXIS_BYTES + _COMMAND_AXIS_BYTES) * rig.n_axes
    return _timing(_STATE_BYTES + _COMMAND_BYTES + axes, options, rig)


def described_timing(options: Options, rig: Rig) -> list[Timing]:
    """Timing of a board with a frame of its own."""
    command = options.get("command") or {}
    return _timing(int(options["sample"]["length"]) + int(command.get("length") or 0), options, rig)


def lines_timing(options: Options, rig: Rig) -> list[Timing]:
    """Timing of a board that speaks in lines of text: some ten characters a number."""
    command = options.get("command") or {"field": ()}
    return _timing(10 * (int(options["sample"]["columns"]) + len(command["field"])), options, rig)
