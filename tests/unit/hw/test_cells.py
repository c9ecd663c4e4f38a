"""Cells of text tables that are no bare numbers, rows that are none of the table's, counters that start over."""

import numpy as np
import pytest

from hw.interface import BackendError
from hw.playback.cells import read_words
from hw.playback.columns import read_table
from hw.playback.stamps import unwrapped


@pytest.mark.parametrize(
    ("cells", "numbers"),
    [
        (["14:02:11.250", "14:02:11.500"], [50531.25, 50531.5]),
        (["2024-03-07 23:59:59.5", "2024-03-08 00:00:00.5"], [86399.5, 86400.5]),
        (["2024-03-07T14:02:11.250Z", "2024-03-07T14:02:12.250+01:00"], [50531.25, 50532.25]),
        (["02:02:11 PM", "02:02:12 PM"], [50531, 50532]),
        (["12:00:00 AM", "12:00:01 AM"], [0, 1]),
        (["14:02:11;250", "14:02:11;251"], [50531.25, 50531.251]),
        (["07.03.2024 14:02:11,250", "07.03.2024 14:02:11,251"], [50531.25, 50531.251]),
    ],
)
def test_times_of_day_are_seconds_that_go_on_past_midnight(cells, numbers):
    found = read_words(cells, ".")
    assert found.unit == "s"
    assert found.numbers == pytest.approx(numbers, abs=1e-9)


@pytest.mark.parametrize(
    "cells", [["14:02", "14:03"], ["overflow", "1"], ["", ""], ["1 s", "2 ms"], ["14:02:11", "1"]]
)
def test_words_that_say_nothing_in_one_unit_are_none(cells):
    assert read_words(cells, ".") is None


def test_a_unit_behind_every_number_is_held_against_the_unit_that_is_given(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,x\n" + "".join(f"{k} ms,{k}.5 deg\n" for k in range(20)))
    table = read_table(path, ("t", "x"))
    assert table.columns["x"][3] == 3.5
    assert table.units["t"] == "ms"
    assert table.units["x"] == "deg"


def test_a_word_far_down_a_column_of_words_is_named_by_its_row(tmp_path):
    path = tmp_path / "log.csv"
    rows = [f"14:02:{k:02d}.5,{k}" for k in range(50)]
    rows[37] = "never,37"
    path.write_text("t,x\n" + "\n".join(rows) + "\n")
    with pytest.raises(BackendError, match="'t' row 38: 'never'"):
        read_table(path, ("t", "x"))


def test_a_fault_below_unit_rows_is_a_fault_and_no_unit(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,x,y\n0,1,1\nms,rad,Nm\n2,3,3\n")
    with pytest.raises(BackendError, match="'t' row 2: 'ms'"):
        read_table(path, ("t", "x", "y"))


def test_a_fault_in_the_first_row_of_numbers_is_a_fault_and_no_unit(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,x\n0,overflow\n1,1\n2,3\n")
    with pytest.raises(BackendError, match="'x' row 1: 'overflow'"):
        read_table(path, ("t", "x"))


def test_rows_of_another_topic_are_passed_over_and_a_column_with_holes_is_not(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,x,y\n0,1,2\n1,,\n2,3,4\n3,,\n")
    assert read_table(path, ("t", "x", "y")).columns["t"].tolist() == [0, 2]
    path.write_text("t,x,y\n0,1,2\n1,,5\n2,3,4\n")
    with pytest.raises(BackendError, match=r"'x' row 2.*an empty cell.*two topics"):
        read_table(path, ("t", "x", "y"))


def test_a_counter_is_continued_only_where_it_explains_every_step_back():
    stamps = np.arange(0.0, 300.0) * 1000
    for bits in (16, 32):
        over = (stamps + 2**bits - 50_000) % 2**bits
        found, told = unwrapped(over)
        assert told == bits
        assert np.diff(found).tolist() == np.diff(stamps).tolist()
    back = stamps.copy()
    back[200:] -= 150_000
    assert unwrapped(back)[1] == 0
    assert unwrapped(stamps)[1] == 0
