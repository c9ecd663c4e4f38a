"""Seeded bugs of devices, recordings and the service that were known for long before they were mended."""

from __future__ import annotations

from seed import Seed

AXES = ("tests/unit/hw/test_can_axes.py",)
STOPS = ("tests/unit/hw/test_stop_sequence.py",)

SEEDS = (
    Seed(
        "a linear motor on a CAN drive goes 6 m a turn",
        "hw/can/sample.py",
        'if motion == "linear" and not lead_m:',
        "if False:",
        AXES,
    ),
    Seed(
        "a described board that saw a later number ignores the stop",
        "hw/serial/described_backend.py",
        "        if not counted:\n",
        "        if True:\n",
        STOPS,
    ),
    Seed(
        "a described board is deaf to commands after a stop",
        "hw/serial/described_backend.py",
        "        if self._stopped_at is not None:\n",
        "        if False:\n",
        STOPS,
    ),
    Seed(
        "a CAN board that saw a later number ignores the stop of another process",
        "hw/can/board_out.py",
        "            counter.count = number - 1  # `send` counts first\n",
        "",
        STOPS,
    ),
)
