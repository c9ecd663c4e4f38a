"""Seeded bugs of what the law believes of sensors and motors: samples, detectors, test pulse, velocity,
current's answer, delay.
"""

from __future__ import annotations

from seed import Seed

UNIT = "tests/unit/control"
LATE = (f"{UNIT}/test_late_ticks.py",)
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
JUMPED = (
    "tests/unit/test_delay_on_the_mock.py"
    "::test_samples_refused_because_the_joint_is_out_of_reach_are_not_the_devices",
)

SEEDS = (
    Seed(
        "a sensor that is bad from the first tick on says nothing", "rtctl/control/sample.py",
        "if elapsed >= patience and not faults & _F_END and (started or not faults & _F_LOST):",
        "if started and elapsed >= patience and not faults & _F_END:", SAMPLE,
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
        "if not -100.0 < temperature < 500.0:", "if temperature <= -100.0 or temperature >= 500.0:",
        DETECTORS,
    ),
    Seed(
        "a silent temperature sensor gives back the full torque", "rtctl/control/detectors.py",
        "        s.cold_ticks[axis] += 1\n        return 1.0 - s.heat_share[axis]",
        "        s.cold_ticks[axis] += 1\n        return 1.0", DETECTORS,
    ),
    Seed(
        "a stall of exactly ten periods is let pass", "rtctl/control/detectors.py",
        "skipped >= STALL_PERIODS", "skipped > STALL_PERIODS", LATE,
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
        "not s.test_product_nm2[axis] >= CURRENT_SHARE * sent",
        "not abs(s.test_product_nm2[axis]) >= CURRENT_SHARE * sent", ARMING,
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
        "if not abs(t.current_a[axis]) <= p.current_limit_a[axis]:",
        "if abs(t.current_a[axis]) > p.current_limit_a[axis]:", SAMPLE,
    ),
    Seed(
        "two jumps are forgiven", "rtctl/control/sample.py",
        "if s.jump_count[0] >= 2:", "if s.jump_count[0] >= 3:", SAMPLE,
    ),
    Seed(
        "jumps back are no jumps", "rtctl/control/sample.py",
        "if abs(t.position_rad[axis] - s.position_rad[axis]) > reach:",
        "if t.position_rad[axis] - s.position_rad[axis] > reach:", SAMPLE,
    ),
    Seed(
        "one component of the force is looked at", "rtctl/control/sample.py",
        "        for i in range(3):\n            if not abs(",
        "        for i in range(1):\n            if not abs(", SAMPLE,
    ),
    Seed(
        "a lost device's samples go on being counted from where they were", "rtctl/control/sample.py",
        "    s.sample_count = -1\n", "", SAMPLE,
    ),
    Seed(
        "a device velocity of NaN is believed", "rtctl/control/device_velocity.py",
        "if not abs(device) <= JUMP_FACTOR", "if abs(device) > JUMP_FACTOR", VELOCITY,
    ),
    Seed(
        "a device velocity is used however far it is off the encoder's", "rtctl/control/device_velocity.py",
        "velocity = min(max(device, encoder - tolerance), encoder + tolerance)", "velocity = device",
        VELOCITY,
    ),
    Seed(
        "a device velocity that does not add up to the travel is plausible",
        "rtctl/control/device_velocity.py",
        "return abs(s.device_gap_rad[axis]) <= allowed", "return True", VELOCITY,
    ),
    Seed(
        "a device velocity is held against the encoder in one direction only",
        "rtctl/control/device_velocity.py",
        "return abs(s.device_gap_rad[axis]) <= allowed", "return s.device_gap_rad[axis] <= allowed", VELOCITY,
    ),
    Seed(
        "a missed sample clears the doubt", "rtctl/control/device_velocity.py",
        "    if elapsed > 0:\n", "    if elapsed == 0:\n        s.device_doubt_ticks[axis] = 0\n    else:\n",
        VELOCITY,
    ),
    Seed(
        "what was summed up before a re-plug is held against the device after it",
        "rtctl/control/device_velocity.py",
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
        "a lag is no delay", "rtctl/control/current_fit.py",
        "return left, gain, shift + 1.0 - rest + lag", "return left, gain, shift + 1.0 - rest", ANSWER,
    ),
    Seed(
        "the best fit counts, and not the least delay that noise allows", "rtctl/control/current_answer.py",
        "better = total < found[2] if most < math.inf else left < found[0]", "better = left < found[0]",
        ANSWER,
    ),
    Seed(
        "a lag is one of the row", "rtctl/control/current_answer.py", "    if best_lag > 0.0:\n",
        "    if False:\n", ANSWER,
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
        "if not abs(gain - 1.0) <= p.current_gain_error[axis] + error:",
        "if not 1.0 - gain <= p.current_gain_error[axis] + error:", ANSWER,
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
        "return 0 * current_answer.conclude(s, p, axis) if sent_ticks == PARTS * p.arming_ticks else 0",
        PULSE,
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
        "a jump that is refused is the device's age", "rtctl/control/detectors.py",
        " and s.jump_count[0] == 0", "", JUMPED,
    ),
)  # fmt: skip
