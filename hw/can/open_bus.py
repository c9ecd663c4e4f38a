"""Opens the bus that a rig file names: SocketCAN and slcan by our own code, everything else by python-can."""

from __future__ import annotations

from hw.can.bus import Bus
from hw.interface import Options


def open_bus(options: Options) -> Bus:
    """Open the bus that `options` (a dumped `BusOptions`) name. Raises BackendError with the remedy."""
    if options["interface"] == "socketcan" and options["raw"]:
        from hw.can.raw import RawBus

        return RawBus(options["channel"], fd=options["fd"])
    if options["interface"] == "slcan" and options["raw"] and not options["fd"]:
        from hw.can.slcan import ARGUMENTS, SlcanBus

        if set(options["arguments"]) <= ARGUMENTS:
            return SlcanBus(options)
    from hw.can.adapter import AdapterBus

    return AdapterBus(options)
