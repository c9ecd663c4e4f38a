"""Tests of which `make test` asks some cases, or none: the others are volume (decision 0126).

Beside what a file of tests says of itself (`tests/amounts.py`): here stand questions that were asked of many
rigs, plants, logs or laws in `make test`, until that took too long. What stays is one of each kind.
`tests/conftest.py` marks by it. Of files that meet a clock the others are of `make test-system`: what takes
only idle time is not punctual.
"""

from __future__ import annotations

from pathlib import Path

import tiers

FEW: dict[str, dict[str, tuple[str, ...]]] = {
    "acceptance/test_followed_friction.py": {
        "test_the_compensated_share_returns_no_faster_than_it_may_and_never_above_what_was_judged": (
            "0.9-0.9",
        ),
    },
    "acceptance/test_ladder.py": {
        "test_the_halving_search_finds_the_same_winner_or_one_within_a_standard_error": (),
        "test_the_mean_prediction_error_is_about_the_mean_training_error": (),
    },
    "acceptance/test_log_identification.py": {
        "test_every_run_meets_the_figure": (),
    },
    "acceptance/test_real_recordings.py": {
        "test_friction_of_one_controllers_run_predicts_anothers": (),
        "test_the_slave_lever_has_the_makers_inertia_and_asymmetric_friction": (),
    },
    "attacks/test_recordings_of_strangers.py": {
        "test_one_flipped_bit_costs_at_most_the_chunk_it_is_in": ("True",),
    },
    "attacks/test_start_and_end_of_a_loop.py": {
        "test_a_host_that_is_killed_at_once_leaves_no_loop_and_no_lock": ("0.1",),
    },
    "attacks/test_strangers.py": {
        "test_an_attack_neither_delays_a_stop_nor_takes_memory_nor_keeps_others_out": (
            "frames at command",
            "unfinished at telemetry",
            "unfinished at viewer",
            "trickle at viewer",
            "connects at keys",
            "raw at command",
            "unknown at keys",
            "half at viewer",
            "lies at command",
            "identities at command",
            "epochs at targets",
        ),
    },
    "integration/test_can_run.py": {
        "test_a_request_to_end_while_a_device_is_being_opened_is_an_orderly_end": (),
        "test_a_rig_arms_is_active_shows_its_samples_and_ends_in_order": (
            "odrive-odrive-odrive",
            "cia402-cia402-cia402",
        ),
    },
    "integration/test_run.py": {
        "test_a_dead_loop_is_reported_as_such": ("9",),
        "test_a_signal_while_active_ramps_the_torque_down_and_exits_0": ("15",),
    },
    "integration/test_serial_rig.py": {
        "test_a_loop_that_is_gone_leaves_a_torque_free_motor_within_the_time_to_live": ("9",),
    },
    "integration/test_slow_end.py": {
        "test_a_process_that_lingers_after_an_orderly_end_is_no_failure": ("longer than the host waits",),
    },
    "integration/test_waiting_loop.py": {
        "test_a_refused_rig_opens_no_device_and_its_loop_is_gone_without_a_word": (
            "a key that there is not",
        ),
    },
    "unit/cli/test_check_force_sensor.py": {
        "test_an_observer_goes_by_a_sensor_that_is_late_and_passes": (
            "0.0-0.002",
            "150.0-0.003163003003003003",
            "30.0-0.0",
        ),
    },
    "unit/control/test_admittance_counts.py": {
        "test_the_loop_that_is_proved_is_the_law_while_it_does_not_see_the_joint": ("hand0",),
    },
    "unit/control/test_admittance_margin.py": {
        "test_the_largest_eigenvalue_is_the_growth_of_a_fine_integration": (
            "loop0",
            "loop3",
            "loop6",
            "loop9",
        ),
        "test_the_largest_eigenvalue_is_the_growth_of_the_law": (
            "changes0-hand0",
            "changes2-hand2",
            "changes5-hand5",
        ),
    },
    "unit/control/test_admittance_proof.py": {
        "test_a_cell_holds_the_values_of_all_its_hands_and_worlds": ("loop1",),
        "test_a_display_is_proved_and_random_hands_and_worlds_find_nothing_against_it": ("loop0",),
        "test_the_proof_ends_where_the_eigenvalues_do": ("1.1",),
    },
    "unit/control/test_admittance_sticking.py": {
        "test_the_largest_eigenvalue_of_a_joint_that_sticks_is_the_growth_of_the_law": (
            "hand0-0.3",
            "hand1-0.0",
            "hand1-2.0",
        ),
    },
    "unit/control/test_dry_friction.py": {
        "test_it_is_a_lower_bound_of_bristles_up_to_two_thirds_of_its_length": ("lugre",),
    },
    "unit/control/test_joints_of_other_sizes.py": {
        "test_what_is_found_is_in_proportion_to_the_joint": ("30.0",),
    },
    "unit/control/test_observer_margin.py": {
        "test_the_largest_eigenvalue_is_the_growth_of_the_law_in_time": (
            "loop0-hand0-5.0",
            "loop1-hand1-25.0",
            "loop2-hand2-15.0",
            "loop3-hand3-15.0",
        ),
    },
    "unit/control/test_observer_of_a_late_force.py": {
        "test_no_loop_that_is_left_out_would_have_been_chosen": (
            "3-0.0-gears0",
            "2-150.0-gears1",
            "0-60.0-gears2",
        ),
        "test_the_largest_eigenvalue_is_the_growth_in_time": (
            "loop0-2-0.0-0-stiff",
            "loop1-2-0.0-2-heavy",
            "loop2-0-0.0-2-stuck",
            "loop3-3-150.0-2-stiff",
            "loop3-3-150.0-2-stuck",
            "loop4-0-60.0-4-heavy",
        ),
        "test_what_is_chosen_passes_with_every_quicker_sensor": ("1-0.0", "2-0.0", "4-150.0", "0-60.0"),
    },
    "unit/control/test_sampled_loop.py": {
        "test_the_closed_form_equals_a_sum_over_thousands_of_aliases": (
            "0.0-5000",
            "0.37-50",
            "1.5-5000",
            "2.81-200",
            "3.0-1000",
        ),
    },
    "unit/control/test_take_back.py": {
        "test_no_motion_of_a_stiff_spring_behind_any_gate_takes_more_than_the_floor": (
            "0.2-0.05-0.0",
            "0.2-0.0-1.6",
            "2.0-0.05-3.0",
        ),
    },
    "unit/control/test_virtual_mass.py": {
        "test_with_a_spring_for_a_hand_it_rings_down_below_the_first_unstable_stiffness_and_up_above": (
            "0.95-0.009-0.05-149.6",
            "0.95-0.012-0.05-602.4",
            "1.05-0.006-0.02-13.77",
            "1.05-0.012-0.05-602.4",
        ),
    },
    "unit/friction/test_band_of_one_log.py": {
        "test_it_covers_90_to_99_percent_of_other_sessions": ("2.0",),
    },
    "unit/friction/test_bands.py": {
        "test_it_holds_on_the_next_of_days_with_heavy_tails_too": ("3",),
        "test_it_holds_on_the_next_session_of_friction_that_wears": ("3-0.02", "4-0.0", "8-0.01"),
    },
    "unit/friction/test_drift_beside.py": {
        "test_a_judge_of_another_make_finds_nothing_wrong": (
            "a tenth less-told",
            "dry a tenth more, viscous .6-told",
            "viscous .6-quiet",
        ),
        "test_a_sensor_whose_zero_swings_is_no_friction_at_any_time": (),
        "test_an_interval_holds_what_viscous_friction_puts_into_the_factor": ("-0.5",),
        "test_viscous_friction_of_a_joint_with_play_is_no_dry_friction_in_quick_use": (),
        "test_viscous_friction_that_changes_in_view_is_no_dry_friction": ("-0.5-1.1",),
    },
    "unit/friction/test_drift_change.py": {
        "test_a_factor_is_not_between_what_was_and_what_is": ("0.7",),
        "test_nothing_is_forgotten_where_nothing_has_changed_or_a_zero_swings": ("45.0-people1",),
    },
    "unit/friction/test_drift_here.py": {
        "test_a_tenth_is_told_at_a_place_that_was_seen_before": ("0.0-0.9",),
    },
    "unit/friction/test_drift_on_the_family.py": {
        "test_nothing_is_told_of_a_joint_that_is_as_it_was_learned": (
            "lugre",
            "elasto-plastic-soft",
            "maxwell-slip-stiff",
            "elasto-plastic-30hz",
        ),
    },
    "unit/friction/test_evidence_page.py": {
        "test_a_held_out_error_says_what_the_next_session_brings": (),
    },
    "unit/friction/test_failed_fits.py": {
        "test_a_non_finite_nusvr_inside_a_search_is_survived_and_counted": ("halving",),
        "test_a_rung_that_cannot_be_compiled_is_passed_over_and_says_why": ("yes",),
    },
    "unit/friction/test_folds.py": {
        "test_the_command_says_how_it_held_out": ("options0-time",),
    },
    "unit/friction/test_other_makes.py": {
        "test_a_carriage_of_another_make_is_right_or_its_cause_is_named": (
            "moves",
            "play",
            "a current that was filtered",
        ),
        "test_a_sound_log_of_another_make_gives_its_parameters_and_no_alarm": (
            "Bliman and Sorine, moves",
            "bristles of 30 mrad, many sines",
            "measured together at 50 Hz",
            "a small motor",
        ),
        "test_logs_of_two_loads_are_told_for_it": ("rig0-2.0-rad-Nm",),
    },
    "unit/friction/test_search.py": {
        "test_a_real_dask_cluster_finds_the_same": ("threads",),
        "test_no_curve_has_more_support_vectors_than_asked": ("nu-spline-halving",),
        "test_the_winner_of_every_rung_can_be_saved_read_and_run": (
            "coulomb",
            "lorentzian",
            "epsilon-rbf",
            "epsilon-spline",
            "nu-polynomial",
        ),
    },
    "unit/hw/test_mock_joint.py": {
        "test_the_usual_step_is_right_to_half_a_thousandth": (
            "None-50.0-0.1-lugre",
            "None-2000.0-0.1-gms",
            "None-2000.0-3.0-elasto_plastic",
            "elastic1-50.0-0.1-gms",
            "elastic1-2000.0-0.1-elasto_plastic",
            "elastic1-2000.0-3.0-lugre",
        ),
    },
    "unit/identify/test_bristles.py": {
        "test_it_is_break_away_over_bristle_stiffness_within_some_percent": (
            "50-3.0-elasto_plastic",
            "2000-1.0-lugre",
        ),
    },
    "unit/identify/test_cogging_joint.py": {
        "test_a_joint_that_cogs_as_much_as_it_rubs_is_identified": ("1.0-7",),
    },
    "unit/identify/test_difficult_joints.py": {
        "test_a_joint_that_is_hard_to_turn_evenly_is_identified_within_two_percent": ("ripple",),
    },
}
"""File -> test -> ids of the cases that `make test` asks; none: it asks the test of nobody."""


def names(path: Path) -> bool:
    """Whether the table leaves something of this file to volume."""
    return tiers.name_of(path) in FEW and not tiers.meets_a_clock(path)


def is_left(path: Path, test: str, case: str) -> bool:
    """Whether `make test` leaves this case of a test of this file to the others."""
    few = FEW.get(tiers.name_of(path), {}).get(test)
    return few is not None and case not in few


def unknown(path: Path, cases: dict[str, set[str]]) -> set[str]:
    """What the table names of a file with these cases of its tests, and is none of them."""
    few = FEW.get(tiers.name_of(path), {})
    return {f"{test}[{one}]" for test, kept in few.items() for one in {*kept} - cases.get(test, set())} | {
        test for test in few if test not in cases
    }
