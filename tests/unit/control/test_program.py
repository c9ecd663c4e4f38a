"""Excitation programs: torque only in ACTIVE, behind guards, and never again without a new request."""

import itertools
import math

import pytest
from law_rig import Plant, T

from rtctl.control.position import reference_at
from rtctl.control.vocabulary import Policy, Program, ProgramFlag, Shape, State

FIELDS = {
    "velocity_rad_s": 0.0,
    "acceleration_rad_s2": 10.0,
    "stiffness_nm_rad": 40.0,
    "damping_nms_rad": 1.2,
    "alpha": 0.3,
    "torque_max_nm": 1.0,
    "ramp_nm_s": 0.5,
    "fast_nm": 0.0,
    "slip_rad": 0.01,
    "min_rad": -2.0,
    "max_rad": 2.0,
    "hand_nm": 0.05,
    "hand_zero_nm": 0.0,
}


def ask(rig, kind, limit_ticks=100_000, **values):
    """Request a program on every axis, with sound numbers where none are given."""
    rig.command["program_kind"] = int(kind)
    rig.command["program_limit_ticks"] = limit_ticks
    for name, value in {**FIELDS, **values}.items():
        rig.command[f"program_{name}"] = value
    rig.command["program_count"] += 1
    return rig


def coast(rig, plant, n):
    """Run the rig on a plant for n ticks."""
    for _ in range(n):
        rig.tick(plant.advance(rig["torque_applied_nm"]))
    return rig


def flags(rig):
    return ProgramFlag(int(rig["program_flags"]))


def kind(rig):
    return Program(int(rig["program_kind"]))


@pytest.fixture
def rig(law_rig):
    return law_rig(velocity_limit_rad_s=5.0).arm()


@pytest.fixture
def law_rig():
    from law_rig import LawRig

    return LawRig


def test_the_servo_reaches_its_speed_and_keeps_it(rig):
    plant = Plant()
    coast(ask(rig, Program.SERVO, velocity_rad_s=0.4), plant, 1500)
    assert plant.v == pytest.approx(0.4, abs=1e-3)
    assert rig["torque_applied_nm"] == pytest.approx(0.05 * 0.4, rel=0.05)
    assert rig["program_torque_nm"] == rig["torque_wanted_nm"]


def test_the_servo_overcomes_a_load_without_losing_speed(rig):
    plant, load = Plant(), 0.3
    ask(rig, Program.SERVO, velocity_rad_s=0.4)
    for _ in range(2000):
        rig.tick(plant.advance(rig["torque_applied_nm"] - load))
    assert plant.v == pytest.approx(0.4, abs=2e-3)


def test_a_joint_that_cannot_follow_does_not_wind_the_reference_up(rig):
    ask(rig, Program.SERVO, velocity_rad_s=1.0).run(3000)
    assert rig["torque_applied_nm"] == pytest.approx(1.0)
    ask(rig, Program.SERVO, velocity_rad_s=-1.0).run(200)
    assert rig["torque_applied_nm"] < 0


def test_the_ramp_rises_at_its_slope_and_ten_times_quicker_below_the_fast_torque(rig):
    ask(rig, Program.RAMP, ramp_nm_s=0.5, fast_nm=0.2).run(101)
    assert rig["torque_applied_nm"] == pytest.approx(0.2 + 0.5 * T * (101 - 40), abs=0.006)
    ask(rig, Program.RAMP, ramp_nm_s=-0.5).run(100)
    assert rig["torque_applied_nm"] == pytest.approx(-0.05, abs=1e-9)


def test_a_slip_ends_the_ramp_in_the_tick_it_is_seen(rig):
    ask(rig, Program.RAMP).run(50)
    assert rig["torque_applied_nm"] > 0
    for k in range(1, 12):
        rig.tick(k * 0.001)
        if flags(rig):
            break
    assert k == 10
    assert flags(rig) is ProgramFlag.SLIPPED
    assert kind(rig) is Program.BRAKE
    assert rig["torque_applied_nm"] <= 0


def test_a_ramp_that_moves_nothing_ends_at_its_largest_torque(rig):
    ask(rig, Program.RAMP, torque_max_nm=0.1).run(300)
    assert flags(rig) is ProgramFlag.LIMIT
    assert rig["torque_applied_nm"] == 0.0


def test_a_hand_ends_any_program_and_it_does_not_come_back_by_itself(rig):
    ask(rig, Program.SERVO, velocity_rad_s=0.5).run(20)
    rig.force_n[1] = 0.6
    rig.tick()
    assert flags(rig) is ProgramFlag.HAND
    rig.force_n[1] = 0.0
    rig.run(100)
    assert kind(rig) is Program.BRAKE
    assert rig["torque_applied_nm"] == 0.0


def test_the_hand_is_measured_from_the_given_zero(rig):
    rig.force_n[1] = 0.6
    ask(rig, Program.SERVO, hand_zero_nm=0.06).run(5)
    assert flags(rig) == ProgramFlag(0)


def test_the_end_of_travel_stops_the_way_out_and_leaves_the_way_back(rig):
    plant = Plant()
    coast(ask(rig, Program.SERVO, velocity_rad_s=1.0, max_rad=0.5), plant, 1500)
    assert flags(rig) is ProgramFlag.TRAVEL
    assert plant.x < 0.6
    coast(ask(rig, Program.SERVO, velocity_rad_s=-1.0, max_rad=0.5), plant, 500)
    assert flags(rig) == ProgramFlag(0)
    assert plant.x < 0.3


def test_a_program_ends_when_its_time_is_over(rig):
    ask(rig, Program.SERVO, velocity_rad_s=0.5, limit_ticks=30).run(31)
    assert flags(rig) is ProgramFlag.DONE
    assert kind(rig) is Program.BRAKE


def test_the_brake_takes_speed_away_within_its_share(rig):
    plant = Plant()
    coast(ask(rig, Program.SERVO, velocity_rad_s=2.0), plant, 800)
    ask(rig, Program.BRAKE, damping_nms_rad=50.0)
    most = 0.0
    for _ in range(400):
        rig.tick(plant.advance(rig["torque_applied_nm"]))
        most = max(most, abs(rig["torque_applied_nm"]))
    assert abs(plant.v) < 0.05
    assert most <= 0.2 * 3.0 + 1e-12


@pytest.mark.parametrize(
    "bad",
    [{name: math.nan} for name in FIELDS]
    + [
        {"velocity_rad_s": 5.1},
        {"torque_max_nm": 3.1},
        {"torque_max_nm": math.inf},
        {"min_rad": 1.0, "max_rad": 1.0},
        {"max_rad": 1e9},
        {"alpha": 0.0},
        {"hand_nm": math.inf},
    ],
)
def test_numbers_that_are_not_finite_or_beyond_the_limits_are_refused(rig, bad):
    ask(rig, Program.SERVO, **{"velocity_rad_s": 0.5, **bad}).run(5)
    assert flags(rig) is ProgramFlag.REFUSED
    assert kind(rig) is Program.BRAKE
    assert rig["torque_applied_nm"] == 0.0
    assert rig.mode is State.ACTIVE


def test_an_unknown_kind_is_refused(rig):
    ask(rig, 7).run(3)
    assert flags(rig) is ProgramFlag.REFUSED


def test_a_program_asked_for_before_arming_never_starts(law_rig):
    rig = law_rig()
    rig.run(5)
    ask(rig, Program.RAMP)
    rig.run(40)
    rig.arm().run(50)
    assert kind(rig) is Program.OFF
    assert rig["torque_applied_nm"] == 0.0


def test_a_stop_ends_a_program_and_an_old_epoch_cannot_start_one(rig):
    ask(rig, Program.RAMP).run(100)
    rig.request("stop_count")
    rig.run(60)
    assert rig.mode is State.IDLE
    assert kind(rig) is Program.OFF
    rig.arm()
    rig.run(20)
    assert kind(rig) is Program.OFF
    rig.command["epoch"] -= 1
    ask(rig, Program.RAMP).run(20)
    assert kind(rig) is Program.OFF


def test_torque_falls_monotonically_when_a_program_is_stopped(rig):
    ask(rig, Program.RAMP, ramp_nm_s=5.0).run(100)
    torques = [rig["torque_applied_nm"]]
    rig.request("stop_count")
    torques += [rig.tick()["torque_applied_nm"] for _ in range(51)]
    assert torques[0] > 0.4
    assert all(b <= a for a, b in itertools.pairwise(torques))
    assert torques[-1] == 0.0


def test_feedforward_and_environment_rest_while_a_program_runs(law_rig):
    rig = law_rig(friction_policy=int(Policy.SIGN), coupling_stiffness_nm_rad=50.0).friction()
    rig.environment("spring", environment_stiffness_nm_rad=20.0, environment_center_rad=0.1)
    rig.arm()
    assert rig["torque_applied_nm"] > 0
    ask(rig, Program.SERVO).run(3000)
    assert rig["coupling_torque_nm"] == 0.0
    assert rig["feedforward_torque_nm"] == 0.0
    assert rig["torque_applied_nm"] == pytest.approx(0.0, abs=1e-9)


def test_a_program_is_no_passivity_fault_though_it_puts_energy_in(rig):
    plant, load = Plant(), 0.3
    ask(rig, Program.SERVO, velocity_rad_s=1.0)
    for _ in range(1500):
        rig.tick(plant.advance(rig["torque_applied_nm"] - load))
    assert rig.mode is State.ACTIVE
    assert rig["energy_port_j"] == 0.0


def test_a_missed_sample_moves_the_reference_once(rig):
    plant = Plant()
    ask(rig, Program.SERVO, velocity_rad_s=0.3)
    for k in range(1500):
        rig.tick(plant.advance(rig["torque_applied_nm"]), fresh=k % 7 != 0)
    assert plant.v == pytest.approx(0.3, abs=0.01)


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
