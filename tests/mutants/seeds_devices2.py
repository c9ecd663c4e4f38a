"""Seeded bugs of devices whose code raises, of clients of another version, and of a daemon that was started
anew.
"""

from __future__ import annotations

from seed import Seed

SEEDS = (
    Seed(
        "a device whose preparation raises is left open and powered",
        "rtctl/rt/process.py",
        "    left = _released(device)\n    theirs",
        "    left = None\n    theirs",
        ("tests/unit/rt/test_replug.py",),
    ),
    Seed(
        "a rig of several devices hides which one was not stopped",
        "hw/rig.py",
        "        if failed:\n            raise BackendError",
        "        if not self._devices:\n            raise BackendError",
        ("tests/unit/hw/test_rig_time_and_loss.py",),
    ),
    Seed(
        "a mistake of one device in a rig of several is called a loss",
        "hw/rig_device.py",
        "return mistake_of(self.member.place, doing, error)",
        "return LinkLost(self.member.place)",
        ("tests/unit/hw/test_rig_time_and_loss.py",),
    ),
    Seed(
        "a request of a later protocol is carried out",
        "rtctl/host/exchange/messages.py",
        "if spoken != PROTOCOL_VERSION:",
        "if spoken < PROTOCOL_VERSION:",
        ("tests/unit/host/test_message_decoder.py",),
    ),
    Seed(
        "a stop of a client of another protocol is said to be refused",
        "rtctl/client/requests.py",
        'if spoken == PROTOCOL_VERSION or (op == "stop" and reply.get("ok")):',
        "if spoken == PROTOCOL_VERSION:",
        ("tests/unit/test_client.py",),
    ),
    Seed(
        "a joint beyond its travel that comes back is braked by the filter of its velocity",
        "rtctl/control/program.py",
        "way * s.program_velocity_rad_s[axis] > 0.0 and way * moved > 0.0",
        "way * s.program_velocity_rad_s[axis] > 0.0",
        (
            "tests/unit/control/test_program.py"
            "::test_a_joint_beyond_its_travel_that_comes_back_or_rests_is_let_back",
        ),
    ),
    Seed(
        "a joint at rest beyond its travel is sent further out",
        "rtctl/control/program.py",
        "goes or (kind == _SERVO and way * c.program_velocity_rad_s[axis] > 0.0)",
        "goes",
        (
            "tests/unit/control/test_program.py"
            "::test_a_joint_beyond_its_travel_is_neither_let_nor_sent_further_out",
        ),
    ),
    Seed(
        "without compensation the check counts on the friction of a model that the law has not got",
        "rtctl/check/stability_report.py",
        "sure = guarantee(axis, model if loaded.model_in_use(axis) else None)",
        "sure = guarantee(axis, model)",
        ("tests/unit/test_plan_arrays.py::test_the_proof_counts_on_what_the_law_counts_on",),
    ),
)
