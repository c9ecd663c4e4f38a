"""Bugs in what a daemon keeps a hand from: a zero taken under a pull, an arm beside a cause that stands."""

from seed import Seed

ZERO = "rtctl/host/exchange/force_zero.py"
REFUSED = "tests/unit/host/test_requests_refused.py"
WATCH = "tests/unit/host/test_friction_watch.py"
PLAN = "tests/unit/test_plan_arrays.py"
TIMES = "test_a_ramp_is_never_longer_and_a_renderers_silence_never_shorter_than_at_1_khz"
UNIT = "tests/unit/host/test_force_zero.py"

HOST = "tests/unit/host"
ANEW = "tests/integration/test_installed_anew.py"

SEEDS = (
    Seed(
        "a safe stop imports what opens a device when it needs it", "rtctl/host/safe_stop.py",
        "for module in modules if self._actuators else ():", "for module in ():",
        (f"{ANEW}::test_a_loop_that_dies_after_that_is_still_stopped_through_a_device_opened_afresh",),
    ),
    Seed(
        "a device whose code fails keeps the others from being stopped", "rtctl/host/safe_stop.py",
        "raised = reach_all(steps, OPEN_TIMEOUT_S, 0)", "raised = [step() for step in steps]",
        ("tests/unit/host/test_safe_stop.py"
         "::test_whatever_the_code_of_one_device_does_the_others_are_opened_and_stopped",),
    ),
    Seed(
        "a word of before a stop that the loop has not seen counts", "rtctl/host/exchange/requests.py",
        "request.op not in (\"stop\", \"arm\") and self._slot.stop_pending(row)", "False",
        (f"{REFUSED}::test_what_was_asked_in_an_epoch_is_void_from_a_stop_on_that_the_loop_has_not_seen",),
    ),
    Seed(
        "who says that nobody touches the device says it for ever", "rtctl/host/exchange/requests.py",
        "if \"hands\" in request.values and request.epoch is None:", "if False:",
        (f"{REFUSED}::test_a_hand_that_pulls_is_not_taken_for_zero_unless_somebody_says_it_is_none",),
    ),
    Seed(
        "a zero that the disk refused counts as kept", ZERO,
        "if offered == news and now_ns - at_ns < AGAIN_NS:", "if offered == news:",
        (f"{UNIT}::test_a_zero_that_the_disk_refused_is_given_again_after_a_while",),
    ),
    Seed(
        "what the next run is not told, nobody is told", "rtctl/host/flight_recorder.py",
        "self.state_broken[what] = why", "_ = why",
        (f"{HOST}/test_flight_recorder.py::test_what_the_next_run_is_not_told_is_known_until_it_is",),
    ),
    Seed(
        "the newest incident is the one of the latest date", "rtctl/recording/incident.py",
        "key=lambda at: (at.name <= written, at.name)", "key=lambda at: at.name",
        ("tests/unit/recording/test_incident.py"
         "::test_what_a_clock_that_went_back_dates_long_ago_is_not_the_first_to_go",),
    ),
    Seed(
        "a daemon of two versions serves", "rtctl/host/waiting_loop.py",
        "    if installed_anew():", "    if False:",
        (f"{ANEW}::test_one_that_was_installed_anew_while_it_started_does_not_serve",),
    ),
    Seed(
        "code of one version's constants is kept under another's key", "hw/code_cache.py",
        "if self.usable() and not installed_anew():", "if self.usable():",
        ("tests/unit/hw/test_code_cache.py::test_what_is_compiled_of_a_package_that_was_replaced_is_not_kept",),
    ),
    Seed(
        "the first tare after a start knows no zero before it", ZERO,
        "self._take_up(kept)", "pass",
        (f"{UNIT}::test_a_hand_that_pulls_at_start_up_is_told_by_the_zero_of_before",),
    ),
    Seed(
        "a zero that was refused is kept for the next run", ZERO,
        "if said or not self.refusal():", "if True:",
        (f"{UNIT}::test_a_hand_that_pulls_at_start_up_is_told_by_the_zero_of_before",),
    ),
    Seed(
        "a word for one tare counts for another", ZERO,
        "said = 0 < self._by_word <= state[\"tare_seen\"]", "said = 0 < self._by_word",
        (f"{UNIT}::test_what_a_person_says_is_accepted_of_the_tare_it_was_said_for_and_of_no_other",),
    ),
    Seed(
        "a rig is armed before its zero was judged", "rtctl/host/exchange/requests.py",
        "        if self._zero.taring(int(self._slot.command[\"tare_count\"])):\n", "        if False:\n",
        (f"{UNIT}::test_nothing_is_armed_while_the_zero_is_not_known_nor_with_one_that_moved",),
    ),
    Seed(
        "a hand that has let go is still a hand", ZERO,
        "row[\"hand_torque_nm\"] + self.moved_nm()", "row[\"hand_torque_nm\"]",
        (f"{UNIT}::test_a_hand_that_has_let_go_is_seen_by_the_zero_of_before",),
    ),
    Seed(
        "a rig that was stopped for its friction is armed at once", "rtctl/host/exchange/requests.py",
        "return \"\" if self._friction is None else", "return \"\" if True else",
        (f"{REFUSED}::test_a_rig_that_was_stopped_for_its_friction_is_armed_by_less_compensation_or_a_word_only",),
    ),
    Seed(
        "less compensation does not lead on", "rtctl/friction/drift_watch.py",
        "verdict.overcompensated(self.found, self.by, share))", "True)",
        (f"{WATCH}::test_what_the_rig_was_stopped_for_hinders_arming_until_the_cause_is_gone_or_somebody_says_so",),
    ),
    Seed(
        "the page's tare says that there is no hand", "rtctl/client/view_panel.py",
        "body.get(\"hands\") == \"off\"", "True",
        ("tests/unit/view/test_guidance.py::test_the_page_tares_under_a_pull_only_when_it_was_told_to",),
    ),
    Seed(
        "a cause that is gone for 1000 ticks is gone, however quick the loop", "rtctl/control/states.py",
        "(s.clear_ticks + 0.5) * p.period_s >= CLEAR_S", "s.clear_ticks >= 1000",
        ("tests/unit/control/test_state_sequences.py::test_a_cause_must_be_gone_for_a_second_at_any_rate",),
    ),
    Seed(
        "a ramp takes 50 ticks, however slow the loop", "rtctl/check/law_plan.py",
        "min(STOP_TICKS, round(STOP_S * rate_hz))", "STOP_TICKS", (f"{PLAN}::{TIMES}",),
    ),
    Seed(
        "a renderer is silent after 20 ticks, however quick the loop", "rtctl/check/law_plan.py",
        "max(TARGET_HOLD_TICKS, round(TARGET_HOLD_S * rate_hz))", "TARGET_HOLD_TICKS", (f"{PLAN}::{TIMES}",),
    ),
    Seed(
        "a renderer is lost after 100 ticks, however quick the loop", "rtctl/check/law_plan.py",
        "max(TARGET_STOP_TICKS, round(TARGET_STOP_S * rate_hz))", "TARGET_STOP_TICKS", (f"{PLAN}::{TIMES}",),
    ),
    Seed(
        "a new daemon knows the epochs of the one before it", "rtctl/control/intake.py",
        "s.epoch = max(c.epoch, 0)", "s.epoch = 0",
        ("tests/unit/control/test_state_sequences.py::test_a_daemon_begins_in_the_epoch_that_its_first_command_names",),
    ),
    Seed(
        "every daemon begins in the same epoch", "rtctl/host/supervisor.py",
        "secrets.randbits(EPOCH_BITS) or 1", "1",
        ("tests/integration/test_restarted_daemon.py::test_what_a_client_knows_of_a_daemon_that_ended_is_void_with_the_next_one",),
    ),
    Seed(
        "a carriage that was pushed past its travel has a loose wire", "rtctl/host/exchange/fault_origin.py",
        "PAST_TRAVEL if _slid(scene, axis) else \"\"", "\"\"",
        ("tests/unit/host/test_fault_book.py::test_a_joint_that_was_moved_past_its_travel_is_no_fault_of_the_wiring",),
    ),
    Seed(
        "a position that jumped was pushed there", "rtctl/host/exchange/fault_origin.py",
        "PAST_TRAVEL if _slid(scene, axis) else \"\"", "PAST_TRAVEL",
        ("tests/unit/host/test_fault_book.py::test_a_joint_that_was_moved_past_its_travel_is_no_fault_of_the_wiring",),
    ),
    Seed(
        "what could not be stopped is said twice", "rtctl/cli/stop_rig.py",
        "        if one.confirmed:\n", "        if True:\n",
        ("tests/unit/host/test_safe_stop.py::test_the_command_says_what_is_not_confirmed_once",),
    ),
    Seed(
        "Ctrl-C while an object ends is lost", "rtctl/cli/__init__.py",
        "        sys.unraisablehook = _unraisable\n", "",
        ("tests/unit/cli/test_last_words.py::test_ctrl_c_while_an_object_ends_is_heard_all_the_same",),
    ),
    Seed(
        "an encoder whose every count is a jump passes", "rtctl/check/verdicts_of_motion.py",
        "Outcome.FAIL if cuts else Outcome.WARN", "Outcome.WARN",
        ("tests/unit/test_delay_on_the_mock.py::test_an_encoder_whose_counts_are_jumps_on_a_quick_loop_is_told",),
    ),
)  # fmt: skip
