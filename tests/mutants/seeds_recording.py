"""Seeded bugs of recordings and their replay."""

from __future__ import annotations

from seed import Seed

UNIT = "tests/unit/recording"

SEEDS = (
    Seed(
        "a clock that is told by its steps is taken for its steps", "rtctl/recording/tick_blocks.py",
        "np.cumsum(found) if name in self.steps else", "np.cumsum(found) if name == 'tick' else",
        (f"{UNIT}/test_tick_blocks.py::test_a_column_is_had_by_itself_and_ticks_in_the_room_that_is_given",),
    ),
    Seed(
        "a field is told once where its first component stays the same", "rtctl/recording/tick_blocks.py",
        "same[first : first + count].all()", "same[first]",
        (f"{UNIT}/test_tick_blocks.py::test_what_stays_the_same_is_told_once_and_what_counts_up_by_its_steps",),
    ),
    Seed(
        "a block goes on over ticks that were lost", "rtctl/recording/parts.py",
        "ends = [*(np.flatnonzero(np.diff(numbers) != 1) + 1).tolist(), len(rows)]", "ends = [len(rows)]",
        (f"{UNIT}/test_export.py::test_mcap_keeps_the_numbers_of_ticks_that_were_lost",),
    ),
    Seed(
        "a recorded state is believed wherever the law came to", "rtctl/recording/replay.py",
        "self._states_hold = self._states_hold and reached",
        "self._states_hold = self._states_hold or reached",
        (f"{UNIT}/test_replay.py::test_a_state_that_the_law_did_not_come_to_is_not_believed",),
    ),
    Seed(
        "two laws are compared by ticks of the last chunk only", "rtctl/recording/compare.py",
        "recorded[name].append(rows[name].copy())", "recorded[name].append(rows[name])",
        (f"{UNIT}/test_replay.py::test_a_recording_as_columns_compares_equal_over_all_its_chunks",),
    ),
    Seed(
        "what is written before the first look of a follower is lost",
        "rtctl/recording/event_log.py",
        "        return _written(path, file, stack.pop_all(), poll_s)",
        "        return _written(path, path.open('rb'), stack.pop_all(), poll_s)",
        ("tests/unit/recording/test_event_log.py::test_follow_begins_when_it_is_asked_for",),
    ),
    Seed(
        "what came last before a rotation is not followed",
        "rtctl/recording/event_log.py",
        "            replaced = _replaced(path, file)\n"
        "            data = file.read() if file is not None else b\"\"\n",
        "            data = file.read() if file is not None else b\"\"\n"
        "            replaced = _replaced(path, file)\n",
        ("tests/unit/recording/test_event_log.py::test_follow_reads_what_came_last_before_a_rotation",),
    ),
    Seed(
        "an event that comes while the log is read is shown twice",
        "rtctl/cli/events.py",
        "            if event in events:",
        "            if False:",
        ("tests/unit/cli/test_events_followed.py",),
    ),
    Seed(
        "a recording of joints goes through the law of a carriage",
        "rtctl/recording/compare.py",
        "    if motions != list(reader.motions):",
        "    if False:",
        ("tests/unit/recording/test_replay.py::test_a_rig_whose_axes_move_otherwise_is_refused",),
    ),
    Seed(
        "a file whose name ends with a date takes all memory",
        "rtctl/recording/reader.py",
        "list(takewhile(Path.is_file, map(named, reversed(range(number)))))",
        "list(map(named, reversed(range(number))))",
        ("tests/unit/recording/test_recording_files.py::test_a_name_that_ends_with_a_date_is_one_file",),
    ),
)  # fmt: skip
