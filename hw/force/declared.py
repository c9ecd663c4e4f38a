"""What force sensors say of their filter, where we set it, and of their numbers, for `rtctl check`. Plain
numbers.

The others stream through a filter that only their own configuration page or command knows: they declare
nothing of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hw.force import optoforce as frames
from hw.interface import ForceSensor, Options, Rig, Shown


def optoforce(options: Options, rig: Rig) -> ForceSensor:
    """The DAQ's filter, as it is set at opening; a sample is as old as the time between two, and the bytes of
    one on the wire."""
    # start bit, eight bits, stop bit; a frame can be decoded when its last byte is in
    wire_s = 10 * frames.length(options["layout"]) / float(options["baud"])
    return ForceSensor(float(options["filter_hz"]), 1.0 / float(options["output_hz"]) + wire_s)


def optoforce_shown(options: Options, rig: Rig) -> Shown:
    """Numbers of the DAQ: 16 bits with a sign, by the counts of the sensor's own data sheet."""
    return _shown(options, [1.0 / float(counts) for counts in options["counts_per_n"]], 16)


def rdt_shown(options: Options, rig: Rig) -> Shown:
    """Numbers of RDT: 32 bits with a sign."""
    return _shown(options, [1.0 / float(options["counts_per_n"])] * 3, 32)


def rokubi_shown(options: Options, rig: Rig) -> Shown:
    """Numbers of Bota sensors, which have a floating point: they end nowhere, and have no step."""
    return _shown(options, [], 0)


def _shown(options: Options, steps_n: Sequence[float], bits: int) -> Shown:
    gain = max(math.hypot(*row) for row in options["matrix"])
    # what of a number is left to its sign
    ends_n = [step * (2 ** (bits - 1) - 1) for step in steps_n]
    return Shown(
        force_step_n=gain * max(steps_n, default=0.0),
        force_most_n=gain * min(ends_n, default=0.0),
        force_gain=gain,
    )
