"""Random and mutated bytes into the serial decoders: `python tests/fuzz/serial_fuzzer.py 10000000 [SEED]`.

Compiled, so ten million inputs take seconds to minutes. `make fuzz` runs it with Numba's bounds checks on
(a cache of its own, since Numba does not tell the two apart): an access out of bounds is then an error.
Every packet a decoder lets through is checked again, its checksum bit by bit by another algorithm.
"""

import json
import sys
import tomllib
from pathlib import Path

import numpy as np

from hw.generator import seed_words, uniform
from hw.interface import Rig
from hw.jit import compiled, records
from hw.serial import checksums, described_codec, frame
from hw.serial.deframer import deframer_dtype, next_packet
from hw.serial.described_options import DescribedOptions
from hw.serial.described_plan import fields_of, layout_of
from hw.serial.framing import BODY_MAX, seal, unseal
from hw.serial.layout import LENGTH_MAX, next_frame, seal_frame, stream_dtype
from hw.simulators import serial_vectors as vectors

ROOM = 640
OPS_MAX = 8

WIDTH = np.array([8, 8, 8, 16, 16, 32, 16])
START = np.array([0, 0, 0, 0xFFFF, 0xFFFF, 0xFFFFFFFF, 0])
END = np.array([0, 0, 0, 0, 0, 0xFFFFFFFF, 0])
POLYNOMIAL = np.array([0, 0, 0xE0, 0x8408, 0xA001, 0xEDB88320, 0x8408])  # reflected
REFLECTED = np.array([0, 0, 0, 0, 1, 1, 0])


@compiled
def below(rng, n):
    return min(int(uniform(rng) * n), n - 1)


@compiled
def mirrored(value, width):
    out = 0
    for k in range(width):
        out |= ((value >> k) & 1) << (width - 1 - k)
    return out


@compiled
def slow_checksum(kind, data, start, stop):
    """The checksums once more, one bit at a time and all in reflected form."""
    if kind < 2:
        total = 0
        for i in range(start, stop):
            total = total + int(data[i]) if kind == 0 else total ^ int(data[i])
        return total & 0xFF
    width = WIDTH[kind]
    rest = START[kind]
    for i in range(start, stop):
        byte = int(data[i]) if REFLECTED[kind] else mirrored(int(data[i]), 8)
        for bit in range(8):
            low = (rest ^ (byte >> bit)) & 1
            rest = (rest >> 1) ^ (POLYNOMIAL[kind] if low else 0)
    rest ^= END[kind]
    return rest if REFLECTED[kind] else mirrored(rest, width)


@compiled
def make_input(rng, bases, lengths, out):
    """Random bytes, or a valid packet with up to `OPS_MAX` flips, changes, losses, repeats, cuts; its
    length.
    """
    if below(rng, 4) == 0:
        n = below(rng, 300)
        zeros = below(rng, 3)
        for i in range(n):
            out[i] = 0 if zeros == 0 and below(rng, 12) == 0 else below(rng, 256)
        return n
    base = below(rng, len(lengths))
    n = lengths[base]
    out[:n] = bases[base, :n]
    if below(rng, 3) == 0:  # two packets in a row, to be cut across
        base = below(rng, len(lengths))
        out[n : n + lengths[base]] = bases[base, : lengths[base]]
        n += lengths[base]
    for _ in range(below(rng, OPS_MAX + 1)):
        kind, at = below(rng, 6), below(rng, max(n, 1))
        if kind <= 1:
            out[at] ^= np.uint8(1 << below(rng, 8))
        elif kind == 2:
            out[at] = below(rng, 256)
        elif kind == 3 and n > 1:
            for i in range(at, n - 1):
                out[i] = out[i + 1]
            n -= 1
        elif kind == 4 and n < ROOM - 1:
            for i in range(n, at, -1):
                out[i] = out[i - 1]
            out[at] = below(rng, 256)
            n += 1
        elif kind == 5 and below(rng, 4) == 0:
            n = at
    return n


@compiled
def fuzz_packets(inputs, rng, bases, lengths, stream, state, command, identity, counts):
    """`rtctl-frame`: counts[0] packets let through, [1] with a wrong checksum, [2] that do not encode to
    themselves.
    """
    data, body = np.zeros(ROOM, np.uint8), np.zeros(BODY_MAX + 8, np.uint8)
    again = np.zeros(BODY_MAX + 16, np.uint8)
    for _ in range(inputs):
        n, at = make_input(rng, bases, lengths, data), 0
        while True:
            at, length = next_packet(stream, data, at, n)
            if length == 0:
                break
            size = unseal(stream[0].pending, length, body)
            if size < 0:
                continue
            counts[0] += 1
            sent = np.int64(0)
            for k in range(4):
                sent |= np.int64(body[size + k]) << (8 * k)
            if sent != slow_checksum(5, body, 0, size):
                counts[1] += 1
            if seal(body, size, again) != length + 2:
                counts[2] += 1
            for k in range(length):
                if again[k + 1] != stream[0].pending[k]:
                    counts[2] += 1
            frame.decode_state(body, size, state)
            frame.decode_command(body, size, command)
            frame.decode_identity(body, size, identity)


@compiled
def fuzz_frames(inputs, rng, bases, lengths, stream, layout, fields, link, tick, counts):
    """A described frame: counts as above; [2] counts values shown that are not finite."""
    data = np.zeros(ROOM, np.uint8)
    x = layout[0]
    for _ in range(inputs):
        n, at = make_input(rng, bases, lengths, data), 0
        described_codec.absorb(data, n, link, stream[1:2], layout, fields)
        described_codec.show(tick, link, 1)
        for axis in range(len(link[0].position_rad)):
            shown = tick[0].position_rad[axis] + tick[0].current_a[axis]
            if not np.isfinite(shown + tick[0].device_velocity_rad_s[axis]):
                counts[2] += 1
        while True:
            at, found, _broken = next_frame(stream[0:1], data, at, n, layout)
            if not found:
                break
            counts[0] += 1
            sent = np.int64(0)
            for k in range(x.checksum_size):
                place = k if x.checksum_big else x.checksum_size - 1 - k
                sent = (sent << 8) | np.int64(stream[0].pending[x.checksum_at + place])
            if sent != slow_checksum(x.checksum, stream[0].pending, x.checksum_from, x.checksum_at):
                counts[1] += 1


def _table(packets):
    bases = np.zeros((len(packets), 256), np.uint8)
    for row, packet in zip(bases, packets, strict=True):
        row[: len(packet)] = np.frombuffer(packet, np.uint8)
    return bases, np.array([len(packet) for packet in packets])


def run_packets(inputs, seed):
    """Fuzz `rtctl-frame`; returns the counts by name."""
    counts = np.zeros(3, np.int64)
    bases, lengths = _table([packet for _, packet in vectors.vectors()])
    fuzz_packets(
        inputs,
        seed_words(seed),
        bases,
        lengths,
        records(np.zeros(1, deframer_dtype())),
        records(np.zeros(1, frame.state_dtype(1))),
        records(np.zeros(1, frame.command_dtype(2))),
        records(np.zeros(1, frame.identity_dtype())),
        counts,
    )
    return dict(zip(("let_through", "wrong_checksum", "not_canonical"), counts.tolist(), strict=True))


RIG = Rig(1, 1e-3, np.ones(1), np.ones(1), np.ones(1), np.full(1, 4096.0), np.ones((1, 3)))
CONFIG = Path(__file__).parents[2] / "configs" / "serial-described.toml"


def run_frames(inputs, seed, name):
    """Fuzz the shipped described sample frame with another checksum; returns the counts by name."""
    options = tomllib.loads(CONFIG.read_text())["device"][0]["options"]
    size = checksums.SIZE[name]
    (heat,) = (field for field in options["sample"]["field"] if field["channel"] == "temperature")
    heat |= {"channel": "velocity", "unit": "rpm"}
    options["sample"] |= {"checksum": name, "length": 20 + size}
    sample = DescribedOptions.model_validate(options).model_dump(mode="json")["sample"]
    layout, fields = records(layout_of(sample)), records(fields_of(sample, RIG, "sample"))
    packets = []
    for seed_of_packet in range(8):
        packet = np.zeros(LENGTH_MAX, np.uint8)
        packet[: 20 + size] = np.random.default_rng(seed_of_packet).integers(0, 256, 20 + size)
        packet[:2] = sample["sync"]
        seal_frame(packet, layout)
        packets.append(packet[: 20 + size].tobytes())
    link = records(np.zeros(1, described_codec.described_dtype(1)))
    link["show_position"] = link["show_velocity"] = 1
    link["angle"][..., 0] = np.nan
    tick = records(np.zeros(1, [*_TICK]))
    counts = np.zeros(3, np.int64)
    stream = records(np.zeros(2, stream_dtype()))
    fuzz_frames(inputs, seed_words(seed), *_table(packets), stream, layout, fields, link, tick, counts)
    return dict(zip(("let_through", "wrong_checksum", "not_finite"), counts.tolist(), strict=True))


_TICK = (
    ("sample_count", "<i8"),
    ("link_faults", "<u8"),
    ("estop", "<i8"),
    ("position_rad", "<f8", (1,)),
    ("current_a", "<f8", (1,)),
    ("temperature_c", "<f8", (1,)),
    ("device_velocity_rad_s", "<f8", (1,)),
    ("force_n", "<f8", (3,)),
    ("moment_nm", "<f8", (3,)),
)


def run(inputs, seed=1):
    """Every decoder, `inputs` each."""
    found = {"rtctl-frame": run_packets(inputs, seed)}
    for name in checksums.KINDS:
        found[name] = run_frames(inputs, seed, name)
    return found


def failures(found):
    """Names of decoders that let something wrong through."""
    return [name for name, counts in found.items() if any(list(counts.values())[1:])]


if __name__ == "__main__":
    result = run(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    sys.stdout.write(json.dumps(result, indent=2) + "\n")
    sys.exit(1 if failures(result) else 0)
