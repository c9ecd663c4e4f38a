"""What is alike in a serial backend that gets its bytes from a test, whatever its language."""

import numpy as np

from hw.interface import LinkFault
from hw.serial import link


class BoardWire:
    """`backend` and its `tick`, made by who takes this up."""

    def feed(self, data, end=link.DRAINED):
        """Let it read these bytes, after which the line is as `end` says; the tick."""
        self.backend.chunk[: len(data)] = np.frombuffer(data, np.uint8)
        self.backend.meta[:] = len(data), end
        self.backend._receive()
        return self.tick

    def sent(self):
        """The packet of a command, as of the tick."""
        return self.backend.packet[: self.backend._send()].tobytes()

    @property
    def count(self):
        return int(self.tick["sample_count"][0])

    @property
    def faults(self):
        return LinkFault(int(self.tick["link_faults"][0]))
