"""MuJoCo moves the joint: `mj_step` is called by its address. Dry friction is a constraint of its solver."""

import ctypes
from pathlib import Path

import mujoco

from foreign_engine.plants import LEVER_M, YIELDS, xml
from foreign_engine.sound import refuse_diverged

_STEP = ctypes.CDLL(str(next(Path(mujoco.__file__).parent.glob("libmujoco*")))).mj_step
_STEP.argtypes, _STEP.restype = [ctypes.c_void_p] * 2, None


class Moved:
    """As `engines` says."""

    step, lever = _STEP, -1.0

    def __init__(self, j, h, w, device):
        self.hand, self.squeeze = h, 0.0
        self.m = mujoco.MjModel.from_xml_string(xml(j, h, w, device))
        self.d = mujoco.MjData(self.m)
        mujoco.mj_forward(self.m, self.d)
        if h.kind == "arm":  # f = -(k x + b v + a) / R: spring, damper and an inerter between palm and handle
            soft = (
                YIELDS
                * self.d.efc_R[self.d.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY][0]
                / LEVER_M**2
            )
            self.m.eq_solref[0] = -h.grip * soft * YIELDS, -h.grip_damping * soft
        names = [self.m.joint(i).name for i in range(self.m.njnt)]
        arms = [name for name in ("arm", "elbow", "wrist") if name in names]
        self.at = names.index("link") if j.link > 0 else 0, names.index(arms[0]) if arms else 0, len(arms)
        self.pointers = self.m._address, self.d._address
        d = self.d
        self.ctrl, self.qpos, self.qvel, self.sensed, self.given = (
            d.ctrl, d.qpos, d.qvel, d.sensordata, d.actuator_force
        )  # fmt: skip

    def sound(self):
        refuse_diverged(self.d, mujoco.mjtWarning)

    def hold(self, share):
        if self.hand.kind in ("arm", "muscles"):
            self.d.eq_active[0] = share > 0.5
        elif self.hand.kind == "fingers":
            self.squeeze = 4.0 * (share - 1) - (2.0 if share == 0 else 0.0)
