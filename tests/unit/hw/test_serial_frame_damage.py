"""Every damaged packet of `rtctl-frame` is refused, and a good one is found whatever stands before it."""

import numpy as np
import pytest
from frame_packets import CODECS, body_of, numbers, packet_of, unpacked
from hypothesis import given, settings
from hypothesis import strategies as st

from hw.jit import compiled, records
from hw.serial import frame
from hw.serial.deframer import deframer_dtype, next_packet
from hw.serial.framing import seal, unseal
from hw.simulators.serial_firmware import Board, request_packet


@compiled
def _accepted_with_flips(packet, wire, body, stream, original, n_original):
    """Flip every bit and every two bits of a packet between two others; how often was a wrong body
    accepted.
    """
    bits = 8 * len(packet)
    wrong = 0
    for first in range(bits):
        for second in range(first, bits):
            for k in range(len(packet)):
                wire[len(packet) + k] = packet[k]
            wire[len(packet) + first // 8] ^= np.uint8(1 << (first % 8))
            if second != first:
                wire[len(packet) + second // 8] ^= np.uint8(1 << (second % 8))
            stream[0].synced = 0
            stream[0].n = 0
            at = 0
            while True:
                at, length = next_packet(stream, wire, at, len(wire))
                if length == 0:
                    break
                n = unseal(stream[0].pending, length, body)
                if n < 0:
                    continue
                same = n == n_original
                for k in range(min(n, n_original)):
                    if body[k] != original[k]:
                        same = False
                if not same:
                    wrong += 1
    return wrong


def _packets():
    yield "stop", request_packet(frame.TYPE_STOP)
    yield "identify", request_packet(frame.TYPE_IDENTIFY, 7)
    yield "identity", Board(1, "SIM-0001", 1000).identity_packet()
    for name, n_axes, seed in (
        ("command", 1, 1),
        ("command", 8, 2),
        ("state", 1, 3),
        ("state", 1, 4),
        ("state", 2, 5),
        ("state", 8, 6),
        ("state", 8, 7),
    ):
        dtype, encode, _ = CODECS[name]
        record, body, packet = numbers(dtype(n_axes), n_axes, seed), body_of(), np.zeros(300, np.uint8)
        if seed == 4:  # many zeros: short COBS runs
            record["position_counts"], record["current_ua"], record["force_un"] = 0, 256, 0
        yield f"{name} {n_axes} {seed}", packet[: seal(body, encode(record, body), packet)].tobytes()


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("name", "packet"), list(_packets()), ids=lambda value: value if isinstance(value, str) else ""
)
def test_every_one_and_two_bit_flip_of_every_packet_is_refused(name, packet):
    original = unpacked(packet)
    wire = np.frombuffer(3 * packet, np.uint8).copy()
    stream = records(np.zeros(1, deframer_dtype()))
    flat = np.frombuffer(packet, np.uint8).copy()
    body = np.frombuffer(original, np.uint8).copy()
    assert _accepted_with_flips(flat, wire, body_of(), stream, body, len(original)) == 0


@settings(max_examples=300, deadline=None)
@given(st.lists(st.one_of(st.binary(max_size=400), st.just("packet")), max_size=12), st.integers(1, 64))
def test_a_packet_is_found_whatever_stands_before_it_and_however_the_bytes_arrive(pieces, step):
    good = packet_of(b"here I am")
    data = b"".join(good if piece == "packet" else piece for piece in pieces) + good
    stream, found = records(np.zeros(1, deframer_dtype())), []
    for start in range(0, len(data), step):
        chunk, at = np.frombuffer(data[start : start + step], np.uint8), 0
        while True:
            at, length = next_packet(stream, chunk, at, len(chunk))
            if length == 0:
                break
            body = body_of()
            n = unseal(stream[0]["pending"], length, body)
            if n >= 0:
                found.append(body[:n].tobytes())
    assert found
    assert found[-1] == b"here I am"
    assert len(found) >= pieces.count("packet")
