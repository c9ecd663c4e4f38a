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
        "a full disk under standard output is a traceback",
        "rtctl/cli/__init__.py",
        "        if error.errno != errno.ENOSPC:\n            raise\n",
        "        raise\n",
        ("tests/unit/cli/test_outputs.py::test_a_full_disk_under_standard_output_is_told_in_one_line",),
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
        'if "hands" not in request.values and (pull := self._pull(row)):',
        "if pull := None:",
        REFUSED,
    ),
    Seed(
        "a force that is none passes for no hand",
        "rtctl/host/exchange/requests.py",
        "if not abs(torque) <= limit:",
        "if abs(torque) > limit:",
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
)
