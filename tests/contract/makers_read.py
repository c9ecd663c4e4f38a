"""How this program reads a frame of a maker's device, through the axis or backend that the loop uses; for the
digests of `makers`.
"""

import math
import types

import numpy as np
from makers.random_frames import OPTOFORCE
from makers.readings import NOTHING, doubles

from hw import registry
from hw.can import odrive, odrive_codec
from hw.can.moteus import MoteusAxis
from hw.can.sample import Sample
from hw.force import serial_backend as serial_sensor
from hw.interface import Rig
from rtctl.tick import new_ticks

RIG = Rig(1, 1e-3, np.ones(1), np.ones(1), np.ones(1), np.full(1, 4096.0), np.eye(3)[:1])
_AXIS = {"node": 5, "direction": 1, "shaft": "motor", "offset_rad": 0.0, "current_max_a": 20.0}
_OPTIONS = {
    "feedback": "cyclic", "heartbeat_ms": 10.0, "temperature_ms": 100.0, "source": 0, "time_to_live_ms": 10.0,
}  # fmt: skip
AT = 8
"""Where a frame's data begins in its buffer, as in SocketCAN's."""


def _hand(handler, data):
    handler(bytes(AT) + data + bytes(72 - len(data)), AT, len(data))


def moteus():
    sample = Sample(1)
    axis = MoteusAxis(_AXIS, _OPTIONS, RIG, 0, sample)
    (handler, *_) = axis.handlers().values()

    def _read(data):
        sample.fresh = 0
        _hand(handler, data)
        assert math.isfinite(sum(sample.values))
        if not sample.fresh:
            return NOTHING
        values = sample.position_rad, sample.velocity_rad_s, sample.current_a, sample.temperature_c
        return doubles(*(value[0] for value in values), axis.mode, axis.fault)

    return _read


def odrive_of(version):
    commands = {
        "Get_Encoder_Estimates": odrive_codec.GET_ENCODER, "Get_Iq": odrive_codec.GET_IQ,
        "Get_Temperature": odrive_codec.GET_TEMPERATURE, "Heartbeat": odrive_codec.HEARTBEAT,
    }  # fmt: skip
    sample = Sample(1)
    axis = odrive.OdriveAxis(_AXIS, _OPTIONS, RIG, 0, sample)
    handlers = axis.handlers()

    def _read(frame):
        name, data = frame
        if name == "Get_Temperature" and version == "0.5.6":
            return NOTHING  # that firmware has another value there; with it the backend refuses to open
        sample.fresh, axis._beats = 0, 0
        sample.temperature_c[0] = 1e9
        _hand(handlers[odrive_codec.can_id(5, commands[name])], data)
        assert math.isfinite(sum(sample.values))
        if name == "Heartbeat":
            return doubles(axis.error, axis.state) if axis._beats else NOTHING
        if name == "Get_Temperature":
            return doubles(sample.temperature_c[0], 0.0) if sample.temperature_c[0] != 1e9 else NOTHING
        if not sample.fresh:
            return NOTHING
        if name == "Get_Iq":
            return doubles(sample.current_a[0])
        return doubles(sample.position_rad[0], sample.velocity_rad_s[0])

    return _read


class _Fed:
    """Stands in for a port: one frame waits at a time."""

    def __init__(self):
        self.data = b""

    def read_into(self, views):
        n, views[0][: len(self.data)] = len(self.data), self.data
        self.data = b""
        return n

    def write(self, packet):
        return True

    def close(self):
        pass


def serial_force(kind, **more):
    """A serial force sensor's backend with a port that is fed, its tick, and the port."""
    options = registry.options_model(kind).model_validate({"port": "/dev/x", "open_timeout_s": 0.0, **more})
    backend, port, tick = registry.create(kind, options.model_dump(mode="json"), RIG), _Fed(), new_ticks()
    assert isinstance(backend, serial_sensor.SerialSensor)
    backend._port = port
    return backend, port, tick


def _shown(backend, tick, *, moments):
    """Read; the force (and moment) of a fresh sample."""
    before = int(tick["sample_count"][0])
    backend.read(tick)
    six = (*tick["force_n"][0], *(tick["moment_nm"][0] if moments else ()))
    assert tick["sample_count"][0] == before or all(map(math.isfinite, six))
    return doubles(*six) if tick["sample_count"][0] == before + 1 else NOTHING


def optoforce():
    made = {}
    for layout in OPTOFORCE:
        six = {"moments": True, "counts_per_nm": [1.0] * 3} if layout == "6-axis" else {}
        made[layout] = serial_force("optoforce", counts_per_n=[1.0] * 3, layout=layout, output_hz=100, **six)

    def _read(frame):
        layout, data = frame
        backend, port, tick = made[layout]
        backend._sample.forget()
        backend._frames.forget()
        port.data = data
        return _shown(backend, tick, moments=layout == "6-axis")

    return _read


def rdt():
    table = {"host": "127.0.0.1", "counts_per_n": 1.0, "counts_per_nm": 1.0, "moments": True}
    options = registry.options_model("rdt").model_validate(table)
    backend, tick, waiting = registry.create("rdt", options.model_dump(mode="json"), RIG), new_ticks(), []

    def _recv_into(buffer):
        if not waiting:
            raise BlockingIOError
        data = waiting.pop()
        buffer[: len(data)] = data
        return len(data)

    backend._socket = types.SimpleNamespace(recv_into=_recv_into, send=len)

    def _read(data):
        backend._reset()
        waiting.append(data)
        return _shown(backend, tick, moments=True)

    return _read


READERS = {
    "moteus": (moteus, "moteus"),
    "odrive 0.5.6": (lambda: odrive_of("0.5.6"), "odrive"),
    "odrive 0.6.10": (lambda: odrive_of("0.6.10"), "odrive"),
    "optoforce": (optoforce, "optoforce"),
    "rdt": (rdt, "rdt"),
}
