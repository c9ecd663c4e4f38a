"""The simulated rig with scripted faults: built, run, and what its readings become while a fault is due."""

import math

import numpy as np

from hw.channels import QUANTITIES
from hw.fault_kinds import KINDS, Effect
from hw.interface import Rig
from hw.scripted_faults import FAULTS
from hw.simulators.jit import records
from hw.simulators.mock_backend import MockBackend
from hw.simulators.mock_options import MockOptions
from hw.simulators.mock_sensors import SENSORS
from rtctl.tick import new_ticks

N, AT, FOR, T = 60, 20, 5, 1e-3
DUE = slice(AT, AT + FOR)
COUNT_RAD = 2 * math.pi / 160_000
MEASURED = ("position_rad", "current_a", "force_n", "moment_nm", "temperature_c", "device_velocity_rad_s")
SHOWN = (
    *MEASURED,
    "estop",
    "link_faults",
    "sample_count",
)
BEYOND = {reading.name for reading in QUANTITIES} - SENSORS.keys()
"""Channels that the mock rig does not measure."""

MOVING = {
    "seed": 7,
    "axis": [{"start_position_rad": 0.2, "current_noise_a": 0.02, "current_bias_a": 0.3}],
    "force": {
        "noise_n": 0.01,
        "bias_n": [0.1, -0.2, 0.3],
        "drift_n_sqrt_s": 0.1,
        "moment": {"noise_nm": 0.01, "contact_m": [0.1, 0.02, 0.0]},
    },
    "velocity": {"noise_rad_s": 0.01, "resolution_rad_s": 0.001},
    "hand": [{"kind": "sine", "start_s": 0.0, "frequency_hz": 5.0}],
}


def rig(n=2):
    return Rig(
        n_axes=n,
        period_s=T,
        gear_ratio=np.full(n, 80.0),
        gear_efficiency=np.full(n, 0.72),
        torque_constant_nm_a=np.full(n, 0.0134),
        encoder_counts_per_rev=np.full(n, 160_000.0),
        lever_m=np.array([[0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])[:n],
    )


def make(faults=(), n=2, **options):
    return MockBackend(
        MockOptions.model_validate({**MOVING, **options, "faults": list(faults)}).model_dump(mode="json"),
        rig(n),
    )


def run(backend, ticks=N, enabled=1, amplitude_a=0.5):
    """Ticks shown, and states of the rig after each one's period."""
    n = len(backend.state["position_rad"][0])
    tick, out = records(new_ticks(1, n)), new_ticks(ticks, n)
    truth = np.zeros(ticks, backend.state.dtype)
    for k in range(ticks):
        tick["tick"] = k
        backend.read(tick)
        tick["current_command_a"] = amplitude_a * math.sin(0.2 * k)
        tick["enabled"] = enabled
        backend.write(tick)
        out[k], truth[k] = tick[0], backend.state[0]
    return out, truth


def fault(channel, kind, **more):
    times = {"at_tick": AT, "for_ticks": FOR}
    for name in ("at_s", "at_tick"):
        if name in more:
            times.pop("at_tick", None)
    for name in ("for_s", "for_ticks"):
        if name in more:
            times.pop("for_ticks", None)
    return {"channel": channel, "kind": kind, **times, **more}


def holding(values):
    held = values.copy()
    held[DUE] = values[AT - 1]
    return held


def with_due(values, change):
    out = values.copy()
    out[DUE] = change(values[DUE])
    return out


def all_effects():
    """One fault of every effect on every channel that neither raises nor sleeps, overlapping, some by
    chance.
    """
    out = []
    for k, kind in enumerate(KINDS.values()):
        if kind.effect in (Effect.RAISE_READ, Effect.RAISE_WRITE, Effect.STALL):
            continue
        if kind.channel.name.lower() in BEYOND:
            continue
        value = kind.default if kind.default is not None else (kind.low + 3 * kind.high) / 4
        probability = 0.4 if k % 3 == 0 else 1.0
        table = fault(kind.channel.name.lower(), kind.name, at_tick=2 + k, for_ticks=4, every_ticks=23)
        out.append({**table, "probability": probability, "value": float(value)})
    return {"first": out[:FAULTS], "last": out[-FAULTS:]}  # as many as there are places
