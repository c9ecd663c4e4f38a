"""What stops a joint in a hand, and controllers of positions (0177)."""

from __future__ import annotations

from seed import Seed

BRAKE, RENDERER = "tests/unit/control/test_program.py::", "tests/unit/control/test_renderer_sequences.py::"
STOPPED = (f"{BRAKE}test_a_brake_that_has_stopped_a_joint_is_one_that_no_hand_makes_ring",)
FILTER = (f"{BRAKE}test_the_filter_of_a_program_goes_by_time_and_not_by_samples",)
AFTER = (f"{BRAKE}test_a_brake_after_a_servo_that_stands_still_brakes_what_still_moves",)
HOLD = (f"{RENDERER}test_a_deficit_before_hold_adds_nothing_to_its_damping",)
QUIET = ("tests/unit/identify/test_quiet_servo.py::test_a_controller_of_positions_is_slowed_likewise",)

SEEDS = (
    Seed(
        "a brake that has stopped a rigid joint goes on with the servo's damping",
        "rtctl/control/program.py",
        "    if not s.program_velocity_rad_s[axis] * s.program_speed_rad_s[axis] > 0.0:\n",
        "    if p.sure_viscous_nms_rad[axis] < p.viscous_nms_rad[axis] and not (\n"
        "        s.program_velocity_rad_s[axis] * s.program_speed_rad_s[axis] > 0.0\n"
        "    ):\n",
        STOPPED,
    ),
    Seed(
        "the filter of a program takes one step a sample",
        "rtctl/control/program.py",
        "            for _ in range(elapsed):\n",
        "            for _ in range(1):\n",
        FILTER,
    ),
    Seed(
        "a brake after a servo goes by the servo's reference",
        "rtctl/control/program.py",
        "    if before != _SERVO or s.program_kind[axis] != _SERVO:\n",
        "    if before != _SERVO or s.program_kind[axis] == _TRACK:\n",
        AFTER,
    ),
    Seed(
        "a deficit adds to the damping of HOLD",
        "rtctl/control/law.py",
        "min(max(-p.hold_damping_nms_rad[axis] * t.velocity",
        "min(max(-2 * p.hold_damping_nms_rad[axis] * t.velocity",
        HOLD,
    ),
    Seed(
        "HOLD tells of damping that it does not inject",
        "rtctl/control/law.py",
        "    t.injected_damping_nms_rad[axis] = 0.0\n    cap = ",
        "    cap = ",
        HOLD,
    ),
    Seed(
        "controllers of positions take every joint for a rigid one",
        "rtctl/experiments/position_gains.py",
        "_proportional(axis, slower, T)\n    g[",
        "_proportional(axis, 1.0, T)\n    g[",
        QUIET,
    ),
    Seed(
        "HOLD forgets that the current overshoots",
        "rtctl/check/axis_plan.py",
        "sure / _needed_of_own(period_s, between)",
        "sure",
        (
            "tests/unit/control/test_sure_damping.py::"
            "test_behind_a_current_that_overshoots_hold_takes_less_than_is_sure",
        ),
    ),
)
