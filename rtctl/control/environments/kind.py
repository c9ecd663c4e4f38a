"""What the file of a kind of environment holds: `ABOUT`, and those of the functions of `KindFile` that its
law needs.

A kind's file imports no compiler: `laws` compiles every function in it, and a client that reads the table
loads none. Angles in rad, torques in N m; p is the proxy, x the joint, c the centre, w and A of
docs/theory.md 3.1."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class Slider:
    """How a page offers a parameter: its label, the range a person tries out, where it begins; `log` for even
    ratios."""

    label: str
    low: float
    high: float
    value: float
    log: bool = False


@dataclass(frozen=True)
class Parameter:
    """A number of an environment, by the name that rig file, protocol, client, records and pages have for it.

    `low` and `high` are the bounds where it is read; one that may only be 1 or -1 is a `sign`, and
    its name ends with `side`. `tried` is the range that the campaign draws from."""

    name: str
    unit: str
    low: float
    high: float
    default: float
    tried: tuple[float, float]
    slider: Slider | None = None
    sign: bool = False


STIFFNESS = Parameter(
    "stiffness_nm_rad", "N m/rad", 0, 1e6, 0.0, (1.0, 1e4), Slider("stiffness", 1, 200, 20, log=True)
)
DAMPING = Parameter("damping_nms_rad", "N m s/rad", 0, 1e4, 0.0, (0.0, 0.2), Slider("damping", 0, 0.2, 0.02))
CENTER = Parameter("center_rad", "rad", -1e3, 1e3, 0.0, (-0.3, 0.3), Slider("place", -0.5, 0.5, 0))

# 1e6 N m/rad is a wall to any coupling, which is felt in its place (docs/theory.md 3.1). Whoever moves these
# ends moves those of the worlds that an admittance is certified in (`admittance_loop`), as a test asks.
SHARED = (STIFFNESS, DAMPING, CENTER)
"""Parameters with a way in between: changes of them are followed step by step, and paid (`changes`).

Any other is a kind's own, stands in its file, and is exchanged while stiffness and damping are zero."""


@dataclass(frozen=True)
class Kind:
    """What there is to know of a kind beside its law."""

    meaning: str
    """A sentence for the person who chooses it."""
    force: str
    """Formula of the force on the proxy, for docs/theory.md 3.1."""
    solution: str
    """How the proxy is found."""
    parameters: Mapping[Parameter, str]
    """What it uses, and what each means here."""
    linear: bool = False
    """The exact test of the coupling covers such a world behind a current loop's lag, too
    (docs/theory.md 2.7)."""
    snaps: bool = False
    """The function `stretch` of this kind bounds how far it is stretched, without a direction."""
    active: bool = False
    """A program moves the proxy (`targets`): of itself such an environment is not passive."""


class KindFile(Protocol):
    """The module of a kind. Each function may be left out, for what stands behind it.

    * `proxy(s, axis, drive, stiffness, before, dt)`: place of the proxy where w - A p, with `drive` w and
      `stiffness` A, equals the environment's force; `before` is the place before, `dt` the time since, s.
      Such a force f must satisfy f (p - before) >= V(p) - V(before), V the energy, or a hand is given energy
      by it. Else w/A: no force.
    * `energy(s, axis, k, center, proxy)`: potential energy V, J, >= 0, with this stiffness and centre. Else
      0.
    * `stretch(s, axis, center)`: way from the centre to the joint by which a spring in force is stretched,
      rad. Else 0.
    * `free_center(s, axis, center)`: how near to `center` the centre may come at once, because nothing is
      felt of it. Else the centre in force: nowhere.

    `s` is the law's state (`records`): numbers of the environment in force are `s.world_<parameter>[axis]`.
    """

    ABOUT: Kind
