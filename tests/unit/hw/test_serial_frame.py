"""The codec of `rtctl-frame`: numbers to bytes and back, and every damaged packet refused."""

import math
import struct
import types
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hw.jit import compiled, records
from hw.serial import frame
from hw.serial.deframer import deframer_dtype, next_packet
from hw.serial.framing import BODY_MAX, crc32, seal, unseal
from hw.simulators.serial_firmware import Board, request_packet


def body_of(size=BODY_MAX + 8):
    return np.zeros(size, np.uint8)


def packet_of(payload):
    body, packet = body_of(), np.zeros(300, np.uint8)
    body[: len(payload)] = np.frombuffer(payload, np.uint8)
    return packet[: seal(body, len(payload), packet)].tobytes()


def unpacked(packet):
    """Body of a packet as it stands between its delimiters, or None."""
    assert packet[0] == packet[-1] == 0
    data, body = np.frombuffer(packet[1:-1], np.uint8), body_of()
    n = unseal(data, len(data), body)
    return None if n < 0 else body[:n].tobytes()


@settings(deadline=None)  # the first call compiles
@given(st.binary(max_size=300))
def test_the_checksum_is_that_of_zlib(data):
    assert crc32(np.frombuffer(data, np.uint8), 0, len(data)) == zlib.crc32(data)


@settings(deadline=None)
@given(st.binary(min_size=1, max_size=BODY_MAX - 4))
def test_a_packet_gives_its_body_back_and_has_no_zero_inside(payload):
    packet = packet_of(payload)
    assert unpacked(packet) == payload
    assert 0 not in packet[1:-1]
    assert len(packet) == len(payload) + 7


def test_cobs_is_the_published_encoding():
    # Cheshire and Baker, section 3: a zero becomes the distance to the next one
    payload = b"\x11\x22\x00\x33"
    crc = zlib.crc32(payload).to_bytes(4, "little")
    assert 0 not in crc
    assert packet_of(payload) == b"\x00\x03\x11\x22" + b"\x06\x33" + crc + b"\x00"


def cobs(raw):
    """The published encoding, byte by byte, for bodies shorter than 254."""
    return b"".join(bytes([len(run) + 1]) + run for run in raw.split(b"\0"))


def sealed_by_hand(payload, flip=0):
    return cobs(payload + (zlib.crc32(payload) ^ flip).to_bytes(4, "little"))


def length_unsealed(data, n=None):
    return unseal(np.frombuffer(data, np.uint8), len(data) if n is None else n, body_of(600))


def test_what_is_no_packet_is_refused():
    payload = b"abc\0def"
    good = sealed_by_hand(payload)
    assert length_unsealed(good) == len(payload)
    for bit in range(32):
        assert length_unsealed(sealed_by_hand(payload, 1 << bit)) == -1
    for n in range(len(good)):
        assert length_unsealed(good, n) == -1, "the bytes beyond n are somebody else's"
    for n in range(6):
        assert length_unsealed(b"\x01" * n) == -1, "the checksum of nothing is 0, and so are these"
    unstuffed = payload + zlib.crc32(payload).to_bytes(4, "little")
    assert length_unsealed(bytes([len(unstuffed) + 1]) + unstuffed) == -1, "a zero inside"
    longest = bytes(range(1, 255))[: BODY_MAX - 4]
    assert length_unsealed(sealed_by_hand(longest)) == BODY_MAX - 4
    assert length_unsealed(sealed_by_hand(longest + b"x")) == -1


def test_stop_and_identify_are_told_apart():
    stop, identify = (
        unpacked(request_packet(frame.TYPE_STOP)),
        unpacked(request_packet(frame.TYPE_IDENTIFY, 7)),
    )
    for kind, yes, no in ((frame.TYPE_STOP, stop, identify), (frame.TYPE_IDENTIFY, identify, stop)):
        assert frame.is_request(kind, np.frombuffer(yes, np.uint8), 4)
        assert not frame.is_request(kind, np.frombuffer(no, np.uint8), 4)
        assert not frame.is_request(kind, np.frombuffer(yes + b"x", np.uint8), 5)


def test_more_bytes_than_a_packet_has_are_dropped_and_the_next_packet_is_found():
    good = packet_of(b"here I am")
    data = np.frombuffer(b"\0" + b"\x05" * 4000 + good, np.uint8)
    stream = records(np.zeros(1, deframer_dtype()))
    at, length = next_packet(stream, data, 0, len(data))
    assert length == BODY_MAX + 2
    assert unseal(stream[0]["pending"], length, body_of()) == -1
    _, length = next_packet(stream, data, at, len(data))
    body = body_of()
    assert body[: unseal(stream[0]["pending"], length, body)].tobytes() == b"here I am"


def numbers(dtype, n_axes, seed):
    rng = np.random.default_rng(seed)
    record = records(np.zeros(1, dtype))
    for name in dtype.names:
        wide = {"position_counts": 31, "current_ua": 31, "force_un": 31, "value": 31, "temperature_cdeg": 15}
        wide |= {"velocity_dcounts_s": 31, "moment_unm": 31}
        bits = wide.get(name)
        shape = record[name].shape
        if bits:
            record[name] = rng.integers(-(2**bits), 2**bits, shape)
        elif name == "serial_number":
            record[name] = rng.integers(33, 127, shape)
        else:
            highest = {"time_us": 2**32, "cycle_us": 2**32, "command_age": 256, "time_to_live": 256}
            highest |= {"enable": 2, "torque_mode": 2, "n_axes": 9}
            record[name] = rng.integers(1 if name == "time_to_live" else 0, highest.get(name, 2**16), shape)
    if "has_velocity" in (dtype.names or ()):
        record["has_velocity"] = seed % 2
        record["velocity_dcounts_s"] *= seed % 2
        record["has_moment"] = seed // 2 % 2
        record["moment_unm"] *= seed // 2 % 2
    return record


CODECS = {
    "state": (frame.state_dtype, frame.encode_state, frame.decode_state),
    "command": (frame.command_dtype, frame.encode_command, frame.decode_command),
    "identity": (lambda n: frame.identity_dtype(), frame.encode_identity, frame.decode_identity),
}


@pytest.mark.parametrize("name", CODECS)
@pytest.mark.parametrize("n_axes", [1, 2, 8])
def test_numbers_come_back_as_they_went(name, n_axes):
    dtype, encode, decode = CODECS[name]
    for seed in range(50):
        sent, body = numbers(dtype(n_axes), n_axes, seed), body_of()
        n = encode(sent, body)
        got = records(np.zeros(1, dtype(n_axes)))
        assert decode(body, n, got)
        assert got.tobytes() == sent.tobytes()
        assert not decode(body, n - 1, got)
        assert not decode(body, n + 1, got)


@pytest.mark.parametrize(("seed", "kind"), [(0, 0x01), (1, 0x03), (2, 0x05), (3, 0x07)])
def test_the_bytes_of_a_state_packet_stand_where_the_document_says(seed, kind):
    record = numbers(frame.state_dtype(2), 2, seed)
    body = body_of()
    n = frame.encode_state(record, body)
    s = types.SimpleNamespace(**{name: record[0][name] for name in record.dtype.names})
    wanted = struct.pack(
        "<BBHIHHBBH3i",
        1,
        kind,
        s.sequence,
        s.time_us,
        s.status,
        s.command_sequence,
        s.command_age,
        2,
        0,
        *s.force_un,
    )
    for axis in range(2):
        wanted += struct.pack("<iih", s.position_counts[axis], s.current_ua[axis], s.temperature_cdeg[axis])
        wanted += struct.pack("<i", s.velocity_dcounts_s[axis]) if kind in (0x03, 0x07) else b""
    wanted += struct.pack("<3i", *s.moment_unm) if kind in (0x05, 0x07) else b""
    assert body[:n].tobytes() == wanted


def test_the_bytes_of_a_command_packet_stand_where_the_document_says():
    record = records(np.zeros(1, frame.command_dtype(1)))
    record["sequence"], record["enable"], record["torque_mode"], record["time_to_live"] = 0x1234, 1, 1, 10
    record["value"] = -1_500_000
    body = body_of()
    n = frame.encode_command(record, body)
    assert body[:n].tobytes() == struct.pack("<BBHBBBBi", 1, 0x81, 0x1234, 3, 10, 1, 0, -1_500_000)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_packets_of_another_version_type_or_number_of_axes_are_not_taken(seed):
    record, body = numbers(frame.state_dtype(2), 2, seed), body_of()
    n = frame.encode_state(record, body)
    one, other = records(np.zeros(1, frame.state_dtype(1))), records(np.zeros(1, frame.state_dtype(2)))
    assert not frame.decode_state(body, n, one)
    for at, change in ((0, 1), (1, 1), (1, 2), (1, 4), (1, 8), (13, 1)):
        wrong = body.copy()
        wrong[at] ^= change
        assert not frame.decode_state(wrong, n, other)
    assert not other.tobytes().strip(b"\0")


@settings(deadline=None)
@given(st.floats())
def test_fixed_point_saturates_and_truncates_toward_zero(value):
    got = frame.micro(value)
    if math.isnan(value):
        assert got == 0
        return
    exact = value * 1e6
    assert abs(got) <= min(abs(exact) * (1 + 2e-15), 2**31 - 1)
    assert abs(got) >= min(abs(exact) - 1, 2**31 - 1)
    assert got * value >= 0


@settings(deadline=None)
@given(st.integers(-(2**31) + 1, 2**31 - 1))
def test_what_was_read_goes_back_as_the_same_number(number):
    assert frame.micro(number * 1e-6) == number


@compiled
def _accepted_with_flips(packet, wire, body, stream, original, n_original):
    """Flip every bit and every two bits of a packet between two others; how often was a wrong body accepted."""
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
