"""Seeded bugs that a strict reading of simulated rigs, campaigns, logs and exports found."""

from __future__ import annotations

from seed import Seed

RECORDING = "tests/unit/recording"
STATES = f"{RECORDING}/test_joint_states.py"

SEEDS = (
    Seed(
        "a delayed current holds the simulated motor for as long as the loop was away",
        "hw/simulators/mock_plant.py",
        "max(CATCH_UP_TICKS, p.time_to_live_ticks + DELAY_LINE)",
        "CATCH_UP_TICKS",
        ("tests/unit/hw/test_mock_timing.py::test_after_a_long_gap_no_late_current_holds_the_motor",),
    ),
    Seed(
        "a late force sensor shows what was before a gap",
        "hw/simulators/mock_plant.py",
        "late = min(rest, p.force_delay_ticks)",
        "late = min(rest, 0)",
        (
            "tests/unit/hw/test_mock_timing.py"
            "::test_after_a_long_gap_a_late_force_sensor_shows_what_it_shows_without",
        ),
    ),
    Seed(
        "the low-pass of the force sensor stands still in a gap",
        "hw/simulators/mock_force_filter.py",
        "    if periods > 1:",
        "    if False:",
        ("tests/unit/hw/test_force_filter.py::test_many_periods_at_once_are_as_many_of_a_ramp",),
    ),
    Seed(
        "an empty bag is told as one of other topics",
        "rtctl/recording/joint_states.py",
        "        if empty:",
        "        if False:",
        (f"{STATES}::test_an_empty_bag_is_told_as_one_and_not_as_one_of_other_topics",),
    ),
    Seed(
        "the first stamp of a simulation, 0, is taken for none",
        "rtctl/recording/joint_states.py",
        "states = _in_turn([(state.stamp_ns, state) for _, state in states])",
        "states = _in_turn([(state.stamp_ns or ns, state) for ns, state in states])",
        (f"{STATES}::test_a_clock_of_a_simulation_that_begins_at_0_is_one",),
    ),
    Seed(
        "joints of different messages are an IndexError",
        "rtctl/recording/joint_states.py",
        "    if not states:\n        raise DataError(",
        "    if False:\n        raise DataError(",
        (f"{STATES}::test_joints_that_no_message_has_together_are_named",),
    ),
    Seed(
        "an event log that is taken away between stat and open ends who follows it",
        "rtctl/recording/event_log.py",
        "                with suppress(FileNotFoundError):\n                    file =",
        "                with suppress(KeyError):\n                    file =",
        (
            f"{RECORDING}/test_event_log.py"
            "::test_follow_goes_on_where_the_log_is_taken_away_before_it_is_opened",
        ),
    ),
    Seed(
        "steps that a block of ticks lacks are read from its next column",
        "rtctl/recording/tick_blocks.py",
        "{count * n, count * n if column.stepped else count}",
        "{count * n, 0 if column.stepped else count}",
        (
            f"{RECORDING}/test_tick_blocks.py"
            "::test_steps_that_are_not_there_are_refused_and_not_read_from_the_next_column",
        ),
    ),
    Seed(
        "a simulated drive shows the link of an elastic joint for its motor",
        "hw/simulators/can_plant.py",
        'self._mock.state["position_rad"] + self._mock.state["joint_twist_rad"]',
        'self._mock.state["position_rad"]',
        (
            "tests/unit/hw/test_mock_joint.py"
            "::test_a_simulated_drive_turns_with_the_motor_of_an_elastic_joint",
        ),
    ),
    Seed(
        "a recording without a tick becomes an empty file",
        "rtctl/recording/export.py",
        "    if batch is None:",
        "    if False:",
        (
            f"{RECORDING}/test_export.py"
            "::test_a_recording_without_a_tick_becomes_a_sound_file_with_all_columns",
        ),
    ),
)
