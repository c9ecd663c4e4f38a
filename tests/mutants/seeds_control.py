"""Seeded bugs of the control law: gate, states, faults, intake, detectors, arming, samples, passivity."""

from __future__ import annotations

from seed import Seed

UNIT = "tests/unit/control"
GATE = (f"{UNIT}/test_gate.py", "tests/properties/test_control_gate.py")
STATES = (f"{UNIT}/test_states.py",)
SEQUENCES = (f"{UNIT}/test_state_sequences.py",)
DETECTORS = (f"{UNIT}/test_detectors.py",)
ARMING = (f"{UNIT}/test_arming.py",)
ANSWER = (f"{UNIT}/test_current_answer.py",)
RUNNING = (f"{UNIT}/test_running_delay.py",)
MOCK = "tests/unit/test_delay_on_the_mock.py"
PULSE = (f"{MOCK}::test_a_biased_hall_sensor_is_refused_from_a_tenth_of_the_limit_on",)
STALLED = (f"{MOCK}::test_one_that_becomes_so_while_running_is_stopped_within_a_tenth_of_a_second",)
OLD = (f"{MOCK}::test_how_old_samples_may_be_is_what_the_coupling_bears",)
SAMPLE = (f"{UNIT}/test_sample.py",)
VELOCITY = (f"{UNIT}/test_device_velocity.py",)
PASSIVITY = (
    f"{UNIT}/test_passivity.py::test_injected_damping_never_exceeds_its_cap_and_rests_below_a_count",
    f"{UNIT}/test_passivity.py::test_the_port_loses_what_the_motor_gave_and_is_credited_the_damping_of_the_joint",
    f"{UNIT}/test_passivity.py::test_no_more_than_the_bank_is_kept_beyond_what_is_stored",
    f"{UNIT}/test_passivity.py::test_deficits_become_faults_before_one_and_a_half_and_at_three_budgets",
)
TAKE_BACK = (f"{UNIT}/test_take_back.py",)
FOLLOWS = (
    f"{UNIT}/test_intermediate.py::test_a_store_without_energy_presses_at_the_power_alone",
    f"{UNIT}/test_intermediate.py::test_a_jump_presses_no_harder_than_the_gate_can_take_back_when_the_joint_is_let_go",
    f"{UNIT}/test_intermediate.py::test_what_appears_before_a_fast_joint_is_as_stiff_as_the_gate_can_follow_and_stiffens_as_it_slows",
    f"{UNIT}/test_intermediate.py::test_a_change_of_kind_passes_through_nothing_to_feel",
    f"{UNIT}/test_intermediate.py::test_a_target_that_jumps_is_followed_no_faster_than_the_joint_may_move",
    f"{UNIT}/test_intermediate.py::test_a_world_of_another_kind_grows_where_it_belongs_and_not_where_the_last_one_was",
)
REMOTE = (
    f"{UNIT}/test_intermediate.py::test_a_remote_proxy_whose_motion_nobody_pays_for_stays_where_it_is",
    f"{UNIT}/test_intermediate.py::test_a_remote_proxy_waits_where_the_torque_limit_ends_and_not_beyond",
    f"{UNIT}/test_intermediate.py::test_the_damper_of_a_remote_proxy_follows_no_velocity_beyond_what_the_joint_may_have_nor_one_unpaid",
)
AUTHORITY = (f"{UNIT}/test_authority.py",)
JUMPED = (
    "tests/unit/test_delay_on_the_mock.py::test_samples_refused_because_the_joint_is_out_of_reach_are_not_the_devices",
)
ASSISTANCE = (f"{UNIT}/test_assistance.py",)
MONITOR = (f"{UNIT}/test_campaign_monitor.py",)

SEEDS = (
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
        "a step that stiffens for nothing does not ask how fast the joint is", "rtctl/control/environments/changes.py",
        "if work > 0.0 or k > s.world_stiffness_nm_rad[axis]:", "if work > 0.0:", FOLLOWS,
    ),
    Seed(
        "another kind is taken with the stiffness of the old one", "rtctl/control/environments/changes.py",
        "        if s.world_stiffness_nm_rad[axis] != 0.0 or s.world_damping_nms_rad[axis] != 0.0:\n            return\n", "", FOLLOWS,
    ),
    Seed(
        "another kind grows where the old one was", "rtctl/control/environments/changes.py",
        "        s.world_center_rad[axis] = c.environment_center_rad[axis]\n    _step_stiffness", "        pass\n    _step_stiffness", FOLLOWS,
    ),
    Seed(
        "a remote proxy jumps to its target", "rtctl/control/environments/targets.py",
        "step = towards(before, target, p.velocity_limit_rad_s[axis] * p.period_s) - before", "step = target - before", FOLLOWS,
    ),
    Seed(
        "a remote proxy goes where nobody paid for it to go", "rtctl/control/environments/targets.py",
        "if work > 0.0 and not (work <= s.renderer_store_j[axis] and k_c * stored <= room):", "if k_c * stored > room:", REMOTE,
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
        "        return 0.0, _DISABLED\n", "        return _clamped(0.0, previous - rate, previous + rate), _DISABLED\n", GATE,
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
        "an arm request of an older epoch counts", "rtctl/control/intake.py",
        "return requests, c.epoch == s.epoch", "return requests, True", SEQUENCES,
    ),
    Seed(
        "anybody's target moves the proxy", "rtctl/control/intake.py",
        "if s.lease != 0 and s.lease != c.target_lease:", "if c.target_lease == 0:", SEQUENCES,
    ),
    Seed(
        "a target of an older epoch counts", "rtctl/control/intake.py",
        "if c.target_epoch != s.epoch or c.target_lease == 0:", "if c.target_lease == 0:", SEQUENCES,
    ),
    Seed(
        "a target's velocity may be NaN", "rtctl/control/intake.py",
        "if not (math.isfinite(c.target_position_rad[axis]) and math.isfinite(c.target_velocity_rad_s[axis])):",
        "if not math.isfinite(c.target_position_rad[axis]):", SEQUENCES,
    ),
    Seed(
        "the slot's old target counts as fresh in every tick", "rtctl/control/intake.py",
        "risen = c.target_count > s.target_seen", "risen = c.target_count > 0", SEQUENCES,
    ),
    Seed(
        "a silent renderer is followed five times longer", "rtctl/control/intake.py",
        "return _is_remote(c) and _silence(s) > p.target_hold_ticks",
        "return _is_remote(c) and _silence(s) > 5 * p.target_hold_ticks", SEQUENCES,
    ),
    Seed(
        "a renderer is silent before there is anything to move", "rtctl/control/intake.py",
        "return int(min(s.target_age_ticks, s.remote_ticks))", "return int(s.target_age_ticks)", SEQUENCES,
    ),
    Seed(
        "a target from before the environment became remote is followed", "rtctl/control/environments/targets.py",
        "if s.target_age_ticks >= s.remote_ticks:", "if s.remote_ticks <= 0:", SEQUENCES,
    ),
    Seed(
        "the rig locks out one fault too late", "rtctl/control/states.py",
        "s.fault_total >= LOCKOUT_FAULTS and", "s.fault_total > LOCKOUT_FAULTS and", SEQUENCES,
    ),
    Seed(
        "a later cause replaces the first one", "rtctl/control/states.py",
        "    if s.fault_first < 0:\n", "    if faults:\n", SEQUENCES,
    ),
    Seed(
        "a reset is accepted while the cause is fresh", "rtctl/control/states.py",
        "may_reset = s.clear_ticks >= CLEAR_TICKS or s.state == _ESTOP", "may_reset = True", SEQUENCES,
    ),
    Seed(
        "a stop does not begin a new epoch", "rtctl/control/states.py",
        "        s.epoch += 1\n        s.lease = 0\n        _latch", "        s.lease = 0\n        _latch", SEQUENCES,
    ),
    Seed(
        "the lease outlives a stop", "rtctl/control/states.py",
        "        s.epoch += 1\n        s.lease = 0\n        _latch", "        s.epoch += 1\n        _latch", SEQUENCES,
    ),
    Seed(
        "a stop at rest voids nothing", "rtctl/control/states.py",
        "if requests & STOP and not is_powered(s.state):", "if False:", SEQUENCES,
    ),
    Seed(
        "a cut during a ramp is ignored", "rtctl/control/states.py",
        "Transition(_POWERED, Event.CUT,", "Transition(_MOVING, Event.CUT,", STATES,
    ),
    Seed(
        "a stop in HOLD is ignored", "rtctl/control/states.py",
        "Transition(_MOVING, Event.STOP,", "Transition((_S.ARMING, _S.ACTIVE), Event.STOP,", STATES,
    ),
    Seed(
        "a renderer that comes back starts with full authority", "rtctl/control/states.py",
        "if state in (_ARMING, _ACTIVE):", "if state == _ARMING:", SEQUENCES,
    ),
    Seed(
        "a rig arms before it was good for long enough", "rtctl/control/states.py",
        "ready = s.good_ticks >= p.ready_ticks and not faults", "ready = not faults", SEQUENCES,
    ),
    Seed(
        "a sensor that is bad from the first tick on says nothing", "rtctl/control/sample.py",
        "if elapsed >= patience and not faults & _F_END and (started or not faults & _F_LOST):",
        "if started and elapsed >= patience and not faults & _F_END:", SAMPLE,
    ),
    Seed(
        "a jump ramps instead of cutting", "rtctl/control/faults.py",
        "Fault.JUMP,\n        Reaction.CUT,", "Fault.JUMP,\n        Reaction.RAMP,", SAMPLE,
    ),
    Seed(
        "heat only keeps a rig from arming", "rtctl/control/faults.py",
        "Fault.OVERTEMPERATURE,\n        Reaction.RAMP,", "Fault.OVERTEMPERATURE,\n        Reaction.REFUSE,", DETECTORS,
    ),
    Seed(
        "a motor may be far off by the whole limit", "rtctl/control/detectors.py",
        "if not gap <= WRONG_SHARE * limit:", "if not gap <= limit:", DETECTORS,
    ),
    Seed(
        "gaps between good ticks add up", "rtctl/control/detectors.py",
        "s.lag_ticks[axis] = 0 if gap <= LAG_SHARE * limit else s.lag_ticks[axis] + 1",
        "s.lag_ticks[axis] += 0 if gap <= LAG_SHARE * limit else 1", DETECTORS,
    ),
    Seed(
        "a temperature of NaN is a good one", "rtctl/control/detectors.py",
        "if not -100.0 < temperature < 500.0:", "if temperature <= -100.0 or temperature >= 500.0:", DETECTORS,
    ),
    Seed(
        "a silent temperature sensor gives back the full torque", "rtctl/control/detectors.py",
        "        s.cold_ticks[axis] += 1\n        return 1.0 - s.heat_share[axis]",
        "        s.cold_ticks[axis] += 1\n        return 1.0", DETECTORS,
    ),
    Seed(
        "a stall of exactly ten periods is let pass", "rtctl/control/detectors.py",
        "skipped >= STALL_PERIODS", "skipped > STALL_PERIODS", SEQUENCES,
    ),
    Seed(
        "the window of marks is as long as its words", "rtctl/control/window.py",
        "place = tick % TICKS", "place = tick % (_BITS * MARK_WORDS)", DETECTORS,
    ),
    Seed(
        "the test pulse may use a fifth of the limit", "rtctl/control/arming.py",
        "MAX_SHARE = 0.05", "MAX_SHARE = 0.2", ARMING,
    ),
    Seed(
        "a current of the wrong sign passes the test pulse", "rtctl/control/arming.py",
        "not s.test_product_nm2[axis] >= CURRENT_SHARE * sent", "not abs(s.test_product_nm2[axis]) >= CURRENT_SHARE * sent", ARMING,
    ),
    Seed(
        "a joint that goes the right way is refused, the wrong way passes", "rtctl/control/arming.py",
        "s.test_moved_rad[axis] < -counts", "s.test_moved_rad[axis] > counts", ARMING,
    ),
    Seed(
        "a hand that pulls backwards is not seen in ARMING", "rtctl/control/arming.py",
        "abs(t.hand_torque_nm[axis])", "t.hand_torque_nm[axis]", ARMING,
    ),
    Seed(
        "an older sample is accepted", "rtctl/control/sample.py",
        "t.sample_count <= s.sample_count", "t.sample_count == s.sample_count", SAMPLE,
    ),
    Seed(
        "a current of NaN is within range", "rtctl/control/sample.py",
        "if not abs(t.current_a[axis]) <= p.current_limit_a[axis]:", "if abs(t.current_a[axis]) > p.current_limit_a[axis]:", SAMPLE,
    ),
    Seed(
        "two jumps are forgiven", "rtctl/control/sample.py",
        "if s.jump_count[0] >= 2:", "if s.jump_count[0] >= 3:", SAMPLE,
    ),
    Seed(
        "jumps back are no jumps", "rtctl/control/sample.py",
        "if abs(t.position_rad[axis] - s.position_rad[axis]) > reach:", "if t.position_rad[axis] - s.position_rad[axis] > reach:", SAMPLE,
    ),
    Seed(
        "one component of the force is looked at", "rtctl/control/sample.py",
        "        for i in range(3):\n            if not abs(", "        for i in range(1):\n            if not abs(", SAMPLE,
    ),
    Seed(
        "a lost device's samples go on being counted from where they were", "rtctl/control/sample.py",
        "    s.sample_count = -1\n", "", SAMPLE,
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
        "s.energy_port_j[axis] = min(energy, felt + p.energy_bank_j + cost_to_take_back(p, axis, held))",
        "s.energy_port_j[axis] = energy", PASSIVITY,
    ),
    Seed(
        "more torque is held than the account can pay for", "rtctl/control/law.py",
        "        allowed = min(allowed, torque_to_take_back(p, axis, s.energy_port_j[axis]))", "        pass", TAKE_BACK,
    ),
    Seed(
        "what taking back costs is forgotten while the torque is held", "rtctl/control/passivity.py",
        " + cost_to_take_back(p, axis, held))", ")", TAKE_BACK,
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
        "    if deficit <= FAULT_FACTOR * p.energy_budget_j:", "    if not deficit > FAULT_FACTOR * p.energy_budget_j:", PASSIVITY,
    ),
    Seed(
        "a device velocity of NaN is believed", "rtctl/control/device_velocity.py",
        "if not abs(device) <= JUMP_FACTOR", "if abs(device) > JUMP_FACTOR", VELOCITY,
    ),
    Seed(
        "a device velocity is used however far it is off the encoder's", "rtctl/control/device_velocity.py",
        "velocity = min(max(device, encoder - tolerance), encoder + tolerance)", "velocity = device", VELOCITY,
    ),
    Seed(
        "a device velocity that does not add up to the travel is plausible", "rtctl/control/device_velocity.py",
        "return abs(s.device_gap_rad[axis]) <= allowed", "return True", VELOCITY,
    ),
    Seed(
        "a device velocity is held against the encoder in one direction only", "rtctl/control/device_velocity.py",
        "return abs(s.device_gap_rad[axis]) <= allowed", "return s.device_gap_rad[axis] <= allowed", VELOCITY,
    ),
    Seed(
        "a missed sample clears the doubt", "rtctl/control/device_velocity.py",
        "    if elapsed > 0:\n", "    if elapsed == 0:\n        s.device_doubt_ticks[axis] = 0\n    else:\n", VELOCITY,
    ),
    Seed(
        "what was summed up before a re-plug is held against the device after it", "rtctl/control/device_velocity.py",
        "        s.device_gap_rad[axis] = 0.0\n", "        pass\n", VELOCITY,
    ),
    Seed(
        "the travel of missed samples is not expected of the device", "rtctl/control/device_velocity.py",
        "elapsed * p.period_s * device - dx", "p.period_s * device - dx", VELOCITY,
    ),
    Seed(
        "a joint that moves when the encoder begins has a gap", "rtctl/control/device_velocity.py",
        "    if begins:\n        return True\n", "", VELOCITY,
    ),
    Seed(
        "the over-speed rule believes the device", "rtctl/control/law.py",
        "    t.velocity_rad_s[axis] = velocity\n",
        "    t.velocity_rad_s[axis] = velocity = t.device_velocity_rad_s[axis] if p.device_velocity_kind[axis] == 2 else velocity\n",
        VELOCITY,
    ),
    Seed(
        "a lag is no delay", "rtctl/control/current_answer.py",
        "return left, gain, shift + 1.0 - rest + lag", "return left, gain, shift + 1.0 - rest", ANSWER,
    ),
    Seed(
        "the best fit counts, and not the least delay that noise allows", "rtctl/control/current_answer.py",
        "better = total < delay if most < math.inf else left < best", "better = left < best", ANSWER,
    ),
    Seed(
        "the three steps are laid over one another with one sign", "rtctl/control/current_answer.py",
        "weight = -2.0 if part == 2 else 1.0", "weight = 2.0 if part == 2 else 1.0", ANSWER,
    ),
    Seed(
        "an answer with slots left out is measured", "rtctl/control/current_answer.py",
        "ticks < SHORTEST or s.answer_late_count[axis] > 0 or", "ticks < SHORTEST or", ANSWER,
    ),
    Seed(
        "a gain has no upper bound", "rtctl/control/current_answer.py",
        "if not abs(gain - 1.0) <= p.current_gain_error[axis] + error:", "if not 1.0 - gain <= p.current_gain_error[axis] + error:", ANSWER,
    ),
    Seed(
        "an offset that is no number is small", "rtctl/control/current_answer.py",
        "fault = 0 if abs(offset) <= p.current_offset_nm[axis] else _F_CURRENT",
        "fault = _F_CURRENT if abs(offset) > p.current_offset_nm[axis] else 0", ANSWER,
    ),
    Seed(
        "a delay twice the proof's is tolerated", "rtctl/control/current_answer.py",
        "return 0 if (delay - TOLERANCE_TICKS) * p.period_s <= covered else _F_DELAY",
        "return 0 if delay * p.period_s <= 2.0 * covered else _F_DELAY", ANSWER,
    ),
    Seed(
        "what the pulse measured stops nothing", "rtctl/control/arming.py",
        "return current_answer.conclude(s, p, axis) if sent_ticks == PARTS * p.arming_ticks else 0",
        "return 0 * current_answer.conclude(s, p, axis) if sent_ticks == PARTS * p.arming_ticks else 0", PULSE,
    ),
    Seed(
        "one window beyond the proof is enough", "rtctl/control/running_delay.py",
        "BAD_WINDOWS = 2", "BAD_WINDOWS = 1", RUNNING,
    ),
    Seed(
        "a window takes slots left out for ticks", "rtctl/control/running_delay.py",
        "if skipped > 0 or s.running_ticks[axis] < 0:", "if s.running_ticks[axis] < 0:", RUNNING,
    ),
    Seed(
        "an estimate counts however uncertain it is", "rtctl/control/running_delay.py",
        "if not (error <= MOST_ERROR_TICKS and", "if not (error < math.inf and", RUNNING,
    ),
    Seed(
        "samples of any age below three are fresh enough", "rtctl/control/detectors.py",
        "    return _F_AGE if s.old_count > OLD_OF_1000 else 0\n", "    return 0\n", STALLED,
    ),
    Seed(
        "one old sample is a fault", "rtctl/control/detectors.py",
        "OLD_OF_1000 = 50", "OLD_OF_1000 = 0", OLD,
    ),
    Seed(
        "the proof is taken to cover an old sample beside all of its delay", "rtctl/control/detectors.py",
        "not delay_s + age_s <= p.proof_delay_s[axis]", "not age_s <= p.proof_delay_s[axis]", DETECTORS,
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
        "a jump that is refused is the device's age", "rtctl/control/detectors.py",
        " and s.jump_count[0] == 0", "", JUMPED,
    ),
    Seed(
        "the monitor judges the feed-forward alone", "rtctl/campaign/monitor.py",
        " or abs(value + observer) > cap:", ":", MONITOR,
    ),
    Seed(
        "the monitor lets the observer go beyond the trained range", "rtctl/campaign/monitor.py",
        "value != 0.0 or (learned and observer != 0.0)", "value != 0.0", MONITOR,
    ),
)  # fmt: skip
