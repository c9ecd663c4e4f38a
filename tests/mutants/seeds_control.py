"""Seeded bugs of the control law: environments, gate, torques, passivity, take-back, authority, and of the
monitor that watches them.
"""

from __future__ import annotations

from seed import Seed

UNIT = "tests/unit/control"
GATE = (f"{UNIT}/test_gate.py", "tests/properties/test_control_gate.py")
SEQUENCES = (f"{UNIT}/test_state_sequences.py", f"{UNIT}/test_renderer_sequences.py")
VELOCITY = (f"{UNIT}/test_device_velocity.py",)
PASSIVITY = (
    f"{UNIT}/test_passivity.py::test_injected_damping_never_exceeds_its_cap_and_rests_below_a_count",
    f"{UNIT}/test_passivity.py"
    "::test_the_port_loses_what_the_motor_gave_and_is_credited_the_damping_of_the_joint",
    f"{UNIT}/test_passivity.py::test_no_more_than_the_bank_is_kept_beyond_what_is_stored",
    f"{UNIT}/test_passivity.py::test_deficits_become_faults_before_one_and_a_half_and_at_three_budgets",
)
TAKE_BACK = (f"{UNIT}/test_take_back.py",)
FOLLOWS = (
    f"{UNIT}/test_intermediate.py::test_a_store_without_energy_presses_at_the_power_alone",
    f"{UNIT}/test_intermediate.py"
    "::test_a_jump_presses_no_harder_than_the_gate_can_take_back_when_the_joint_is_let_go",
    f"{UNIT}/test_intermediate.py"
    "::test_what_appears_before_a_fast_joint_is_as_stiff_as_the_gate_can_follow_and_stiffens_as_it_slows",
    f"{UNIT}/test_intermediate.py::test_a_change_of_kind_passes_through_nothing_to_feel",
    f"{UNIT}/test_remote_proxy.py::test_a_target_that_jumps_is_followed_no_faster_than_the_joint_may_move",
    f"{UNIT}/test_intermediate.py"
    "::test_a_world_of_another_kind_grows_where_it_belongs_and_not_where_the_last_one_was",
)
REMOTE = (
    f"{UNIT}/test_remote_proxy.py::test_a_remote_proxy_whose_motion_nobody_pays_for_stays_where_it_is",
    f"{UNIT}/test_remote_proxy.py::test_a_remote_proxy_waits_where_the_torque_limit_ends_and_not_beyond",
    f"{UNIT}/test_remote_proxy.py"
    "::test_the_damper_of_a_remote_proxy_follows_no_velocity_beyond_what_the_joint_may_have_nor_one_unpaid",
)
AUTHORITY = (f"{UNIT}/test_authority.py",)
ASSISTANCE = (f"{UNIT}/test_assistance.py",)
MONITOR = (f"{UNIT}/test_campaign_monitor.py",)

FOAW = (f"{UNIT}/test_velocity.py::test_foaw_gives_what_its_definition_gives_to_the_last_bit",)

SEEDS = (
    Seed(
        "the account of the port forgets that the motor is late", "rtctl/control/passivity.py",
        "held = acted_torque(s, p, axis, elapsed)", "held = s.torque_applied_nm[axis]",
        ("tests/unit/control/test_passivity.py"
         "::test_the_port_loses_what_the_torque_that_acted_gave_where_the_motor_is_late",),
    ),
    Seed(
        "torques in flight cost nothing", "rtctl/control/take_back.py",
        "return _way(p, axis) * total", "return 0.0 * total",
        ("tests/unit/control/test_take_back.py::test_torques_in_flight_are_paid_for_before_the_next_one",),
    ),
    Seed(
        "a sample that the turned line has left stays in the window", "rtctl/control/velocity.py",
        "if worst <= band:", "if n > 2:", FOAW,
    ),
    Seed(
        "the far end of a window is taken to turn no farther than the near one", "rtctl/control/velocity.py",
        "turned = max(abs(intercept - before), abs(intercept - before - (candidate - slope) * (n - 1)))",
        "turned = abs(intercept - before)", FOAW,
    ),
    Seed(
        "a renderer's step need not be paid", "rtctl/control/environments/changes.py",
        "    s.renderer_store_j[axis] -= paid\n", "", FOLLOWS,
    ),
    Seed(
        "a step may bring more energy than the gate can follow", "rtctl/control/environments/changes.py",
        "work <= s.renderer_store_j[axis] and stored + motion <= gate_room(s, p, axis, k)",
        "work <= s.renderer_store_j[axis]", FOLLOWS,
    ),
    Seed(
        "a step that stiffens for nothing does not ask how fast the joint is",
        "rtctl/control/environments/changes.py",
        "if work > 0.0 or k > s.world_stiffness_nm_rad[axis]:", "if work > 0.0:", FOLLOWS,
    ),
    Seed(
        "another kind is taken with the stiffness of the old one", "rtctl/control/environments/changes.py",
        "        if s.world_stiffness_nm_rad[axis] != 0.0 or s.world_damping_nms_rad[axis] != 0.0:\n       "
        "     return\n", "", FOLLOWS,
    ),
    Seed(
        "another kind grows where the old one was", "rtctl/control/environments/changes.py",
        "        s.world_center_rad[axis] = c.environment_center_rad[axis]\n    _step_stiffness",
        "        pass\n    _step_stiffness", FOLLOWS,
    ),
    Seed(
        "a remote proxy jumps to its target", "rtctl/control/environments/targets.py",
        "step = towards(before, target, p.velocity_limit_rad_s[axis] * p.period_s) - before",
        "step = target - before", FOLLOWS,
    ),
    Seed(
        "a remote proxy goes where nobody paid for it to go", "rtctl/control/environments/targets.py",
        "if work > 0.0 and not (work <= s.renderer_store_j[axis] and k_c * stored <= room):",
        "if k_c * stored > room:", REMOTE,
    ),
    Seed(
        "a remote proxy winds up beyond the torque limit", "rtctl/control/environments/targets.py",
        " and k_c * stored <= room)", ")", REMOTE,
    ),
    Seed(
        "the damper of a remote proxy follows any velocity", "rtctl/control/environments/targets.py",
        "velocity = towards(0.0, velocity, p.velocity_limit_rad_s[axis])", "pass", REMOTE,
    ),
    Seed(
        "the damper of a remote proxy is not paid", "rtctl/control/environments/targets.py",
        "    if work > s.renderer_store_j[axis]:\n        return False\n", "", REMOTE,
    ),
    Seed(
        "the authority rises however much is stretched", "rtctl/control/authority.py",
        "return left / stored if left > 0.0 and stored > 0.0 else 0.0", "pass", AUTHORITY,
    ),
    Seed(
        "the rise of the authority is granted and not paid", "rtctl/control/authority.py",
        "        s.renderer_store_j[axis] -= paid\n", "", AUTHORITY,
    ),
    Seed(
        "the rise of the authority is granted whether or not it was paid", "rtctl/control/authority.py",
        "min(rise * s.stored_energy_j[axis], s.renderer_store_j[axis]) if rise > 0.0 else 0.0",
        "rise * s.stored_energy_j[axis] if rise > 0.0 else 0.0", AUTHORITY,
    ),
    Seed(
        "one rise of the authority is granted in every tick that follows", "rtctl/control/passivity.py",
        "    s.authority_grant_j[axis] = 0.0\n", "", AUTHORITY,
    ),
    Seed(
        "the absolute limit bounds one sign only", "rtctl/control/gate.py",
        "    if abs(torque) > limit:\n", "    if torque > limit:\n", GATE,
    ),
    Seed(
        "the torque rate bounds rises only", "rtctl/control/gate.py",
        "if abs(torque - previous) > rate:", "if torque - previous > rate:", GATE,
    ),
    Seed(
        "the gate lets NaN of the law pass", "rtctl/control/gate.py",
        "if not (_finite(wanted) and _finite(velocity)):", "if not _finite(velocity):", GATE,
    ),
    Seed(
        "a disabled gate ramps instead of cutting", "rtctl/control/gate.py",
        "        return 0.0, _DISABLED\n",
        "        return _clamped(0.0, previous - rate, previous + rate), _DISABLED\n", GATE,
    ),
    Seed(
        "above the speed limit braking is cut and pushing allowed", "rtctl/control/gate.py",
        "torque * velocity > 0.0:", "torque * velocity < 0.0:", GATE,
    ),
    Seed(
        "the gate trusts a broken memory of what was sent", "rtctl/control/gate.py",
        "if not abs(previous) <= limit * (1.0 + SLACK):", "if abs(previous) > 2.0 * limit:", GATE,
    ),
    Seed(
        "an allowed share of NaN means all of it", "rtctl/control/gate.py",
        "ceiling = allowed if allowed > 0.0 else 0.0", "ceiling = 0.0 if allowed <= 0.0 else limit", GATE,
    ),
    Seed(
        "broken limits are seen while enabled only", "rtctl/control/gate.py",
        "if not (limit > 0.0 and rate > 0.0 and _finite(limit) and _finite(rate)):",
        "if enabled and not (limit > 0.0 and rate > 0.0 and _finite(limit) and _finite(rate)):", GATE,
    ),
    Seed(
        "the encoded value's sign is not checked", "rtctl/control/gate.py",
        "abs(said - torque) <=", "abs(abs(said) - abs(torque)) <=", GATE,
    ),
    Seed(
        "one tick may carry the window beyond the continuous limit", "rtctl/control/gate.py",
        "_clamped(min(limit - slope * (mean - start), ahead), 0.0, limit)",
        "_clamped(limit - slope * (mean - start), 0.0, limit)", GATE,
    ),
    Seed(
        "torques of opposite sign cancel in the window", "rtctl/control/gate.py",
        "share * (abs(torque) - mean)", "share * (torque - mean)", GATE,
    ),
    Seed(
        "a torque that is not finite cuts its own axis only", "rtctl/control/law.py",
        "        t.torque_applied_nm[axis] = 0.0\n        t.current_command_a[axis] = 0.0\n    # The machine",
        "        t.current_command_a[axis] = 0.0\n    # The machine", GATE,
    ),
    Seed(
        "HOLD damps with twice its share", "rtctl/control/law.py",
        "HOLD_SHARE = 0.2", "HOLD_SHARE = 0.4", SEQUENCES,
    ),
    Seed(
        "a stop takes twice its time", "rtctl/control/law.py",
        "abs(s.torque_applied_nm[axis]) / max(p.stop_ticks, 1)",
        "abs(s.torque_applied_nm[axis]) / max(2 * p.stop_ticks, 1)", SEQUENCES,
    ),
    Seed(
        "no soft start", "rtctl/control/law.py",
        "return s.authority * t.torque_wanted_nm[axis]", "return t.torque_wanted_nm[axis]", SEQUENCES,
    ),
    Seed(
        "over-speed is seen in one direction only", "rtctl/control/law.py",
        "return _F_OVERSPEED if abs(velocity) >", "return _F_OVERSPEED if velocity >", SEQUENCES,
    ),
    Seed(
        "a target from before the environment became remote is followed",
        "rtctl/control/environments/targets.py",
        "if s.target_age_ticks >= s.remote_ticks:", "if s.remote_ticks <= 0:", SEQUENCES,
    ),
    Seed(
        "energy the motor gives is booked as energy it takes", "rtctl/control/passivity.py",
        "s.energy_port_j[axis] - held * dx + credit", "s.energy_port_j[axis] + held * dx + credit", PASSIVITY,
    ),
    Seed(
        "a port may give out ten times its budget", "rtctl/control/passivity.py",
        "FAULT_FACTOR = 1.35", "FAULT_FACTOR = 10.0", PASSIVITY,
    ),
    Seed(
        "injected damping has no cap", "rtctl/control/passivity.py",
        "return min(-energy * dt / (dx * dx), max(most, 0.0))",
        "return -energy * dt / (dx * dx)", PASSIVITY,
    ),
    Seed(
        "energy is banked without end", "rtctl/control/passivity.py",
        "s.energy_port_j[axis] = min(energy, felt + p.energy_bank_j + kept)",
        "s.energy_port_j[axis] = energy", PASSIVITY,
    ),
    Seed(
        "more torque is held than the account can pay for", "rtctl/control/law.py",
        "        allowed = min(allowed, torque_to_take_back(p, axis, left))", "        pass",
        TAKE_BACK,
    ),
    Seed(
        "what taking back costs is forgotten while the torque is held", "rtctl/control/passivity.py",
        "kept = cost_to_take_back(p, axis, s.torque_applied_nm[axis]) + in_flight", "kept = in_flight",
        TAKE_BACK,
    ),
    Seed(
        "taking back is thought to take half as long", "rtctl/control/take_back.py",
        "size * size / (2.0 * rate)", "size * size / (4.0 * rate)", TAKE_BACK,
    ),
    Seed(
        "an account of NaN pays for any torque", "rtctl/control/take_back.py",
        "    if not (left > 0.0 and rate > 0.0):\n        return 0.0",
        "    if left <= 0.0 or rate <= 0.0:\n        return 0.0", TAKE_BACK,
    ),
    Seed(
        "a deficit of NaN is no deficit", "rtctl/control/passivity.py",
        "    if deficit <= FAULT_FACTOR * p.energy_budget_j:",
        "    if not deficit > FAULT_FACTOR * p.energy_budget_j:", PASSIVITY,
    ),
    Seed(
        "the over-speed rule believes the device", "rtctl/control/law.py",
        "    t.velocity_rad_s[axis] = velocity\n",
        "    t.velocity_rad_s[axis] = velocity = t.device_velocity_rad_s[axis] if "
        "p.device_velocity_kind[axis] == 2 else velocity\n",
        VELOCITY,
    ),
    Seed(
        "the observer has all, whatever its account says", "rtctl/control/law.py",
        "    t.observer_torque_nm[axis] *= share\n", "", ASSISTANCE,
    ),
    Seed(
        "the feed-forward has all, whatever its account says", "rtctl/control/law.py",
        "    t.feedforward_torque_nm[axis] *= share\n", "", ASSISTANCE,
    ),
    Seed(
        "the account of the force feedback takes the torque for as late as the current may show it",
        "rtctl/control/force_feedback.py",
        "late = min(max(p.actuator_delay_ticks[axis], 0), HELD - 3)",
        "late = min(max(p.follow_delay_ticks[axis], 0), HELD - 3)",
        (f"{UNIT}/test_force_feedback.py"
         "::test_the_account_takes_the_worse_of_when_the_torque_acts_and_one_tick_more",),
    ),
    Seed(
        "the monitor judges the feed-forward alone", "rtctl/simulation/campaign_monitor.py",
        " or abs(value + observer) > cap:", ":", MONITOR,
    ),
    Seed(
        "the monitor lets the observer go beyond the trained range", "rtctl/simulation/campaign_monitor.py",
        "value != 0.0 or (learned and observer != 0.0)", "value != 0.0", MONITOR,
    ),
)  # fmt: skip
