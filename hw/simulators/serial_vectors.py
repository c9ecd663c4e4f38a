"""Test vectors of `rtctl-frame` for firmware authors: `python -m hw.simulators.serial_vectors`.

One line per packet: what it is, its numbers, and its bytes on the wire in hexadecimal."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np

from hw.jit import records
from hw.serial import frame
from hw.serial.framing import BODY_MAX, PACKET_MAX, seal
from hw.simulators.serial_firmware import Board, request_packet


def _sealed(n: int, body: np.ndarray) -> bytes:
    packet = np.zeros(PACKET_MAX, np.uint8)
    return packet[: seal(body, n, packet)].tobytes()


def _command(**numbers: int | list[int]) -> bytes:
    values = numbers["value"]
    record = records(np.zeros(1, frame.command_dtype(len(values) if isinstance(values, list) else 1)))
    for name, number in numbers.items():
        record[name] = number
    body = np.zeros(BODY_MAX + 8, np.uint8)
    return _sealed(frame.encode_command(record, body), body)


def _state(**numbers: int | list[int]) -> bytes:
    counts = numbers["position_counts"]
    record = records(np.zeros(1, frame.state_dtype(len(counts) if isinstance(counts, list) else 1)))
    for name, number in numbers.items():
        record[name] = number
    body = np.zeros(BODY_MAX + 8, np.uint8)
    return _sealed(frame.encode_state(record, body), body)


def vectors() -> Iterator[tuple[str, bytes]]:
    """Every kind of packet: description and bytes on the wire."""
    yield "identify, sequence 7", request_packet(frame.TYPE_IDENTIFY, 7)
    board = Board(1, "SIM-0001", 1000)
    yield "identity, answer to 0, 1 axis, firmware 1, cycle 1000 us, SIM-0001", board.identity_packet()
    off = {"enable": 0, "torque_mode": 0, "time_to_live": 10}
    yield "command, sequence 1, disabled, ttl 10, 1 axis: 0", _command(sequence=1, **off, value=0)
    on = {"enable": 1, "torque_mode": 0, "time_to_live": 10}
    yield (
        "command, sequence 513, enabled, current, ttl 10: +1500000",
        _command(sequence=513, **on, value=1_500_000),
    )
    both = {"enable": 1, "torque_mode": 1, "time_to_live": 20}
    # the ends of both numbers, and both signs: width and sign are what firmware gets wrong
    text = "command, sequence 65535, enabled, torque, ttl 20, 2 axes: -1, +2147483647"
    yield text, _command(sequence=65_535, **both, value=[-1, 2_147_483_647])
    yield "stop, sequence 0", request_packet(frame.TYPE_STOP)
    text = (
        "state, sequence 258, time 66051 us, status enabled, command 513, age 2, force 1 -2 0 N, "
        "counts -4096, current +0.25 A, 31.5 C"
    )
    force = [1_000_000, -2_000_000, 0]
    # 258 and 66051 are 01 02 and 01 02 03 in bytes, 513 is 02 01: a wrong order of bytes shows
    seen = {"sequence": 258, "time_us": 66_051, "status": 1, "command_sequence": 513, "command_age": 2}
    axis = {"position_counts": -4096, "current_ua": 250_000, "temperature_cdeg": 3150}
    yield text, _state(**seen, force_un=force, **axis)
    speed = {"has_velocity": 1, "velocity_dcounts_s": -123_456}
    yield text + ", type 03: -12345.6 counts/s", _state(**seen, force_un=force, **axis, **speed)
    moment: dict[str, int | list[int]] = {"has_moment": 1, "moment_unm": [-250_000, 0, 1]}
    told = text + ", type {}: moment -0.25 0 0.000001 N m"
    yield told.format("05"), _state(**seen, force_un=force, **axis, **moment)
    fast = told.format("07") + ", -12345.6 counts/s"
    yield fast, _state(**seen, force_un=force, **axis, **speed, **moment)


def main() -> int:
    """Print them all. Returns 0."""
    for text, packet in vectors():
        sys.stdout.write(f"{text}\n    {packet.hex(' ')}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
