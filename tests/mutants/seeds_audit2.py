"""Seeded bugs of an engineer who came new: what a page, a bound or a reload says is not what is so."""

from __future__ import annotations

from seed import Seed

RELOAD = "tests/unit/host/test_reload.py::test_"
SERVICE = "tests/unit/cli/test_service_again.py::test_"

SEEDS = (
    Seed(
        "a model learned anew under its name is no change to a reload",
        "rtctl/host/reload.py",
        "if old != new]",
        "if not old]",
        (f"{RELOAD}a_model_that_was_learned_anew_under_its_name_is_told",),
    ),
    Seed(
        "a recording has the model that is in the file by now",
        "rtctl/recording/setup.py",
        '("application/json", content)',
        '("application/json", loaded.model_path(axis).read_bytes())',
        (f"{RELOAD}a_plan_knows_what_it_read_of_each_model",),
    ),
    Seed(
        "the largest coupling that check tells is refused",
        "rtctl/check/verdicts_of_loop.py",
        'f"k_c up to {down(axis.sampled_data_k_max_nm_rad, 4)} N m/rad',
        'f"k_c up to {axis.sampled_data_k_max_nm_rad:.4g} N m/rad',
        ("tests/unit/cli/test_check.py::test_the_largest_coupling_that_is_told_passes",),
    ),
    Seed(
        "the shipped file is copied in place of one's own",
        "rtctl/simulation/shipped_files.py",
        "(own.name == source or not own.is_file() or own.samefile(theirs))",
        "True",
        ("tests/unit/cli/test_init.py::test_a_path_is_ones_own_file_and_a_rig_is_renamed_by_it",),
    ),
    Seed(
        "the name of an axis is taken for that of the rig",
        "rtctl/simulation/shipped_files.py",
        "if tomllib.loads(text) != _replaced(wanted, other):",
        "if False:",
        ("tests/unit/cli/test_init.py::test_a_file_of_ones_own_that_is_written_otherwise_is_refused",),
    ),
    Seed(
        "a fit asks for the models of other axes",
        "rtctl/check/observer_advice.py",
        "report = stability_report.examine_axis(with_it, index, None, telling=False)",
        "report = stability_report.examine(with_it, telling=False).axes[index]",
        ("tests/unit/cli/test_fit_observer_advice.py::test_the_models_of_other_axes_need_not_be_there_yet",),
    ),
    Seed(
        "the largest gain that fit tells fails its own test",
        "rtctl/friction/gain.py",
        "math.floor(1e3 * gain)",
        "round(1e3 * gain)",
        ("tests/unit/cli/test_fit_observer_advice.py::test_the_largest_gain_that_is_told_passes",),
    ),
    Seed(
        "a service keeps the network that an earlier rig file asked for",
        "rtctl/host/service_steps.py",
        "if path.exists() and path not in wanted]",
        "if path in wanted]",
        (f"{SERVICE}what_an_earlier_rig_file_asked_for_is_taken_away_and_nothing_else",),
    ),
    Seed(
        "the room that a recording leaves is told in other units than it is given in",
        "rtctl/recording/parts.py",
        "self._limits.free_bytes / 1e6",
        "self._limits.free_bytes / (1 << 20)",
        (
            "tests/unit/recording/test_recorder.py::test_a_full_disk_marks_the_recording_broken_and_a_new_file_follows",
        ),
    ),
    Seed(
        "an installation over a daemon that runs says nothing of it",
        "rtctl/cli/service.py",
        "        if runs_on:\n",
        "        if made.stale:\n",
        (f"{SERVICE}a_daemon_that_runs_is_said_to_run_on_as_it_was_started",),
    ),
)
