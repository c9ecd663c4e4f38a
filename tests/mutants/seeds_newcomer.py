"""Seeded bugs of what newcomers met: a contract that lets a mistaken backend pass, a client's own numbers."""

from __future__ import annotations

from seed import Seed

PLUGIN = ("tests/contract/test_contract_plugin.py",)
UNITS = "rtctl/backend_contract/units.py"

SEEDS = (
    Seed(
        "the contract lets a torque of the other sign pass",
        UNITS,
        "assert told.torque == pytest.approx([value] * len(told.torque), rel=0.05)",
        "",
        PLUGIN,
    ),
    Seed(
        "the contract turns a joint by less than a turn",
        UNITS,
        "STEP_RAD = 0.4",
        "STEP_RAD = 0.01",
        PLUGIN,
    ),
    Seed(
        "the contract takes a velocity of any unit",
        UNITS,
        "assert found == pytest.approx(wanted, rel=0.02, abs=0.01), channel",
        "",
        PLUGIN,
    ),
    Seed(
        "a rig without a thermometer is not identified",
        "rtctl/identify/ticks.py",
        "return mean if math.isfinite(mean) else None",
        "return mean",
        ("tests/unit/identify/test_signals.py",),
    ),
    Seed(
        "an epoch that is no whole number is rounded",
        "rtctl/host/exchange/messages.py",
        "if isinstance(epoch, float) and epoch.is_integer():",
        "if isinstance(epoch, float) and abs(epoch) < 9e15:",
        ("tests/unit/host/test_message_decoder.py",),
    ),
    Seed(
        "a sensor that the rig does not use is a board's word",
        "hw/serial/frame_backend.py",
        "unwanted = _MISSING & ~",
        "unwanted = 0 & ~",
        ("tests/unit/hw/test_moments_of_boards.py",),
    ),
    Seed(
        "the fault behind an identification that ended is forgotten",
        "rtctl/identify/ended.py",
        'latched = rows["fault_first"][rows["fault_first"] >= 0]',
        'latched = rows["fault_first"][-1:][rows["fault_first"][-1:] >= 0]',
        ("tests/unit/identify/test_signals.py",),
    ),
    Seed(
        "a device whose opening the system refuses ends the daemon",
        "rtctl/rt/replug.py",
        "error = raised_by(self._backend.open)",
        "error = self._backend.open()",
        ("tests/unit/rt/test_replug.py",),
    ),
    Seed(
        "an experiment compares nothing with nothing",
        "rtctl/cli/experiment.py",
        'if axis.friction.policy == "off" or (',
        "if False and (",
        ("tests/unit/cli/test_experiment_without_help.py",),
    ),
    Seed(
        "the contract does not time a read that finds a sample",
        "rtctl/backend_contract/checks.py",
        "            running.device.step()\n\n        assert",
        "\n        assert",
        PLUGIN,
    ),
    Seed(
        "a joint that stood beyond its travel while the host was late does not follow",
        "rtctl/identify/motion.py",
        "patience_s -= max(ran, 1) * self.rig.period_s",
        "patience_s -= len(rows) * self.rig.period_s",
        (
            "tests/unit/identify/test_session.py"
            "::test_the_time_that_a_late_host_left_a_joint_beyond_its_travel_is_no_time_to_follow",
        ),
    ),
)
