"""The procedure on the simulated rig: right points, limits kept, hands seen, errors named."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from identified import CONFIG, SMALL, Kept, run, true_friction_nm, variant

from rtctl.control.vocabulary import ProgramFlag, State
from rtctl.errors import ConfigError, DataError, FaultError, HandOnRigError
from rtctl.identify.motion import Motion
from rtctl.identify.places import gap_to
from rtctl.identify.session import _require_room
from rtctl.identify.settings import Rig, Settings, rig_of, without_feedforward
from rtctl.identify.windows import fastest_rad_s
from rtctl.rig_file.config import load
from rtctl.tick import new_ticks

HAND = '[[device.options.hand]]\nkind = "none"                       # nobody holds the rig\n'
GRIP = '[[device.options.hand]]\nkind = "rest"\nstiffness_nm_rad = 1.0\ndamping_nms_rad = 0.2\n'
LIMITED = (
    "current_limit_a = 10.0",
    "position_min_rad = -0.5\nposition_max_rad = 0.6\ncurrent_limit_a = 10.0",
)
SLOWER = replace(SMALL, speed_max_rad_s=1.0)


def errors_nm(points):
    return np.array([p.friction_torque_nm - true_friction_nm(p.velocity_rad_s, p.direction) for p in points])


@pytest.fixture(scope="module")
def kept():
    return run()


def test_every_point_is_there_with_its_count_and_spread(kept):
    assert len(kept.points) == 2 * (1 + 4 + 2)
    assert {point.count for point in kept.points} == {12}
    assert all(0 < point.std_nm < 0.02 for point in kept.points)
    assert all(len(measurements) == 12 for measurements in kept.measurements)
    assert kept.warm_ups == 1


def test_points_say_where_and_when_they_were_measured(kept):
    times = [point.time_s for point in kept.points]
    assert times == sorted(times)
    assert times[0] > 5.0 + 2.0, "bias and warm-up come first"
    for point, measurements in zip(kept.points, kept.measurements, strict=True):
        assert point.position_rad == pytest.approx(np.mean([m.position_rad for m in measurements]))
        assert (
            measurements[0].time_s < point.time_s + 1e-3 * kept.sessions[0].time_s < measurements[-1].time_s
        )


def test_points_are_the_true_friction_within_two_percent_of_coulomb(kept):
    assert np.sqrt(np.mean(errors_nm(kept.points) ** 2)) < 0.02 * 0.25


def test_points_are_at_the_planned_speeds_in_both_directions(kept):
    for point in kept.points:
        assert point.velocity_rad_s == pytest.approx(point.target_rad_s, rel=0.03)
        assert np.sign(point.friction_torque_nm) == point.direction


def test_the_bias_of_the_sensors_is_noted(kept):
    (bias,) = kept.sessions
    assert bias.current_a == pytest.approx(0.01, abs=3e-4)
    assert bias.force_n == pytest.approx((0.3, -0.2, 0.5), abs=0.02)
    assert bias.temperature_c == 25.0
    assert kept.points[0].temperature_c == 25.0


def test_the_rig_is_left_at_rest_and_disarmed(kept):
    assert kept.simulation.state["state"][0] == State.IDLE
    assert abs(kept.simulation.truth[-1]["velocity_rad_s"][0]) < 1e-6
    assert kept.simulation.tick["torque_applied_nm"][0, 0] == 0.0


def test_it_is_the_same_identification_every_time(kept):
    assert [p.friction_torque_nm for p in run().points] == [p.friction_torque_nm for p in kept.points]


def test_a_limited_travel_is_kept_and_the_runs_are_split(tmp_path):
    lowest, highest = [], []

    def watch(rows):
        lowest.append(rows["position_rad"].min())
        highest.append(rows["position_rad"].max())
        assert np.all(rows["faults"] == 0)

    settings = replace(SMALL, speed_max_rad_s=1.0, measurements=20, spots=10)
    kept = run(variant(tmp_path, LIMITED), settings, watch=watch)
    assert -0.5 < min(lowest) < -0.3
    assert 0.4 < max(highest) < 0.6
    fast = next(i for i, p in enumerate(kept.points) if p.target_rad_s == 1.0)
    starts = np.array([measurement.first_tick for measurement in kept.measurements[fast]])
    assert np.sum(np.diff(starts) > 500) >= 5, "20 windows at 1 rad/s do not fit into one run over 1.1 rad"
    assert np.sqrt(np.mean(errors_nm(kept.points) ** 2)) < 0.03 * 0.25


def test_a_travel_too_short_for_the_speed_is_refused_with_the_speed_that_fits(tmp_path):
    path = variant(tmp_path, LIMITED)
    with pytest.raises(DataError, match=r"too short for 2 rad/s; give --speed-max (\d\.\d+)") as error:
        run(path)
    fits = float(str(error.value).split("--speed-max ")[1].split()[0])
    run(path, replace(SMALL, speed_max_rad_s=fits, measurements=2, spots=1, test_levels=0))


def test_the_places_of_a_point_are_even_over_a_turn_so_that_what_varies_over_it_cancels():
    settings = replace(SMALL, spots=10, measurements=20, test_levels=0, train_levels=5, warm_up_s=0.5)
    for point, measurements in zip((kept := run(settings=settings)).points, kept.measurements, strict=True):
        first_harmonic = np.mean(np.exp(1j * np.array([one.position_rad for one in measurements])))
        assert abs(first_harmonic) < 0.1, point.name


def test_a_place_just_passed_is_not_gone_round_to():
    class Still:
        position_rad, rig = 1.0, SimpleNamespace(turn_rad=2 * np.pi)

    assert gap_to(Still, 1, 1.5, 0.2) == pytest.approx(0.5)
    assert gap_to(Still, -1, 0.5, 0.2) == pytest.approx(0.5)
    assert gap_to(Still, 1, 1.5 - 4 * np.pi, 0.2) == pytest.approx(0.5), "whole turns are the same place"
    assert gap_to(Still, 1, 0.9, 0.2) == 0.0
    assert gap_to(Still, 1, 0.7, 0.2) == pytest.approx(2 * np.pi - 0.3)


def test_a_joint_that_was_stopped_beyond_its_travel_is_asked_back_again():
    motion = Motion(rig_of(load(CONFIG), SMALL), SMALL)
    motion.low_rad, motion.high_rad = -0.35, 0.35
    rows = new_ticks(1, 1)
    rows["state"], rows["position_rad"] = State.ACTIVE, -0.376
    motion.last = rows[0]
    steps = motion.advance(0.5, 0.5)
    assert next(steps).fields["program_velocity_rad_s"] == 0.5
    rows["program_flags"] = ProgramFlag.TRAVEL
    again = steps.send(rows)
    assert again.fields["program_count"] == 2
    assert again.fields["program_velocity_rad_s"] == 0.5
    rows["program_flags"] = 0
    assert steps.send(rows).fields == {}


def test_the_time_that_a_late_host_left_a_joint_beyond_its_travel_is_no_time_to_follow():
    motion = Motion(rig_of(load(CONFIG), SMALL), SMALL)
    motion.low_rad, motion.high_rad = -0.35, 0.35
    rows = new_ticks(10_000, 1)
    rows["state"], rows["position_rad"] = State.ACTIVE, -0.376
    rows["program_flags"] = ProgramFlag.TRAVEL
    motion.last = rows[0]
    steps = motion.advance(0.5, 0.5)
    next(steps)
    assert steps.send(rows).fields["program_velocity_rad_s"] == 0.5
    rows["program_flags"] = 0
    with pytest.raises(DataError, match="does not follow"):
        steps.send(rows)


def test_points_that_are_there_are_not_measured_again(kept):
    had = [point.name for point in kept.points[:9]]
    again = run(store=Kept(had))
    assert [point.name for point in again.points] == [point.name for point in kept.points[9:]]
    assert run(store=Kept(point.name for point in kept.points)).sessions == []


def test_a_hand_pauses_the_motion_and_it_goes_on_when_the_hand_is_gone(tmp_path):
    path = variant(tmp_path, LIMITED, (HAND, GRIP + "grips_s = [[30.0, 34.0]]\n"))
    seen = []
    kept = run(
        path, SLOWER, watch=lambda rows: seen.append(rows[["tick", "torque_applied_nm", "state"]].copy())
    )
    assert kept.notices[:2] == ["hand on the rig: take it off", ""]
    rows = np.concatenate(seen)
    held = rows[(rows["tick"] > 31_000) & (rows["tick"] < 34_000)]
    assert np.abs(held["torque_applied_nm"]).max() < 0.5
    assert len(kept.points) == 14
    assert np.sqrt(np.mean(errors_nm(kept.points) ** 2)) < 0.03 * 0.25


def test_a_hand_that_stays_is_a_named_error(tmp_path):
    path = variant(tmp_path, LIMITED, (HAND, GRIP + "grips_s = [[30.0, 1e6]]\n"))
    with pytest.raises(HandOnRigError, match="Take the hand off"):
        run(path, SLOWER, store=(store := Kept()))
    assert len(store.points) < 14


def test_a_hand_that_only_drags_is_a_named_error_too(tmp_path):
    drag = GRIP.replace("stiffness_nm_rad = 1.0", "stiffness_nm_rad = 0.0") + "start_s = 20.0\n"
    drag += "grips_s = [[30.0, 1e6]]\n"
    with pytest.raises(HandOnRigError, match="pauses") as told:
        run(variant(tmp_path, LIMITED, (HAND, drag)), SLOWER)
    most, limit = map(float, re.search(r"up to (\S+) N m, limit (\S+)\)", str(told.value)).groups())
    assert most > limit, "it drags while the joint turns, and is quiet while it rests"


def test_a_hand_that_moves_before_arming_is_a_named_error(tmp_path):
    moving = '[[device.options.hand]]\nkind = "sine"\nstart_s = 0.0\n'
    with pytest.raises(HandOnRigError, match="with the motor off"):
        run(variant(tmp_path, (HAND, moving)))


def test_an_emergency_stop_ends_it_with_its_name(tmp_path):
    path = variant(tmp_path, ("seed = 1 ", "estop_from_s = 20.0\nestop_to_s = 21.0\nseed = 1 "))
    with pytest.raises(FaultError, match="ended by ESTOP"):
        run(path)


def test_a_joint_too_stiff_to_move_is_said(tmp_path):
    stuck = (
        "coulomb_nm = 0.25                   # F_c\nbreakaway_nm = 0.35                 # F_s",
        "coulomb_nm = 2.5\nbreakaway_nm = 3.5",
    )
    with pytest.raises(DataError, match="does not follow"):
        run(variant(tmp_path, stuck))


def test_feedforward_and_environment_are_off_whatever_the_rig_file_says():
    loaded = without_feedforward(load(CONFIG.parent / "mock-spring.toml"))
    (axis,) = loaded.config.axis
    assert (axis.friction.policy, axis.environment.kind) == ("off", "free")
    assert loaded.sha256 == load(CONFIG.parent / "mock-spring.toml").sha256


@pytest.mark.parametrize("wrong", [{"axis": 1}, {"speed_max_rad_s": 5.0}, {"speed_min_rad_s": 3.0}])
def test_settings_that_do_not_fit_the_rig_are_refused(wrong):
    with pytest.raises(ConfigError):
        rig_of(load(CONFIG), replace(SMALL, **wrong))


def test_the_servo_is_softer_on_a_coarse_encoder():
    rig = rig_of(load(CONFIG), SMALL)
    coarse = replace(rig, count_rad=80 * rig.count_rad)
    for now in (rig, coarse):
        assert now.damping_nms_rad * now.count_rad / now.filter_s <= 0.0101 * now.torque_limit_nm
    assert coarse.damping_nms_rad < 0.2 * rig.damping_nms_rad


def test_a_short_carriage_is_told_a_speed_that_fits_too():
    rig = Rig("stage", 0, 1e-3, 1e-8, 1.0, 10.0, 1.0, -0.001, 0.001, 0.2, radian=0.01, motion="linear")
    settings = Settings(speed_max_rad_s=0.02, speed_min_rad_s=1e-4, margin_rad=1e-5)
    motion = Motion(rig, settings)
    motion.last = {"position_rad": [0.0]}
    with pytest.raises(DataError, match="too short") as error:
        _require_room(motion)
    fits = float(str(error.value).split("--speed-max ")[1].split()[0])
    assert 0.9 * fastest_rad_s(motion) < fits < fastest_rad_s(motion)
