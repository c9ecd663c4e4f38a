"""Seeded bugs of what clients and persons are told, and of a start: a stop that is overridden, a target
dropped unheard, a full disk.
"""

from __future__ import annotations

from seed import Seed

REFUSED = ("tests/unit/host/test_requests_refused.py",)
STOPPED = "tests/unit/test_stopped_while_arming.py::test_"

SEEDS = (
    Seed(
        "a client that waits arms again after a stop",
        "rtctl/client/rig.py",
        'if status["epoch"] != epoch:',
        'if (epoch := status["epoch"]) is None:',
        (f"{STOPPED}a_client_that_waits_for_its_rig_does_not_arm_it_again_after_somebodys_stop",),
    ),
    Seed(
        "a renderer's target that is no number is sent and dropped unheard",
        "rtctl/client/lease.py",
        "if not all(map(math.isfinite, numbers)):",
        "if not numbers:",
        (
            "tests/integration/test_client_and_rig.py"
            "::test_a_target_that_the_daemon_would_drop_unheard_is_refused_where_it_is_made",
        ),
    ),
    Seed(
        "a full disk under standard output is told without a remedy",
        "rtctl/cli/__init__.py",
        "    if error.errno == errno.ENOSPC and not error.filename:",
        "    if False:",
        ("tests/unit/cli/test_last_words.py::test_what_the_machine_or_a_person_refuses_is_one_line",),
    ),
    Seed(
        "a simulated rig arms itself after a stop",
        "rtctl/host/auto_arm.py",
        " or epoch != self._epoch:",
        ":",
        (f"{STOPPED}a_simulated_rig_that_arms_by_itself_stays_stopped",),
    ),
    Seed(
        "an arm request that its client gave up arms the rig when the daemon goes on",
        "rtctl/host/exchange/requests.py",
        "if not self._rig.virtual and late_s > DECIDED_S:",
        "if self._rig.virtual and late_s > DECIDED_S:",
        ("tests/unit/host/test_requests.py::test_an_arm_request_that_was_given_up_long_ago_arms_nothing",),
    ),
    Seed(
        "an arm request to a daemon arms the one that is started after it",
        "rtctl/host/exchange/requests.py",
        "if decided > tick_now:",
        "if decided > tick_now + 1000:",
        (
            "tests/unit/host/test_requests.py"
            "::test_an_arm_request_to_the_daemon_before_arms_nothing_in_this_one",
        ),
    ),
    Seed(
        "a client that arms does not tell on which tick it decided",
        "rtctl/client/rig.py",
        'self._call("arm", epoch=epoch, tick=status["tick"])\n            ',
        'self._call("arm", epoch=epoch, tick=-1)\n            ',
        (f"{STOPPED}a_client_that_waits_for_its_rig_does_not_arm_it_again_after_somebodys_stop",),
    ),
    Seed(
        "what is kept is written where a link of the new file's name leads",
        "rtctl/whole_files.py",
        "    path.unlink(missing_ok=True)  # left by a process that died, or a link to somewhere else\n"
        '    with path.open("xb") as file:',
        '    with path.open("wb") as file:',
        ("tests/unit/test_state_file.py::test_nothing_is_written_where_a_link_in_the_folder_leads",),
    ),
    Seed(
        "an experiment arms the rig again after a stop",
        "rtctl/experiments/real_run.py",
        'self._epoch = int(last["epoch"]) if self._epoch < 0 else self._epoch',
        'self._epoch = int(last["epoch"])',
        (f"{STOPPED}an_experiment_on_the_rig_ends_when_it_is_stopped_before_it_began",),
    ),
    Seed(
        "an identification arms the rig again after a stop",
        "rtctl/identify/motion.py",
        'self.epoch = int(rows["epoch"][0]) if self.epoch is None else self.epoch',
        'self.epoch = int(rows["epoch"][-1])',
        (f"{STOPPED}an_identification_ends_when_it_is_stopped_before_it_began",),
    ),
    Seed(
        "an arm that waited for a host that stood still moves the rig",
        "rtctl/host/exchange/gateway.py",
        "            self.stop()\n            self._announce",
        "            self._announce",
        ("tests/unit/host/test_gateway.py::test_an_arm_that_waited_for_longer_than_its_client_is_void",),
    ),
    Seed(
        "a host that stood still in the middle of a turn goes on as if nothing had been",
        "rtctl/host/exchange/gateway.py",
        "            self._void_after_standstill()\n            self.counters",
        "            self.counters",
        (
            "tests/unit/host/test_gateway.py"
            "::test_a_host_that_stops_between_two_messages_of_one_turn_voids_the_second",
        ),
    ),
    Seed(
        "a daemon never looks for garbage",
        "rtctl/cli/run.py",
        "        _collect_garbage()\n        loaded",
        "        loaded",
        ("tests/integration/test_run.py::test_a_daemon_looks_for_garbage_once_its_rig_runs",),
    ),
    Seed(
        "a hand that pulls is taken for zero",
        "rtctl/host/exchange/requests.py",
        "if pull := self._zero.pull(row):",
        "if pull := None:",
        REFUSED,
    ),
    Seed(
        "a force that is none passes for no hand",
        "rtctl/host/exchange/force_zero.py",
        "if self._rig.params is not None and not abs(torque) <= limit:",
        "if self._rig.params is not None and abs(torque) > limit:",
        REFUSED,
    ),
    Seed(
        "a closed rig takes what it is asked",
        "rtctl/host/exchange/requests.py",
        'if state in CLOSED and OPERATIONS[request.op].role != "observer":',
        "if state is State.INIT:",
        REFUSED,
    ),
    Seed(
        "an environment that is put back in the rig file stays",
        "rtctl/host/reload.py",
        "(before if reloadable else started).get(key)",
        "started.get(key)",
        ("tests/unit/host/test_reload.py",),
    ),
    Seed(
        "an environment of the rig file is taken for whatever axis has its place",
        "rtctl/host/reload.py",
        "same_axes = _axes(running) == _axes(read)",
        "same_axes = True",
        ("tests/unit/host/test_reload.py",),
    ),
    Seed(
        "not a number is within all bounds",
        "rtctl/cli/number.py",
        "        if math.isnan(number):",
        "        if False:",
        ("tests/unit/cli/test_last_words.py::test_no_option_takes_what_is_not_a_number",),
    ),
    Seed(
        "what the machine refuses is a traceback",
        "rtctl/cli/__init__.py",
        "    except OSError as error:\n        return _refused",
        "    except BlockingIOError as error:\n        return _refused",
        ("tests/unit/cli/test_last_words.py::test_what_the_machine_or_a_person_refuses_is_one_line",),
    ),
    Seed(
        "what others make of Ctrl-C is a traceback",
        "rtctl/cli/__init__.py",
        "    _interrupts.append(number)\n",
        "",
        ("tests/unit/cli/test_last_words.py::test_what_the_machine_or_a_person_refuses_is_one_line",),
    ),
    Seed(
        "a mistake in rtctl is an interrupt",
        "rtctl/cli/__init__.py",
        "        if _interrupts:\n",
        "        if True:\n",
        ("tests/unit/cli/test_last_words.py::test_a_mistake_in_rtctl_keeps_its_traceback",),
    ),
    Seed(
        "an early Ctrl-C is a traceback",
        "rtctl/__main__.py",
        "        signal.signal(signal.SIGINT, _end)",
        "        pass",
        (
            "tests/unit/cli/test_last_words.py::test_a_signal_while_the_program_is_imported_ends_it_with_a_line",
        ),
    ),
    Seed(
        "an early Ctrl-C ends who was told to ignore it",
        "rtctl/__main__.py",
        "    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:",
        "    if True:",
        (
            "tests/unit/cli/test_last_words.py::test_a_signal_while_the_program_is_imported_ends_it_with_a_line",
        ),
    ),
    Seed(
        "a user without a home has a traceback",
        "hw/outside.py",
        "    except KeyError:\n        return Path",
        "    except RuntimeError:\n        return Path",
        ("tests/unit/test_user_folders.py::test_a_user_without_a_home_has_folders_all_the_same",),
    ),
    Seed(
        "a service that cannot start has no status",
        "rtctl/cli/run.py",
        "            notifier.ended(error)\n",
        "            pass\n",
        ("tests/unit/cli/test_last_words.py::test_a_service_that_cannot_start_says_why_in_its_status",),
    ),
    Seed(
        "a status of two lines",
        "rtctl/host/notify.py",
        "{' '.join((str(error)",
        "{chr(10).join((str(error)",
        ("tests/unit/host/test_notify.py::test_what_ended_the_daemon_is_its_last_status_in_one_line",),
    ),
    Seed(
        "a rig file whose name is no text ends the daemon that tells it",
        "rtctl/rig_file/config.py",
        '    if any("\\ud800" <= letter',
        '    if False and any("\\ud800" <= letter',
        ("tests/unit/cli/test_last_words.py::test_a_rig_file_whose_name_is_no_text_is_refused",),
    ),
    Seed(
        "what came late before the daemon was started again is forgotten",
        "rtctl/cli/doctor_watch.py",
        """elif late["ticks"] < before["ticks"]:""",
        "elif False:",
        (
            "tests/unit/doctor/test_doctor_watch.py::test_the_sums_are_those_of_all_runs_of_the_daemon_meanwhile",
        ),
    ),
    Seed(
        "a map of columns that is no table is a traceback",
        "rtctl/cli/columns.py",
        "            if not isinstance(table, dict):",
        "            if False:",
        ("tests/unit/cli/test_columns_said.py",),
    ),
)
