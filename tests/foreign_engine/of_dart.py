"""DART moves the joint: each mass is a tree of one skeleton, its Coulomb friction a bound of a linear
complementarity problem that is solved exactly, once a step."""

import math

import dartpy
import numpy as np

from foreign_engine.stepped import Stepped


class Moved(Stepped):
    """As `engines` says."""

    def __init__(self, *parts):
        super().__init__(*parts)
        self.world = dartpy.simulation.World("rig")
        self.world.setTimeStep(self.step_s)
        self.world.setGravity(np.zeros(3))
        self.skeleton = dartpy.dynamics.Skeleton("rig")
        for mass in self.masses:
            joint, body = self.skeleton.createRevoluteJointAndBodyNodePair(None)
            joint.setName(mass.name)
            joint.setAxis(np.array([0.0, 0.0, 1.0]))
            body.setInertia(dartpy.dynamics.Inertia(1e-3, np.zeros(3), mass.inertia * np.eye(3)))
            joint.setDampingCoefficient(0, mass.viscous)
            joint.setCoulombFriction(0, mass.dry)
            if math.isfinite(mass.end):
                joint.setPositionUpperLimit(0, mass.end)
                joint.setLimitEnforcement(True)
        self.world.addSkeleton(self.skeleton)

    def turn(self, torques):
        s = self.skeleton
        s.setForces(torques)
        self.world.step()
        return s.getPositions().tolist(), s.getVelocities().tolist()
