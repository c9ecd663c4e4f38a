"""Seeded bugs in how the logs of a third outsider are read (decision 0161)."""

from __future__ import annotations

from seed import Seed

BESIDE = "tests/unit/hw/test_units_of_attributes.py"
CELLS = "tests/unit/hw/test_cells.py"
FORMATS = "tests/unit/hw/test_strange_tables.py"
LOST = "tests/unit/friction/test_lost_rows.py"

POINTS = "tests/unit/cli/test_fit_points.py"
CHECK = "tests/unit/friction/test_points_check.py"

BAG = "tests/unit/recording/test_joint_states.py"
JUDGE = "tests/unit/cli/test_fit_judge.py"

SEEDS = (
    Seed(
        "rows that are missing again and again are those of a slower device",
        "rtctl/friction/logs/lost_rows.py",
        "if len(some) > MOST_LOST and",
        "if len(some) > 10**9 and",
        (f"{LOST}::test_rows_that_are_missing_again_and_again_are_told",),
    ),
    Seed(
        "two rows of twelve that are missing are those of a slower device",
        "rtctl/friction/logs/lost_rows.py",
        "(ways >= 2)",
        "(ways == 2)",
        (f"{LOST}::test_rows_that_are_missing_again_and_again_are_told",),
    ),
    Seed(
        "stamps that tell of lost rows are no help",
        "rtctl/friction/logs/lost_rows.py",
        "velocity = np.diff(position_rad) / step_s",
        "velocity = np.diff(position_rad) / np.median(step_s)",
        (f"{LOST}::test_stamps_that_tell_of_the_lost_rows_are_right",),
    ),
    Seed(
        "an angle that starts over in the first rows is left as it is",
        "rtctl/friction/logs/row_faults.py",
        'size=_window(rows), mode="mirror")',
        'size=_window(rows), mode="nearest")',
        (f"{LOST}::test_an_angle_may_start_over_in_any_row",),
    ),
    Seed(
        "a unit beside a column in a MATLAB structure is not looked at",
        "hw/playback/matlab.py",
        "return Table(found, units_beside(found, spelt))",
        "return Table(found)",
        (f"{BESIDE}::test_a_torque_of_which_the_file_says_another_unit_is_refused",),
    ),
    Seed(
        "words of an HDF5 file are references",
        "hw/playback/matlab_hdf.py",
        "elif self.h5py.check_ref_dtype(item.dtype):",
        "elif item.dtype == self.h5py.ref_dtype:",
        (f"{BESIDE}::test_a_torque_of_which_the_file_says_another_unit_is_refused",),
    ),
    Seed(
        "a unit beside several arrays is that of the first",
        "hw/playback/units.py",
        "if len(series) == 1 else {}",
        "if series else {}",
        (f"{BESIDE}::test_a_unit_beside_several_arrays_is_of_none",),
    ),
    Seed(
        "decimal commas in a binary file are points",
        "hw/playback/spelt_out.py",
        "words = read_cells(cells, marks)",
        'words = read_cells(cells, ".")',
        (f"{FORMATS}::test_numbers_that_were_saved_as_text_are_read_as_in_a_text_table",),
    ),
    Seed(
        "settings above a table are values with their names",
        "hw/playback/text_rows.py",
        "if not names or any(_labels(line)[0] != names for line in first[1:-1]):",
        "if not names:",
        (f"{FORMATS}::test_settings_with_names_above_a_table_are_no_values",),
    ),
    Seed(
        "a D of hexadecimal is an exponent",
        "hw/playback/cells.py",
        "[dD](?=[-+]\\d{1,3}$)",
        "[dD](?=[-+]?\\d{1,3}$)",
        (f"{CELLS}::test_a_typographic_minus_and_the_exponents_of_fortran_are_read",),
    ),
    Seed(
        "a run whose torque is clipped is a point",
        "rtctl/friction/logs/runs.py",
        "if share > STANDS and size.max() == top:",
        "if False:",
        (f"{POINTS}::test_a_run_whose_torque_ends_at_a_limit_is_refused",),
    ),
    Seed(
        "a torque that is commanded and constant is clipped",
        "rtctl/friction/logs/runs.py",
        "if np.median(stands) > STANDS:",
        "if False:",
        (f"{POINTS}::test_a_run_whose_torque_ends_at_a_limit_is_refused",),
    ),
    Seed(
        "a point of quiet rows scatters by them alone",
        "rtctl/friction/logs/points_check.py",
        "elif (scatter := _scatter(points)) > UNEVEN:",
        "elif not np.isfinite(points.std_nm).any() and (scatter := _scatter(points)) > UNEVEN:",
        (f"{CHECK}::test_a_zero_that_wanders_from_run_to_run_scatters_however_quiet_each_run_is",),
    ),
    Seed(
        "messages of a bag that overtook each other stay as they came",
        "rtctl/recording/joint_states.py",
        "if near else states",
        "if False else states",
        (f"{BAG}::test_messages_that_overtook_each_other_are_in_the_order_of_their_stamps",),
    ),
    Seed(
        "a clock that was set back mixes two runs",
        "rtctl/recording/joint_states.py",
        "if near else states",
        "if True else states",
        (f"{BAG}::test_a_clock_that_was_set_back_mixes_no_two_runs",),
    ),
    Seed(
        "points within the temperatures of a model are warmer",
        "rtctl/friction/learn/report_judged_cause.py",
        "over_k = mean - min(max(mean, low), high)",
        "over_k = mean + 10",
        (f"{JUDGE}::test_points_warmer_than_any_before_are_told_so",),
    ),
    Seed(
        "a number in front of each row moves all columns",
        "hw/playback/text_table.py",
        "if fewest > header:",
        "if False:",
        (f"{FORMATS}::test_rows_of_more_cells_than_there_are_names_are_refused",),
    ),
    Seed(
        "a footer is a column of another rate",
        "hw/playback/text_table.py",
        "first = min(first or (wrong, at, name), (wrong, at, name))",
        "first = max(first or (wrong, at, name), (wrong, at, name))",
        (f"{FORMATS}::test_a_footer_is_told_as_one",),
    ),
)
