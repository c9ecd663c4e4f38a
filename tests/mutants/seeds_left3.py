"""Seeded bugs of what was left in the daemon and its devices: what is not told, or ends too much."""

from __future__ import annotations

from seed import Seed

RELOAD = "tests/unit/host/test_reload.py::test_"
VIEW = "tests/unit/host/test_view_process.py::test_"
SAFE = "tests/unit/host/test_safe_stop.py::test_"
REQUESTS = "tests/unit/host/test_requests.py::test_"
TELEMETRY = "tests/unit/test_broken_telemetry.py::test_"

SEEDS = (
    Seed(
        "a schedule of faults of another content is no change to a reload",
        "rtctl/host/reload.py",
        'if option == "faults" else',
        'if option == "file" else',
        (f"{RELOAD}a_schedule_of_faults_of_another_content_is_told",),
    ),
    Seed(
        "a reload reads the rig file without the schedule that the daemon was given",
        "rtctl/rig_file/config.py",
        "script=None if script is None else real(script),",
        "script=None,",
        (f"{RELOAD}a_schedule_of_faults_of_another_content_is_told",),
    ),
    Seed(
        "a fault without a length is taken",
        "hw/fault_options.py",
        'validate_default=True, description="as for_s',
        'description="as for_s',
        ("tests/unit/hw/test_fault_options.py::test_all_that_is_wrong_with_one_fault_is_told_at_once",),
    ),
    Seed(
        "an event without what is shown of it is handed out",
        "rtctl/client/streams.py",
        "            line_of(event)\n            FaultPlaces().take_event(event)\n",
        "            pass\n",
        (f"{TELEMETRY}a_malformed_message_is_a_named_error_and_the_stream_goes_on",),
    ),
    Seed(
        "of two rigs with one port the second tells the page of the first as its own",
        "rtctl/host/view_process.py",
        "        if self._listening is None:\n            return []\n",
        "",
        (f"{VIEW}of_two_rigs_with_one_port_the_second_tells_no_address_until_it_is_its_own",),
    ),
    Seed(
        "who presses STOP on a page that has died waits",
        "rtctl/host/view_process.py",
        "        self._process = None\n        self._refuse()\n",
        "        self._process = None\n",
        (f"{VIEW}where_no_page_answers_nobody_waits",),
    ),
    Seed(
        "a drive on a bus is not told by a host whose loop has died or stands still",
        "hw/can/backend.py",
        '        tell_afresh(self._options["bus"], self._noted or [])\n',
        "",
        (f"{SAFE}a_drive_on_a_bus_is_told_before_its_bus_is_opened_whole",),
    ),
    Seed(
        "the last number of a stop is sent five times",
        "hw/can/stopping.py",
        "        noted = self.outgoing(0, frame.length)\n        noted.buffer[:] = frame.buffer\n",
        "        noted = frame\n",
        (f"{SAFE}a_drive_on_a_bus_is_told_before_its_bus_is_opened_whole",),
    ),
    Seed(
        "a device that could not be closed after another one's opening failed is not told",
        "hw/rig.py",
        "            if raised is None:\n",
        "            if raised is not None:\n",
        (
            "tests/unit/hw/test_rig_time_and_loss.py::test_when_one_cannot_be_opened_the_others_are_closed_again",
        ),
    ),
    Seed(
        "a renderer is not told that no axis is remote",
        "rtctl/host/exchange/motion_requests.py",
        "np.flatnonzero(self._is_remote())",
        "range(len(self._rig.axes))",
        (f"{REQUESTS}a_target_needs_a_remote_environment_and_counts_as_fresh",),
    ),
    Seed(
        "a runtime folder without room ends a rig for its page",
        "rtctl/host/view_process.py",
        "except OSError as error:  # a rig needs",
        "except PermissionError as error:  # a rig needs",
        (f"{VIEW}a_machine_without_room_or_descriptors_costs_the_page_and_not_the_rig",),
    ),
    Seed(
        "the first hand of a rig is drawn from the stream of the rig",
        "rtctl/simulation/campaign_certified_pairs.py",
        "number or _FIRST_HAND_STREAM",
        "number",
        ("tests/unit/test_campaign_hands.py",),
    ),
    Seed(
        "two readings of one slot advance the mock's velocity filter twice",
        "hw/simulators/mock_sensors.py",
        "    if periods != 1 and share < 1.0:",
        "    if periods > 1 and share < 1.0:",
        (
            "tests/unit/hw/test_mock_sensors.py"
            "::test_a_second_reading_of_a_slot_moves_neither_filter_nor_drift_and_late_ones_both",
        ),
    ),
    Seed(
        "Ctrl-C while LLVM links a module ends the process with SIGSEGV",
        "rtctl/cli/__init__.py",
        'name.startswith("llvmlite.binding")',
        'name.startswith("llvmlite.link")',
        (
            "tests/unit/cli/test_last_words.py::test_ctrl_c_where_it_would_go_nowhere_or_be_fatal_is_said_again",
        ),
    ),
    Seed(
        "a loop that dies keeps the kernel's workers from carrying its stop",
        "rtctl/host/loop_guard.py",
        "loop.out_of_the_way() if dying else nullcontext()",
        "nullcontext()",
        ("tests/unit/host/test_loop_process.py",),
    ),
    Seed(
        "a loop that dies has no priority to the end",
        "rtctl/host/loop_process.py",
        "                os.sched_setscheduler(self.pid, *before)\n",
        "                pass\n",
        ("tests/unit/host/test_loop_process.py",),
    ),
)
