"""Seeded bugs of a new user who ran every printed command: what a script or a person is told at the end."""

from __future__ import annotations

from seed import Seed

SAID = "tests/unit/cli/test_one_object_and_its_code.py::test_"

PLOT = "tests/unit/cli/test_plot_and_compare.py::test_"

SEEDS = (
    Seed(
        "a demonstration that was stopped before its figures is a success",
        "rtctl/cli/demo.py",
        "130 if not all(one.count for one in demo.phases) else 0",
        "0",
        (f"{SAID}a_demonstration_that_was_stopped_has_no_figure",),
    ),
    Seed(
        "an object of a command that failed has no exit code",
        "rtctl/cli/json_text.py",
        "if code and isinstance(body, dict)",
        "if not body",
        (f"{SAID}what_ends_in_a_no_says_so_in_its_object",),
    ),
    Seed(
        "a fault that is due for ever may come again",
        "hw/fault_options.py",
        "if (seconds or ticks) and",
        "if False and",
        ("tests/unit/hw/test_fault_options.py::test_a_bad_fault_is_refused_with_key_value_and_bound",),
    ),
    Seed(
        "a rig is opened to every network of its machine",
        "rtctl/rig_file/host_tables.py",
        "if address is None or address.is_unspecified:",
        "if address is None:",
        ("tests/unit/test_config.py::test_what_would_open_the_rig_to_others_is_refused_with_its_key",),
    ),
    Seed(
        "a package whose options are none is believed",
        "hw/registry.py",
        'if not hasattr(model, "model_validate"):',
        "if not model:",
        ("tests/unit/hw/test_registry.py::test_a_mistake_in_a_third_partys_package_is_named_with_its_line",),
    ),
    Seed(
        "a driver that cannot be made keeps the others under torque",
        "rtctl/host/safe_stop.py",
        "    except BackendError as error:\n        return _Unmade(member, error)",
        "    except OSError as error:\n        return _Unmade(member, error)",
        (
            "tests/unit/host/test_safe_stop.py"
            "::test_a_driver_that_cannot_be_made_is_named_and_keeps_no_other_under_torque",
        ),
    ),
    Seed(
        "a torque that was not measured counts as none",
        "rtctl/recording/panels.py",
        "np.where(count, square / np.maximum(count, 1), np.nan)",
        "square / len(values)",
        (f"{PLOT}only_ticks_at_work_count_and_nan_counts_as_nothing",),
    ),
)
