"""A run of MuJoCo's that diverged is refused by name; the engine itself is asked where it is installed."""

from enum import Enum
from types import SimpleNamespace

import numpy as np
import pytest
from foreign_engine.sound import DivergedError, refuse_diverged

Kinds = Enum("Kinds", {"CNSTRFULL": 0, "BADQACC": 1})


def data(*numbers, qpos=0.0, qvel=0.0):
    warned = [SimpleNamespace(number=number) for number in numbers]
    return SimpleNamespace(warning=warned, qpos=np.array([qpos]), qvel=np.array([0.1, qvel]), time=1.25)


def test_a_run_without_warnings_is_judged():
    refuse_diverged(data(0, 0), Kinds)


@pytest.mark.parametrize(
    ("diverged", "name"),
    [
        (data(0, 3), "BADQACC"),
        (data(1, 0), "CNSTRFULL"),
        (data(0, 0, qpos=np.nan), "NOT_FINITE"),
        (data(0, 0, qvel=np.inf), "NOT_FINITE"),
    ],
)
def test_a_run_that_diverged_is_refused_by_name(diverged, name):
    with pytest.raises(DivergedError, match=f"{name}, by 1.25 s"):
        refuse_diverged(diverged, Kinds)


def test_the_engine_tells_a_joint_that_flies_apart():
    mujoco = pytest.importorskip("mujoco")
    m = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body><joint armature="1e-5" stiffness="-1e9"/>'
        '<inertial pos="0 0 0" mass="1e-3" diaginertia="1e-6 1e-6 1e-6"/></body></worldbody></mujoco>'
    )
    d = mujoco.MjData(m)
    d.qpos[0] = 1e-3
    mujoco.mj_step(m, d, 20)
    with pytest.raises(DivergedError, match="mjWARN_BADQACC"):
        refuse_diverged(d, mujoco.mjtWarning)
