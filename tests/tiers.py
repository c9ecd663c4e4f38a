"""Which tests run when: the one table of it. `tests/conftest.py` marks by it, `tests/run_tier.py` runs by it.

A file of tests either only computes, or meets a clock: it starts real-time loops, opens ptys, or talks through
sockets to what answers in its own time. Only-computing files run side by side; those that meet a clock run one
after the other, with nothing beside them but what takes processor time that nobody else wants.
"""

from __future__ import annotations

from pathlib import Path

TESTS = Path(__file__).resolve().parent

MEETS_A_CLOCK = (
    "attacks",
    "contract",
    "integration",
    "system",
    "unit/cli/test_commissioning.py",
    "unit/hw/test_can_odrive_firmware.py",
)
"""Folders and files, below `tests`."""

ONLY_COMPUTES = (
    "attacks/test_compiled_code_of_another_user.py",
    "attacks/test_files_of_strangers.py",
    "attacks/test_recordings_of_strangers.py",
    "attacks/test_table.py",
    "contract/test_backend_contract.py",  # in step with what plays the device
    "contract/test_can_contract.py",
    "contract/test_fault_matrix.py",  # in step, too
    "contract/test_force_sensors.py",
    "contract/test_makers_bota.py",
    "contract/test_makers_cantools.py",
    "contract/test_makers_installed.py",
    "contract/test_makers_libraries.py",
    "contract/test_makers_random.py",
    "integration/test_first_start.py",  # compiles everything, and waits for that as long as it takes
    "integration/test_identify_simulated.py",
    "integration/test_run_refused.py",
    "integration/test_positioning_on_the_loop.py",  # of the law in a simulation; test_positioning_of_a_run.py has the clock
)
"""Files in such folders that meet none: whatever they wait for may take minutes."""

LONG = (
    "properties/test_control_environment.py",
    "properties/test_intermediate_passivity.py",
    "properties/test_messages.py",
    "properties/test_safety_invariants.py",
    "properties/test_safety_invariants_12_to_20.py",
    "properties/test_safety_machine.py",
    "unit/cli/test_check.py",
    "unit/cli/test_check_followed_friction.py",
    "unit/cli/test_check_plausibility.py",
    "unit/cli/test_check_friction.py",
    "unit/cli/test_fit.py",
    "unit/cli/test_plot_and_compare.py",
    "unit/control/test_assistance.py",
    "unit/control/test_dry_friction.py",
    "unit/control/test_observer_margin.py",
    "unit/control/test_running_delay.py",
    "unit/control/test_sampled_loop.py",
    "unit/doctor/test_doctor_report.py",
    "unit/experiments/test_experiment_parts.py",
    "unit/experiments/test_identification_experiment.py",
    "unit/experiments/test_positioning.py",
    "unit/friction/test_artefact.py",
    "unit/friction/test_dirty_logs.py",
    "unit/friction/test_drift.py",
    "unit/friction/test_drift_on_the_family.py",
    "unit/friction/test_evidence_page.py",
    "unit/friction/test_failed_fits.py",
    "unit/friction/test_folds.py",
    "unit/friction/test_followed_drift.py",
    "unit/friction/test_honest_scoring.py",
    "unit/friction/test_left_over.py",
    "unit/friction/test_other_makes.py",
    "unit/friction/test_report.py",
    "unit/friction/test_report_command.py",
    "unit/friction/test_search.py",
    "unit/friction/test_sentences.py",
    "unit/friction/test_tables.py",
    "unit/host/test_flight_recorder.py",
    "unit/host/test_probe.py",
    "unit/hw/test_mock_hand.py",
    "unit/hw/test_mock_joint.py",
    "unit/hw/test_mock_points.py",
    "unit/hw/test_mock_sensors.py",
    "unit/hw/test_other_layouts.py",
    "unit/hw/test_serial_asked.py",
    "unit/hw/test_serial_described.py",
    "unit/hw/test_serial_frame.py",
    "unit/hw/test_serial_frame_damage.py",
    "unit/hw/test_serial_rig_files.py",
    "unit/identify/test_bristles.py",
    "unit/identify/test_dataset.py",
    "unit/identify/test_difficult_joints.py",
    "unit/identify/test_session.py",
    "unit/recording/test_export.py",
    "unit/recording/test_incident.py",
    "unit/recording/test_other_readers.py",
    "unit/recording/test_recorder.py",
    "unit/recording/test_replay.py",
    "unit/test_delay_on_the_mock.py",
    "unit/test_playback_report.py",
)
"""Unit tests and properties that `make check` leaves to `make test`: each file takes two seconds of a core or more."""


def _is_below(path: Path, names: tuple[str, ...]) -> bool:
    path = path.resolve()
    inside = path.relative_to(TESTS).as_posix() if path.is_relative_to(TESTS) else ""
    return any(inside == name or inside.startswith(f"{name}/") for name in names)


def meets_a_clock(path: Path) -> bool:
    """Whether this file of tests must not run beside busy others."""
    return _is_below(path, MEETS_A_CLOCK) and not _is_below(path, ONLY_COMPUTES)


def every_file() -> list[Path]:
    """All files of tests, folder by folder. What is marked `system` in them, pytest leaves to `make test-system`."""
    return sorted(TESTS.rglob("test_*.py"), key=lambda path: (path.parent, path))


def is_quick(path: Path) -> bool:
    """Whether `make check` runs this file: unit tests and properties that are done in seconds."""
    return _is_below(path, ("unit", "properties")) and not meets_a_clock(path) and not _is_below(path, LONG)
