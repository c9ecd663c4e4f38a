"""Seeded bugs of the admittance display: mass, servo, worlds on the mass, account of the hand."""

from __future__ import annotations

from seed import Seed

MASS = "rtctl/control/virtual_mass.py"
STEP = "tests/unit/control/test_admittance_step.py"
LOOP = "tests/unit/control/test_admittance_closed_loop.py"
CHANGES = "tests/unit/control/test_display_changes.py"
EXPERIMENT = "tests/unit/experiments/test_admittance_experiment.py"
IN_HANDS = "tests/acceptance/test_admittance_in_hands.py"
DISPLAY = "rtctl/control/display.py"

MARGIN = "tests/unit/control/test_admittance_margin.py"
STICKING = "tests/unit/control/test_admittance_sticking.py"
COUNTS = "tests/unit/control/test_admittance_counts.py"
CHECKED = "tests/unit/cli/test_check_admittance.py"

HELP = "tests/unit/control/test_admittance_help.py"

SIZES = "tests/unit/control/test_joints_of_other_sizes.py"

GIVES = (
    "tests/acceptance/test_foreign_counts.py"
    "::test_a_joint_that_gives_way_by_a_count_under_a_leaning_mass_is_not_jolted"
)

SEEDS = (
    Seed(
        "an admittance is tried with samples as old as declared only",
        "rtctl/check/admittance_figures.py",
        "    ages = sorted({1, loop.sample_ticks})\n",
        "    ages = [loop.sample_ticks]\n",
        ("tests/unit/cli/test_check_admittance.py::test_the_certificate_is_asked_of_the_loop_that_the_file_describes",),
    ),
    Seed(
        "a renderer's end of the spring stays where the mass was armed", MASS,
        "if s.world_kind[axis] != _REMOTE:  # it begins", "if False:  # it begins",
        ("tests/unit/control/test_virtual_mass.py"
         "::test_a_renderer_finds_its_end_of_the_spring_at_the_mass_wherever_that_went_in_another_world",),
    ),
    Seed(
        "a damper of rest begins at rest under a mass that goes on", MASS,
        " and (blind or s.mass_velocity_rad_s[axis] * s.mass_bristle_share[axis] > 0.0)", " and blind",
        (GIVES, f"{STICKING}::test_the_damping_acts_while_the_joint_sticks_and_begins_anew_each_time"),
    ),
    Seed(
        "a knob is certified in the springs of a joint", "rtctl/control/proofs/admittance_loop.py",
        "    smaller = min(loop.size, 1.0)\n", "    smaller = 1.0\n",
        (f"{SIZES}::test_a_small_joint_that_the_springs_of_a_usual_one_certified_shakes_and_is_refused",),
    ),
    Seed(
        "help with friction is judged as if it turned at once", "rtctl/control/proofs/admittance_help.py",
        "spring_and_loss(amplitude_rad / loop.help_turns_rad)", "spring_and_loss(1e9)",
        (f"{HELP}::test_help_that_turns_with_the_mass_before_the_joint_keeps_a_hand_swinging",),
    ),
    Seed(
        "help that keeps a hand swinging is not refused", "rtctl/check/verdicts_of_admittance.py",
        "    helped, passes = one.helped, one.helped.ok\n", "    helped, passes = one.helped, True\n",
        (f"{IN_HANDS}::test_help_that_keeps_a_hand_swinging_is_refused_with_a_share_that_does_not",),
    ),
    Seed(
        "a virtual mass rings on a joint that sticks", MASS,
        "    return float(damping)\n", "    return 0.0\n",
        (
            f"{STICKING}::test_it_swings_as_fast_as_is_foreseen_and_not_with_the_damping",
            f"{STICKING}::test_the_damping_acts_while_the_joint_sticks_and_begins_anew_each_time",
        ),
    ),
    Seed(
        "what is not seen is braked to rest", MASS,
        "        s.mass_calm_rad_s[axis] = s.mass_velocity_rad_s[axis]\n", "        pass\n",
        (
            f"{COUNTS}"
            "::test_a_mass_that_a_leaning_hand_moves_on_is_not_jolted_where_the_joint_is_no_longer_seen",
        ),
    ),
    Seed(
        "a joint that creeps is taken to be held", "rtctl/control/proofs/admittance_counts.py",
        "max(hunting(loop, held=False), _crept(loop), key", "max((hunting(loop, held=True),), key",
        ("tests/unit/cli/test_check_force_sensor.py"
         "::test_a_count_that_only_bristles_hold_is_refused_where_a_flicker_is_answered",),
    ),
    Seed(
        "the edges that a creeping joint crosses are left out", "rtctl/control/proofs/admittance_counts.py",
        "_CREPT_COUNTS = 1.5 / math.pi", "_CREPT_COUNTS = 0.0",
        (f"{COUNTS}::test_a_reading_that_errs_by_a_sawtooth_moves_the_joint_as_fast_as_is_told",),
    ),
    Seed(
        "a joint that is not seen is answered at once", MASS,
        "quick = p.mass_blind_alpha[axis] if is_blind(s, p, axis) else p.mass_force_alpha[axis]\n",
        "quick = p.mass_force_alpha[axis]\n",
        (f"{COUNTS}::test_the_loop_that_is_proved_is_the_law_while_it_does_not_see_the_joint",),
    ),
    Seed(
        "a joint whose reading does not change is taken to be seen", "rtctl/control/flicker.py",
        " or still_s >= HELD_S\n", "\n",
        (f"{COUNTS}::test_the_law_is_blind_while_the_reading_is_held_or_does_not_change",),
    ),
    Seed(
        "the observer of an admittance integrates while its joint sticks",
        "rtctl/control/disturbance_observer.py",
        "        s.mass_helped_share[axis] -= p.rest_alpha[axis] * s.mass_helped_share[axis]\n",
        "        s.mass_helped_share[axis] = 1.0\n",
        (
            "tests/unit/control/test_observer_at_rest.py"
            "::test_where_a_virtual_mass_is_shown_it_goes_and_stays_away",
        ),
    ),
    Seed(
        "an observer behind a declared sensor is tried as declared and without it only",
        "rtctl/control/proofs/less_late.py",
        "for share in (0.0, 0.25, 0.5, 0.75, 1.0)", "for share in (0.0, 1.0)",
        ("tests/unit/cli/test_check_force_sensor.py"
         "::test_a_force_that_is_late_is_counted_in_whole_ticks_and_what_is_earlier_is_tried",),
    ),
    Seed(
        "a joint that shakes while it sticks is not refused", "rtctl/check/verdicts_of_admittance.py",
        "        if speed > still:\n", "        if False:\n",
        (f"{CHECKED}::test_a_joint_that_shakes_while_it_sticks_is_refused_with_the_damping_that_calms_it",),
    ),
    Seed(
        "what a swing on bristles loses is forgotten", "rtctl/control/proofs/admittance_sticking.py",
        "math.sin(phi) ** 2 / math.pi", "0.0",
        (f"{STICKING}::test_spring_and_loss_are_the_first_harmonic_of_a_spring_that_slides_at_its_end",),
    ),
    Seed(
        "help with friction at rest goes by the hand while a mass is shown", "rtctl/control/feedforward.py",
        "return s.mass_velocity_rad_s[axis] / p.friction_blend_rad_s[axis] * p.friction_intent_nm[axis]",
        "pass",
        (f"{EXPERIMENT}::test_help_with_friction_goes_by_the_mass_and_does_not_push_the_joint_into_a_wall",),
    ),
    Seed(
        "help with friction goes by the joint's motion while a mass is shown", "rtctl/control/feedforward.py",
        "    return velocity * p.period_s, velocity\n", "    return dx, v\n",
        (f"{EXPERIMENT}::test_help_with_friction_turns_with_the_mass_and_makes_it_no_lighter",),
    ),
    Seed(
        "a virtual mass is helped with all of the friction", "rtctl/control/law.py",
        "helped_share(s, p, axis) * unbraked", "unbraked",
        (f"{IN_HANDS}::test_a_mass_is_helped_with_the_share_that_its_rig_file_says",),
    ),
    Seed(
        "the virtual mass goes on outside ACTIVE", MASS,
        "if s.proxy_set_count[axis] == 0 or disabled or s.state != _ACTIVE or in_program(s, axis):",
        "if s.proxy_set_count[axis] == 0 or disabled:",
        (f"{STEP}::test_outside_active_the_mass_rests_where_the_joint_is",),
    ),
    Seed(
        "the dead band cuts the hand's torque off instead of leaving it out", MASS,
        "return s.mass_force_nm[axis] - towards(0.0, s.mass_force_nm[axis], band)",
        "return s.mass_force_nm[axis] if abs(s.mass_force_nm[axis]) > band else 0.0",
        (f"{STEP}::test_without_a_hand_it_drifts_at_what_the_bias_is_beyond_the_dead_band_over_the_damping",),
    ),
    Seed(
        "a change of environment carries the virtual mass along", "rtctl/control/environments/changes.py",
        "    if s.display_kind[axis] != _ADMITTANCE:\n", "    if True:\n",
        (f"{STEP}::test_a_stiffer_spring_is_paid_by_the_work_it_does_on_a_mass_that_stays_where_it_is",),
    ),
    Seed(
        "the account of the hand forgets the motion of the joint", MASS,
        "held = s.authority * s.stored_energy_j[axis] + 0.5 * p.inertia_kgm2[axis] * speed * speed",
        "held = s.authority * s.stored_energy_j[axis]",
        (f"{STEP}::test_the_account_holds_what_mass_joint_and_world_may_give_back_and_a_bank",),
    ),
    Seed(
        "damping that a deficit adds is gone with the deficit", MASS,
        "left = s.mass_injected_nms_rad[axis] * math.exp(-p.period_s / CALM_S)", "left = 0.0",
        (
            f"{STEP}::test_damping_rises_at_once_with_a_deficit_that_counts_and_falls_slowly",
            f"{LOOP}::test_a_hand_stiffer_than_promised_is_calmed_within_a_fifth_of_a_second_and_stays_so",
        ),
    ),
    Seed(
        "a force that is no number stays in the low-pass of the mass", MASS,
        "    s.mass_force_nm[axis] = s.servo_velocity_rad_s[axis] = s.mass_bristle_share[axis] = 0.0\n", "",
        (f"{STEP}::test_a_force_that_is_no_number_gives_none_and_nothing_of_it_stays",),
    ),
    Seed(
        "the account does not bound the torque of an admittance", "rtctl/control/law.py",
        "    if not in_program(s, axis):\n        left =",
        "    if not in_program(s, axis) and not is_admittance(s, axis):\n        left =",
        (f"{LOOP}"
         "::test_a_grip_four_times_as_stiff_as_it_bears_ends_in_a_fault_with_the_torque_bounded_by_what_is_left",),
    ),
    Seed(
        "the servo's place lags without bound", MASS,
        "    if p.servo_position_gain_nm_rad[axis] > 0.0:\n        place =",
        "    if False:\n        place =",
        (f"{STEP}::test_the_servo_never_runs_further_ahead_than_the_torque_limit",),
    ),
    Seed(
        "a mass of which only a share is felt gets no damping for it", MASS,
        "    added += (1.0 - felt_share(s, axis)) * p.servo_velocity_gain_nms_rad[axis]\n", "",
        (f"{CHANGES}::test_a_display_of_which_a_share_is_felt_bears_the_hands_that_the_whole_bears",),
    ),
    Seed(
        "a heavier mass at speed is for nothing", DISPLAY,
        "        if work <= s.renderer_store_j[axis]:\n            s.mass_kgm2[axis] = before + step",
        "        if True:\n            s.mass_kgm2[axis] = before + step",
        (f"{CHANGES}::test_a_heavier_mass_at_speed_is_paid_for_from_the_renderers_store",),
    ),
    Seed(
        "a display is exchanged while it is felt", DISPLAY,
        "s.display_faded[axis] = min(1.0, s.display_faded[axis] + 1.0 / max(p.stop_ticks, 1))",
        "s.display_faded[axis] = 1.0",
        (f"{CHANGES}"
         "::test_a_display_that_is_changed_at_rest_under_load_gives_the_hand_what_is_paid_and_no_more",),
    ),
    Seed(
        "the rise of the other display is not paid", DISPLAY,
        "        rise = affordable(s, p, axis, rise)\n", "",
        (f"{CHANGES}::test_a_display_that_nobody_pays_for_does_not_come_up",),
    ),
    Seed(
        "mass and damping jump to what is asked", DISPLAY,
        "    if resting:\n", "    if True:\n",
        (f"{CHANGES}"
         "::test_mass_and_damping_take_a_tenth_of_a_second_from_end_to_end_and_are_taken_at_once_at_rest",),
    ),
    Seed(
        "what is sent ahead forgets the force that is there already", MASS,
        "acceleration + drag - felt_nm", "acceleration + drag",
        ("tests/unit/control/test_admittance_margin.py"
         "::test_the_largest_eigenvalue_is_the_growth_of_the_law",),
    ),
)  # fmt: skip
