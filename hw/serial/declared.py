"""How late a board on a serial port is at worst, for `rtctl check`. Plain arithmetic; imports no driver.

A board sends its state at least once a period and takes a command at the begin of its next cycle, so with a
cycle no longer than the loop's period a sample is at most one period old, and a command waits at most one
more; where `rate_hz` says that it sends more seldom, its cycle takes the place of the period. Both frames
besides need their time on the wire (ten bits a byte; a USB board is faster). Board and loop
have clocks of their own: of all that up to one period may come and go."""

from __future__ import annotations

import math

from hw.field_units import force_numbers
from hw.interface import Options, Rig, Shown, Timing
from hw.serial.described_plan import TYPES, unit_of
from hw.serial.layout import FLOAT, SIGNED


def state_packet_bytes(n_axes: int, *, velocity: bool = False, moment: bool = False) -> int:
    """Length on the wire of a state packet: body, CRC, COBS byte, delimiters."""
    return 28 + (14 if velocity else 10) * n_axes + (12 if moment else 0) + 4 + 3


def command_packet_bytes(n_axes: int) -> int:
    """Length on the wire of a command packet."""
    return 8 + 4 * n_axes + 4 + 3


def _timing(wire_bytes: int, options: Options, rig: Rig) -> list[Timing]:
    # of a board that sends more seldom than the loop reads: its cycle is what lies between two samples, and
    # what a command may wait for; a thousandth is how far two clocks are apart, not a slower board
    cycle_s = 1.0 / float(options.get("rate_hz") or math.inf)
    cycle_s = cycle_s if cycle_s > 1.001 * rig.period_s else rig.period_s
    # ten bits a byte: start, eight of data, stop
    # one period that the sample is old at most when it is read, one cycle that the command waits at most
    delay_s = rig.period_s + cycle_s + 10 * wire_bytes / float(options.get("baud") or 921_600)
    return [Timing(delay_s=delay_s, sample_period_s=cycle_s, jitter_s=cycle_s)] * rig.n_axes


def timing(options: Options, rig: Rig) -> list[Timing]:
    """Timing of a board that speaks rtctl-frame."""
    told = {name: name in (options.get("channels") or ()) for name in ("velocity", "moment")}
    wire_bytes = state_packet_bytes(rig.n_axes, **told) + command_packet_bytes(rig.n_axes)
    return _timing(wire_bytes, options, rig)


def described_timing(options: Options, rig: Rig) -> list[Timing]:
    """Timing of a board with a frame of its own."""
    command = options.get("command") or {}
    return _timing(int(options["sample"]["length"]) + int(command.get("length") or 0), options, rig)


def lines_timing(options: Options, rig: Rig) -> list[Timing]:
    """Timing of a board that speaks in lines of text: some ten characters a number."""
    command = options.get("command") or {"field": ()}
    return _timing(10 * (int(options["sample"]["columns"]) + len(command["field"])), options, rig)


def described_shown(options: Options, rig: Rig) -> Shown:
    """Steps and ends of the whole numbers in a described frame."""
    steps: dict[str, list[float]] = {name: [0.0] * rig.n_axes for name in ("position", "current")}
    forces = []
    for table in options["sample"]["field"]:
        kind, size = TYPES[table["type"]]
        if kind == FLOAT:
            continue
        step = abs(float(table["scale"])) * unit_of(table, rig)
        if table["channel"] in steps:
            steps[table["channel"]][table["axis"]] = step
        elif table["channel"] == "force":
            span, zero = 2.0 ** (8 * size), float(table["zero"])
            low, high = (-span / 2, span / 2 - 1) if kind == SIGNED else (0.0, span - 1)
            forces.append((step, step * min(abs(low - zero), abs(high - zero))))
    return Shown(tuple(steps["position"]), False, tuple(steps["current"]), *force_numbers(forces))
