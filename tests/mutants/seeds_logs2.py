"""Seeded bugs in what was left over of logs: copies, causes that were not the true ones, chance."""

from __future__ import annotations

from seed import Seed

CAUSES = "tests/unit/friction/test_true_causes.py"
CHANCE = "tests/unit/friction/test_judged_by_chance.py"
COPIES = "tests/unit/friction/test_copied_rows.py"

SEEDS = (
    Seed(
        "rows that are others again count as measured anew",
        "rtctl/friction/logs/copied_rows.py",
        "zip(edges[::2], edges[1::2], strict=True)",
        "[(0, len(fresh))]",
        (f"{COPIES}::test_a_log_that_stands_twice_or_has_a_part_pasted_is_as_sure_as_it_is_once",),
    ),
    Seed(
        "a torque that is commanded lap for lap is a copy wherever the joint went",
        "rtctl/friction/logs/copied_rows.py",
        "moved[length - 1 : -1] == moved[: len(key)]",
        "moved[length - 1 : -1] >= moved[: len(key)]",
        (f"{COPIES}::test_a_joint_at_rest_and_a_torque_that_is_commanded_lap_for_lap_are_no_copies",),
    ),
    Seed(
        "rows of points in two files count twice",
        "rtctl/friction/logs/other_programs.py",
        "[part.at(mine) for part, mine in zip(parts, fresh, strict=True)]",
        "list(parts)",
        (f"{COPIES}::test_rows_of_points_that_are_in_two_files_are_counted_once",),
    ),
    Seed(
        "a torque that is not proportional makes a fine position too coarse",
        "rtctl/friction/logs/log_checks.py",
        "_short_by(signals.noise_rad_s2, balance) < 0.5 * short:",
        "_short_by(signals.noise_rad_s2, balance) < -1.0:",
        (f"{CAUSES}::test_a_fine_position_is_not_called_coarse_where_the_torque_is_not_proportional",),
    ),
    Seed(
        "what coarse steps leave over is a hand",
        "rtctl/friction/logs/left_over.py",
        "** 2 > STEPS_SHARE * plain.rest**2",
        "** 2 > 1e9 * plain.rest**2",
        (f"{CAUSES}::test_what_the_steps_of_a_position_leave_over_is_told_as_theirs",),
    ),
    Seed(
        "a tenth of the points outside refuses a session of five",
        "rtctl/friction/learn/report_judge.py",
        "float(likely.min(initial=points))",
        "0.0",
        (CHANCE,),
    ),
    Seed(
        "a joint at rest has 1e-240 rad/s",
        "rtctl/friction/points.py",
        "np.where(speed > AT_REST * speed.max(initial=0.0), velocity_rad_s, 0.0)",
        "velocity_rad_s",
        (f"{CHANCE}::test_a_joint_that_comes_to_rest_has_points_at_rest",),
    ),
    Seed(
        "a torque that is a power of what acts is not told",
        "rtctl/friction/logs/power_of_torque.py",
        "abs(found.value) > LEAST",
        "abs(found.value) > 99 * LEAST",
        (f"{CAUSES}::test_a_torque_that_is_a_power_is_told_where_friction_peaks_and_the_torque_is_noisy",),
    ),
    Seed(
        "noise of a position is not in the interval of the inertia",
        "rtctl/friction/logs/log_checks.py",
        "noise_rad_s2=max(steps, noise)",
        "noise_rad_s2=steps",
        (f"{CAUSES}::test_noise_of_a_position_widens_the_interval_of_the_inertia_and_has_its_name",),
    ),
)
