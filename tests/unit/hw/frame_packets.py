"""Packets of `rtctl-frame` and the numbers in them, as tests make them."""

import numpy as np

from hw.jit import records
from hw.serial import frame
from hw.serial.framing import BODY_MAX, seal, unseal


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
