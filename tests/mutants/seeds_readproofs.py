"""Seeded bugs of a reading of proofs and of `rtctl check` by first principles: what a sweep steps over, what
a frame of several ticks is, what a remedy leaves out.
"""

from __future__ import annotations

from seed import Seed

COUNTS = "tests/unit/control/test_admittance_counts.py::test_"
PROOF = "rtctl/control/proofs/admittance_counts.py"
CLI = "tests/unit/cli/test_check"

SEEDS = (
    Seed(
        "a loop of two ticks is asked for the creep of one",
        PROOF,
        "np.exp(1j * turns * loop.sample_ticks * loop.period_s)",
        "np.exp(1j * turns * loop.period_s)",
        (f"{COUNTS}a_reading_that_errs_by_a_sawtooth_moves_the_joint_as_fast_as_is_told",),
    ),
    Seed(
        "a ring between two speeds of creep is stepped over",
        PROOF,
        "np.nan_to_num(own, posinf=quickest)",
        "np.nan_to_num(0 * own, nan=slowest)",
        (f"{COUNTS}a_ring_between_two_of_the_speeds_that_are_tried_is_found",),
    ),
    Seed(
        "a count is no more to an observer that takes the inertia too high",
        "rtctl/check/verdicts_of_observer.py",
        "(1 + s.axis.observer.excess) * s.table.inertia_kgm2",
        "s.table.inertia_kgm2",
        (f"{CLI}_friction.py::test_the_torque_of_a_count_is_what_the_law_sends",),
    ),
    Seed(
        "a recommended coupling forgets what compensation by place adds",
        "rtctl/check/stability_report.py",
        "max(0.0, advised[0] - spring) / more",
        "advised[0] / more",
        (f"{CLI}.py::test_the_recommended_pair_leaves_room_for_what_compensation_adds_to_it",),
    ),
    Seed(
        "a hand is as soft as the lever of a sensor of moments is short",
        "rtctl/check/verdicts_of_loop.py",
        "TIP_STIFFNESS_N_M * s.hand * HANDLE_M**2",
        "TIP_STIFFNESS_N_M * sum(x * x for x in s.table.lever_m)",
        (
            f"{CLI}_plausibility.py::test_a_handle_beyond_a_sensor_of_moments_is_as_stiff_a_hand_for_the_steps_"
            "of_the_encoder",
        ),
    ),
    Seed(
        "a moment has no steps where there is no lever",
        "rtctl/check/verdicts_of_admittance_steps.py",
        "max(step, s.moment_step_nm if any(s.table.axis_direction) else 0.0)",
        "max(step, 0.0)",
        (f"{CLI}_plausibility.py::test_a_step_of_a_moment_makes_a_torque_though_the_axis_has_no_lever",),
    ),
    Seed(
        "a delay is covered by a fiftieth less damping than it needs",
        "rtctl/control/proofs/delay_cover.py",
        "damping_needed_sampled_data(k_c, b_c, T, delta) <= b",
        "0.98 * damping_needed_sampled_data(k_c, b_c, T, delta) <= b",
        ("tests/unit/control/test_delay_cover.py::test_the_delay_covered_is_covered_at_every_frequency",),
    ),
    Seed(
        "a certificate ends at a tenth of the damper that a program may ask for",
        "rtctl/control/proofs/admittance_loop.py",
        "WORLD_DAMPING_NMS_RAD = 1e4",
        "WORLD_DAMPING_NMS_RAD = 1e3",
        (
            "tests/unit/control/test_admittance_proof.py::test_the_worlds_that_are_proved_are_all_that_a_program_"
            "may_ask_for",
        ),
    ),
    Seed(
        "a swing is told by the largest that was tried",
        "rtctl/control/proofs/admittance_sticking.py",
        "_HALVINGS = 5",
        "_HALVINGS = 0",
        (
            "tests/unit/control/test_admittance_sticking.py::test_a_swing_between_two_that_are_tried_is_told_as_"
            "fast_as_it_stands",
        ),
    ),
)
