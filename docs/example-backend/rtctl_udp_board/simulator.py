"""A board without hardware: `python -m rtctl_udp_board.simulator PORT`. Ctrl-C ends it."""

from __future__ import annotations

import contextlib
import math
import socket
import sys
import time

from rtctl_udp_board.backend import COMMAND, STATE

PERIOD_S = 0.0005
TIME_TO_LIVE_S = 0.010


class Board:
    """A motor with viscous friction, pushed by the torque of the newest command."""

    def __init__(self, port: int = 0) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", port))
        self.host: tuple[str, int] | None = None
        self.count = 0
        self.angle_rad = self.velocity_rad_s = self.torque_nm = self.current_a = 0.0
        self.force_n = (0.0, 0.0, 0.0)
        self.enabled = False
        self.commanded_s = 0.0

    def listen(self, now_s: float) -> None:
        """Obey the commands that wait; without any for its time-to-live, drop the torque."""
        self.socket.setblocking(False)
        while True:
            try:
                data, self.host = self.socket.recvfrom(64)
            except OSError:
                break
            if len(data) == COMMAND.size:
                _, enabled, torque_nm = COMMAND.unpack(data)
                self.enabled, self.commanded_s = bool(enabled), now_s
                self.torque_nm = torque_nm if enabled and math.isfinite(torque_nm) else 0.0
        if now_s - self.commanded_s > TIME_TO_LIVE_S:
            self.enabled, self.torque_nm = False, 0.0

    def step(self) -> None:
        """Move for one period and send the state."""
        self.velocity_rad_s += (self.torque_nm - 0.05 * self.velocity_rad_s) / 0.012 * PERIOD_S
        self.angle_rad += self.velocity_rad_s * PERIOD_S
        self.current_a = self.torque_nm / 0.7
        self.send()

    def send(self) -> None:
        """Send the state as it is."""
        self.count = (self.count + 1) & 0xFFFFFFFF
        if self.host is not None:
            state = STATE.pack(self.count, self.angle_rad, self.current_a, *self.force_n, 0)
            with contextlib.suppress(OSError):
                self.socket.sendto(state, self.host)

    def close(self) -> None:
        """Release the socket."""
        self.socket.close()


def main() -> None:
    """Run until Ctrl-C."""
    board = Board(int(sys.argv[1]) if len(sys.argv) > 1 else 9100)
    due_s = time.monotonic()
    with contextlib.suppress(KeyboardInterrupt):
        while True:
            board.listen(time.monotonic())
            board.step()
            due_s = max(due_s + PERIOD_S, time.monotonic() - 0.1)
            time.sleep(max(due_s - time.monotonic(), 0.0))
    board.close()


if __name__ == "__main__":
    main()
