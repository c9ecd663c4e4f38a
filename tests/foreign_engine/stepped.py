"""A joint whose engine is called from Python: motor, link and arm about one axis, each with its dry and
viscous friction, are the engine's; springs and dampers between them are torques that it is given.

Torques go by where the masses are as a step begins, and the engine moves them by the speeds that it ends
with: such a spring neither gains nor loses energy. A wall is the engine's end of travel.
"""

import ctypes
import math
import weakref
from typing import NamedTuple

import numpy as np

from foreign_engine.plants import LEVER_M
from foreign_engine.sound import DivergedError

_CALLED = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)


class Mass(NamedTuple):
    """kg m^2, N m s/rad, N m, and where it ends, rad (none: infinity)."""

    name: str
    inertia: float
    viscous: float
    dry: float
    end: float = math.inf


class Stepped:
    """As `engines` says; an engine has `turn(torques)`, which goes on by a step and gives (rad, rad/s)."""

    lever, squeeze, pointers = 1.0, 0.0, (0, 0)

    def __init__(self, j, h, w, device):
        if h.kind not in ("arm", "nobody") or w.kind not in ("", "wall"):
            raise ValueError(f"no hand {h.kind!r} or world {w.kind!r} of such an engine")
        end = w.at if w.kind else math.inf
        self.joint, self.hand, self.step_s, self.held, self.grips = j, h, device.step_s, 1.0, 0.0
        self.masses = [Mass("motor", j.motor, j.viscous, j.dry, math.inf if j.link > 0 else end)]
        if j.link > 0:
            self.masses.append(Mass("link", j.link, j.link_viscous, j.link_dry, end))
        arms = int(h.kind == "arm")
        self.at = len(self.masses) - 1, len(self.masses) if arms else 0, arms
        if arms:
            self.masses.append(Mass("arm", h.mass, 0.0, 0.0))
        n = len(self.masses)
        self.q, self.v, self.current, self.broke = [0.0] * n, [0.0] * n, 0.0, False
        self.rise = 1.0 if device.lag_s == 0 else -math.expm1(-device.step_s / device.lag_s)
        self.ctrl, self.qpos, self.qvel = np.zeros(2), np.zeros(n), np.zeros(n)
        self.sensed, self.given = np.zeros(3), np.zeros(1)
        me = weakref.ref(self)  # an engine goes with its last rig, not with a later collection
        self.step = _CALLED(lambda *_: me()._step())

    def _step(self):
        if not self.broke:
            self.broke = True  # what is raised here is only printed, as C called: `sound` raises
            self.advance()
            self.broke = False

    def advance(self):
        """Go on by a step."""
        q, v, j, h = self.q, self.v, self.joint, self.hand
        link, arm, arms = self.at
        wanted, pulled = self.ctrl.tolist()
        self.current += self.rise * (wanted - self.current)
        torques, felt = [0.0] * len(q), 0.0
        if link:
            gear = j.gear * (q[0] - q[1]) + j.gear_damping * (v[0] - v[1])
            torques[1] = gear
            torques[0] = -gear
        if arms:
            felt = self.held * (
                h.grip * (q[arm] - q[link] - self.grips) + h.grip_damping * (v[arm] - v[link])
            )
            torques[arm] = pulled - h.spring * q[arm] - h.damper * v[arm] - felt
            torques[link] += felt
        torques[0] += self.current
        self.q, self.v = self.turn(torques)
        self.qpos[:], self.qvel[:] = self.q, self.v
        self.sensed[1], self.given[0] = felt / LEVER_M, self.current

    def sound(self):
        if self.broke or not (np.isfinite(self.qpos).all() and np.isfinite(self.qvel).all()):
            why = "RAISED, as was printed" if self.broke else "NOT_FINITE"
            raise DivergedError(f"the engine's simulation is not to be trusted: {why}")

    def hold(self, share):
        held, (link, arm, _) = float(share > 0.5), self.at
        if held > self.held:  # where the handle is: it is not thrown
            self.grips = self.q[arm] - self.q[link]
        self.held = held
