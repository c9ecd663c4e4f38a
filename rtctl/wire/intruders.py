"""Throws out whoever takes more of the host than a client needs, at every turn: unfinished messages, crowds,
what they do not take, memory.

One connection is cut where the culprit is known, all of one kind where it is not; clients connect again by
themselves."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from enum import IntEnum

import zmq

from rtctl.wire.authenticator import VIEWER, Authenticator, Notice
from rtctl.wire.freed_memory import Heap
from rtctl.wire.protocol import MAX_OUTSTANDING_REQUESTS, MAX_REQUEST_BYTES
from rtctl.wire.sockets import Door, descriptor_of, user_id
from rtctl.wire.stalled import STALLED_S
from rtctl.wire.traffic import bytes_taken, hang_up, local_peer, unread

# four processes open two thousand connections a second (`rtctl.wire.turnstile`): ten between two looks
LOOK_S = 0.005

STRANGERS = 256
"""Connections to a door that have not said who they are: with more, the silent and the oldest of them go."""

SPARED = 300
"""Descriptors that are for other things than strangers."""

GROWTH_BYTES = 48 << 20
"""By this much the host may grow at once; its own needs come below, or slowly."""

GROWTH_BYTES_S = 2 << 20
"""What an observer in the host (an experiment) may collect."""

STEP_BYTES = 12 << 20
"""By which it has to go on growing for those to be suspected of whom nothing shows."""

TRIM_S = 0.05

LOOK_AT_STALLED_S = 0.5

GROWN_STALLED_S = 1.0
"""While memory has grown, whoever has taken nothing for so long is cut before anybody is suspected."""


class _Stage(IntEnum):
    CALM = 0
    HUNG_UP = 1
    CUT = 2


class Resident:
    """Resident memory that this process has alone, read without opening anything.

    What is shared is not counted: the ring of ticks, which becomes resident as the loop fills it (6.5 MB a
    second at 10 kHz), and code. No client makes any of it."""

    def __init__(self) -> None:
        self._fd = os.open("/proc/self/statm", os.O_RDONLY | os.O_CLOEXEC)
        self._page = os.sysconf("SC_PAGE_SIZE")

    def __call__(self) -> int:
        """Bytes."""
        _, resident, shared, *_ = map(int, os.pread(self._fd, 128, 0).split())
        return (resident - shared) * self._page

    def close(self) -> None:
        """Release the file."""
        os.close(self._fd)


class Intruders:
    """Looks after all doors.

    Parameters
    ----------
    doors
        Every door there is; may grow.
    authenticator
        Is told whom to keep out.
    notice
        Told of each that was thrown out.
    descriptors
        As many may be open in this process.
    resident
        Resident memory of this process alone, bytes; None: memory is not looked at."""

    def __init__(
        self,
        doors: Sequence[Door],
        authenticator: Authenticator,
        notice: Notice,
        descriptors: int,
        resident: Callable[[], int] | None = None,
    ) -> None:
        self._doors, self._authenticator, self._notice = doors, authenticator, notice
        self._resident, self._descriptors = resident, descriptors
        self._heap = Heap()
        self._usual: float | None = None  # memory that the host needs by itself
        self._stage = _Stage.CALM
        self._level: float | None = None  # memory when it was too much first, or somebody was cut off last
        self._next_s = self._stalled_s = self._trim_s = self._looked_s = 0.0

    def look(self, now_s: float) -> None:
        """Look, if it is time; `now_s` on a clock that never goes back, s."""
        # turns come quicker than a look is worth
        if now_s < self._next_s:
            return
        self._next_s = now_s + LOOK_S
        for door in self._doors:
            if not door.is_open:
                continue
            for descriptor in door.traffic.excessive(door.connections.descriptors(), now_s):
                self._hang_up(door, descriptor, "a message without an end")
            self._thin_out(door)
        self._look_at_memory(now_s)
        if now_s >= self._stalled_s:
            self._stalled_s = now_s + LOOK_AT_STALLED_S
            self._cut_stalled(now_s, STALLED_S)

    def expel(self, door: Door, frame: zmq.Frame, why: str = "a message of too many frames") -> None:
        """Throw out whoever sent this frame: cut its connection, keep its sender out for a while."""
        if (descriptor := descriptor_of(frame)) is not None:
            hang_up(descriptor)
        self._ban(door, user_id(frame), why)

    def _thin_out(self, door: Door) -> None:
        """Leave no more strangers at a door than there is room for: libzmq 4.3.5 aborts when a Unix socket
        finds none."""
        most = min(STRANGERS, max(1, (self._descriptors - SPARED) // (2 * len(self._doors))))
        strangers = door.connections.strangers()
        if len(strangers) <= most:
            return
        # asked of each only now: it costs a question to the kernel
        strangers = [one for one in strangers if not self._is_known(door, one)]
        # the oldest go: who comes now may be a client, who has waited for long without a word is none
        surplus = len(strangers) - most
        if surplus <= 0:  # most are clients that came just now
            return
        if door.by_tcp:
            strangers.sort(key=_has_spoken)  # a stable order: the oldest of each kind
        for descriptor in strangers[:surplus]:
            hang_up(descriptor)
        self._notice("crowd", f"more than {most} strangers at once on {door.address}: {surplus} cut off")

    def _is_known(self, door: Door, descriptor: int) -> bool:
        """Whether somebody who was let in has this connection: by the kernel, or by a message that came over
        it."""
        if door.by_tcp:
            return descriptor in door.traffic.users
        return self._authenticator.knows(door.domain, local_peer(descriptor) or "")

    def _hang_up(self, door: Door, descriptor: int, why: str) -> None:
        who = VIEWER if door.for_viewers else door.traffic.users.get(descriptor, "")
        hang_up(descriptor)
        self._ban(door, who, why)

    def _ban(self, door: Door, who: str, why: str) -> None:
        if who:
            self._authenticator.ban(door.domain, who)
        self._notice("expelled", f"{self._name_of(who)} was expelled from {door.address}: {why}")

    def _name_of(self, who: str) -> str:
        caller = self._authenticator.caller(who)
        return caller.name if caller else who.rstrip(":") or "a client"

    def _look_at_memory(self, now_s: float) -> None:
        if self._resident is None:
            return
        resident = self._resident()
        slowly = GROWTH_BYTES_S * (now_s - self._looked_s)
        self._looked_s = now_s
        # what the host gives back it does not need: the least counts, and rises slowly
        self._usual = resident if self._usual is None else min(resident, self._usual + slowly)
        # what was begun against a growth that has ended is forgotten
        if resident - self._usual < GROWTH_BYTES:
            self._stage, self._level = _Stage.CALM, None
            return
        # memory of those that were expelled comes back late: from here on growth counts anew
        known = self._cut_stalled(now_s, GROWN_STALLED_S) or self._expel_floods()
        if known or self._level is None:
            self._level = resident
        if now_s >= self._trim_s:  # what is left of those that were cut off
            self._trim_s = now_s + TRIM_S
            self._heap.trim()
        if resident < self._level + STEP_BYTES:  # it comes back, or grows no more
            return
        self._level = resident
        if self._stage is _Stage.CALM:
            for door, descriptor in self._local():
                who = local_peer(descriptor) or "a client"
                hang_up(descriptor)
                self._notice("memory", f"memory grew: {who} was cut off from {door.address}")
            self._stage = _Stage.HUNG_UP
        elif self._stage is _Stage.HUNG_UP:
            for door in self._doors:
                door.cut()
            self._notice("memory", "memory grew, nobody knows by whom: every connection was cut")
            self._stage = _Stage.CUT
        else:  # it is the host's own
            self._usual, self._stage = self._resident(), _Stage.CALM

    def _cut_stalled(self, now_s: float, patience_s: float) -> bool:
        """Cut whoever has taken nothing for so long: what waits for it is memory. False: there is nobody.

        It is not kept out: a program that was stopped goes on, and connects again by itself."""
        found = [
            (door, descriptor)
            for door in self._doors
            if door.is_open
            for descriptor in door.stalled.found(door.connections.descriptors(), now_s, patience_s)
        ]
        for door, descriptor in found:
            who = door.traffic.users.get(descriptor, "") if door.by_tcp else local_peer(descriptor) or ""
            hang_up(descriptor)
            self._notice(
                "stalled",
                f"{self._name_of(who)} was cut off from {door.address}: it took nothing for {patience_s:g} s",
            )
        return bool(found)

    def _expel_floods(self) -> bool:
        """Throw out local processes of which more waits to be read than requests can make. False: there are
        none."""
        floods = [(door, descriptor) for door, descriptor in self._local() if _floods(descriptor)]
        for door, descriptor in floods:
            who = local_peer(descriptor) or ""
            hang_up(descriptor)
            self._ban(door, who, "a flood while memory grew")
        return bool(floods)

    def _local(self) -> list[tuple[Door, int]]:
        return [
            (door, descriptor)
            for door in self._doors
            if door.is_open and not door.by_tcp
            for descriptor in door.connections.descriptors()
        ]


def _floods(descriptor: int) -> bool:
    try:
        # as much as a client may have asked for and not yet heard of: more than that no client needs
        return unread(descriptor) > MAX_OUTSTANDING_REQUESTS * MAX_REQUEST_BYTES
    except OSError:
        return False


def _has_spoken(descriptor: int) -> bool:
    """Whether a TCP connection has sent anything."""
    return bool(bytes_taken(descriptor))
