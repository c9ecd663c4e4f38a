"""What a backend is: five small methods and a declaration of channels.

A backend never blocks in `read` or `write`, never raises in `stop`, and presents a sample as fresh
(by advancing `tick["sample_count"]`) only when it is. `tick` is a one-row structured array: the backend
writes the fields of its `provides` channels and reads those of its `consumes` channels.

A third-party backend is any object with this shape, offered through the entry-point group
`rtctl.backends` as a `BackendInfo`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntFlag
from typing import Any, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np

from hw.channels import CHANNEL_FIELDS as CHANNEL_FIELDS
from hw.channels import OPTIONAL_FIELDS as OPTIONAL_FIELDS
from hw.channels import WHOLE_RIG_CHANNELS as WHOLE_RIG_CHANNELS


class LinkFault(IntFlag):
    """Bits of `tick["link_faults"]`: what went wrong on the link in this cycle."""

    # the bits stand in ticks and recordings: a number is never given to another meaning
    CHECKSUM = 1
    SEQUENCE = 2
    LOST = 4
    END_OF_LOG = 8
    DEVICE = 16  # the device itself reports a fault: overload, invalid measurement, drive error
    OVER_BUDGET = 32  # a device took longer than the time set aside for it


class BackendError(Exception):
    """A device that cannot be opened or used; the text names the device, the cause and the remedy."""


class LinkLost(BackendError):  # noqa: N818 - the field's word
    """The device is gone: unplugged, hung up, or closed by its driver."""


@dataclass(frozen=True)
class Rig:
    """The facts of the rig a backend may need: axes, period, gearing.

    Arrays have shape `(n_axes,)`; `lever_m` and `axis_direction` have shape `(n_axes, 3)`: joint torque =
    lever @ tip force + direction @ moment. `axis_direction` is None or 0 where it is not known.

    `lead_m` is below 0 for a rotary axis, the lead of the screw (m a turn) for a linear one (`hw.motion`), 0
    without one; None: all are rotary. A linear axis with a screw has the ratio in rad of the motor a m, and
    the counts of 2 pi m."""

    n_axes: int
    period_s: float
    gear_ratio: np.ndarray
    gear_efficiency: np.ndarray
    torque_constant_nm_a: np.ndarray
    encoder_counts_per_rev: np.ndarray
    lever_m: np.ndarray
    axis_direction: np.ndarray | None = None
    lead_m: np.ndarray | None = None

    def moves(self, axis: int) -> tuple[str, float]:
        """Motion of an axis, and the lead of its screw, m a turn (0 without one)."""
        if self.lead_m is None or self.lead_m[axis] < 0:
            return "rotary", 0.0
        return "linear", float(self.lead_m[axis])


class Backend(Protocol):
    """One device, or a composed rig."""

    provides: frozenset[str]
    consumes: frozenset[str]

    def open(self) -> None:
        """Acquire the device. Idempotent. Raises BackendError."""

    def read(self, tick: np.ndarray) -> None:
        """Write the newest measurement into `tick[0]`. Never blocks. Raises LinkLost."""

    def write(self, tick: np.ndarray) -> None:
        """Send `tick[0]`'s applied torque (and `enabled`). Never blocks. Raises LinkLost."""

    def stop(self) -> None:
        """Make the actuator torque-free now. Never raises; safe before open and after close."""

    def close(self) -> None:
        """Release the device. Idempotent, never raises."""


@runtime_checkable
class CompiledBackend(Protocol):
    """A backend with compiled parts: they are compiled or loaded before the first cycle, not in it."""

    def warm_up(self, tick: np.ndarray) -> None:
        """Compile (or load) what `read` and `write` call, for ticks like `tick`; changes nothing."""


@runtime_checkable
class PreparedStop(Protocol):
    """A backend whose `stop`, unless it was opened before, first has to make what it sends."""

    def prepare_stop(self) -> None:
        """Make it (compiled code is loaded for that) without opening or sending anything."""


class CompiledCycle(NamedTuple):
    """What a whole compiled cycle calls in place of `read` and `write`: compiled functions with their
    arguments.

    Each returns 0 when it has done all that the method does. Any other number leaves the method to Python: it
    is then called in the same cycle and must find everything as if nothing had been done, so that words of an
    error, and what else is rare, stand there."""

    read: Callable[..., int]
    read_arguments: tuple[Any, ...]
    write: Callable[..., int]
    write_arguments: tuple[Any, ...]
    simulated: tuple[np.ndarray, ...] = ()
    """Where both change these records (of words of 64 bits) and the tick, and reach nothing else: the
    records, each among the arguments. The loop then calls both on copies too, for practice. Empty where there
    is a device."""


@runtime_checkable
class CompiledCycleBackend(Protocol):
    """A backend that can do without Python in ordinary cycles (`rtctl.rt.whole_cycle`)."""

    def compiled_cycle(self, tick: np.ndarray) -> CompiledCycle | None:
        """For this tick, in which they then work, until it is asked for another one; None where this device
        needs Python in every cycle."""


@runtime_checkable
class CountingBackend(Protocol):
    """A backend that counts what its link has seen; `rtctl probe` shows it."""

    def counts(self) -> dict[str, int]:
        """Totals since `open`: frames, checksum errors, lost frames, ... by name."""


@runtime_checkable
class AskedBackend(Protocol):
    """A backend some of whose devices answer only when asked; `rtctl probe` asks, and never writes a
    command."""

    def ask(self) -> None:
        """Ask for one sample, disabled and without torque, where none comes unasked. Never blocks. Raises
        LinkLost."""


class Words(NamedTuple):
    """What a device says of itself, or of one of its axes, in words for a person."""

    text: str
    """Error registers, emergency codes, states and flags by their names; empty: nothing to say."""
    faults: int = 0
    """`LinkFault` bits that this axis raises now."""
    silent: bool = False
    """This axis is what a whole new sample waits for."""


@runtime_checkable
class SpeakingBackend(Protocol):
    """A backend whose device has words of its own: events, `rtctl probe`, monitor and view show them."""

    def words(self) -> Sequence[Words]:
        """One per axis of the device, in its order, or a single one for all of it.

        Asked for only while the actuator is disabled, so it may make strings. Never blocks, never raises."""


@dataclass(frozen=True)
class Channels:
    """What a device provides and consumes: names of `CHANNEL_FIELDS`."""

    provides: frozenset[str]
    consumes: frozenset[str]


@dataclass(frozen=True)
class Timing:
    """How late one axis of a device is, at its worst; `rtctl check` proves the coupling with it.

    `delay_s` is all the time between a position and the torque that answers it, but for the loop's own
    computing, which reads, decides and sends in one go: age of the sample when it is read, way of the
    command, wait until the motor's current changes. A device that only measures, or only drives, declares its
    part."""

    delay_s: float = 0.0
    sample_period_s: float = 0.0
    """Time between two fresh positions; 0: a new one for every reading."""
    jitter_s: float = 0.0
    """How much shorter the delay may be in one cycle than in another, s."""
    current_loop_hz: float = 0.0
    """Bandwidth of the current loop, Hz, behind the delay; 0: none to speak of."""


@dataclass(frozen=True)
class ForceSensor:
    """What lies between a force and what a device shows of it, at its worst; `rtctl check` proves the loops
    that the force closes with it."""

    lowpass_hz: float = 0.0
    """Low-pass in its hardware or firmware, as one of first order, Hz; 0: none to speak of."""
    delay_s: float = 0.0
    """How old the force is besides when it is read: age of the sample, way to the host, half the window of a
    moving average."""


@dataclass(frozen=True)
class Shown:
    """What the numbers of a device can show of what it measures: a wrong scale or count is told by it.

    0: not known, or none to speak of, as of a number with a floating point."""

    step_rad: tuple[float, ...] = ()
    """Step of the position, rad at the link, one per axis; empty: none of them is known."""
    counted: bool = False
    """Such a step is a count of the encoder, and not the last digit of a number that may have far more."""
    current_step_a: tuple[float, ...] = ()
    """Step of the motor's current, A, one per axis; empty: as above."""
    force_step_n: float = 0.0
    """Step of the force, N, of the coarsest component."""
    force_most_n: float = 0.0
    """Largest force that it can show of every component and sign, N."""
    force_gain: float = 0.0
    """Force shown for each newton of the sensor's own, by a matrix that ought only to turn and mirror."""


@dataclass(frozen=True)
class Joint:
    """What a device knows of the joint of one axis that a rig file may not."""

    motor_share: float = 1.0
    """Share of the viscous damping on the side of motor and encoder."""
    dry_share: float = 1.0
    """Share of the dry friction there."""
    damping_nms_rad: float = 0.0
    """Damping of the elastic joint itself, N m s/rad."""
    encoder: str = "motor"
    """The side it turns with: "motor" or "link"."""
    stiffness_nm_rad: float = 0.0
    """Stiffness of its spring, N m/rad; 0: not known, or rigid."""
    link_inertia_share: float = 0.5
    """Share of the inertia on the link's side."""


class Finding(NamedTuple):
    """What a backend's `doctor` found of one thing that its device needs: `rtctl doctor` shows it as a
    line."""

    status: Literal["ok", "warn", "fail"]
    """`fail`: the rig will refuse to run, or be useless. `warn`: it runs, less well."""
    found: str
    fix: str = ""
    """The command, or the line of a file, that puts it right."""


@dataclass(frozen=True)
class BackendInfo:
    """Registry entry. Both targets are `module:attribute`, imported only when used.

    `factory(options: Mapping, rig: Rig) -> Backend` runs in the loop process.
    `options` names a pydantic model that validates the device's table in the rig file; it is imported
    only by the host.
    `simulated`: no real actuator, so refused real-time rights only warn.
    `channels`: those of every device of this kind. None: they depend on the options; the host then makes
    the backend, without opening it, and looks at its `provides` and `consumes`."""

    factory: str
    options: str
    simulated: bool
    channels: Channels | None = None
    follows: bool = True
    """The current measured answers the torque sent; False for a recording."""
    timing: str | None = None
    """`module:attribute` of a function `(options, rig) -> Sequence[Timing]`, one per axis of `rig`. None: the
    backend does not say, and `rtctl check` has only the rig file's word for it."""
    joint: str | None = None
    """Module and function that give a `Joint` per axis. None: rigid, as far as the device knows."""
    force: str | None = None
    """Module and function `(options, rig) -> ForceSensor | None` of a device that shows forces. None: it does
    not know, and `rtctl check` has only the rig file's word."""
    shown: str | None = None
    """Module and function `(options, rig) -> Shown`. None: nothing is known of its numbers."""
    network: bool = False
    """The device is reached by IP or by a CAN interface: the service's unit then leaves the network open to
    the daemon."""
    doctor: str | None = None
    """`module:attribute` of a function `(options) -> Sequence[Finding]`, for `rtctl doctor`: is everything
    there that the device needs? It opens, sends and changes nothing. None: its options alone are looked
    at."""


Options = Mapping[str, Any]
