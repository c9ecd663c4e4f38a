"""What the controller's error frames say about the bus, and when it counts as well again.

    bus-off          the controller has left the bus: LOST, until it is restarted and is error-active again
    error-passive    it may no longer report errors (no acknowledge, broken wire, wrong bit rate): LOST,
                     until its counters are below the limit again
    transmit queue   full REFUSED_LIMIT times in a row (nobody takes the frames): LOST, until one is taken

All are faults of the rig while they last. Being well again only lets a person reset the fault: no torque
comes back by itself."""

from __future__ import annotations

from hw.can.fields import Buffer
from hw.interface import LinkFault

CONTROLLER, BUS_OFF, RESTARTED = 0x004, 0x040, 0x100
"""Classes of error frames (linux/can/error.h) that are asked for: those that say the controller's state. A
frame that nobody takes shows in the queue, by `refused`."""

WANTED = CONTROLLER | BUS_OFF | RESTARTED

# linux/can/error.h, CAN_ERR_CRTL_*: lower bit of each pair for receiving, upper one for sending
_PASSIVE, _ACTIVE, _WARNING, _OVERFLOW = 0x30, 0x40, 0x0C, 0x03
"""Bits of data byte 1 of a controller error frame: both directions of each."""

# one is a busy moment; of a single drive three are three cycles in which its motor holds an old command.
# Frames are counted, not cycles: of three drives on a bus one full cycle is enough
REFUSED_LIMIT = 3

_LOST = int(LinkFault.LOST)


class BusHealth:
    """State and counters of one bus."""

    def __init__(self) -> None:
        self.bus_off = False
        self.passive = False
        self.counts = {
            "bus_off": 0,
            "passive": 0,
            "restarted": 0,
            "overflow": 0,
            "tx_refused": 0,
            "damaged": 0,
        }
        self.refused_in_a_row = 0
        self.link_faults = 0
        """`LinkFault` bits in force."""

    def error_frame(self, error: int, data: Buffer) -> None:
        """Take in an error frame: class bits of its identifier, and its data (of any length)."""
        # the byte counts in this class alone, and a driver may leave the data out
        status = data[1] if len(data) > 1 and error & CONTROLLER else 0
        if error & BUS_OFF:
            self.bus_off = True
            self.counts["bus_off"] += 1
        if error & RESTARTED:
            # a controller that was restarted begins with both counters at 0 (ISO 11898-1)
            self.bus_off = self.passive = False
            self.counts["restarted"] += 1
        # one direction is enough: a node that cannot send is as lost as one that cannot hear
        if status & _PASSIVE:
            self.passive = True
            self.counts["passive"] += 1
        elif status & (_ACTIVE | _WARNING):  # warning is below passive
            self.passive = False
        if status & _OVERFLOW:
            self.counts["overflow"] += 1
        self._update()

    def refused(self) -> None:
        """A frame could not be handed over: the queue is full."""
        self.counts["tx_refused"] += 1
        self.refused_in_a_row += 1
        self._update()

    def taken(self) -> None:
        """A frame was handed over after one was refused."""
        self.refused_in_a_row = 0
        self._update()

    def _update(self) -> None:
        ill = self.bus_off or self.passive or self.refused_in_a_row >= REFUSED_LIMIT
        self.link_faults = _LOST if ill else 0
