"""Which tests run when: the one table of it. `tests/conftest.py` marks by it, `tests/run_tier.py` runs by it.

A file of tests either only computes, or meets a clock: it starts real-time loops, opens ptys, or talks
through sockets to what answers in its own time. Only-computing files run side by side; those that meet a
clock run in two streams, one file of each at a time, with nothing else beside them but what takes processor
time that nobody else wants.
"""

from __future__ import annotations

import re
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
    # of the law in a simulation; test_positioning_of_a_run.py has the clock
    "integration/test_positioning_on_the_loop.py",
)
"""Files in such folders that meet none: whatever they wait for may take minutes."""

PATIENT = (
    "contract",
    "integration/test_bench_of_a_composed_rig.py",
    "integration/test_bench_of_a_serial_cycle.py",
    "integration/test_can_run.py",  # at 100 Hz, armed again after a late cycle
    "integration/test_client_and_rig.py",
    "integration/test_event_log_of_a_run.py",
    "integration/test_first_steps.py",
    "integration/test_gateway_doors.py",
    "integration/test_gateway_roles.py",
    "integration/test_gateway_security.py",
    "integration/test_monitor_of_a_rig.py",
    "integration/test_operate_by_command_line.py",
    "integration/test_protocol_document.py",
    "integration/test_serial_rig.py",  # as test_can_run.py
    "integration/test_slow_end.py",
    "integration/test_view.py",
    "integration/test_view_of_the_daemon.py",
    "integration/test_view_streams.py",
    "integration/test_virtual_world_page.py",
    "integration/test_waiting_loop.py",
    "unit/cli/test_commissioning.py",
    "unit/hw/test_can_odrive_firmware.py",
)
"""Of what meets a clock, what only waits until something is so: it asks no loop to be punctual, and uses
little of a core. It is the second stream. The first has rigs that are attacked, killed, measured and held to
every tick."""

LONG = (
    "properties/test_control_environment.py",
    "properties/test_control_gate.py",
    "properties/test_friction_model.py",
    "properties/test_intermediate_passivity.py",
    "properties/test_messages.py",
    "properties/test_safety_invariants.py",
    "properties/test_safety_invariants_12_to_20.py",
    "properties/test_safety_machine.py",
    "unit/test_bench_wakeup.py",
    "unit/test_campaign_plants.py",
    "unit/test_delay_on_the_mock.py",
    "unit/test_family.py",
    "unit/test_force_that_lies.py",
    "unit/test_mock_rig_files.py",
    "unit/test_plain_words.py",
    "unit/test_playback_report.py",
    "unit/test_simulation.py",
    "unit/test_tiers.py",
    "unit/cli/test_check.py",
    "unit/cli/test_check_admittance.py",
    "unit/cli/test_check_followed_friction.py",
    "unit/cli/test_check_force_sensor.py",
    "unit/cli/test_check_friction.py",
    "unit/cli/test_check_plausibility.py",
    "unit/cli/test_fit.py",
    "unit/cli/test_fit_judge.py",
    "unit/cli/test_fit_observer_advice.py",
    "unit/cli/test_fit_points.py",
    "unit/cli/test_identify_log.py",
    "unit/cli/test_identify_log_of_a_linear_axis.py",
    "unit/cli/test_init.py",
    "unit/cli/test_linear_axis.py",
    "unit/cli/test_one_object_and_its_code.py",
    "unit/cli/test_playback_of_a_linear_axis.py",
    "unit/cli/test_plot_and_compare.py",
    "unit/cli/test_words_of_a_linear_rig.py",
    "unit/control/test_admittance_counts.py",
    "unit/control/test_admittance_help.py",
    "unit/control/test_admittance_margin.py",
    "unit/control/test_admittance_proof.py",
    "unit/control/test_admittance_sticking.py",
    "unit/control/test_assistance.py",
    "unit/control/test_display_changes.py",
    "unit/control/test_dry_friction.py",
    "unit/control/test_flicker.py",
    "unit/control/test_force_doubt.py",
    "unit/control/test_joints_of_other_sizes.py",
    "unit/control/test_law.py",
    "unit/control/test_observer_margin.py",
    "unit/control/test_observer_of_a_late_force.py",
    "unit/control/test_passivity.py",
    "unit/control/test_place_trust.py",
    "unit/control/test_running_current.py",
    "unit/control/test_running_delay.py",
    "unit/control/test_sampled_loop.py",
    "unit/control/test_states.py",
    "unit/control/test_take_back.py",
    "unit/control/test_virtual_mass.py",
    "unit/doctor/test_doctor_report.py",
    "unit/experiments/test_identification_experiment.py",
    "unit/experiments/test_positioning.py",
    "unit/friction/test_artefact.py",
    "unit/friction/test_band_of_one_log.py",
    "unit/friction/test_bands.py",
    "unit/friction/test_baselines.py",
    "unit/friction/test_between_speeds.py",
    "unit/friction/test_clipping.py",
    "unit/friction/test_dirt_of_programs.py",
    "unit/friction/test_dirty_logs.py",
    "unit/friction/test_drift.py",
    "unit/friction/test_drift_beside.py",
    "unit/friction/test_drift_by_place.py",
    "unit/friction/test_drift_change.py",
    "unit/friction/test_drift_here.py",
    "unit/friction/test_drift_on_the_family.py",
    "unit/friction/test_drift_window.py",
    "unit/friction/test_even_motion.py",
    "unit/friction/test_evidence_page.py",
    "unit/friction/test_failed_fits.py",
    "unit/friction/test_folds.py",
    "unit/friction/test_foreign_clocks.py",
    "unit/friction/test_followed_drift.py",
    "unit/friction/test_honest_scoring.py",
    "unit/friction/test_learn_places.py",
    "unit/friction/test_left_over.py",
    "unit/friction/test_load.py",
    "unit/friction/test_mean.py",
    "unit/friction/test_models_of_a_linear_axis.py",
    "unit/friction/test_nested.py",
    "unit/friction/test_other_makes.py",
    "unit/friction/test_presliding_in_logs.py",
    "unit/friction/test_processed_logs.py",
    "unit/friction/test_regression.py",
    "unit/friction/test_report.py",
    "unit/friction/test_report_command.py",
    "unit/friction/test_reversal_memory.py",
    "unit/friction/test_search.py",
    "unit/friction/test_sentences.py",
    "unit/friction/test_torque_shape.py",
    "unit/friction/test_truth_of_intervals.py",
    "unit/friction/test_two_clocks.py",
    "unit/host/test_flight_recorder.py",
    "unit/host/test_friction_watch.py",
    "unit/host/test_probe.py",
    "unit/host/test_telemetry.py",
    "unit/host/test_why_waiting.py",
    "unit/hw/test_can_steady.py",
    "unit/hw/test_compile_key.py",
    "unit/hw/test_entry_points.py",
    "unit/hw/test_fault_schedules.py",
    "unit/hw/test_mock_hand.py",
    "unit/hw/test_mock_joint.py",
    "unit/hw/test_mock_points.py",
    "unit/hw/test_mock_sensors.py",
    "unit/hw/test_other_layouts.py",
    "unit/hw/test_serial_described.py",
    "unit/hw/test_serial_frame_damage.py",
    "unit/hw/test_undefined_symbols.py",
    "unit/identify/test_bristles.py",
    "unit/identify/test_cogging_joint.py",
    "unit/identify/test_dataset.py",
    "unit/identify/test_difficult_joints.py",
    "unit/identify/test_identify_a_linear_axis.py",
    "unit/identify/test_light_joint.py",
    "unit/identify/test_place_rows.py",
    "unit/identify/test_session.py",
    "unit/recording/test_incident.py",
    "unit/recording/test_recorder.py",
    "unit/recording/test_recording_files.py",
    "unit/recording/test_recordings_as_logs.py",
    "unit/recording/test_replay.py",
    "unit/recording/test_shadow.py",
)
"""Unit tests and properties that `make check` leaves to `make test`: files that take more than a second and a
half of a core, once all is compiled. `make check` names those of its own that do; what takes less than one
again, leaves the table."""

QUICK_S = 1.5
"""Processor time of a file of tests that `make check` runs, at most."""

_SAID = re.compile(r"^ *([\d.]+) s of a core: (\S+\.py)$", re.MULTILINE)


def said_of(name: str, used_s: float) -> str:
    """The line of a session of pytest about a file that was not quick."""
    return f"{used_s:6.1f} s of a core: {name}"


def not_quick(text: str) -> list[str]:
    """Files that a session of pytest said such a line of, and that no table says it of."""
    named = ((float(used_s), name) for used_s, name in _SAID.findall(text))
    return [said_of(name, used_s) for used_s, name in named if is_quick(TESTS / name)]


def name_of(path: Path) -> str:
    """As the tables name it: from here on; empty if it is elsewhere."""
    path = path.resolve()
    return path.relative_to(TESTS).as_posix() if path.is_relative_to(TESTS) else ""


def _is_below(path: Path, names: tuple[str, ...]) -> bool:
    inside = name_of(path)
    return any(inside == name or inside.startswith(f"{name}/") for name in names)


def meets_a_clock(path: Path) -> bool:
    """Whether this file of tests must not run beside busy others."""
    return _is_below(path, MEETS_A_CLOCK) and not _is_below(path, ONLY_COMPUTES)


def is_patient(path: Path) -> bool:
    """Whether this file, which meets a clock, may meet it beside another one that does."""
    return meets_a_clock(path) and _is_below(path, PATIENT)


def every_file() -> list[Path]:
    """All files of tests, folder by folder. What is marked `system` in them, pytest leaves to
    `make test-system`.
    """
    return sorted(TESTS.rglob("test_*.py"), key=lambda path: (path.parent, path))


def is_quick(path: Path) -> bool:
    """Whether `make check` runs this file: unit tests and properties that are done in seconds."""
    return _is_below(path, ("unit", "properties")) and not meets_a_clock(path) and not _is_below(path, LONG)
