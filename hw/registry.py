"""Finds backends by name: the entry-point group `rtctl.backends`, ours and third parties' alike.

Drivers are imported only when used, so a missing one fails only when asked for, by name."""

from __future__ import annotations

import importlib
import math
import sys
import traceback
from collections.abc import Callable, Iterable, Sequence
from dataclasses import astuple
from functools import cache
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any, cast

from hw.interface import (
    Backend,
    BackendError,
    BackendInfo,
    Channels,
    Finding,
    ForceSensor,
    Joint,
    Options,
    Rig,
    Shown,
    Timing,
)

if TYPE_CHECKING:
    from pydantic import BaseModel

GROUP = "rtctl.backends"
STATUSES = ("ok", "warn", "fail")

DISTRIBUTIONS = {
    "serial": "rtctl[serial]",
    "can": "rtctl[can]",
    "cantools": "rtctl[can]",
    "canopen": "rtctl[can]",
}
"""What to install for a module that is missing, where it is not called like the module."""


BUILT_IN = {
    "mock": BackendInfo(
        factory="hw.simulators.mock_backend:MockBackend",
        options="hw.simulators.mock_options:MockOptions",
        simulated=True,
        summary="simulated rig: motor, gearbox, friction, sensors, a hand",
        timing="hw.simulators.mock_declared:timing",
        joint="hw.simulators.mock_declared:joint",
        force="hw.simulators.mock_declared:force",
        shown="hw.simulators.mock_declared:shown",
    ),
    "playback": BackendInfo(
        factory="hw.playback.backend:PlaybackBackend",
        options="hw.playback.options:PlaybackOptions",
        simulated=True,
        summary="a recorded log (CSV) as the sensor stream",
        follows=False,
        timing="hw.playback.declared:timing",
        force="hw.playback.declared:force",
    ),
    "serial": BackendInfo(
        factory="hw.serial.frame_backend:SerialBackend",
        options="hw.serial.options:SerialOptions",
        simulated=False,
        summary="a board on a serial port that speaks rtctl-frame (docs/serial-protocol.md)",
        timing="hw.serial.declared:timing",
    ),
    "serial-described": BackendInfo(
        factory="hw.serial.described_backend:DescribedBackend",
        options="hw.serial.described_options:DescribedOptions",
        simulated=False,
        summary="a board on a serial port with a frame of its own, described in the rig file "
        "(docs/serial-described.md)",
        timing="hw.serial.declared:described_timing",
        shown="hw.serial.declared:described_shown",
    ),
    "serial-lines": BackendInfo(
        factory="hw.serial.lines_backend:LinesBackend",
        options="hw.serial.lines_options:LinesOptions",
        simulated=False,
        summary="a board on a serial port that prints and takes lines of text (docs/serial-lines.md)",
        timing="hw.serial.declared:lines_timing",
    ),
    "rokubi": BackendInfo(
        factory="hw.force.serial_backend:make_rokubi",
        options="hw.force.options:RokubiOptions",
        simulated=False,
        summary="force sensor: Bota Systems Rokubi, SensONE, LaxONE on a serial port",
        shown="hw.force.declared:rokubi_shown",
    ),
    "optoforce": BackendInfo(
        factory="hw.force.serial_backend:make_optoforce",
        options="hw.force.options:OptoForceOptions",
        simulated=False,
        summary="force sensor: OptoForce / OnRobot DAQ on a serial port",
        force="hw.force.declared:optoforce",
        shown="hw.force.declared:optoforce_shown",
    ),
    "rdt": BackendInfo(
        factory="hw.force.rdt_backend:RdtBackend",
        options="hw.force.options:RdtOptions",
        simulated=False,
        summary="force sensor: ATI Net F/T and Axia, OnRobot HEX, Schunk over UDP (RDT)",
        shown="hw.force.declared:rdt_shown",
        network=True,
    ),
    "can": BackendInfo(
        factory="hw.can.board_backend:BoardBackend",
        options="hw.can.board_options:BoardOptions",
        simulated=False,
        summary="a board on a CAN bus, by a field map or a DBC file",
        timing="hw.can.declared:board_timing",
        shown="hw.can.declared:board_shown",
        network=True,
    ),
    "odrive": BackendInfo(
        factory="hw.can.drive_backend:OdriveBackend",
        options="hw.can.options:OdriveOptions",
        simulated=False,
        summary="ODrives over CAN Simple",
        timing="hw.can.declared:odrive_timing",
        network=True,
    ),
    "moteus": BackendInfo(
        factory="hw.can.drive_backend:MoteusBackend",
        options="hw.can.options:MoteusOptions",
        simulated=False,
        summary="moteus controllers over CAN-FD",
        timing="hw.can.declared:moteus_timing",
        network=True,
    ),
    "cia402": BackendInfo(
        factory="hw.can.drive_backend:Cia402Backend",
        options="hw.can.options:Cia402Options",
        simulated=False,
        summary="CANopen drives (CiA 402) in cyclic synchronous torque",
        timing="hw.can.declared:cia402_timing",
        shown="hw.can.declared:cia402_shown",
        network=True,
    ),
}


@cache
def lookup(kind: str) -> BackendInfo:
    """The backend called `kind`. Raises BackendError naming the ones there are."""
    # our own before anybody's: a package cannot put itself in the place of a driver by its name
    if kind in BUILT_IN:
        return BUILT_IN[kind]
    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    if kind not in found:
        known = ", ".join(sorted({*BUILT_IN, *found}))
        raise BackendError(
            f"no backend {kind!r}; there are: {known}; a third party's comes with its package: install that "
            f"into {sys.prefix}"
        )
    try:
        info = found[kind].load()
    except (ImportError, AttributeError, SyntaxError) as error:
        dist = found[kind].dist
        package = "a package" if dist is None else dist.name
        raise BackendError(
            f"backend {kind!r} of {package} cannot be loaded: {error}; install {package} again, into "
            f"{sys.prefix}"
        ) from error
    except Exception as error:  # of a third party's package anything: no other device goes without its stop
        raise BackendError(f"backend {kind!r} cannot be loaded: {_mistake(error)}") from error
    if not isinstance(info, BackendInfo):
        raise BackendError(f"entry point {kind!r} of {GROUP} is not a hw.interface.BackendInfo")
    return info


def _resolve(target: str) -> Callable[..., Any]:
    module, _, attribute = target.partition(":")
    try:
        named: Callable[..., Any] = getattr(importlib.import_module(module), attribute)
    except ModuleNotFoundError as error:
        if sys.modules.get(module.partition(".")[0]) and f"{module}.".startswith(f"{error.name}."):
            raise BackendError(f"{target}: its package has no module {error.name}") from error
        missing = (error.name or "").partition(".")[0]
        wanted = DISTRIBUTIONS.get(missing, missing)
        raise BackendError(f"{target} needs the Python module {missing!r}: pip install {wanted!r}") from error
    except Exception as error:  # likewise
        raise BackendError(f"{target} cannot be loaded: {_mistake(error)}") from error
    return named


def _mistake(error: Exception) -> str:
    """A mistake in a package of somebody's, with the line: who has to mend it reads this."""
    at = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({at.filename}:{at.lineno})"


def options_model(kind: str) -> type[BaseModel]:
    """The pydantic model of the backend's options (host side only)."""
    target = lookup(kind).options
    model = _resolve(target)
    if not hasattr(model, "model_validate"):
        raise BackendError(f"{target} is no pydantic model")
    return cast("type[BaseModel]", model)


def channels(kind: str, options: Options, rig: Rig) -> Channels:
    """What such a device provides and consumes, without opening it. `options` are validated ones."""
    declared = lookup(kind).channels
    if declared is not None:
        return declared
    backend = create(kind, options, rig)
    return Channels(provides=backend.provides, consumes=backend.consumes)


def _sound(values: Iterable[float]) -> bool:
    return all(math.isfinite(value) and value >= 0 for value in values)


def timing(kind: str, options: Options, rig: Rig) -> Sequence[Timing] | None:
    """What such a device declares of its delay, one per axis of `rig`; None where it declares nothing.

    Raises BackendError for a declaration that is no such thing: the proof rests on it."""
    target = lookup(kind).timing
    if target is None:
        return None
    # a list: what a third party gives may be an iterator, which a check would use up
    found = list(_resolve(target)(options, rig))
    if len(found) != rig.n_axes or not all(isinstance(one, Timing) and _sound(astuple(one)) for one in found):
        raise BackendError(f"{target} must give {rig.n_axes} Timing of finite numbers >= 0, not {found}")
    return found


def joint(kind: str, options: Options, rig: Rig) -> Sequence[Joint]:
    """What such a device knows of its joints, one per axis of `rig`."""
    target = lookup(kind).joint
    return [Joint()] * rig.n_axes if target is None else list(_resolve(target)(options, rig))


def force_sensor(kind: str, options: Options, rig: Rig) -> ForceSensor | None:
    """What such a device declares of the way of a force; None where it does not know.

    Raises BackendError for a declaration that is no such thing: the proof rests on it."""
    target = lookup(kind).force
    found = None if target is None else _resolve(target)(options, rig)
    if found is None:
        return None
    if not isinstance(found, ForceSensor) or not _sound(astuple(found)):
        raise BackendError(f"{target} must give a ForceSensor of finite numbers >= 0, not {found}")
    return found


def shown(kind: str, options: Options, rig: Rig) -> Shown:
    """What the numbers of such a device can show. Raises BackendError for a declaration that is none."""
    target = lookup(kind).shown
    found = Shown() if target is None else _resolve(target)(options, rig)
    counts = {len(found.step_rad), len(found.current_step_a)} if isinstance(found, Shown) else {-1}
    if counts - {0, rig.n_axes} or not _sound((*found.step_rad, *found.current_step_a, *astuple(found)[3:])):
        raise BackendError(f"{target} must give a Shown of finite numbers >= 0, not {found}")
    return found


def examine(kind: str, options: Options) -> Sequence[Finding]:
    """What the backend's own look at this machine finds; nothing where it has none.

    Raises BackendError, which names the function, for one that fails or gives anything but `Finding`."""
    target = lookup(kind).doctor
    if target is None:
        return ()
    try:
        found = [Finding(*one) for one in _resolve(target)(options)]
    except (
        OSError,
        ArithmeticError,
        AttributeError,
        LookupError,
        RuntimeError,
        TypeError,
        ValueError,
    ) as error:
        raise BackendError(f"{target}: {type(error).__name__}: {error}") from error
    if wrong := [one for one in found if one.status not in STATUSES]:
        raise BackendError(f"{target}: status {wrong[0].status!r}; there are {', '.join(STATUSES)}")
    return found


def create(kind: str, options: Options, rig: Rig) -> Backend:
    """Make the backend `kind`. `options` are validated ones. Does not open the device.

    Raises BackendError for one that cannot be made, whatever its code raises."""
    target = lookup(kind).factory
    make = _resolve(target)
    try:
        backend: Backend = make(options, rig)
    except BackendError:
        raise
    except Exception as error:  # likewise
        raise BackendError(f"{target} cannot be made: {_mistake(error)}") from error
    return backend
