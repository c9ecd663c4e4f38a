"""Makes a rig torque-free when nobody else does any more: through a fresh open of its actuators.

The loop stops its devices on every way out but three: killed, crashed, stalled. Then the device's own time to
live comes first; this comes second, from the supervisor and from `rtctl stop-rig` (systemd's ExecStopPost).
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from functools import partial
from importlib import import_module

import numpy as np

from hw import registry
from hw.channels import COMMAND_FIELDS
from hw.every_device import reach_all
from hw.interface import Backend, BackendError, PreparedStop, Rig
from hw.member import Member
from hw.refusals import raised_by, words_of
from hw.rig_words import subset
from rtctl.host.loop_process import OPEN_TIMEOUT_S
from rtctl.rig_file.config import LoadedConfig


@dataclass(frozen=True)
class Stopped:
    """What became of one actuator. `confirmed`: it was opened afresh and told to stop; else `detail` says why
    not."""

    device: str
    confirmed: bool
    detail: str

    def text(self) -> str:
        """For a person."""
        if self.confirmed:
            return f"{self.device}: opened afresh and stopped"
        return f"{self.device}: NOT CONFIRMED to be torque-free: {self.detail}"

    def as_dict(self) -> dict[str, object]:
        """For `--json`."""
        return asdict(self)


class _Unmade:
    """In the place of a driver that cannot be made: named as not stopped, while the others are."""

    provides: frozenset[str] = frozenset()

    def __init__(self, member: Member, error: BackendError) -> None:
        self.consumes = frozenset(member.channels) & COMMAND_FIELDS.keys()
        self._error = error

    def open(self) -> None:
        raise self._error

    def read(self, tick: np.ndarray) -> None:
        del tick
        raise self._error

    write = read
    stop = close = open


def _made(member: Member, rig: Rig) -> Backend:
    try:
        return registry.create(member.kind, member.options, rig)
    except BackendError as error:
        return _Unmade(member, error)


class SafeStop:
    """The actuators of a rig, each behind a backend of its own; simulated devices have no torque to take
    away.

    Making it imports and compiles what is needed, opening nothing, so that `now` is quick."""

    def __init__(self, loaded: LoadedConfig) -> None:
        rig = loaded.config.hardware()
        made: list[tuple[Member, Backend]] = [
            (member, _made(member, subset(rig, member.axes)))
            for member in loaded.members()
            if not registry.lookup(member.kind).simulated
        ]
        # sensors have nothing to be stopped, and opening one takes time
        self._actuators = [(member.label, backend) for member, backend in made if backend.consumes]

    def know(self, modules: Iterable[str]) -> None:
        """Import what opening needs, as the loop found when it opened the devices: later these may be files
        of another version, or gone. And make what `tell` sends: the loop has compiled what that takes."""
        for module in modules if self._actuators else ():
            with contextlib.suppress(ImportError):  # one that is made by another, and comes with it
                import_module(module)
        for _, backend in self._actuators:
            # when it is needed this would take 4 to 20 ms, under torque (decision 0163)
            if isinstance(backend, PreparedStop):
                raised_by(backend.prepare_stop)

    def tell(self) -> None:
        """Tell every actuator at once, as far as that works without opening it. Quick; never raises, and one
        that hangs holds up neither the others nor the host."""
        reach_all([backend.stop for _, backend in self._actuators])

    def now(self) -> list[Stopped]:
        """Stop every actuator. Never raises for a device; whoever else has it open is not asked.

        All are told at once; then all are opened, which takes as long as their options allow, told again, and
        closed. One that has not come back by `OPEN_TIMEOUT_S` is left."""
        self.tell()
        # whatever one device's code does, the others are stopped; with a whole stack, for opening may compile
        steps = [partial(_stop_opened, backend) for _, backend in self._actuators]
        raised = reach_all(steps, OPEN_TIMEOUT_S, 0)
        # told, not seen: whether its torque is gone, only the device could say
        return [
            Stopped(label, confirmed=error is None, detail=words_of(error) if error else "")
            for (label, _), error in zip(self._actuators, raised, strict=True)
        ]


def _stop_opened(backend: Backend) -> None:
    backend.open()
    backend.stop()
    backend.close()
