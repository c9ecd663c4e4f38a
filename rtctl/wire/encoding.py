"""Messages of the host as bytes: replies and telemetry alike."""

from __future__ import annotations

import msgpack


def encode(message: object) -> bytes:
    """Pack a reply or a telemetry message."""
    packed: bytes = msgpack.packb(message)
    return packed
