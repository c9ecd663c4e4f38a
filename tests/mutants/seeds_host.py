"""Seeded bugs of the host: messages, roles, epochs, the lease, the command slot, rates."""

from __future__ import annotations

from seed import Seed

HOST = "tests/unit/host"
MESSAGES = (f"{HOST}/test_message_decoder.py",)
REQUESTS = (f"{HOST}/test_requests.py",)
LEASE = (f"{HOST}/test_lease.py",)
TARGETS = (f"{HOST}/test_targets.py",)
BOOK = (f"{HOST}/test_fault_book.py",)
MAILBOX = (
    "tests/unit/test_shm.py::test_the_newest_command_wins_and_counters_lose_no_request",
    "tests/unit/test_shm.py::test_a_half_written_command_changes_nothing_and_is_counted",
    "tests/unit/test_shm.py::test_an_older_command_is_never_taken",
    "tests/unit/test_shm.py::test_a_row_whose_seal_does_not_fit_is_never_returned",
)
PAGE_CROWD = (
    "tests/integration/test_view.py"
    "::test_a_crowd_that_says_half_a_request_each_takes_neither_threads_nor_the_way_of_a_stop",
)
LATE = ("tests/unit/host/test_late.py",)
SEEN = ("tests/unit/host/test_late_trace.py",)
VERDICT = ("tests/unit/host/test_late_verdict.py::test_what_explains_half_is_the_cause",)
TASKS = ("tests/unit/host/test_late_tasks.py",)
CORE = ("tests/unit/host/test_late_core.py",)
EXITS = ("tests/unit/host/test_late_exits.py",)

SEEDS = (
    Seed(
        "the ring that the loop fills is laid at the clients' door", "rtctl/wire/intruders.py",
        "return (resident - shared) * self._page", "return resident * self._page",
        (f"{HOST}/test_intruders.py"
         "::test_memory_that_others_fill_too_is_not_counted_and_what_the_process_has_alone_is",),
    ),
    Seed(
        "a number of NaN is within its bounds", "rtctl/host/exchange/messages.py",
        "if not math.isfinite(value) or not low <= value <= high:", "if value < low or value > high:",
        MESSAGES,
    ),
    Seed(
        "true is a number", "rtctl/host/exchange/messages.py",
        "if isinstance(value, bool) or not isinstance(value, int | float):",
        "if not isinstance(value, int | float):", MESSAGES,
    ),
    Seed(
        "the last of two equal keys wins", "rtctl/host/exchange/messages.py",
        "        if key in unique:\n", "        if False:\n", MESSAGES,
    ),
    Seed(
        "a request needs no epoch", "rtctl/host/exchange/messages.py",
        "_epoch(message, required=operation.needs_epoch)", "_epoch(message, required=False)", MESSAGES,
    ),
    Seed(
        "unknown keys are ignored", "rtctl/host/exchange/messages.py",
        "if name not in known and name not in _OF_ALL:", "if False:", MESSAGES,
    ),
    Seed(
        "any role may do anything", "rtctl/host/exchange/requests.py",
        "if not allowed(request.op, caller.role):", "if False:", REQUESTS,
    ),
    Seed(
        "an observer may arm", "rtctl/host/exchange/operations.py",
        '"enable the actuator: IDLE to ARMING to ACTIVE", "operator"',
        '"enable the actuator: IDLE to ARMING to ACTIVE", "observer"', REQUESTS,
    ),
    Seed(
        "a request of an older epoch is carried out", "rtctl/host/exchange/requests.py",
        'if request.epoch is not None and request.op != "stop" and request.epoch != row["epoch"]:',
        'if request.epoch is not None and request.op != "stop" and request.epoch > row["epoch"]:', REQUESTS,
    ),
    Seed(
        "a stop of an older epoch is refused", "rtctl/host/exchange/requests.py",
        'if request.epoch is not None and request.op != "stop" and request.epoch != row["epoch"]:',
        'if request.epoch is not None and request.epoch != row["epoch"]:', REQUESTS,
    ),
    Seed(
        "a rig arms while a stop is on its way", "rtctl/host/exchange/requests.py",
        "if self._slot.stop_pending(row):", "if False:", REQUESTS,
    ),
    Seed(
        "a loop that stands still is armed", "rtctl/host/exchange/requests.py",
        'if row["time_ns"] == 0 or (not self._rig.virtual and age_s > STALLED_S):', 'if row["time_ns"] == 0:',
        REQUESTS,
    ),
    Seed(
        "a reset is passed on while the rig moves", "rtctl/host/exchange/requests.py",
        "if state not in (State.FAULT, State.ESTOP):", "if state is State.IDLE:",
        REQUESTS,
    ),
    Seed(
        "the force is tared under torque", "rtctl/host/exchange/requests.py",
        "if state not in (State.INIT, State.IDLE, State.FAULT, State.ESTOP):", "if state is State.ACTIVE:",
        REQUESTS,
    ),
    Seed(
        "a stop leaves the arm request and the target in the slot", "rtctl/host/exchange/newest_command.py",
        '        command["epoch"] = command["target_epoch"] = _VOID\n        command["target_lease"] = 0\n',
        "", TARGETS,
    ),
    Seed(
        "a lease's number is enough for anybody", "rtctl/host/exchange/lease.py",
        "if lease.text != text or lease.user_id != user_id:", "if lease.text != text:", LEASE,
    ),
    Seed(
        "a lease outlives its epoch", "rtctl/host/exchange/lease.py",
        "if self._lease is not None and self._lease.epoch != epoch:", "if False:", LEASE,
    ),
    Seed(
        "a silent holder keeps the lease", "rtctl/host/exchange/lease.py",
        "elif self._lease is not None and self._clock_s() > self._until_s:", "elif False:", LEASE,
    ),
    Seed(
        "two may hold the lease", "rtctl/host/exchange/lease.py",
        "        if lease is not None:\n            return Refusal(\n",
        "        if False:\n            return Refusal(\n", LEASE,
    ),
    Seed(
        "the lease is given while the loop follows the last holder", "rtctl/host/exchange/lease.py",
        "        if loop_holds:\n", "        if False:\n", LEASE,
    ),
    Seed(
        "a stop may come too often", "rtctl/host/exchange/gateway.py",
        ' and request.op != "stop":', ":", TARGETS,
    ),
    Seed(
        "targets have no rate", "rtctl/host/exchange/gateway.py",
        "        if not self._target_rate.allows(caller.user_id):\n            return False\n", "", TARGETS,
    ),
    Seed(
        "of targets that wait the oldest is taken", "rtctl/host/exchange/targets.py",
        "newest[sender] = (user_id(frame), frame.bytes)",
        "newest.setdefault(sender, (user_id(frame), frame.bytes))", TARGETS,
    ),
    Seed(
        "an emergency stop is told as what came before it", "rtctl/wire/fault_names.py",
        "    if state == State.ESTOP:\n", "    if False:\n", BOOK,
    ),
    Seed(
        "a fault is laid at the newest words", "rtctl/host/exchange/device_words.py",
        "if tick is None or one.tick <= tick", "if True", BOOK,
    ),
    Seed(
        "a half-written command is taken", "rtctl/control/mailbox.py",
        "if compiled_checksum(command_words[1], n) != slot[n] or command_words[1, 0] < command_words[0, 0]:",
        "if command_words[1, 0] < command_words[0, 0]:", MAILBOX,
    ),
    Seed(
        "an older command is taken", "rtctl/control/mailbox.py",
        " or command_words[1, 0] < command_words[0, 0]:", ":", MAILBOX,
    ),
    Seed(
        "a torn tick is shown", "rtctl/rt/shared_memory.py",
        "        if not sealed.all():\n", "        if False:\n", MAILBOX,
    ),
    Seed(
        "a loop drives what another process drives", "rtctl/rt/process.py",
        "            claims.take(member.label, member.claims)\n", "            pass\n",
        ("tests/attacks/test_two_daemons_one_drive.py",),
    ),
    Seed(
        "one process may take every place", "rtctl/wire/connections.py",
        "SHARE = 0.5\n", "SHARE = 1.0\n",
        ("tests/unit/host/test_intruders.py::test_one_process_gets_half_of_the_places_of_a_door",),
    ),
    Seed(
        "any crowd may wait at the page's port", "rtctl/client/view_guests.py",
        "while len(self._waiting) > self._most:", "while False:", PAGE_CROWD,
    ),
    Seed(
        "who looks at the page may be cut off for who comes", "rtctl/client/view_guests.py",
        "        self.go(guest)\n        try:", "        try:", PAGE_CROWD,
    ),
    Seed(
        "a link to itself is a traceback", "hw/outside.py",
        "return Path(os.path.realpath(path))", "return Path(path).resolve()",
        ("tests/attacks/test_files_of_strangers.py::test_a_link_to_itself_is_refused_by_name",),
    ),
    Seed(
        "what held the loop up before a look in the middle is not counted",
        "rtctl/host/exchange/late_watch.py",
        "        return self._looks[0][0], judged_ns\n", "        return reading, judged_ns\n",
        ("tests/unit/host/test_late.py"
         "::test_what_held_the_loop_up_before_a_look_in_the_middle_counts",),
    ),
    Seed(
        "a task that may not preempt the loop rules a softirq out", "rtctl/host/exchange/late_verdict.py",
        "if one.may_preempt and not one.name", "if not one.name", VERDICT,
    ),
    Seed(
        "the kernel's task for softirqs is another task", "rtctl/host/exchange/late_verdict.py",
        "one.may_preempt and not one.name.startswith(SOFTIRQ_TASK)", "one.may_preempt", VERDICT,
    ),
    Seed(
        "a task that can have run rules a softirq out as one that is likely to",
        "rtctl/host/exchange/late_verdict.py",
        "sum(one.likely_ns for one in known)", "sum(one.likely_ns + one.ran_ns for one in known)", VERDICT,
    ),
    Seed(
        "who ran evenly comes before who filled the wait", "rtctl/host/exchange/late_tasks.py",
        "-(one.ran_ns + one.likely_ns)", "-one.likely_ns", TASKS,
    ),
    Seed(
        "of two tasks that have ended the first is named", "rtctl/host/exchange/late_verdict.py",
        "if len(ended) == 1:", "if ended:", VERDICT,
    ),
    Seed(
        "a task that rose above the loop is in a section of the kernel", "rtctl/host/exchange/late_seen.py",
        "found.waited[_whose(mark.left, self._own, self.state), self._core",
        "found.waited[_whose(self._core.priority, self._own, self.state), self._core", SEEN,
    ),
    Seed(
        "who took an idle core is not told, and the hypervisor is blamed", "rtctl/host/exchange/late_seen.py",
        "if self._idle and mark.leaver:", "if False:", SEEN,
    ),
    Seed(
        "a loop that runs on another core waits on this one", "rtctl/host/exchange/late_seen.py",
        "story.found if story.state == _RUNS else None", "story.found", SEEN,
    ),
    Seed(
        "switches that were left out are taken for none", "rtctl/host/exchange/late_seen.py",
        "if mark.what == GAP:", "if False:", SEEN,
    ),
    Seed(
        "what was overwritten is followed on", "rtctl/host/exchange/late_trace.py",
        "self._known, new = [], new[: max(left, 0)]", "new = new[: max(left, 0)]", SEEN,
    ),
    Seed(
        "a slow clock is the device's fault", "rtctl/host/exchange/late_verdict.py",
        "late.cycle_ns * rise.slower >= EXPLAINS * late.own_ns", "False", VERDICT,
    ),
    Seed(
        "an SMI in the cycle is the device's fault", "rtctl/host/exchange/late_verdict.py",
        "rise.steal_ns, rise.smis * SMI_NS, *counted)", "rise.steal_ns, *counted)", VERDICT,
    ),
    Seed(
        "softirqs in the middle of the cycle are the device's fault", "rtctl/host/exchange/late_verdict.py",
        "rise.smis * SMI_NS, *counted)", "rise.smis * SMI_NS)", VERDICT,
    ),
    Seed(
        "all that a task ran for counts, whenever that was", "rtctl/host/exchange/late_tasks.py",
        "min(b.ran_ns - a.ran_ns, shared)", "b.ran_ns - a.ran_ns", TASKS,
    ),
    Seed(
        "a task ran evenly since it was first seen", "rtctl/host/exchange/late_tasks.py",
        "known.add(known.samples[-1]._replace(at_ns=at_ns))", "pass", TASKS,
    ),
    Seed(
        "a task counts on the core where it is now only", "rtctl/host/exchange/late_tasks.py",
        "core in (a.core, b.core)", "core == b.core", TASKS,
    ),
    Seed(
        "a task that has ended is forgotten", "rtctl/host/exchange/late_tasks.py",
        "if not one.gone_ns and self._exits is None:", "if False:", TASKS,
    ),
    Seed(
        "a task whose parent has not heard of its end runs on", "rtctl/host/exchange/late_tasks.py",
        "            if known.gone_ns:\n                return\n", "", TASKS,
    ),
    Seed(
        "a task that ended during a look began in it", "rtctl/host/exchange/late_tasks.py",
        "sample, self._scans_ns[:1])", "sample, self._scans_ns[-1:])", TASKS,
    ),
    Seed(
        "tasks that have ended are kept for ever", "rtctl/host/exchange/late_tasks.py",
        "now_ns - one.gone_ns > KEPT_NS", "False", TASKS,
    ),
    Seed(
        "SCHED_DEADLINE has no priority", "rtctl/host/exchange/late_tasks.py",
        "HIGHEST if int(words[_POLICY]) == _DEADLINE else", "", TASKS,
    ),
    Seed(
        "the host reads of ends for ever", "rtctl/host/exchange/late_exits.py",
        "for _ in range(MOST):", "while True:", EXITS,
    ),
    Seed(
        "a softirq of many packets is one", "rtctl/host/exchange/late_counters.py",
        "found[NET_RX] += int(words[_PACKETS], 16)", "found[NET_RX] += 0", LATE,
    ),
    Seed(
        "packets are those of the line, not of the core", "rtctl/host/exchange/late_counters.py",
        "int(words[_PACKETS_CORE], 16) if len(words) > _PACKETS_CORE else index", "index", LATE,
    ),
    Seed(
        "the time another control group was held is the loop's", "rtctl/host/exchange/late_counters.py",
        "after.throttled_ns - before.throttled_ns if after.group == before.group else NAN",
        "after.throttled_ns - before.throttled_ns", LATE,
    ),
    Seed(
        "a driver that does not know how long a change takes is believed",
        "rtctl/host/exchange/late_core.py",
        "latency if latency < _ETERNAL_NS else NAN", "latency", CORE,
    ),
)  # fmt: skip
