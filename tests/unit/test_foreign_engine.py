"""Engines of other makers as judges: what they move is the joint that was meant, and a run that is not to be
trusted is refused by name. An engine itself is asked where it is installed."""

import math
import sys
from enum import Enum
from types import SimpleNamespace

import numpy as np
import pytest
from foreign_engine import engines, plants, rig
from foreign_engine.backend import Engine
from foreign_engine.options import EngineOptions
from foreign_engine.sound import DivergedError, refuse_diverged
from foreign_engine.stepped import Stepped
from foreign_files import CONFIGS

from rtctl.rig_file.config import load
from rtctl.tick import new_ticks

Kinds = Enum("Kinds", {"CNSTRFULL": 0, "BADQACC": 1})
ENGINES = {"mujoco": "mujoco", "dart": "dartpy", "bullet": "pybullet"}
NOBODY, STEP_S = plants.Hand("nobody"), 2.5e-4


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


class Free(Stepped):
    """An engine of masses without friction."""

    def turn(self, torques):
        v = [
            speed + self.step_s * torque / mass.inertia
            for speed, torque, mass in zip(self.v, torques, self.masses, strict=True)
        ]
        return [place + self.step_s * speed for place, speed in zip(self.q, v, strict=True)], v


def swinging():
    joint = plants.Joint(0.008, 0.0, 0.0, 0.004, 168.4)
    hand = plants.Hand("arm", 0.01, 10.0, 0.0, 100.0, 0.0)
    one = Free(joint, hand, plants.World(), plants.Device(step_s=STEP_S))
    one.q[2] = 0.1
    return one


def energy(one):
    (q, v), j, h = (one.q, one.v), one.joint, one.hand
    springs = j.gear * (q[0] - q[1]) ** 2 + h.grip * (q[2] - q[1]) ** 2 + h.spring * q[2] ** 2
    return 0.5 * (springs + sum(mass.inertia * speed**2 for mass, speed in zip(one.masses, v, strict=True)))


def test_what_lies_between_the_masses_neither_gains_nor_loses():
    one = swinging()
    began, later = energy(one), []
    for _ in range(8000):
        one.step(*one.pointers)
        later.append(energy(one))
    one.sound()
    assert abs(np.mean(later[-1000:]) / began - 1) < 0.03
    assert np.ptp(one.qpos) > 1e-3, "it moves"


def test_the_handle_feels_what_moves_it():
    one = swinging()
    one.advance()
    assert one.sensed[1] * one.lever * plants.LEVER_M == pytest.approx(100.0 * 0.1)
    one.hold(0.0)
    one.advance()
    assert one.sensed[1] == 0.0
    one.hold(1.0)
    one.advance()
    assert one.sensed[1] == 0.0, "it is gripped where it is"


def test_an_engine_that_raises_is_told(monkeypatch):
    printed = []
    monkeypatch.setattr(sys, "unraisablehook", lambda told: printed.append(told.exc_type))
    one = swinging()
    one.turn = lambda _torques: 1 / 0
    for _ in range(2):
        one.step(*one.pointers)
    with pytest.raises(DivergedError, match="RAISED"):
        one.sound()
    assert printed == [ZeroDivisionError], "it goes no further"


def test_an_engine_whose_joint_is_nowhere_is_told():
    one = swinging()
    one.q[0] = math.nan
    one.step(*one.pointers)
    with pytest.raises(DivergedError, match="NOT_FINITE"):
        one.sound()


@pytest.mark.parametrize("name", ENGINES)
def test_an_engines_joint_sticks_and_slides_as_it_was_given(name):
    pytest.importorskip(ENGINES[name])
    joint, device = plants.Joint(0.012, 0.05, 0.25), plants.Device(step_s=STEP_S, engine=name)
    one = engines.made(joint, NOBODY, plants.World(), device)
    for torque, seconds in ((0.24, 0.3), (0.35, 0.6)):
        one.ctrl[0] = torque
        for _ in range(round(seconds / STEP_S)):
            one.step(*one.pointers)
        one.sound()
        if torque < joint.dry:
            assert abs(one.qpos[0]) < 1e-4
    # J dv/dt = torque - dry - b v
    wanted = (0.35 - joint.dry) / joint.viscous * -math.expm1(-0.6 * joint.viscous / joint.motor)
    assert one.qvel[0] == pytest.approx(wanted, rel=0.01)


def test_a_step_that_does_not_divide_the_period_is_refused():
    """Three of .4 ms in a period of 1 ms: the joint was 1.2 times as fast as its law's clock."""
    loaded, device = load(CONFIGS / "mock.toml"), plants.Device(step_s=4e-4)
    with pytest.raises(ValueError, match=r"2\.5 steps"):
        rig.Rig(loaded, plants.Joint(), NOBODY, plants.World(), device)


def test_an_engine_is_a_backend():
    pytest.importorskip("dartpy")
    hardware = SimpleNamespace(
        n_axes=1, period_s=1e-3, encoder_counts_per_rev=[1e6], gear_ratio=[1.0], gear_efficiency=[1.0],
        torque_constant_nm_a=[0.5],
    )  # fmt: skip
    options = EngineOptions(
        engine="dart", joint={"motor": 0.012, "viscous": 0.05, "dry": 0.25}, step_s=STEP_S
    )
    one, tick = Engine(options.model_dump(), hardware), new_ticks(1, 1)
    one.open()
    tick["torque_applied_nm"], tick["enabled"] = 0.35, 1
    for _ in range(600):
        one.write(tick)
    one.read(tick)
    assert tick["current_a"][0, 0] == pytest.approx(0.7, abs=0.02)
    assert tick["position_rad"][0, 0] > 0.1
    assert tick["sample_count"][0] == 1
    one.close()


def test_every_row_of_the_engines_is_asked():
    assert set(ENGINES) == set(engines.ROWS)
