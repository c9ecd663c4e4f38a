"""A motion that a late host lets run out of its travel is braked within the ends of the rig file.

At 2 rad/s, the default, none was: half a margin, 25 mrad, was left to be braked in, and it takes 60."""

import math
from dataclasses import replace

import numpy as np
import pytest
from identified import CONFIG, variant

from rtctl.control.vocabulary import ProgramFlag, State
from rtctl.experiments.simulated_identification import drive
from rtctl.identify.motion import Motion, Order
from rtctl.identify.session import arm
from rtctl.identify.settings import Settings, rig_of, without_feedforward
from rtctl.identify.travel_guard import SPARE_S, guards_rad, run_on_rad
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

ENDS = ("current_limit_a = 10.0", "position_min_rad = -1.5\nposition_max_rad = 1.5\ncurrent_limit_a = 10.0")
LITTLE = (("coulomb_nm = 0.25 ", "coulomb_nm = 0.03 "), ("breakaway_nm = 0.35 ", "breakaway_nm = 0.04 "))
LATE = ("ripple_order = 1.0\n", "ripple_order = 1.0\ntorque_delay_ticks = 8\n")
"""With it the joint left its travel by 2 mrad and was cut, as it did by 106 with a slope of 15 N m/s: where
the brake takes 60 mrad was reckoned as if its torque were there at once."""
QUICK = Settings(bias_s=0.5)
RIG = rig_of(load(CONFIG), QUICK)


@pytest.mark.parametrize("speed", [0.05, 0.5, 2.0])
@pytest.mark.parametrize("calmer", [1.0, 5.0])
def test_a_joint_runs_on_as_far_as_the_brake_lets_it(speed, calmer):
    rig = replace(RIG, calmer=calmer, late_s=0.0, torque_rate_nm_s=math.inf)
    dt, way, v = 1e-5, 0.0, speed
    while v > 1e-3 * speed:
        v -= dt * min(rig.damping_nms_rad * v, 0.2 * rig.torque_limit_nm) / rig.inertia_kgm2
        way += dt * v
    assert run_on_rad(rig, speed) == pytest.approx(way, rel=5e-3)


@pytest.mark.parametrize("speed", [0.2, 1.0, 2.0])
@pytest.mark.parametrize(("late_ticks", "rate_nm_s"), [(1, 1e6), (9, 400.0), (2, 15.0)])
def test_a_late_torque_and_a_gate_let_it_run_on_no_further(speed, late_ticks, rate_nm_s):
    rig = replace(RIG, late_s=late_ticks * 1e-3, torque_rate_nm_s=rate_nm_s)
    dt, way, v, torque, sent = 1e-5, 0.0, speed, 0.0, [0.0] * (100 * late_ticks)
    while v > 1e-3 * speed:
        wanted = min(rig.damping_nms_rad * v, 0.2 * rig.torque_limit_nm)
        torque += min(max(wanted - torque, -rate_nm_s * dt), rate_nm_s * dt)
        sent.append(torque)
        v -= dt * sent.pop(0) / rig.inertia_kgm2
        way += dt * v
    assert way < run_on_rad(rig, speed) < 1.4 * way


def test_what_is_declared_late_is_late(tmp_path):
    rig = rig_of(load(variant(tmp_path, LATE)), QUICK)
    assert rig.late_s == pytest.approx(9e-3), "eight ticks, and one until the place is seen"
    assert rig.torque_rate_nm_s == 400.0


def test_a_rig_knows_how_late_its_brake_acts(tmp_path):
    assert RIG.late_s == pytest.approx(1e-3), "a sample"
    drive = ("current_limit_a = 10.0", "current_limit_a = 10.0\ndrive = { current_loop_hz = 200.0 }")
    seldom = ("seed = 1 ", "timing = { sample_every_ticks = 3, transport_delay_ticks = 6.0 }\nseed = 1 ")
    late = rig_of(load(variant(tmp_path, drive, seldom)), QUICK)
    assert late.late_s == pytest.approx(9e-3 + 1 / (2 * np.pi * 200.0))


@pytest.mark.parametrize("way", [1, -1])
def test_the_guard_leaves_room_to_be_braked_and_none_is_met_in_time(way):
    rig, travel = replace(RIG, position_min_rad=-1.5, position_max_rad=1.5), (-1.45, 1.45)

    def outer(speed, weak=1.0):
        one = replace(rig, inertia_kgm2=weak * rig.inertia_kgm2)
        return way * guards_rad(one, travel, 0.0, 0.05, way * speed)[way > 0]

    assert outer(0.1) == pytest.approx(1.475), "half a margin beyond what is planned, as ever"
    assert outer(2.0) == pytest.approx(1.5 - run_on_rad(rig, 2.0))
    assert outer(2.0, weak=20.0) == pytest.approx(1.45 - 0.5 * SPARE_S * 2.0)
    assert -outer(-2.0) == pytest.approx(-1.475), "behind the joint nothing is braked"
    back = guards_rad(rig, travel, way * 1.48, 0.05, -way * 0.5)
    assert way * back[way > 0] == pytest.approx(1.4925), "a joint that is out there may come back"


@pytest.mark.compiled
@pytest.mark.parametrize("more", [(), (LATE,)], ids=["prompt", "late"])
def test_a_late_host_lets_no_joint_leave_its_travel(tmp_path, more):
    loaded = without_feedforward(load(variant(tmp_path, ENDS, *LITTLE, *more)))
    simulation, motion, seen = Simulation(loaded), Motion(rig_of(loaded, QUICK), QUICK), []

    def steps():
        yield from motion.see_any(Order(look_s=0.7))
        yield from arm(motion)
        motion.choose_travel()
        yield from motion.see(Order(motion.turn(-1.0).fields, 1.0))
        seen.append((yield from motion.see_any(Order(motion.turn(2.0).fields, 3.0))))

    drive(simulation, steps(), 0)
    last = seen[0][-1]
    assert last["state"] == State.ACTIVE, "beyond its end the rig would have been cut"
    assert ProgramFlag(int(last["program_flags"][0])) is ProgramFlag.TRAVEL
    assert 1.42 < np.max(seen[0]["position_rad"]) < 1.5
