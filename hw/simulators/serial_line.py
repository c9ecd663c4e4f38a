"""The simulated board's end of the line: a pty with a stable name, and the damage a real line does."""

from __future__ import annotations

import contextlib
import os
import pty
import random
import tty
from collections import deque
from dataclasses import dataclass
from pathlib import Path

READ_MAX = 65536


@dataclass
class Damage:
    """What happens to state packets. Shares are of packets; the `next_` counts are used up first."""

    flip_share: float = 0.0
    drop_share: float = 0.0
    duplicate_share: float = 0.0
    delay_packets: int = 0
    """Each packet leaves this many packets late."""
    next_flips: int = 0
    next_drops: int = 0
    next_stalls: int = 0
    """Cycles without any packet."""
    next_duplicates: int = 0
    command_flip_share: float = 0.0
    """Share of the received chunks of commands in which a bit is flipped."""


class Line:
    """A pseudo-terminal; `link` is the symbolic link under which the host finds it."""

    def __init__(self, link: Path, damage: Damage, seed: int) -> None:
        self.link, self.damage = link, damage
        self._random = random.Random(seed)
        self._late: deque[bytes] = deque()
        self._fds: tuple[int, int] | None = None
        self.unsent = 0
        """Packets for which the host had left no room."""

    @property
    def fd(self) -> int:
        """The board's descriptor, -1 while unplugged."""
        return -1 if self._fds is None else self._fds[0]

    def plug(self) -> None:
        """Appear under `link`."""
        if self._fds is not None:
            return
        master, slave = pty.openpty()
        tty.setraw(slave)
        # a host that does not read must not stop the board's clock
        os.set_blocking(master, False)
        # the board keeps its own descriptor of the host's side: a host that closes is no hang-up for it
        self._fds = (master, slave)
        # a link is replaced whole: a host that looks meanwhile finds the old one or the new one
        fresh = self.link.with_name(self.link.name + ".new")
        with contextlib.suppress(FileNotFoundError):
            fresh.unlink()
        fresh.symlink_to(os.ttyname(slave))
        fresh.replace(self.link)

    def unplug(self) -> None:
        """Vanish: the host's descriptor hangs up."""
        if self._fds is None:
            return
        with contextlib.suppress(FileNotFoundError):
            self.link.unlink()
        # the board's end too, whose closing is the hang-up that the host sees
        for fd in self._fds:
            os.close(fd)
        self._fds = None
        self._late.clear()

    def read(self) -> bytes:
        """What the host has sent; empty when nothing."""
        if self._fds is None:
            return b""
        data = bytearray()
        with contextlib.suppress(BlockingIOError, OSError):
            while len(data) < READ_MAX:
                data += os.read(self._fds[0], 4096)
        if data and self._random.random() < self.damage.command_flip_share:
            data[self._random.randrange(len(data))] ^= 1 << self._random.randrange(8)
        return bytes(data)

    def send(self, packet: bytes) -> None:
        """Send a packet that matters (an identity): undamaged."""
        if self._fds is None:
            return
        try:
            os.write(self._fds[0], packet)
        except OSError:
            self.unsent += 1

    def send_sample(self, packet: bytes) -> None:
        """Send a state packet, with whatever the line does to it."""
        damage = self.damage
        self._late.append(packet)
        if len(self._late) <= damage.delay_packets:
            return
        while len(self._late) > damage.delay_packets + 1:
            self._late.popleft()
        packet = self._late.popleft()
        if damage.next_stalls:
            damage.next_stalls -= 1
            return
        if self._happens("next_drops", damage.drop_share):
            return
        if self._happens("next_flips", damage.flip_share):
            # not the first nor the last byte: those delimit a packet
            at, bit = self._random.randrange(1, len(packet) - 1), self._random.randrange(8)
            packet = packet[:at] + bytes([packet[at] ^ (1 << bit)]) + packet[at + 1 :]
        self.send(packet)
        if self._happens("next_duplicates", damage.duplicate_share):
            self.send(packet)

    def _happens(self, count: str, share: float) -> bool:
        left = getattr(self.damage, count)
        if left:
            setattr(self.damage, count, left - 1)
            return True
        return share > 0 and self._random.random() < share
