"""Excitation programs: torque only in ACTIVE, behind guards, and never again without a new request."""

import itertools
import math

import numpy as np
import pytest
from law_rig import Plant, T
from program_rig import FIELDS, ask, coast, flags, kind

from rtctl.control.vocabulary import Policy, Program, ProgramFlag, State


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


OUT = 0.01  # end of the travel in what follows


def sent_out(rig):
    """A joint that goes outward over the end of its travel, with a program that has ended there."""
    ask(rig, Program.SERVO, velocity_rad_s=0.2, max_rad=OUT, alpha=0.05).run(1)
    while flags(rig) == ProgramFlag(0):
        rig.tick(rig.position + 2e-4)
    assert flags(rig) is ProgramFlag.TRAVEL
    for _ in range(5):  # it slides on
        rig.tick(rig.position + 2e-4)


@pytest.mark.parametrize("way", [-2e-4, 0.0])
def test_a_joint_beyond_its_travel_that_comes_back_or_rests_is_let_back(rig, way):
    """The filter still points outward as this is asked."""
    sent_out(rig)
    ask(rig, Program.SERVO, velocity_rad_s=-0.2, max_rad=OUT, alpha=0.05)
    for _ in range(3):
        rig.tick(rig.position + way)
        assert flags(rig) == ProgramFlag(0)


@pytest.mark.parametrize(("asked", "way"), [(-0.2, 2e-4), (0.0, 2e-4), (0.2, 0.0), (0.2, -2e-4)])
def test_a_joint_beyond_its_travel_is_neither_let_nor_sent_further_out(rig, asked, way):
    sent_out(rig)
    ask(rig, Program.SERVO, velocity_rad_s=asked, max_rad=OUT, alpha=0.05)
    rig.tick(rig.position + way)
    assert flags(rig) is ProgramFlag.TRAVEL


@pytest.mark.parametrize("step_rad", [2e-5, 2e-4, 2e-3])
def test_no_reading_gets_past_the_first_one_beyond_however_it_flickers(rig, step_rad):
    """With the filter outward, of an encoder of counts of .1 mrad and noise of three counts."""
    rng, count, out, place = np.random.default_rng(8), 1e-4, 200 * step_rad, 0.0
    ask(rig, Program.SERVO, velocity_rad_s=0.2, max_rad=out, alpha=0.05).run(1)
    readings = []
    while flags(rig) == ProgramFlag(0):
        place += step_rad
        rig.tick(round((place + 3 * count * rng.standard_normal()) / count) * count)
        if rig.state["program_velocity_rad_s"][0] > 0.0:
            readings.append(rig.position[0])
    first = next(reading for reading in readings if reading >= out)
    assert max(readings[:-1]) <= max(first, out)


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


@pytest.mark.parametrize("sure", [0.05, 0.02], ids=["rigid", "elastic"])
def test_a_brake_that_has_stopped_a_joint_is_one_that_no_hand_makes_ring(law_rig, sure):
    rig = law_rig(viscous_nms_rad=0.05, sure_viscous_nms_rad=sure, hold_damping_nms_rad=sure).arm()
    ask(rig, Program.SERVO, velocity_rad_s=0.1, max_rad=0.005, alpha=1.0)
    places = itertools.accumulate([0.1 * T] * 60 + [-0.1 * T] * 20 + [0.1 * T] * 20)
    torques = []
    for place in places:
        rig.tick(place)
        torques.append(float(rig["program_torque_nm"]))
    assert kind(rig) is Program.BRAKE
    assert flags(rig) is ProgramFlag.TRAVEL
    # as hard as ever while it goes out, and once it has turned back never more so
    assert torques[58] == pytest.approx(-FIELDS["damping_nms_rad"] * 0.1)
    assert torques[75] == pytest.approx(sure * 0.1)
    assert torques[95] == pytest.approx(-sure * 0.1)


@pytest.mark.parametrize("every", [1, 2, 3])
def test_the_filter_of_a_program_goes_by_time_and_not_by_samples(rig, every):
    """As the proof of the servo has it (docs/theory.md 9.1): once a sample it would be as slow as that."""
    ask(rig, Program.SERVO, velocity_rad_s=0.1, alpha=0.1, max_rad=2.0)
    for k in range(1, 13):
        rig.tick(0.1 * T * (k // every * every), fresh=k % every == 0)
    known = 0.1 * (1.0 - 0.9**12)
    assert rig.state["program_velocity_rad_s"][0] == pytest.approx(known)


def test_a_brake_after_a_servo_that_stands_still_brakes_what_still_moves(rig):
    """The servo's reference has come to rest before the joint has."""
    ask(rig, Program.SERVO, velocity_rad_s=0.0, alpha=1.0, max_rad=2.0)
    places = itertools.accumulate([0.1 * T] * 20)
    rig.tick(next(places))
    ask(rig, Program.BRAKE, alpha=1.0)
    for place in places:
        rig.tick(place)
        assert rig["program_torque_nm"] == pytest.approx(-FIELDS["damping_nms_rad"] * 0.1)
