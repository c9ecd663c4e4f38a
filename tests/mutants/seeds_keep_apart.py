"""Bugs in what keeps rigs of one machine apart, and in what is left of a run for the next."""

from seed import Seed

WHOLE = "tests/unit/test_whole_files.py"
CORE = "tests/unit/rt/test_core.py"
ZERO = "rtctl/host/exchange/force_zero.py"
OF_ZERO = "tests/unit/host/test_force_zero.py"
ENDPOINTS = "tests/unit/host/test_endpoints.py"
LEFT = f"{WHOLE}::test_what_may_be_somebodys_is_left"

SEEDS = (
    Seed(
        "a start without room for its sockets waits for ever", "rtctl/host/supervisor.py",
        "self.context.destroy(linger=0)", "self.context.term()",
        ("tests/integration/test_run_refused.py"
         "::test_a_runtime_folder_without_room_for_its_sockets_is_told_and_not_waited_for",),
    ),
    Seed(
        "a door that libzmq cannot open again ends the daemon", "rtctl/wire/sockets.py",
        "suppress(OSError, zmq.ZMQError):", "suppress(OSError):",
        ("tests/unit/host/test_intruders.py"
         "::test_a_door_that_cannot_be_opened_again_stays_shut_until_it_can",),
    ),
    Seed(
        "a full disk is told without its folder", "rtctl/wire/endpoints.py",
        "{error.filename or directory}", "{error.filename}",
        (f"{ENDPOINTS}::test_a_full_disk_is_told_with_the_folder",),
    ),
    Seed(
        "an armed rig goes on when its terminal is closed", "rtctl/host/signals.py",
        "if self._at_terminal and not _has_terminal():", "if False:",
        ("tests/unit/host/test_host_signals.py::test_a_terminal_that_is_gone_is_an_end_and_one_only",),
    ),
    Seed(
        "the hangups of kernel and shell are two ends, and cut", "rtctl/host/signals.py",
        "self.ends = max(self.ends, 1)", "self.ends += 1",
        ("tests/unit/host/test_host_signals.py::test_a_terminal_that_is_gone_is_an_end_and_one_only",),
    ),
    Seed(
        "nohup helps nobody", "rtctl/host/signals.py",
        "_has_terminal() and signal.getsignal(signal.SIGHUP) != signal.SIG_IGN", "_has_terminal()",
        ("tests/unit/host/test_host_signals.py"
         "::test_a_hangup_while_the_terminal_is_there_and_one_under_nohup_are_none",),
    ),
    Seed(
        "a rig that nobody can reach to stop it runs on", "rtctl/host/supervisor.py",
        "        if why := self.runtime.lost():\n", "        if why := \"\":\n",
        ("tests/integration/test_run_refused.py::test_a_daemon_at_rest_whose_sockets_went_ends_too",),
    ),
    Seed(
        "another daemon's folder is taken for one's own", "rtctl/wire/endpoints.py",
        "os.path.samestat(here, held)", "True",
        (f"{ENDPOINTS}::test_a_folder_that_went_while_the_daemon_runs_is_noticed",),
    ),
    Seed(
        "a stop of a later version is refused for its new key", "rtctl/host/exchange/messages.py",
        "if message.get(\"op\") == \"stop\":", "if message == {\"id\": identity, \"op\": \"stop\"}:",
        ("tests/unit/host/test_message_decoder.py::test_a_stop_is_one_whatever_else_its_map_holds",),
    ),
    Seed(
        "a stop that nobody can be answered for is dropped", "rtctl/host/exchange/gateway.py",
        "        if isinstance(request, Refusal) and request.id is None:\n",
        "        if request.id is None:\n",
        ("tests/unit/host/test_gateway.py::test_a_stop_without_an_id_stops_and_is_not_answered",),
    ),
    Seed(
        "what a power cut left stays for ever", "rtctl/whole_files.py",
        "                _remove_left(part, int(pid))", "                pass",
        (f"{WHOLE}::test_what_a_power_cut_left_is_removed_by_the_next_that_writes_the_same_file",),
    ),
    Seed(
        "a file that somebody is writing is swept away", "rtctl/whole_files.py",
        "        os.kill(pid, 0)\n", "        raise ProcessLookupError\n", (LEFT,),
    ),
    Seed(
        "what another machine is writing is swept away", "rtctl/whole_files.py",
        " or time.time_ns() - part.stat().st_mtime_ns < LEFT_NS:", ":", (LEFT,),
    ),
    Seed(
        "zeros walk by small steps without a bound", ZERO,
        "if not abs(walked) <= walked_most[a]:", "if False:",
        (f"{OF_ZERO}::test_light_pulls_add_up_to_half_of_the_bound_and_no_further_over_restarts_too",),
    ),
    Seed(
        "each zero that is accepted is where the walk begins", ZERO,
        "self._vouched[first | said] = self._zero[first | said]", "self._vouched[:] = self._zero",
        (f"{OF_ZERO}::test_light_pulls_add_up_to_half_of_the_bound_and_no_further_over_restarts_too",),
    ),
    Seed(
        "a restart begins the walk anew", ZERO,
        "_numbers(told.get(\"vouched\")) or zero", "zero",
        (f"{OF_ZERO}::test_light_pulls_add_up_to_half_of_the_bound_and_no_further_over_restarts_too",),
    ),
    Seed(
        "a word does not begin the walk anew", ZERO, "self._vouched[first | said] = self._zero[first | said]",
        "self._vouched[first] = self._zero[first]",
        (f"{OF_ZERO}::test_what_a_person_says_is_where_the_walk_begins_anew",),
    ),
    Seed(
        "two daemons of one name share what is kept", "rtctl/host/supervisor.py",
        "self._streams.enter_context(kept_alone(name, state_folder(name)))", "pass",
        ("tests/integration/test_run_refused.py"
         "::test_a_second_daemon_of_a_name_is_refused_wherever_its_sockets_are",),
    ),
    Seed(
        "a rig whose disk is read-only does not start", "rtctl/wire/endpoints.py",
        "        yield  # where nothing can be written nobody is written over; what is lost is told as it is "
        "lost\n",
        "        raise\n",
        (f"{ENDPOINTS}::test_where_nothing_can_be_written_nothing_is_kept_and_the_rig_runs",),
    ),
    Seed(
        "two loops take one core", "rtctl/rt/core.py",
        "    allowed = allowed.difference(taken) or allowed\n", "",
        (f"{CORE}::test_a_core_that_another_rig_keeps_to_is_left_while_there_is_another",),
    ),
    Seed(
        "the kernel's own threads drive the loop from its core", "rtctl/rt/core.py",
        "if not flags & _KERNEL_THREAD:", "if True:",
        (f"{CORE}::test_the_kernels_own_threads_and_what_has_ended_keep_no_core",),
    ),
    Seed(
        "status flickers where events do not", "rtctl/host/exchange/motor_temperature.py",
        "return temperature_warnings(self._rig, row, self._present)",
        "return temperature_warnings(self._rig, row)",
        ("tests/unit/host/test_requests_refused.py"
         "::test_status_warns_of_a_motor_outside_the_learned_temperatures",),
    ),
)  # fmt: skip
