"""A reference that an excitation program tracks: where it arrives, what it may ask for, and when it is let
go.
"""

import math

import pytest
from law_rig import LawRig, Plant, T
from program_rig import ask, coast, flags, kind

from rtctl.control.position import reference_at
from rtctl.control.vocabulary import Program, ProgramFlag, Shape

TRACK = {
    "stiffness_nm_rad": 10.0,
    "damping_nms_rad": 0.64,
    "alpha": 0.33,
    "integral_nm_rad_s": 0.0,
    "inertia_kgm2": 0.012,
    "friction_gain": 0.0,
    "error_rad": 1e-3,
    "shape": int(Shape.STEP),
    "amplitude_rad": 0.1,
    "rate": 0.0,
    "slip_rad": 0.5,
}


@pytest.fixture
def rig():
    return LawRig(velocity_limit_rad_s=5.0).arm()


def test_a_tracked_step_arrives_and_ends_when_its_time_is_over(rig):
    plant = Plant()
    coast(ask(rig, Program.TRACK, limit_ticks=1500, **TRACK), plant, 1500)
    assert kind(rig) is Program.TRACK
    assert plant.x == pytest.approx(0.1, abs=1e-4)
    coast(rig, plant, 1)
    assert kind(rig) is Program.BRAKE
    assert flags(rig) is ProgramFlag.DONE


@pytest.mark.parametrize("amplitude_rad", [0.2, -0.2])
@pytest.mark.parametrize(("shape", "rate"), [(Shape.SINE, 3.0), (Shape.TRIANGLE, 0.2)])
def test_a_tracked_reference_is_followed_either_way(rig, amplitude_rad, shape, rate):
    plant = Plant()
    moving = {**TRACK, "shape": int(shape), "rate": rate, "amplitude_rad": amplitude_rad}
    ask(rig, Program.TRACK, **moving)
    for k in range(3000):
        coast(rig, plant, 1)
        wanted = reference_at(int(shape), amplitude_rad, rate, k * T)[0]
        assert plant.x == pytest.approx(wanted, abs=0.02)
    assert kind(rig) is Program.TRACK


def test_the_integral_carries_a_load_up_to_its_share(rig):
    plant, load = Plant(), 0.3
    ask(rig, Program.TRACK, **{**TRACK, "integral_nm_rad_s": 40.0})
    for _ in range(4000):
        rig.tick(plant.advance(rig["torque_applied_nm"] - load))
    assert plant.x == pytest.approx(0.1, abs=2e-3)
    assert abs(rig.state["program_integral_nm"][0, 0]) <= 0.2 * 3.0


@pytest.mark.parametrize(
    "wrong",
    [
        {"shape": 3},
        {"amplitude_rad": 2.5},
        {"amplitude_rad": -2.5},
        {"amplitude_rad": math.nan},
        {"shape": int(Shape.SINE), "rate": 1.0, "amplitude_rad": 1.1},
        {"shape": int(Shape.SINE), "rate": 100.0},
        {"shape": int(Shape.SINE), "rate": 0.0},
        {"shape": int(Shape.TRIANGLE), "rate": -1.0},
        {"shape": int(Shape.TRIANGLE), "rate": 5.1},
        {"shape": int(Shape.TRIANGLE), "rate": 1.0, "amplitude_rad": 0.0},
        {"integral_nm_rad_s": math.inf},
        {"integral_nm_rad_s": -1.0},
        {"inertia_kgm2": math.nan},
        {"friction_gain": 1.01},
        {"error_rad": 0.0},
    ],
)
def test_a_reference_that_leaves_travel_or_speed_or_makes_no_sense_never_starts(rig, wrong):
    plant = Plant()
    coast(ask(rig, Program.TRACK, **{**TRACK, **wrong}), plant, 50)
    assert kind(rig) is Program.BRAKE
    assert flags(rig) is ProgramFlag.REFUSED
    assert plant.x == pytest.approx(0.0, abs=1e-3)


def test_a_joint_that_falls_behind_its_reference_is_let_go(rig):
    ask(rig, Program.TRACK, **{**TRACK, "shape": int(Shape.SINE), "rate": 3.0, "slip_rad": 0.05})
    for _ in range(600):
        rig.tick(0.0)  # the joint is stuck
    assert kind(rig) is Program.BRAKE
    assert ProgramFlag.SLIPPED in flags(rig)


def test_a_hand_ends_a_tracked_motion(rig):
    plant = Plant()
    coast(ask(rig, Program.TRACK, **TRACK), plant, 100)
    rig.force_n[1] = 5.0
    coast(rig, plant, 1)
    assert kind(rig) is Program.BRAKE
    assert ProgramFlag.HAND in flags(rig)
