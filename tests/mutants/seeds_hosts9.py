"""Seeded bugs on hosts that misbehave: readers that stop reading, refused resources, early signals."""

from __future__ import annotations

from seed import Seed

STALLED = "tests/unit/host/test_stalled.py"
WORDS = "tests/unit/cli/test_last_words.py"

SEEDS = (
    Seed(
        "a subscriber by ipc that takes nothing is never known",
        "rtctl/wire/stalled.py",
        "since[descriptor] = taken, at_s if taken == before else now_s",
        "since[descriptor] = taken, at_s if taken == before and self._by_tcp else now_s",
        (
            f"{STALLED}::test_a_subscriber_that_takes_nothing_is_cut_and_one_that_takes_little_or_has_nothing_stays",
        ),
    ),
    Seed(
        "who has nothing to take counts as one that takes nothing",
        "rtctl/wire/stalled.py",
        "full = set(descriptors) - {descriptor for descriptor, _ in poll.poll(0)}",
        "full = set(descriptors)",
        (
            f"{STALLED}::test_a_subscriber_that_takes_nothing_is_cut_and_one_that_takes_little_or_has_nothing_stays",
        ),
    ),
    Seed(
        "local clients are suspected of what one that takes nothing has made grow",
        "rtctl/wire/intruders.py",
        "known = self._cut_stalled(now_s, GROWN_STALLED_S) or self._expel_floods()",
        "known = self._expel_floods()",
        (f"{STALLED}::test_while_memory_grows_who_takes_nothing_goes_before_anybody_is_suspected",),
    ),
    Seed(
        "a quick rig keeps as many seconds for a subscriber as a slow one",
        "rtctl/host/exchange/streams.py",
        "return min(wanted, max(16, int(2 * QUEUE_BYTES / (ticks + BESIDES_BYTES))))",
        "return wanted",
        ("tests/unit/host/test_telemetry.py::test_queues_hold_no_more_than_their_bytes",),
    ),
    Seed(
        "SIGTERM while the program is imported ends it without a word",
        "rtctl/__main__.py",
        "        signal.signal(signal.SIGTERM, _end)\n",
        "        pass\n",
        (f"{WORDS}::test_a_signal_while_the_program_is_imported_ends_it_with_a_line",),
    ),
    Seed(
        "SIGTERM while a daemon starts is told as Ctrl-C",
        "rtctl/cli/__init__.py",
        "ended = isinstance(stop.__cause__ or stop, TerminatedError) or _interrupts[-1:] == [signal.SIGTERM]",
        "ended = False",
        (f"{WORDS}::test_what_the_machine_or_a_person_refuses_is_one_line",),
    ),
    Seed(
        "a browser that does not read keeps as many batches of any length",
        "rtctl/client/view_feed.py",
        "while len(self.batches) > max(1, KEPT_BYTES // rows.nbytes):",
        "while len(self.batches) > KEPT_BATCHES:",
        (
            "tests/unit/view/test_followers.py::test_a_browser_that_does_not_read_keeps_a_bounded_number_of_bytes",
        ),
    ),
    Seed(
        "an incident that a full disk refused is forgotten",
        "rtctl/host/flight_recorder.py",
        "while self._unwritten and self._write(self._unwritten[0]):",
        "while self._unwritten and (self._write(self._unwritten[0]) or True):",
        (
            "tests/unit/host/test_flight_recorder.py::"
            "test_incidents_that_a_full_disk_refused_are_written_once_there_is_room",
        ),
    ),
    Seed(
        "a run that was cut off is forgotten",
        "rtctl/host/flight_recorder.py",
        'if before is not None and before.get("event") != "ended":',
        'if before is not None and before.get("event") == "log_gap":',
        (
            "tests/unit/host/test_flight_recorder.py::"
            "test_a_run_that_told_no_end_is_told_by_the_next_one_alone",
        ),
    ),
    Seed(
        "a page without descriptors asks for the connection that waits as fast as it can",
        "rtctl/client/view_server.py",
        "            time.sleep(MESSAGE_S)\n            raise",
        "            raise",
        (
            "tests/unit/view/test_followers.py::"
            "test_a_connection_that_cannot_be_taken_for_want_of_descriptors_is_not_asked_for_without_a_rest",
        ),
    ),
)
