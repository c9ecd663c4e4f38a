"""Bullet moves the joint: dry friction is a motor of one velocity, 0, that has so much torque, solved by
impulses in turn with everything else."""

import math
import tempfile
import weakref
from pathlib import Path

import pybullet

from foreign_engine.stepped import Stepped

SOLVED = 50
"""Rounds of impulses a step."""


def _urdf(masses):
    links = "".join(
        f'<link name="{one.name}"><inertial><mass value="1"/><inertia ixx="{one.inertia}" ixy="0" ixz="0" '
        f'iyy="{one.inertia}" iyz="0" izz="{one.inertia}"/></inertial></link>'
        f'<joint name="{one.name}" type="{"revolute" if math.isfinite(one.end) else "continuous"}">'
        f'<parent link="base"/><child link="{one.name}"/><axis xyz="0 0 1"/>'
        f'<dynamics damping="{one.viscous}" friction="0"/>'
        + (f'<limit lower="-100" upper="{one.end}" effort="1e9" velocity="1e9"/>' * math.isfinite(one.end))
        + "</joint>"
        for one in masses
    )
    base = "<inertial><mass value='0'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>"
    return f'<robot name="rig"><link name="base">{base}</link>{links}</robot>'


class Moved(Stepped):
    """As `engines` says."""

    def __init__(self, *parts):
        super().__init__(*parts)
        self.client = {"physicsClientId": pybullet.connect(pybullet.DIRECT)}
        weakref.finalize(self, pybullet.disconnect, **self.client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=self.step_s, numSubSteps=1, numSolverIterations=SOLVED,
            solverResidualThreshold=0.0, **self.client,
        )  # fmt: skip
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "rig.urdf"
            path.write_text(_urdf(self.masses))
            self.body = pybullet.loadURDF(
                str(path), useFixedBase=True, flags=pybullet.URDF_USE_INERTIA_FROM_FILE, **self.client
            )
        self.joints = list(range(len(self.masses)))
        for i, one in enumerate(self.masses):
            pybullet.changeDynamics(
                self.body, i, linearDamping=0.0, angularDamping=0.0, maxJointVelocity=1e4,
                **self.client,
            )  # fmt: skip
            pybullet.setJointMotorControl2(
                self.body, i, pybullet.VELOCITY_CONTROL, targetVelocity=0.0, force=one.dry, **self.client
            )

    def turn(self, torques):
        pybullet.setJointMotorControlArray(
            self.body, self.joints, pybullet.TORQUE_CONTROL, forces=torques, **self.client
        )
        pybullet.stepSimulation(**self.client)
        states = pybullet.getJointStates(self.body, self.joints, **self.client)
        return [one[0] for one in states], [one[1] for one in states]
