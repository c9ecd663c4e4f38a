"""Seeded bugs of a third reading of the house: what devices say of themselves, and files nobody had read."""

from __future__ import annotations

from seed import Seed

REGISTRY = ("tests/unit/hw/test_registry.py",)

REVERSALS = ("tests/unit/friction/test_reversal_memory.py",)
POINTS = ("tests/unit/friction/test_points_check.py",)
INPUT = ("tests/unit/friction/test_log_input.py",)

SEEDS = (
    Seed(
        "a joint that a package declares is believed as it is",
        "hw/registry.py",
        "_rows(target, Joint, options, rig)",
        "list(_resolve(target)(options, rig))",
        REGISTRY,
    ),
    Seed(
        "a number that is none passes as one of a joint",
        "hw/registry.py",
        "isinstance(value, Real) and math.isfinite(value) and float(value) >= 0",
        "isinstance(value, Real) and not float(value) < 0",
        REGISTRY,
    ),
    Seed(
        "turns of one half alone are judged by the other",
        "rtctl/friction/logs/reversal_memory.py",
        "all(len(blocks) >= BLOCKS_MIN // 2 for blocks in turning)",
        "any(len(blocks) >= 0 for blocks in turning)",
        REVERSALS,
    ),
    Seed(
        "a velocity that was recorded is asked for",
        "rtctl/friction/logs/log_checks.py",
        "for stretches in logs for one in stretches if one.velocity_rad_s is None):",
        "for stretches in logs for one in stretches):",
        INPUT,
    ),
    Seed(
        "points at set speeds that agree by chance are copies",
        "rtctl/friction/logs/points_check.py",
        "again >= REPEATS_LEAST + CHANCE * by_chance",
        "again >= REPEATS_LEAST",
        POINTS,
    ),
    Seed(
        "points of two files are not copies",
        "rtctl/friction/logs/points_check.py",
        'if name != "log"]',
        'if name != "place"]',
        POINTS,
    ),
    Seed(
        "the end of a log in which the joint hardly moves bounds the lengths that are tried",
        "rtctl/friction/logs/turns.py",
        "return wide if sum(",
        "return wide if 0 > sum(",
        ("tests/unit/friction/test_presliding_in_logs.py",),
    ),
    Seed(
        "drives are stopped one by one, as they are learned",
        "hw/can/drive_backend.py",
        "            self._stop(bus)\n        for drive in self.drives:",
        "        for drive in self.drives:",
        ("tests/unit/hw/test_can_axes.py",),
    ),
    Seed(
        "the zero of one log is taken off another, and holds its joint",
        "rtctl/friction/logs/held_still.py",
        "np.abs(torque_nm - zeros[signals.log])",
        "np.abs(torque_nm - float(np.median(left)))",
        ("tests/unit/friction/test_second_logs.py",),
    ),
    Seed(
        "the contract asks no package for its joint",
        "rtctl/backend_contract/checks.py",
        "(registry.timing, registry.joint, registry.force_sensor)",
        "(registry.timing, registry.force_sensor)",
        ("tests/contract/test_contract_plugin.py",),
    ),
    Seed(
        "a constant that its bits do not hold is sent as another one",
        "hw/can/board_tables.py",
        'if self.channel == "constant" and abs(',
        'if self.channel == "none" and abs(',
        ("tests/unit/hw/test_can_constants.py",),
    ),
    Seed(
        "a board on a serial port sends a sample in every cycle, whatever its rate",
        "hw/serial/declared.py",
        "cycle_s = cycle_s if cycle_s > 1.001 * rig.period_s else rig.period_s",
        "cycle_s = rig.period_s",
        ("tests/unit/hw/test_declared.py",),
    ),
    Seed(
        "a force is of this tick, however old its device's samples may be",
        "rtctl/check/force_way.py",
        "age_ticks if says else 0",
        "0",
        ("tests/unit/cli/test_check_force_sensor.py",),
    ),
)
