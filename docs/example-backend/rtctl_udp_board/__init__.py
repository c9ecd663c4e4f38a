"""An rtctl backend for a one-axis motor board that speaks UDP."""

from hw.interface import BackendInfo, Channels

INFO = BackendInfo(
    factory="rtctl_udp_board.backend:UdpBoard",
    options="rtctl_udp_board.options:UdpBoardOptions",
    simulated=False,
    summary="one-axis motor board over UDP (example)",
    channels=Channels(
        provides=frozenset({"position", "current", "force", "estop"}), consumes=frozenset({"torque"})
    ),
)
"""What the entry point names. Importing it must not need the driver: rtctl lists backends with it."""
