"""What a force sensor whose filter we set says of it, for `rtctl check`. Plain numbers.

The others stream through a filter that only their own configuration page or command knows: they declare
nothing."""

from __future__ import annotations

from hw.force import optoforce as frames
from hw.interface import ForceSensor, Options, Rig


def optoforce(options: Options, rig: Rig) -> ForceSensor:
    """The DAQ's filter, as it is set at opening; a sample is as old as the time between two, and the bytes of
    one on the wire."""
    # start bit, eight bits, stop bit; a frame can be decoded when its last byte is in
    wire_s = 10 * frames.length(options["layout"]) / float(options["baud"])
    return ForceSensor(float(options["filter_hz"]), 1.0 / float(options["output_hz"]) + wire_s)
