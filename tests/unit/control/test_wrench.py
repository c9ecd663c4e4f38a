"""Six components at every pose, against rotation matrices and plain mechanics."""

import numpy as np
import pytest

from rtctl.control import wrench
from rtctl.control.jit import records
from rtctl.control.records import new_records
from rtctl.tick import new_ticks


def rotation(axis, angle):
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


class Arm:
    """A chain of hinges in the axes of its base; at position 0 of all joints the sensor's axes are the
    base's.
    """

    def __init__(self, axes, points, sensor):
        self.axes, self.points, self.sensor = np.array(axes), np.array(points), np.array(sensor, float)

    def at(self, angles):
        """Axes and a point of each hinge, orientation and origin of the sensor, in the base's axes."""
        turn, shift = np.eye(3), np.zeros(3)
        axes, points = [], []
        for axis, point, angle in zip(self.axes, self.points, angles, strict=True):
            axes.append(turn @ axis)
            points.append(turn @ point + shift)
            shift = points[-1] - (turn @ rotation(axis, angle)) @ point
            turn = turn @ rotation(axis, angle)
        return axes, points, turn, turn @ self.sensor + shift

    def torques(self, angles, force, moment):
        """Torque on each joint of a force and a moment at the sensor's origin, in the sensor's axes."""
        axes, points, turn, origin = self.at(angles)
        return [
            float(u @ (np.cross(origin - c, turn @ force) + turn @ moment))
            for u, c in zip(axes, points, strict=True)
        ]


def law(arm, chain, tip_kg=0.0, center=(0, 0, 0), gravity=(0, 0, 0), moments=1):
    """(tick, state, params) of a law whose rig file describes this arm."""
    n = len(arm.axes)
    params, state, _, _ = new_records(n)
    params["axis_direction"][0] = arm.axes
    params["lever_m"][0] = np.cross(arm.axes, arm.sensor - arm.points)
    params["chain_count"], params["moment_used"] = len(chain), moments
    params["chain_axis"][0, : len(chain)] = chain
    params["tip_weight_n"][0, :3] = tip_kg * np.array(gravity, float)
    params["tip_center_m"] = center
    return records(new_ticks(1, n)), records(state), records(params)


def take(tick, state, params, angles, force, moment):
    state["position_rad"][0], tick["force_n"][0], tick["moment_nm"][0] = angles, force, moment
    wrench.take_wrench(tick[0], state[0], params[0])
    return state["force_raw_nm"][0].copy()


SHOULDER_ELBOW = Arm([[0, 0, 1], [0, 0, 1]], [[0, 0, 0], [0.3, 0, 0]], [0.5, 0.02, 0.01])
ANY = Arm(
    [[0, 0, 1], [0, 1, 0], [0.6, 0.0, 0.8]], [[0, 0.1, 0], [0, 0, 0.3], [0.1, 0.05, 0.4]], [0.2, 0.1, 0.5]
)
RNG = np.random.default_rng(15)


@pytest.mark.parametrize("arm", [SHOULDER_ELBOW, ANY], ids=["two", "three"])
def test_r_x_f_plus_m_at_every_pose(arm):
    n = len(arm.axes)
    rig = law(arm, range(n))
    for _ in range(50):
        angles, force, moment = RNG.uniform(-3, 3, n), RNG.normal(size=3), RNG.normal(size=3)
        assert take(*rig, angles, force, moment) == pytest.approx(
            arm.torques(angles, force, moment), abs=1e-12
        )


def test_the_order_is_the_chains_and_not_the_rig_files():
    arm = Arm(SHOULDER_ELBOW.axes[::-1], SHOULDER_ELBOW.points[::-1], SHOULDER_ELBOW.sensor)
    force, moment = np.array([1.0, -2.0, 0.5]), np.array([0.1, 0.2, -0.3])
    found = take(*law(arm, [1, 0]), [0.7, -0.4], force, moment)
    assert found == pytest.approx(SHOULDER_ELBOW.torques([-0.4, 0.7], force, moment)[::-1], abs=1e-12)


def test_without_a_chain_levers_are_the_same_at_every_pose():
    rig = law(ANY, [])
    force, moment = np.array([1.0, -2.0, 0.5]), np.array([0.1, 0.2, -0.3])
    there = take(*rig, [1.0, 2.0, -1.0], force, moment)
    assert there == pytest.approx(ANY.torques([0, 0, 0], force, moment), abs=1e-12)


def test_moments_that_are_not_used_may_be_anything():
    rig = law(ANY, [], moments=0)
    found = take(*rig, [0, 0, 0], [1.0, 0, 0], [np.nan] * 3)
    assert found == pytest.approx(ANY.torques([0, 0, 0], np.array([1.0, 0, 0]), np.zeros(3)), abs=1e-12)


def test_the_weight_of_the_tip_turns_with_the_joints_and_acts_at_its_centre():
    center, gravity, kg = np.array([0.01, -0.02, 0.05]), np.array([0.0, 3.0, -9.3]), 0.4
    tick, state, params = law(ANY, range(3), kg, center, gravity)
    for _ in range(20):
        angles = RNG.uniform(-3, 3, 3)
        take(tick, state, params, angles, np.zeros(3), np.zeros(3))
        down = ANY.at(angles)[2].T @ gravity * kg
        assert state["weight"][0] == pytest.approx([*down, *np.cross(center, down)], abs=1e-12)
    assert np.abs(state["weight"][0, 3:]).max() > 1e-3


def test_of_a_sensor_without_moments_the_weight_has_none():
    tick, state, params = law(ANY, range(3), 0.4, [0.1, 0, 0], [0, 0, -9.81], moments=0)
    take(tick, state, params, [0.5, 0.5, 0.5], np.zeros(3), np.zeros(3))
    assert not state["weight"][0, 3:].any()


@pytest.mark.parametrize("part", [0, 3], ids=["force", "moment"])
def test_what_lies_across_the_joints_is_what_turns_none_of_them(part):
    tick, state, params = law(SHOULDER_ELBOW, range(2))
    take(tick, state, params, [0.3, 0.8], np.zeros(3), np.zeros(3))
    turning = state["screw"][0, :, part : part + 3]
    for _ in range(20):
        state["tared"][0, part : part + 3] = RNG.normal(size=3)
        tared = state["tared"][0, part : part + 3]
        inside = np.linalg.lstsq(turning.T, tared, rcond=1e-6)[0] @ turning
        assert wrench.beside(state[0], part) == pytest.approx(np.linalg.norm(tared - inside), abs=1e-9)
    state["tared"][0, part : part + 3] = turning[1] * 7.0
    assert wrench.beside(state[0], part) == pytest.approx(0.0, abs=1e-9)


def test_levers_in_all_three_directions_leave_nothing_across():
    tick, state, params = law(ANY, [])
    take(tick, state, params, [0, 0, 0], np.zeros(3), np.zeros(3))
    state["tared"][0] = 5.0
    assert wrench.beside(state[0], 0) == 0.0
