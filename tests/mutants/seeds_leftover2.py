"""Seeded bugs of stops, leases and records that earlier sessions had seen and left."""

from __future__ import annotations

from seed import Seed

LOSSES = ("tests/unit/hw/test_rig_time_and_loss.py",)
SAFE = ("tests/unit/host/test_safe_stop.py",)

SEEDS = (
    Seed(
        "a sample that is held is taken for a delay where the watch of the delay asks for its bound",
        "rtctl/check/law_plan.py",
        "period_s, declared, between.sample_ticks)",
        "period_s, declared)",
        ("tests/unit/test_delay_on_the_mock.py::test_one_that_declares_it_is_proven_with_it_and_arms",),
    ),
    Seed(
        "NaN as the damping of a joint covers every delay",
        "rtctl/control/proofs/delay_cover.py",
        "if not damping_needed_sampled_data(k_c, b_c, T, delta) <= b:",
        "if damping_needed_sampled_data(k_c, b_c, T, delta) > b:",
        ("tests/unit/control/test_delay_cover.py",),
    ),
    Seed(
        "a rotation while the files of the log are read hides events",
        "rtctl/recording/event_log.py",
        "filter(Path.is_file, reversed(_names(folder)))",
        "reversed(log_files(folder)[1:])",
        ("tests/unit/recording/test_event_log.py",),
    ),
    Seed(
        "the host makes the stop packet while a loop dies under torque",
        "rtctl/host/safe_stop.py",
        "raised_by(backend.prepare_stop)",
        "pass",
        SAFE,
    ),
    Seed(
        "a device whose stop hangs is taken for one that stopped",
        "hw/every_device.py",
        "= [hangs] * len(actions)",
        "= [None] * len(actions)",
        LOSSES,
    ),
    Seed(
        "an actuator whose stop hangs keeps the host from stopping the others",
        "rtctl/host/safe_stop.py",
        "        reach_all([backend.stop for _, backend in self._actuators])\n",
        "        [reach_all([backend.stop], 60.0) for _, backend in self._actuators]\n",
        SAFE,
    ),
    Seed(
        "an actuator that hangs as it is opened keeps the others from being stopped",
        "rtctl/host/safe_stop.py",
        "reach_all(steps, OPEN_TIMEOUT_S, 0)",
        "reach_all(steps, 60.0, 0)",
        SAFE,
    ),
)
