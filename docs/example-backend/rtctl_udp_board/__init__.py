"""An rtctl backend for a one-axis motor board that speaks UDP."""

import socket

from hw.interface import BackendInfo, Channels, Finding, Options, Rig, Timing

INFO = BackendInfo(
    factory="rtctl_udp_board.backend:UdpBoard",
    options="rtctl_udp_board.options:UdpBoardOptions",
    simulated=False,
    channels=Channels(
        provides=frozenset({"position", "current", "force", "estop"}), consumes=frozenset({"torque"})
    ),
    timing="rtctl_udp_board:timing",
    network=True,
    doctor="rtctl_udp_board:examine",
)
"""What the entry point names. Importing it must not need the driver: rtctl lists backends with it."""

BOARD_PERIOD_S = 0.0005
NETWORK_S = 0.0002


def timing(options: Options, rig: Rig) -> list[Timing]:
    """How late the board is at worst: a state waits for the loop, a command for the board, each a cycle of
    the board, and both need the network. `rtctl check` proves the coupling with it; measure yours with
    `rtctl probe`.
    """
    del options
    delay_s = 2 * (BOARD_PERIOD_S + NETWORK_S)
    return [Timing(delay_s=delay_s, sample_period_s=BOARD_PERIOD_S, jitter_s=BOARD_PERIOD_S)] * rig.n_axes


def examine(options: Options) -> list[Finding]:
    """The line of `rtctl doctor` for this board; nothing is sent to it."""
    try:
        socket.getaddrinfo(options["host"], options["port"], type=socket.SOCK_DGRAM)
    except OSError as error:
        return [Finding("fail", f"{options['host']}: {error.strerror}", "set host in [device.options]")]
    return [Finding("ok", f"the address of the board, {options['host']}, is one")]
