"""Compiled code of the table: what depends on the kind in force asks here.

Numba compiles no tuple of functions of different kinds. So each function here is written out from the table
as the chain of comparisons that a person would write, `if kind == 1: return spring.proxy(...)`, and compiled
with the rest of the law. A number that is no kind's is as free space."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from hw.jit import compiled
from rtctl.control.environments.kind import DAMPING, Parameter
from rtctl.control.environments.table import OWN, PARAMETERS, Environment, using

if TYPE_CHECKING:
    from hw.record_fields import Record

DAMPED = tuple(int(kind) for kind in using(DAMPING))
SNAPPING = tuple(int(kind) for kind in Environment if kind.about.snaps)
PASSIVE = tuple(int(kind) for kind in Environment if not kind.about.active)

_FILES = {kind.word: kind.file for kind in Environment}

for _file in _FILES.values():  # what a function of a file calls there must be compiled before it is
    for _name, _function in inspect.getmembers(_file, inspect.isfunction):
        setattr(_file, _name, compiled(_function))


def _written(name: str, arguments: str, lines: list[str]) -> Callable[..., Any]:
    """Compile the function of these lines. To the cache of compiled code it is one of this file, whose key
    covers every kind's file by the imports (decision 0019)."""
    source = "\n    ".join([f"def {name}({arguments}):", *lines])
    scope: dict[str, Any] = {"__name__": __name__, "__spec__": __spec__, "math": math, **_FILES}
    exec(compile(source, __file__, "exec"), scope)  # of the table alone
    return compiled(scope[name])


def _chain(name: str, arguments: str, otherwise: str) -> Callable[..., Any]:
    """The function `name` of the file of the kind in force, `otherwise` where the file has none."""
    kinds = [kind for kind in Environment if hasattr(kind.file, name)]
    rows = [f"if kind == {kind}: return {kind.word}.{name}({arguments})" for kind in kinds]
    return _written(name, arguments, ["kind = s.world_kind[axis]", *rows, f"return {otherwise}"])


def _asked(parameter: Parameter) -> str:
    """What is commanded of a parameter."""
    value = f"c.environment_{parameter.name}[axis]"
    return f"(1 if {value} >= 0 else -1)" if parameter.sign else value  # a 0 is a sign, too


def _same(kind: Environment) -> str:
    own = [one for one in kind.about.parameters if one in OWN]
    return " and ".join(f"s.world_{one.name}[axis] == {_asked(one)}" for one in own)


solve_proxy = _chain("proxy", "s, axis, drive, stiffness, before, dt", "drive / stiffness")
"""Proxy position at which the coupling force w - A p equals the environment's force, rad
(`kind.KindFile`)."""

potential = _chain("energy", "s, axis, k, center, proxy", "0.0")
"""Potential energy of the environment with the proxy there, with this stiffness and centre, J, >= 0."""

stretch = _chain("stretch", "s, axis, center", "0.0")
"""Way from this centre to the joint that a spring in force is stretched by, rad; 0 where nothing touches."""

free_center = _chain("free_center", "s, axis, center", "s.world_center_rad[axis]")
"""Where the centre is at once, on its way to `center` through what nobody feels, rad."""

same_own = _written(
    "same_own",
    "s, c, axis",
    [
        "kind = s.world_kind[axis]",
        *(f"if kind == {kind}: return {_same(kind)}" for kind in Environment if _same(kind)),
        "return True",
    ],
)
"""True when the kind in force has the parameters of its own that are commanded."""

take_own = _written("take_own", "s, c, axis", [f"s.world_{one.name}[axis] = {_asked(one)}" for one in OWN])
"""Put all parameters that are a kind's own in force."""

set_own = _written(
    "set_own",
    "c, axis, which, value",
    [
        f"if which == {which}: c.environment_{one.name}[axis] = "
        f"{'1 if value > 0.0 else -1' if one.sign else 'value'}"
        for which, one in enumerate(OWN)
    ],
)
"""Command a value for the parameter `OWN[which]`; a sign is that of the value."""

_DISPLAY = tuple(f"c.{name}[axis]" for name in ("mass_kgm2", "mass_damping_nms_rad"))

finite_command = _written(
    "finite_command",
    "c, axis",
    [
        "return "
        # one test for all: a sum is finite only if each is
        f"math.isfinite({' + '.join((*_DISPLAY, *(_asked(one) for one in PARAMETERS if not one.sign)))})"
    ],
)
"""False when any number of the commanded environment or display is NaN or infinite."""


@compiled
def environment_energy(s: Record, axis: int, proxy: float) -> float:
    """Potential energy of the environment in force with the proxy at `proxy`, J, >= 0."""
    return potential(s, axis, s.world_stiffness_nm_rad[axis], s.world_center_rad[axis], proxy)
