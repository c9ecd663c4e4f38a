"""Finds backends by name: the entry-point group `rtctl.backends`, ours and third parties' alike.

Drivers are imported only when used, so a missing one fails only when asked for, by name."""

from __future__ import annotations

import importlib
import math
import sys
import traceback
from collections.abc import Callable, Sequence
from dataclasses import astuple
from functools import cache
from importlib.metadata import entry_points
from numbers import Real
from typing import TYPE_CHECKING, Any, TypeVar, cast

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

T = TypeVar("T")

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
        "hw.simulators.mock_backend:MockBackend",
        "hw.simulators.mock_options:MockOptions",
        simulated=True,
        timing="hw.simulators.mock_declared:timing",
        joint="hw.simulators.mock_declared:joint",
        force="hw.simulators.mock_declared:force",
        shown="hw.simulators.mock_declared:shown",
    ),
    "playback": BackendInfo(
        "hw.playback.backend:PlaybackBackend",
        "hw.playback.options:PlaybackOptions",
        simulated=True,
        follows=False,
        timing="hw.playback.declared:timing",
        force="hw.playback.declared:force",
    ),
    "serial": BackendInfo(
        "hw.serial.frame_backend:SerialBackend",
        "hw.serial.options:SerialOptions",
        simulated=False,
        timing="hw.serial.declared:timing",
    ),
    "serial-described": BackendInfo(
        "hw.serial.described_backend:DescribedBackend",
        "hw.serial.described_options:DescribedOptions",
        simulated=False,
        timing="hw.serial.declared:described_timing",
        shown="hw.serial.declared:described_shown",
    ),
    "serial-lines": BackendInfo(
        "hw.serial.lines_backend:LinesBackend",
        "hw.serial.lines_options:LinesOptions",
        simulated=False,
        timing="hw.serial.declared:lines_timing",
    ),
    "rokubi": BackendInfo(
        "hw.force.serial_backend:make_rokubi",
        "hw.force.options:RokubiOptions",
        simulated=False,
        shown="hw.force.declared:rokubi_shown",
    ),
    "optoforce": BackendInfo(
        "hw.force.serial_backend:make_optoforce",
        "hw.force.options:OptoForceOptions",
        simulated=False,
        force="hw.force.declared:optoforce",
        shown="hw.force.declared:optoforce_shown",
    ),
    "rdt": BackendInfo(
        "hw.force.rdt_backend:RdtBackend",
        "hw.force.options:RdtOptions",
        simulated=False,
        shown="hw.force.declared:rdt_shown",
        network=True,
    ),
    "can": BackendInfo(
        "hw.can.board_backend:BoardBackend",
        "hw.can.board_options:BoardOptions",
        simulated=False,
        timing="hw.can.declared:board_timing",
        shown="hw.can.declared:board_shown",
        network=True,
    ),
    "odrive": BackendInfo(
        "hw.can.drive_backend:OdriveBackend",
        "hw.can.options:OdriveOptions",
        simulated=False,
        timing="hw.can.declared:odrive_timing",
        network=True,
    ),
    "moteus": BackendInfo(
        "hw.can.drive_backend:MoteusBackend",
        "hw.can.options:MoteusOptions",
        simulated=False,
        timing="hw.can.declared:moteus_timing",
        network=True,
    ),
    "cia402": BackendInfo(
        "hw.can.drive_backend:Cia402Backend",
        "hw.can.options:Cia402Options",
        simulated=False,
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


def _asked(target: str, ask: Callable[[Callable[..., Any]], T], what: str = "") -> T:
    """What asking a function of a device's package gives. Raises BackendError that names the function."""
    function = _resolve(target)
    try:
        return ask(function)
    except BackendError:
        raise
    except Exception as error:  # likewise
        raise BackendError(f"{target}{what}: {_mistake(error)}") from error


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


def timing(kind: str, options: Options, rig: Rig) -> Sequence[Timing] | None:
    """What such a device declares of its delay, one per axis of `rig`; None where it declares nothing. Raises
    BackendError for a declaration that is no such thing: the proof rests on it."""
    target = lookup(kind).timing
    return None if target is None else _rows(target, Timing, options, rig)


def joint(kind: str, options: Options, rig: Rig) -> Sequence[Joint]:
    """What such a device knows of its joints, one per axis of `rig`. Raises as `timing` does."""
    target = lookup(kind).joint
    return [Joint()] * rig.n_axes if target is None else _rows(target, Joint, options, rig)


def force_sensor(kind: str, options: Options, rig: Rig) -> ForceSensor | None:
    """What such a device declares of the way of a force; None where not known. Raises as `timing` does."""
    target = lookup(kind).force
    found = None if target is None else _asked(target, lambda ask: cast("object", ask(options, rig)))
    if found is not None and not _sound(found, ForceSensor):
        raise BackendError(f"{target} must give a ForceSensor of finite numbers >= 0, not {found}")
    return cast("ForceSensor | None", found)


def shown(kind: str, options: Options, rig: Rig) -> Shown:
    """What the numbers of such a device can show. Raises BackendError for a declaration that is none."""
    target = lookup(kind).shown
    found = Shown() if target is None else _asked(target, lambda ask: cast("object", ask(options, rig)))
    if not isinstance(found, Shown) or not _shown(found, rig.n_axes):
        raise BackendError(f"{target} must give a Shown of finite numbers >= 0, not {found}")
    return found


def _shown(found: Shown, n_axes: int) -> bool:
    rows = [value if isinstance(value, tuple) else (value,) * n_axes for value in astuple(found)]
    return all(len(row) in (0, n_axes) and all(map(_number, row)) for row in rows)


def _rows(target: str, sort: type[T], options: Options, rig: Rig) -> list[T]:
    # a list: what a third party gives may be an iterator, which a check would use up
    found = _asked(target, lambda ask: list(ask(options, rig)))
    if len(found) != rig.n_axes or not all(_sound(one, sort) for one in found):
        raise BackendError(f"{target} must give {rig.n_axes} {sort.__name__} {_RANGES[sort]}, not {found}")
    return found


_RANGES = {
    Timing: "of finite numbers >= 0",
    Joint: 'of finite numbers >= 0, shares of 1 at most, and an encoder on "motor" or "link"',
}


def _sound(row: object, sort: type) -> bool:
    """Whether a declaration is of its sort and within its ranges. NaN would pass every comparison that a
    proof makes with it: `min(1.0, nan)` is 1.0, a rigid joint."""
    if not isinstance(row, sort):
        return False
    if isinstance(row, Joint):
        shares = (row.motor_share, row.dry_share, row.link_inertia_share)
        if row.encoder not in ("motor", "link") or not all(_number(one) and one <= 1 for one in shares):
            return False
    return all(_number(value) for name, value in vars(row).items() if name != "encoder")


def _number(value: object) -> bool:
    return isinstance(value, Real) and math.isfinite(value) and float(value) >= 0


def examine(kind: str, options: Options) -> Sequence[Finding]:
    """What the backend's own look at this machine finds; nothing where it has none.

    Raises BackendError, which names the function, for one that fails or gives anything but `Finding`."""
    target = lookup(kind).doctor
    if target is None:
        return ()
    found = _asked(target, lambda ask: [Finding(*one) for one in ask(options)])
    if wrong := [one for one in found if one.status not in STATUSES]:
        raise BackendError(f"{target}: status {wrong[0].status!r}; there are {', '.join(STATUSES)}")
    return found


def create(kind: str, options: Options, rig: Rig) -> Backend:
    """Make the backend `kind`, of validated `options`. Does not open the device. Raises BackendError for one
    that cannot be made, whatever its code raises."""
    return _asked(lookup(kind).factory, lambda make: cast("Backend", make(options, rig)), " cannot be made")
