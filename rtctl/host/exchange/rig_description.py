"""The facts of a rig that its telemetry and its gateway tell clients, and the bounds they enforce."""

from __future__ import annotations

import secrets
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from rtctl import __version__
from rtctl.control.vocabulary import PARAMETERS
from rtctl.friction import artefact
from rtctl.rig_file import measured_timing as timing
from rtctl.rig_file.axis_tables import AxisTable
from rtctl.rig_file.config import LoadedConfig

Bounds = Mapping[str, tuple[float, float]]
"""Key of a request -> lowest and highest value accepted."""

# 32 bits: telemetry has it as a float, too, which holds them exactly
SESSION = secrets.randbits(32)
"""Random number of this run of the daemon; a client that sees it change knows of the restart."""


NOT_TAKEN = -(1 << 62)
"""No difference of two clocks: one below 0 is, where the wall clock began in 1970 and was not set since."""

BATCH_TICKS = 8
"""Ticks of a telemetry message: a world that answers each message with a target is never near HOLD."""

SHORTEST_BATCH_S, LONGEST_BATCH_S = 2e-3, 20e-3
STATE_HZ = 100.0


def pace(rate_hz: float, batch_ms: float | None, state_hz: float | None) -> tuple[float, float]:
    """Seconds from one telemetry message to the next, and state samples a second, where the rig file leaves
    them out."""
    batch_s = min(max(BATCH_TICKS / rate_hz, SHORTEST_BATCH_S), LONGEST_BATCH_S)
    if batch_ms is not None:
        batch_s = batch_ms * 1e-3
    # one sample a message at least: a renderer that waits for the state is not to wait for several
    return batch_s, max(STATE_HZ, 1.0 / batch_s) if state_hz is None else state_hz


@dataclass(frozen=True)
class AxisDescription:
    """One axis: its name and what a client may ask of it.

    `trained_c` is the range of temperature its friction was learned at, degC: None without a model in use, or
    one that does not say. `coupling` is the virtual coupling in force: stiffness_nm_rad, damping_nms_rad.
    `displays` are those that it may show, the rig file's first; `motion` says whether `_rad` and `_nm` are of
    rad and N m, or of m and N."""

    name: str
    bounds: Bounds
    trained_c: tuple[float, float] | None = None
    coupling: Mapping[str, float] | None = None
    displays: tuple[str, ...] = ("impedance",)
    motion: str = "rotary"

    def told(self) -> dict[str, Any]:
        """The axis as `hello` tells it."""
        return {
            "name": self.name,
            "motion": self.motion,
            "displays": list(self.displays),
            "bounds": {key: list(pair) for key, pair in self.bounds.items()},
            "coupling": None if self.coupling is None else dict(self.coupling),
        }


@dataclass(frozen=True)
class DeviceDescription:
    """One device: its label, the axes it serves (numbers), and those of its channels the rig uses."""

    label: str
    axes: tuple[int, ...]
    channels: tuple[str, ...]


@dataclass(frozen=True)
class RigDescription:
    """One rig.

    Attributes
    ----------
    virtual
        True when the loop runs on a virtual clock: `time_ns` is then no CLOCK_MONOTONIC time.
    session
        See `SESSION`.
    start_wall_ns
        Wall-clock time minus the loop's clock, ns: add it to `time_ns` for a time stamp. Taken once, so a
        step of the wall clock never makes time stamps jump.
    devices
        In the order of the rig file.
    not_proved
        Rows of `rtctl check` that are not proved, as "axis: row".
    params
        The law's parameters, shape (1,), by which a fault is laid at an axis; None: they are not known."""

    name: str
    axes: tuple[AxisDescription, ...]
    rate_hz: float
    state_hz: float = 100.0
    batch_s: float = 0.02
    virtual: bool = False
    config_sha256: str = ""
    devices_sha256: str = ""
    version: str = __version__
    session: int = SESSION
    start_wall_ns: int = NOT_TAKEN
    devices: tuple[DeviceDescription, ...] = ()
    not_proved: tuple[str, ...] = ()
    params: np.ndarray | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if self.start_wall_ns == NOT_TAKEN:
            clock_ns = 0 if self.virtual else time.monotonic_ns()
            # frozen: this is the one moment at which it may be filled
            object.__setattr__(self, "start_wall_ns", time.time_ns() - clock_ns)

    @property
    def n_axes(self) -> int:
        """Number of axes."""
        return len(self.axes)

    @property
    def motions(self) -> list[str]:
        """Motion of each axis."""
        return [axis.motion for axis in self.axes]


def describe(rig: LoadedConfig | RigDescription) -> RigDescription:
    """The description of a rig from its file; one that is a description already is returned as it is."""
    if isinstance(rig, RigDescription):
        return rig
    loaded, config = rig, rig.config
    batch_s, state_hz = pace(config.loop.rate_hz, config.telemetry.batch_ms, config.telemetry.state_hz)
    return RigDescription(
        name=config.rig.name,
        axes=tuple(
            AxisDescription(
                axis.name,
                _bounds(axis),
                _trained_c(loaded, axis),
                {
                    "stiffness_nm_rad": axis.coupling.stiffness_nm_rad,
                    "damping_nms_rad": axis.coupling.damping_nms_rad,
                },
                axis.displays,
                axis.motion,
            )
            for axis in config.axis
        ),
        rate_hz=config.loop.rate_hz,
        state_hz=state_hz,
        batch_s=batch_s,
        virtual=config.loop.clock == "virtual",
        config_sha256=loaded.sha256,
        devices_sha256=timing.devices_sha256(loaded),
    )


def describe_run(
    loaded: LoadedConfig, params: np.ndarray, not_proved: tuple[str, ...] = ()
) -> RigDescription:
    """The description of a rig that is about to run, with all that tells where a fault comes from.

    `params` are the law's, shape (1,); `not_proved` rows of its check."""
    devices = tuple(
        DeviceDescription(member.label, member.axes, member.channels) for member in loaded.members()
    )
    return replace(describe(loaded), devices=devices, params=params, not_proved=not_proved)


def _trained_c(loaded: LoadedConfig, axis: AxisTable) -> tuple[float, float] | None:
    path = loaded.model_in_use(axis)
    if path is None:
        return None
    model = artefact.load(path)
    low, high = model.temperature_min_c, model.temperature_max_c
    # 0 throughout: a rig without a sensor (files of the first versions)
    return (low, high) if low is not None and high is not None and (low or high) else None


def _bounds(axis: AxisTable) -> dict[str, tuple[float, float]]:
    """What a client may ask: the bounds of the rig file's own [axis.environment], and the axis' travel."""
    travel = (axis.position_min_rad, axis.position_max_rad)
    speed, shown = axis.velocity_limit_rad_s, axis.admittance
    return {
        **{one.name: (one.low, one.high) for one in PARAMETERS if not one.sign},
        "position_rad": travel,
        "velocity_rad_s": (-speed, speed),
        "mass_kgm2": (shown.mass_kgm2, shown.mass_max_kgm2 or shown.mass_kgm2),
        # without a largest value of its own it stays at the rig file's
        "mass_damping_nms_rad": (shown.damping_nms_rad, shown.damping_max_nms_rad or shown.damping_nms_rad),
    }
