"""Seeded bugs of the force sensor's own filter: what is declared of it, and the loops that must know it."""

from __future__ import annotations

from seed import Seed

CHECK = "tests/unit/cli/test_check_force_sensor.py"
JUDGED = f"{CHECK}::test_the_loops_that_are_judged_have_the_force_sensors_own_filter"
PROOF = "tests/unit/control/test_admittance_proof.py"
FILTER = "tests/unit/hw/test_force_filter.py"
LAW = "tests/unit/control/test_disturbance_observer.py"
INSTANT = f"{LAW}::test_torque_and_velocity_are_those_of_the_instant_of_a_force_that_comes_late"
RESTING = "tests/unit/control/test_resting.py"
IN_GEARS = "tests/unit/control/test_observer_in_gears.py"
IN_TIME = "tests/unit/control/test_observer_of_a_late_force.py"

SEEDS = (
    Seed(
        "a joint of which nobody says how stiff it is counts as rigid for the observer",
        "rtctl/check/observer_tuning.py",
        "() if fixed else gears_of(table, joint)",
        "()",
        (
            f"{IN_GEARS}"
            "::test_a_late_rig_has_a_slower_observer_until_its_gear_is_known_and_a_named_bandwidth_is_refused",
        ),
    ),
    Seed(
        "the observer is tuned for a rigid joint whatever the joint is",
        "rtctl/check/observer_tuning.py",
        "loop if joint.stiffness_nm_rad > 0 else replace",
        "loop if False else replace",
        (f"{CHECK}::test_the_default_observer_of_an_elastic_joint_passes_behind_a_late_sensor",),
    ),
    Seed(
        "the certificate does not know the force sensor's own low-pass",
        "rtctl/check/admittance_figures.py",
        "        **vars(drive),\n",
        "        **{**vars(drive), 'sensor_hz': 0.0},\n",
        (JUDGED,),
    ),
    Seed(
        "the observer's eigenvalues do not know the force sensor's own low-pass",
        "rtctl/check/verdicts_of_observer.py",
        "return replace(loop, bristle_nm_rad=",
        "return replace(loop, sensor_hz=0.0, bristle_nm_rad=",
        (JUDGED,),
    ),
    Seed(
        "a force that is late is rounded down to whole ticks",
        "rtctl/check/force_way.py",
        "math.ceil(late_s / loaded.config.period_s - _SLACK_TICKS)",
        "math.floor(late_s / loaded.config.period_s)",
        (f"{CHECK}::test_a_force_that_is_late_is_counted_in_whole_ticks_and_what_is_earlier_is_tried",),
    ),
    Seed(
        "a sensor of which nobody says anything counts as proved",
        "rtctl/check/verdicts_of_force.py",
        "Outcome.PASS if way.said_by else Outcome.NOT_PROVED",
        "Outcome.PASS",
        (f"{CHECK}::test_a_sensor_of_which_nobody_says_what_its_filter_is_is_not_proved",),
    ),
    Seed(
        "the proof forgets the sensor at the aliases",
        "rtctl/control/proofs/admittance_spectrum.py",
        "        shown = a * _sensor(loop, alias)\n",
        "        shown = a\n",
        (f"{PROOF}::test_the_characteristic_function_is_zero_just_at_the_eigenvalues",),
    ),
    Seed(
        "the proof forgets how late the force is",
        "rtctl/control/proofs/admittance_spectrum.py",
        "    for _ in range(loop.sensor_ticks):\n        sensor = sensor * last\n",
        "",
        (f"{PROOF}::test_the_characteristic_function_is_zero_just_at_the_eigenvalues",),
    ),
    Seed(
        "the intent settles behind any sensor",
        "rtctl/check/verdicts_of_friction.py",
        "        own[-2] += alpha * (1.0 - kept) * lead\n",
        "        own[-2] += alpha * lead\n",
        (f"{CHECK}::test_a_slow_sensor_narrows_the_intent_that_settles",),
    ),
    Seed(
        "the simulated sensor's low-pass is half a period early",
        "hw/simulators/mock_force_filter.py",
        "    ahead = (1.0 - kept) / -math.log(kept) if kept > 0.0 else 0.0\n",
        "    ahead = kept\n",
        (f"{FILTER}::test_the_low_pass_answers_a_ramp_as_one_in_continuous_time",),
    ),
    Seed(
        "an OptoForce's sample is never old",
        "hw/force/declared.py",
        '1.0 / float(options["output_hz"]) + wire_s',
        "wire_s",
        (f"{FILTER}::test_the_optoforce_declares_the_filter_it_is_set_to_and_how_old_a_sample_is",),
    ),
    Seed(
        "an admittance that hunts about a count is not refused",
        "rtctl/check/verdicts_of_admittance_steps.py",
        "    outcome = Outcome.PASS if speed <= bound else Outcome.FAIL\n",
        "    outcome = Outcome.PASS\n",
        (f"{CHECK}::test_a_count_that_only_bristles_hold_is_refused_where_a_flicker_is_answered",),
    ),
    Seed(
        "a rig is started without being asked how it hunts",
        "rtctl/check/verdicts.py",
        "TELL = (verdicts_of_force.sensor_of_an_observer, verdicts_of_admittance_steps.creeping)",
        "TELL = (verdicts_of_force.sensor_of_an_observer, verdicts_of_admittance_steps.hunting)",
        (f"{CHECK}::test_a_count_that_only_bristles_hold_is_refused_where_a_flicker_is_answered",),
    ),
    Seed(
        "an admittance is kicked where a flicker begins to be held",
        "rtctl/control/flicker.py",
        "                s.reading_slip_rad[axis] = s.reading_held_rad[axis] - before\n",
        "                s.reading_slip_rad[axis] = 0.0\n",
        ("tests/unit/control/test_flicker.py::test_neither_the_begin_nor_the_end_of_a_flicker_is_a_motion",),
    ),
    Seed(
        "help at rest follows the speed of bending bristles",
        "rtctl/control/resting.py",
        "    if stands(s, p, axis) and held > speed:\n",
        "    if is_bent(s, p, axis) and held > speed:\n",
        (f"{RESTING}::test_a_joint_that_rests_or_only_bends_is_read_at_its_largest_speed_of_late",),
    ),
    Seed(
        "the observer at rest follows the bristles",
        "rtctl/control/disturbance_observer.py",
        "    if not is_resting(s, p, axis):\n        s.observer_end[axis] =",
        "    if True:\n        s.observer_end[axis] =",
        (
            "tests/unit/control/test_observer_at_rest.py"
            "::test_a_joint_that_rests_is_sent_the_share_that_it_was_sent_when_it_moved",
        ),
    ),
    Seed(
        "the observer's velocity belongs to another instant than a late force",
        "rtctl/control/disturbance_observer.py",
        "(s.ticks - late) % HELD])",
        "s.ticks % HELD])",
        (INSTANT,),
    ),
    Seed(
        "the observer's velocity is a tick off a late force",
        "rtctl/control/disturbance_observer.py",
        "(s.ticks - late) % HELD])",
        "(s.ticks - late + 1) % HELD])",
        (INSTANT,),
    ),
    Seed(
        "the observer's velocity is delayed the wrong way",
        "rtctl/control/disturbance_observer.py",
        "(s.ticks - late) % HELD])",
        "(s.ticks + late) % HELD])",
        (INSTANT,),
    ),
    Seed(
        "the observer's torque belongs to another instant than a late force",
        "rtctl/control/disturbance_observer.py",
        "p.actuator_delay_ticks[axis], 0) + _late(p, axis)",
        "p.actuator_delay_ticks[axis], 0)",
        (INSTANT,),
    ),
    Seed(
        "the observer's torque is a tick off a late force",
        "rtctl/control/disturbance_observer.py",
        "p.actuator_delay_ticks[axis], 0) + _late(p, axis)",
        "p.actuator_delay_ticks[axis], 0) + max(_late(p, axis) - 1, 0)",
        (INSTANT,),
    ),
    Seed(
        "a velocity that is no number stays in the line",
        "rtctl/control/disturbance_observer.py",
        "        s.observer_moved_rad_s[axis, k] = 0.0\n",
        "        pass\n",
        (
            f"{LAW}"
            "::test_the_line_of_velocities_is_as_long_as_that_of_torques_and_holds_nothing_that_is_no_number",
        ),
    ),
    Seed(
        "a sample that took several ticks is one velocity in the line",
        "rtctl/control/disturbance_observer.py",
        "for k in range(min(elapsed, HELD)):",
        "for k in range(1):",
        (f"{LAW}::test_a_sample_that_took_two_ticks_is_the_velocity_of_both_for_a_late_force_too",),
    ),
    Seed(
        "the observer's eigenvalues take the newest velocity behind a late force",
        "rtctl/control/proofs/observer_loop.py",
        "quick * (moved[:, V] - w1)",
        "quick * (v - w1)",
        (f"{IN_TIME}::test_the_largest_eigenvalue_is_the_growth_in_time",),
    ),
    Seed(
        "the observer's eigenvalues take the newest torque behind a late force",
        "rtctl/control/proofs/observer_loop.py",
        "(1 + loop.acting_ticks + loop.own_ticks)",
        "(1 + loop.acting_ticks)",
        (f"{IN_TIME}::test_the_largest_eigenvalue_is_the_growth_in_time",),
    ),
    Seed(
        "the observer is tuned for the slowest sensor alone",
        "rtctl/control/proofs/observer_match.py",
        "for one in (loop, *less_late(loop)):",
        "for one in [loop]:",
        (f"{IN_TIME}::test_what_is_chosen_passes_with_every_quicker_sensor",),
    ),
    Seed(
        "the observer is tuned for a drive that is as late as it may be",
        "rtctl/control/proofs/less_late.py",
        "dict.fromkeys([*quicker_sensors(loop), *others])",
        "dict.fromkeys(quicker_sensors(loop))",
        (f"{IN_TIME}::test_what_is_chosen_passes_with_a_drive_that_is_less_late_than_declared",),
    ),
    Seed(
        "a gear is said to ring that keeps enough where another loop rang",
        "rtctl/control/proofs/observer_match.py",
        "hard.fails(free, KEPT_LEAST)",
        "hard.fails(free, 0.9)",
        ("tests/unit/control/test_observer_in_gears.py::test_where_another_loop_rang_is_only_asked_first",),
    ),
    Seed(
        "an observer is left out that keeps enough where the last one failed",
        "rtctl/control/proofs/observer_match.py",
        "np.array([*self._points]))) >= wanted",
        "np.array([*self._points]))) >= 0.9",
        (f"{IN_TIME}::test_no_loop_that_is_left_out_would_have_been_chosen",),
    ),
    Seed(
        "the observer is judged with the slowest sensor alone",
        "rtctl/check/observer_tuning.py",
        "(loop, *less_late(loop))",
        "(loop,)",
        (f"{CHECK}::test_an_observer_is_judged_with_quicker_sensors_too",),
    ),
    Seed(
        "the law is not told how late its force is",
        "rtctl/check/law_plan.py",
        '    p["observer_late_ticks"][a], p["observer_excess"][a] = tuning.own_ticks, tuning.excess\n',
        "",
        (f"{CHECK}::test_law_and_check_go_by_the_same_observer",),
    ),
)
