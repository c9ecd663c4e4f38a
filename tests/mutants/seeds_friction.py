"""Seeded bugs of the help with friction: feed-forward, observer, rest, and the account that pays for them."""

from __future__ import annotations

from seed import Seed

UNIT = "tests/unit/control"
DRIFT = ("tests/unit/friction/test_drift.py",)
VELOCITY = (f"{UNIT}/test_device_velocity.py",)
CREDIT = (
    f"{UNIT}/test_dry_friction.py::test_bristles_first_bend_then_slide",
    f"{UNIT}/test_dry_friction.py"
    "::test_a_closed_motion_is_credited_four_times_what_its_amplitude_exceeds_the_bristles_by",
    f"{UNIT}/test_dry_friction.py"
    "::test_what_was_stored_is_withdrawn_at_the_friction_of_rest_however_fast_the_joint_is_by_then",
    f"{UNIT}/test_dry_friction.py::test_a_velocity_against_the_motion_does_not_choose_the_place_on_the_curve",
    f"{UNIT}/test_dry_friction.py::test_the_curve_is_lowered_as_much_as_its_minimum_was",
    f"{UNIT}/test_dry_friction.py::test_friction_seen_counts_in_sliding_its_own_direction_and_up_to_its_cap",
)
TWICE = (
    f"{UNIT}/test_dry_friction.py"
    "::test_viscous_friction_is_not_credited_as_dry_where_the_curves_slope_is_too_low",
)
SPRING = (
    f"{UNIT}/test_feedforward.py::test_a_vibration_within_the_presliding_length_gets_no_work_from_hybrid",
)
RESTING = (f"{UNIT}/test_resting.py",)
ASSISTANCE = (f"{UNIT}/test_assistance.py",)
FINDS = (
    f"{UNIT}/test_disturbance_observer.py"
    "::test_it_finds_a_constant_friction_without_the_viscous_damping_that_the_joint_keeps",
)
INERTIA = (
    f"{UNIT}/test_disturbance_observer.py::test_the_right_inertia_leaves_nothing_and_a_wrong_one_its_share",
)
OBSERVED_LATE = (f"{UNIT}/test_disturbance_observer.py::test_the_delay_of_the_motor_is_accounted_for",)
BIAS = (
    f"{UNIT}/test_disturbance_observer.py"
    "::test_a_bias_below_the_dead_band_makes_no_torque_at_rest_and_one_above_only_the_rest",
)
RANGE = (
    f"{UNIT}/test_disturbance_observer.py::test_it_fills_only_what_the_feed_forward_leaves",
    f"{UNIT}/test_disturbance_observer.py::test_with_the_feed_forward_it_keeps_under_the_cap",
    f"{UNIT}/test_disturbance_observer.py::test_beyond_the_trained_range_it_fades_out_where_there_is_one",
    f"{UNIT}/test_disturbance_observer.py::test_the_command_scales_it_and_the_policy_off_ends_it",
)
SAMPLES = (
    f"{UNIT}/test_disturbance_observer.py::test_a_missed_sample_holds_what_was_found_and_its_torque",
    f"{UNIT}/test_disturbance_observer.py::test_a_sample_that_took_two_ticks_counts_as_two",
    f"{UNIT}/test_disturbance_observer.py::test_a_torque_that_is_not_a_number_is_a_fault_and_is_forgotten",
)
SEEN = (f"{UNIT}/test_disturbance_observer.py::test_friction_is_remembered_in_sliding_only",)
INTENT = (f"{UNIT}/test_feedforward.py::test_the_intent_is_low_passed_and_forgets_what_is_not_a_number",)
LUGRE = (
    f"{UNIT}/test_feedforward.py"
    "::test_the_bristles_of_lugre_turn_exponentially_over_their_length_whatever_the_steps",
)
GUARANTEE = ("tests/unit/friction/test_guarantee.py",)

SEEDS = (
    Seed(
        "sessions know what they share as if their mean were known", "rtctl/friction/learn/certainty.py",
        "max(n_blocks - 1, FREEDOM_MIN)", "n_blocks", ("tests/unit/friction/test_bands.py",),
    ),
    Seed(
        "a zero that sessions differ by is nothing that they share", "rtctl/friction/learn/certainty.py",
        "np.unique([blocks, directions], axis=1", "np.unique([blocks, blocks], axis=1",
        ("tests/unit/friction/test_bands.py",),
    ),
    Seed(
        "the feed-forward gives what the device's velocity alone allows", "rtctl/control/feedforward.py",
        "    if speed != encoder:\n", "    if v != v:\n", VELOCITY,
    ),
    Seed(
        "a model of NaN at the encoder's velocity is no fault", "rtctl/control/feedforward.py",
        "if not allowed >= magnitude:", "if allowed < magnitude:", VELOCITY,
    ),
    Seed(
        "bristles are credited their whole motion", "rtctl/control/dry_friction.py",
        "    work = 0.5 * (before + now) * dx\n", "    work = abs(dx)\n", CREDIT,
    ),
    Seed(
        "what bristles give back stays credited", "rtctl/control/dry_friction.py",
        "guaranteed_friction(p, model, axis, 0.0) * work", "0.0 * work", CREDIT,
    ),
    Seed(
        "what bristles give back is withdrawn at the friction of the speed", "rtctl/control/dry_friction.py",
        "guaranteed_friction(p, model, axis, 0.0) * work",
        "guaranteed_friction(p, model, axis, velocity) * work", CREDIT,
    ),
    Seed(
        "a velocity against the motion chooses the place on the curve", "rtctl/control/dry_friction.py",
        "v = velocity if velocity * dx > 0.0 else dx / (p.period_s * max(elapsed, 1))", "v = velocity",
        CREDIT,
    ),
    Seed(
        "the guaranteed friction is not lowered by what may be wrong", "rtctl/control/dry_friction.py",
        "lowered = dry - (model.friction_min_nm[branch] - floor)", "lowered = dry", CREDIT,
    ),
    Seed(
        "friction seen is credited while bristles still bend", "rtctl/control/dry_friction.py",
        "    if now == end:\n", "    if True:\n", CREDIT,
    ),
    Seed(
        "friction seen is credited without a cap", "rtctl/control/dry_friction.py",
        "min(max(SEEN_SHARE * seen, 0.0), p.friction_seen_max_nm[axis])", "max(SEEN_SHARE * seen, 0.0)",
        CREDIT,
    ),
    Seed(
        "friction seen one way is credited the other", "rtctl/control/dry_friction.py",
        "FORWARD if forward else BACKWARD]", "BACKWARD if forward else FORWARD]", CREDIT,
    ),
    Seed(
        "creep fills the account", "rtctl/control/assistance.py",
        "            earned = min(earned, 0.0)\n", "            pass\n", ASSISTANCE,
    ),
    Seed(
        "the account knows no delay of the motor", "rtctl/control/assistance.py",
        "(s.ticks - 1 - late - later) % HELD", "(s.ticks - 1 - later) % HELD", ASSISTANCE,
    ),
    Seed(
        "the account trusts the delay to the tick", "rtctl/control/assistance.py",
        "energy = min(s.assistance_energy_j[axis, 0], s.assistance_energy_j[axis, 1])",
        "energy = s.assistance_energy_j[axis, 0]", ASSISTANCE,
    ),
    Seed(
        "the account has no end", "rtctl/control/assistance.py",
        "min(s.assistance_energy_j[axis, later] + earned, bank)",
        "s.assistance_energy_j[axis, later] + earned", ASSISTANCE,
    ),
    Seed(
        "viscous damping pays in presliding too", "rtctl/control/assistance.py",
        "slides = s.bristle_share[axis] ** 2", "slides = 1.0", ASSISTANCE,
    ),
    Seed(
        "the observer spends for nothing", "rtctl/control/assistance.py",
        "sent = t.feedforward_torque_nm[axis] + t.observer_torque_nm[axis]",
        "sent = t.feedforward_torque_nm[axis]", ASSISTANCE,
    ),
    Seed(
        "a share that is not a number is all of it", "rtctl/control/assistance.py",
        "return min(share, 1.0) if share > 0.0 else 0.0",
        "return 0.0 if share <= 0.0 else 1.0 if not share < 1.0 else share", ASSISTANCE,
    ),
    Seed(
        "an empty account stays so out of power", "rtctl/control/assistance.py",
        "        s.assistance_energy_j[axis, 0] = s.assistance_energy_j[axis, 1] = bank\n        return\n",
        "        return\n", ASSISTANCE,
    ),
    Seed(
        "the observer adds the inertia it should take off", "rtctl/control/disturbance_observer.py",
        "friction = s.observer_torque_nm[axis] - inertia", "friction = s.observer_torque_nm[axis] + inertia",
        INERTIA,
    ),
    Seed(
        "the observer compensates the viscous damping too", "rtctl/control/disturbance_observer.py",
        "    friction -= p.viscous_nms_rad[axis] * s.observer_velocity_rad_s[axis]\n", "", FINDS,
    ),
    Seed(
        "the observer takes the torque sent for the one that acts", "rtctl/control/disturbance_observer.py",
        "(s.ticks - 1 - late) % HELD", "(s.ticks - 1) % HELD", OBSERVED_LATE,
    ),
    Seed(
        "the observer has no dead band", "rtctl/control/disturbance_observer.py",
        "max(abs(rest) - p.observer_deadband_nm[axis], 0.0)", "abs(rest)", BIAS,
    ),
    Seed(
        "the observer does what the feed-forward does already", "rtctl/control/disturbance_observer.py",
        "t.friction_observed_nm[axis] - s.observer_forward_nm[axis]", "t.friction_observed_nm[axis]", RANGE,
    ),
    Seed(
        "the observer has a cap of its own beside the feed-forward's",
        "rtctl/control/disturbance_observer.py",
        "min(max(torque, -cap - forward), cap - forward)", "min(max(torque, -cap), cap)", RANGE,
    ),
    Seed(
        "the observer goes on beyond the trained range", "rtctl/control/disturbance_observer.py",
        "        torque *= range_fade(model, branch, abs(v))\n", "        pass\n", RANGE,
    ),
    Seed(
        "the observer works without being asked", "rtctl/control/disturbance_observer.py",
        " or p.friction_policy[axis] == _OFF", "", RANGE,
    ),
    Seed(
        "the observer takes two ticks for one", "rtctl/control/disturbance_observer.py",
        "alpha if ticks == 1 else 1.0 - (1.0 - alpha) ** ticks", "alpha", SAMPLES,
    ),
    Seed(
        "the observer takes a missed sample for a measurement", "rtctl/control/disturbance_observer.py",
        " or elapsed < 1:", ":", SAMPLES,
    ),
    Seed(
        "what is not a number stays in the observer", "rtctl/control/disturbance_observer.py",
        "        _forget(s, axis)\n", "        pass\n", SAMPLES,
    ),
    Seed(
        "viscous friction is credited twice", "rtctl/control/dry_friction.py",
        "max(model.viscous_nms_rad[branch], p.viscous_nms_rad[axis])", "model.viscous_nms_rad[branch]", TWICE,
    ),
    Seed(
        "friction is seen in presliding", "rtctl/control/disturbance_observer.py",
        "elif slides(s, axis):", "else:", SEEN,
    ),
    Seed(
        "hybrid goes by the sign of the velocity in presliding", "rtctl/control/feedforward.py",
        "blend(v, s.friction_stop[axis], _intent",
        "blend(v, math.tanh(v / p.friction_tanh_rad_s[axis]), _intent", SPRING,
    ),
    Seed(
        "the intent is not low-passed", "rtctl/control/feedforward.py",
        "alpha * (push - s.friction_intent_nm[axis])", "(push - s.friction_intent_nm[axis])", INTENT,
    ),
    Seed(
        "the gate of a resting joint follows the hand", "rtctl/control/feedforward.py",
        "while_bent(s, p, axis, p.friction_gate_alpha[axis], 1.0)", "p.friction_gate_alpha[axis]", RESTING,
    ),
    Seed(
        "a hand that brakes is helped", "rtctl/control/law.py",
        "helped_share(s, p, axis) * unbraked_share(t, s, p, axis)", "helped_share(s, p, axis)",
        (f"{UNIT}/test_braking.py::test_the_law_sends_no_help_to_a_hand_that_brakes",),
    ),
    Seed(
        "a hand that pushes backward is taken for one that brakes", "rtctl/control/braking.py",
        "against = -push if s.bristle_share[axis] > 0.0 else push", "against = -push",
        (f"{UNIT}/test_braking.py",),
    ),
    Seed(
        "the gate closes as fast as it opens", "rtctl/control/feedforward.py",
        "alpha = min(alpha, p.rest_alpha[axis] * (GATE_TIMES if moves_on else 1.0))", "alpha = alpha",
        (f"{UNIT}/test_feedforward.py::test_the_gate_closes_as_slowly_as_a_joint_at_rest_is_followed",),
    ),
    Seed(
        "the observer holds a joint back that turns", "rtctl/control/disturbance_observer.py",
        "        torque *= _turning(s, p, axis)", "        pass",
        (f"{UNIT}/test_disturbance_observer.py"
         "::test_while_the_bristles_turn_half_of_it_comes_on_top_of_a_hybrid_direction",),
    ),
    Seed(
        "flicker at rest is a velocity", "rtctl/control/disturbance_observer.py",
        "    if is_resting(s, p, axis):\n        velocity = 0.0\n", "", RESTING,
    ),
    Seed(
        "an intent that is not a number stays", "rtctl/control/feedforward.py",
        "    if not math.isfinite(s.friction_intent_nm[axis]):\n        s.friction_intent_nm[axis] = 0.0\n",
        "", INTENT,
    ),
    Seed(
        "bristles of LuGre turn in proportion", "rtctl/control/feedforward.py",
        "math.exp(-abs(dx) / length)", "max(1.0 - abs(dx) / length, 0.0)", LUGRE,
    ),
    Seed(
        "the floor forgets the drift", "rtctl/friction/guarantee.py",
        "floor_nm, doubt_nm, peak_nm = 0.0, friction.drift_nm, cap_nm",
        "floor_nm, doubt_nm, peak_nm = 0.0, 0.0, cap_nm", GUARANTEE,
    ),
    Seed(
        "the length in the rig file is overruled by the model", "rtctl/friction/guarantee.py",
        "    if friction.presliding_rad > 0:", "    if friction.presliding_rad > 0 and model is None:",
        GUARANTEE,
    ),
    Seed(
        "the credited bristles are as long as those measured", "rtctl/friction/guarantee.py",
        "LENGTH_FACTOR * (length_rad + SPREADS * spread_rad)", "length_rad", GUARANTEE,
    ),
    Seed(
        "the account may hold any energy", "rtctl/friction/guarantee.py",
        "min(credited_rad, longest_rad)", "credited_rad", GUARANTEE,
    ),
    Seed(
        "friction is watched from the reversal on", "rtctl/friction/drift_sliding.py",
        "(middle[:, 5] >= self._settle)", "(middle[:, 5] >= 0.0)", DRIFT,
    ),
    Seed(
        "all sessions share one offset", "rtctl/friction/drift_watch.py",
        "        if not (moving & ~before).any():", "        if True:", DRIFT,
    ),
    Seed(
        "the rig is stopped for what an earlier session saw", "rtctl/friction/drift_verdict.py",
        " or found.session_seconds < SESSION_S", "", DRIFT,
    ),
    Seed(
        "what was kept of another model is used", "rtctl/friction/drift_state.py",
        ' or kept.get("identity") != axis.by.identity', "", DRIFT,
    ),
    Seed(
        "samples with faults count as motion", "rtctl/friction/drift_watch.py",
        ' & (rows["faults"] == 0)', "", DRIFT,
    ),
    Seed(
        "a rig without compensation in force is stopped for too much of it",
        "rtctl/friction/drift_verdict.py",
        "by.least_factor(share))", "by.least_factor(1.0))", DRIFT,
    ),
    Seed(
        "a form by load is fitted along a slope that is not its own", "rtctl/friction/learn/load_terms.py",
        "first * u * log_u - second", "first * u * log_u + second", ("tests/unit/friction/test_load.py",),
    ),
)  # fmt: skip
