"""What the contract is run on: a backend, the device that a test plays beside it, and ticks of its size."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hw import registry
from hw.interface import Backend, BackendInfo, Options, Rig
from hw.jit import records
from rtctl.tick import new_ticks


class Received(NamedTuple):
    """What an actuator was told last."""

    torque: Sequence[float]
    """One per axis, of what the backend consumes: N m at the joint, or A of the motor, positive towards
    larger positions. As the device's manual reads the bytes, not as the backend wrote them."""
    enabled: bool


class Device:
    """The device beside a backend, as far as a test has to play it. A simulated backend that needs none takes
    this as it is.

    Parameters
    ----------
    backend
        The one under test, not opened.
    options
        Its validated options.
    n_axes
        Axes of the rig."""

    def __init__(self, backend: Backend, options: Options, n_axes: int) -> None:
        self.backend, self.options, self.n_axes = backend, options, n_axes

    def open(self) -> None:
        """Open the backend, with the device answering whatever that asks."""
        self.backend.open()

    def step(self) -> None:
        """Obey everything sent so far, and send one sample: the next read finds it."""

    def show(self, channel: str, values: Sequence[float]) -> bool:
        """Have the samples from now on show these values of a channel, whatever the motor is told; the other
        channels stay as they are.

        Parameters
        ----------
        channel
            One that the backend provides: `position`, `velocity`, `current`, `temperature`, `force`,
            `moment`.
        values
            In the unit of the tick (rad, rad/s, A, degrees C, N, N m), one per axis, or x, y, z. What the
            device makes of them (counts, degrees, a turn that starts over) is as its manual says.

        Returns
        -------
        bool
            False: the device cannot show it."""
        del channel, values
        return False

    def write(self, tick: np.ndarray) -> None:
        """Have the backend write."""
        self.backend.write(tick)

    def received(self) -> Received | None:
        """What was obeyed last, as the *device* understood it; None: it has no actuator, or has heard nothing
        yet."""
        return None

    def close(self) -> None:
        """End the device. The backend is closed by then."""


def nominal_rig(n_axes: int = 1) -> Rig:
    """A rig of geared motors, all axes alike, at 1 kHz."""
    return Rig(
        n_axes,
        period_s=1e-3,
        gear_ratio=np.full(n_axes, 80.0),
        gear_efficiency=np.full(n_axes, 0.72),
        torque_constant_nm_a=np.full(n_axes, 0.0134),
        encoder_counts_per_rev=np.full(n_axes, 160_000.0),
        lever_m=np.array([[0.0, 0.1, 0.0], [0.0, 0.0, 0.1], [0.1, 0.0, 0.0]])[np.arange(n_axes) % 3],
    )


@dataclass(frozen=True)
class Case:
    """One way to use a backend.

    Parameters
    ----------
    kind
        As rig files have it: the name of the entry point.
    options
        Called with a folder and "first" or "second": starts what the device is, and gives `[device.options]`
        that lead to it.
    device
        Called with backend, validated options and number of axes, once the backend is made.
    n_axes
        Axes of the rig.
    twins
        Whether two such devices can be played at once.
    hears
        Whether `Device.received` tells what the actuator was told. A kind that is not simulated and drives
        something needs it.
    shows
        Whether `Device.show` has it measure what the contract wants. A kind that is not simulated needs it.
    make
        Another way to make the backend, from kind, validated options and rig."""

    kind: str
    options: Callable[[Path, str], Mapping[str, Any]]
    device: Callable[[Backend, Options, int], Device] = Device
    n_axes: int = 1
    twins: bool = True
    hears: bool = True
    shows: bool = True
    make: Callable[[str, Options, Rig], Backend] = registry.create


class Subject:
    """A backend under test. `read` and `write` are those of a cycle, in step with the device."""

    def __init__(self, case: Case, folder: Path, which: str = "first") -> None:
        self.case, self.folder = case, folder
        given = case.options(folder, which)
        # through the model, as a rig file's: defaults and paths are what the daemon would have
        valid = registry.options_model(case.kind).model_validate(given, context={"folder": folder})
        self.options: dict[str, Any] = valid.model_dump(mode="json")
        self.rig = nominal_rig(case.n_axes)
        self.backend = case.make(case.kind, self.options, self.rig)
        self.device = case.device(self.backend, self.options, case.n_axes)

    @cached_property
    def info(self) -> BackendInfo:
        """What the kind declares."""
        return registry.lookup(self.case.kind)

    @property
    def paced(self) -> bool:
        """Whether samples come from a device that the test plays, and so not before it steps."""
        return type(self.device).step is not Device.step

    def twin(self) -> Subject:
        """Another one with the same options and an equal device of its own."""
        return Subject(self.case, self.folder, "second")

    def tick(self, slot: int = 0) -> np.ndarray:
        """A zeroed tick."""
        tick = records(new_ticks(1, self.case.n_axes))
        tick["tick"] = slot
        return tick

    def open(self) -> None:
        """Open the backend, its device answering."""
        self.device.open()

    def read(self, tick: np.ndarray) -> None:
        """Have the device send a sample, and read it."""
        self.device.step()
        self.backend.read(tick)

    def write(self, tick: np.ndarray) -> None:
        """Write as in a cycle."""
        self.device.write(tick)

    def told(self, slot: int, *, enabled: int, torque: float) -> Received | None:
        """Run a cycle that sends this, up to the next sample; what the device then has of it."""
        tick = self.tick(slot)
        # both: a backend takes the current or the torque, and which is its own choice
        tick["enabled"], tick["current_command_a"], tick["torque_applied_nm"] = enabled, torque, torque
        self.write(tick)
        self.read(tick)
        return self.device.received()

    def release(self) -> None:
        """End both."""
        # the backend first: it may still say goodbye to its device
        try:
            self.backend.close()
        finally:
            self.device.close()
