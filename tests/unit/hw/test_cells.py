"""Cells of text tables that are no bare numbers, rows that are none of the table's, counters that start
over.
"""

import json

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
        (["2024-10-27T02:59:59.5+02:00", "2024-10-27T02:00:00.5+01:00"], [10799.5, 10800.5]),
        (["20240307T235959.5Z", "20240308T000000,5Z"], [86399.5, 86400.5]),
        (["02:02:11 PM", "02:02:12 PM"], [50531, 50532]),
        (["12:00:00 AM", "12:00:01 AM"], [0, 1]),
        (["2024-03-07T14:02:11.250+0100", "2024-03-07T14:02:12.250+0100"], [50531.25, 50532.25]),
        (["26-Oct-2025 14:02:11.5", "26 Oktober 2025 14:02:12,5"], [50531.5, 50532.5]),
        (["2026-03-02 17:59:59", "2026-03-03 08:00:00"], [64799, 115200]),
        (["2026-03-02 10:00:00", "2026-03-03 10:00:01", "2026-03-03 10:00:02"], [36000, 122401, 122402]),
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


def test_settings_that_name_the_columns_are_no_header(tmp_path):
    path = tmp_path / "run.dat"
    rows = "".join(f"{k} {k}.5 {2 * k} 20\n" for k in range(20))
    path.write_text(f"# columns: t q tau\n# kt = 0.05\n# t q tau temp\n{rows}")
    table = read_table(path, ("t", "q", "tau"))
    assert table.columns["t"][3] == 3
    assert table.columns["tau"][3] == 6


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
        assert told == f"a counter of {bits} bits"
        assert np.diff(found).tolist() == np.diff(stamps).tolist()
    back = stamps.copy()
    back[200:] -= 150_000
    assert unwrapped(back)[1] == ""
    assert unwrapped(stamps)[1] == ""


@pytest.mark.parametrize(("unit", "per_s"), [("s", 1.0), ("ms", 1e3), ("us", 1e6)])
def test_the_time_of_the_day_goes_on_past_midnight(unit, per_s):
    t = np.arange(0.0, 20.0, 0.002)
    found, told = unwrapped(np.mod(t + 86390.0, 86400.0) * per_s)
    assert f"midnight is in the log), in {unit}" in told
    assert np.allclose(np.diff(found) / per_s, 0.002, atol=1e-9)


def test_a_clock_that_was_set_back_is_no_midnight():
    t = np.arange(0.0, 20.0, 0.002)
    for stamps in (np.where(t > 10, t - 3600, t) + 50_000, np.mod(t + 43190.0, 43200.0)):
        assert unwrapped(stamps)[1] == ""


@pytest.mark.parametrize(
    ("text", "delimiter"),
    [
        ("t;x\n999,5;0,25\n1.000,5;-0,5\n1.001,5;1.234,75\n", ";"),
        ('t,x\n999.5,0.25\n"1,000.5",-0.5\n"1,001.5","1,234.75"\n', ","),
        ("t\tx\n999.5\t0.25\n1'000.5\t-0.5\n1'001.5\t1'234.75\n", "\t"),
    ],
)
def test_marks_between_thousands_are_told_from_those_before_decimals(tmp_path, text, delimiter):
    path = tmp_path / "log.csv"
    path.write_text(text)
    found = read_table(path, ("t", "x")).columns
    assert found["t"].tolist() == [999.5, 1000.5, 1001.5]
    assert found["x"].tolist() == [0.25, -0.5, 1234.75]


@pytest.mark.parametrize(
    "text", ["t;x\n1;1.234\n2;0,5\n", "t;x\n1.234;0,5\n1.235;0,25\n", "t;x\n0.999;0,5\n1.000;2,5\n"]
)
def test_a_mark_that_may_be_either_is_not_guessed(tmp_path, text):
    path = tmp_path / "log.csv"
    path.write_text(text)
    with pytest.raises(BackendError, match="not a number"):
        read_table(path, ("t", "x"))


def test_zeros_of_a_file_that_was_not_closed_are_no_row(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,x\n0,1\n1,2\n" + "\0" * 512)
    assert read_table(path, ("t", "x")).columns["x"].tolist() == [1, 2]


def test_thousands_are_marked_as_the_swiss_do_and_hexadecimal_as_controllers_do(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t;x;y\n5\u2019000;1.5;16#001F\n1\u2019006\u2019000;2.5;16#FFFF\n", encoding="utf-8")
    found = read_table(path, ("t", "x", "y")).columns
    assert found["t"].tolist() == [5000, 1006000]
    assert found["y"].tolist() == [31, 65535]
    path.write_text("t,x\n0,0000006B\n1,FFFFFF01\n")
    with pytest.raises(BackendError, match="hexadecimal"):
        read_table(path, ("t", "x"))


@pytest.mark.parametrize(
    ("text", "decimal"),
    [
        ("t;x\n1.000;0,5\n1.001;1.234,75\n", ","),
        ("t;x\n1,000;0.5\n1,001;1,234.75\n", "."),
    ],
)
def test_the_mark_that_is_not_before_decimals_is_between_thousands(tmp_path, text, decimal):
    path = tmp_path / "log.csv"
    path.write_text(text)
    found = read_table(path, ("t", "x"), decimal=decimal).columns
    assert found["t"].tolist() == [1000, 1001]
    assert found["x"].tolist() == [0.5, 1234.75]


def test_a_point_that_is_neither_is_refused_where_commas_were_said(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t;x\n0.5;0,5\n0.75;0,75\n")
    with pytest.raises(BackendError, match=r"'0\.5' is not a number"):
        read_table(path, ("t", "x"), decimal=",")
    with pytest.raises(BackendError, match=r"'0,5' is not a number .*--decimal comma"):
        read_table(path, ("t", "x"))


def test_a_date_that_is_none_is_no_number(tmp_path):
    stamps = np.array(["NaT", "2026-01-01T00:00:01", "NaT", "2026-01-01T00:00:03"], dtype="datetime64[us]")
    np.savez(tmp_path / "log.npz", t=stamps, x=np.arange(4.0))
    with pytest.raises(BackendError, match=r"'t' row 1: nan is not a finite number \(2 such cells\)"):
        read_table(tmp_path / "log.npz", ("t", "x"))
    np.savez(tmp_path / "log.npz", t=stamps[:1].repeat(4), x=np.arange(4.0))
    with pytest.raises(BackendError, match=r"\(4 such cells\)"):
        read_table(tmp_path / "log.npz", ("t", "x"))


def test_a_name_without_its_unit_is_not_said_to_stand_in_the_rows(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t [s],vel [rad/s]\n0,1\n1,2\n")
    with pytest.raises(BackendError) as refused:
        read_table(path, ("t [s]", "vel"))
    assert str(refused.value).endswith("no column 'vel'; the header has: t [s], vel [rad/s]")


def test_a_quoted_cell_with_the_delimiter_in_it_shifts_nothing_however_far_down_it_stands(tmp_path):
    path = tmp_path / "log.csv"
    rows = [f"{k},ok,{k}" for k in range(20)]
    rows[15] = '15,"slipped, 777, by hand",15'
    path.write_text("\n".join(["t,note,q", *rows]))
    assert read_table(path, ("t", "q")).columns["q"].tolist() == list(range(20))


def test_python_s_own_way_to_write_a_number_is_none_of_a_log(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t;q\n0;1\n1;1_5\n2;3\n")
    with pytest.raises(BackendError, match=r"column 'q' row 2: '1_5' is not a number"):
        read_table(path, ("t", "q"))


def test_the_place_before_the_first_is_not_the_last_one(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("".join(f"{k},{k},9\n" for k in range(8)))
    with pytest.raises(BackendError, match=r"no column '#0'"):
        read_table(path, ("#1", "#0"))


def test_a_typographic_minus_and_the_exponents_of_fortran_are_read(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,q,x\n0,\u22120.5,1.5D-03\n1,2e\u221203,\u22121.D+02\n")
    found = read_table(path, ("t", "q", "x")).columns
    assert found["q"].tolist() == [-0.5, 0.002]
    assert found["x"].tolist() == [0.0015, -100]
    path.write_text("t,q\n0,12D4\n1,1300\n")  # may be hexadecimal
    with pytest.raises(BackendError, match="hexadecimal"):
        read_table(path, ("t", "q"))


def messages(begin, between=" ", rows=40):
    return "".join(f"{begin(k)}pos={k}.5{between}iq={2 * k}\n" for k in range(rows))


@pytest.mark.parametrize(
    ("begin", "between", "second"),
    [
        (lambda k: f"[{1000 + 2 * k}] ", " ", 1002),
        (lambda k: f"2026-11-28 15:02:{k:02d},250 - rig.motor - INFO - ", " ", 54121.25),
        (lambda k: f"15:02:{k:02d}.5 motor ", ", ", 54121.5),
    ],
    ids=["printf", "logging of Python", "a time of day"],
)
def test_values_in_messages_are_columns_by_their_names_and_what_they_begin_with_is_the_stamp(
    tmp_path, begin, between, second
):
    path = tmp_path / "uart.log"
    path.write_text("\0boot v1.2 clk=168MHz\nadc cal ok\n" + messages(begin, between) + "WARN: dma overrun\n")
    table = read_table(path, ("stamp", "pos", "iq"))
    assert table.columns["pos"].tolist() == [k + 0.5 for k in range(40)]
    assert table.columns["iq"][-1] == 78
    assert table.columns["stamp"][1] == pytest.approx(second)


def test_a_message_that_was_cut_off_is_told_and_numbers_without_a_name_are_no_message(tmp_path):
    path = tmp_path / "uart.log"
    text = messages(lambda k: f"[{k}] ")
    path.write_text(text + "[40] pos=3\n[41] pos=41.5 iq=82\n")
    with pytest.raises(BackendError, match="row 41"):
        read_table(path, ("stamp", "pos", "iq"))
    path.write_text("t,x,state\n" + "".join(f"{k / 100},0.0,id:5\n" for k in range(300)))
    assert len(read_table(path, ("t", "x")).columns["x"]) == 300


def test_a_stamp_of_ros_in_two_parts_is_one_number_of_seconds(tmp_path):
    path = tmp_path / "bag.json"
    rows = ({"header": {"stamp": {"sec": 1764342131, "nanosec": 2_000_000 * k}}, "q": [k]} for k in range(9))
    path.write_text("\n".join(map(json.dumps, rows)))
    stamps = read_table(path, ("header.stamp", "q#1")).columns["header.stamp"]
    assert np.diff(stamps) == pytest.approx(2e-3, abs=1e-6)
    assert read_table(path, ("header.stamp.sec",)).columns["header.stamp.sec"][0] == 1764342131


def test_a_table_of_r_has_quoted_names_between_blanks(tmp_path):
    path = tmp_path / "r.txt"
    rows = "".join(f'"{k + 1}" {k} {k}.5 {2 * k}\n' for k in range(20))
    path.write_text('"t" "motor angle" "tau"\n' + rows.replace('" ', '"   '))
    with pytest.raises(BackendError, match=r"R writes one.*by their places \(#2\)"):
        read_table(path, ("t", "motor angle", "tau"))
    assert read_table(path, ("#2", "#3", "#4")).columns["#3"][3] == 3.5
    path.write_text('"row" "t"  "motor angle" "tau"\n' + rows)
    assert read_table(path, ("t", "motor angle", "tau")).columns["tau"][3] == 6


@pytest.mark.parametrize("cell", ["02:11.1", "28.11.2026 15:02"])
def test_a_time_whose_ms_a_spreadsheet_lost_is_told_as_that(tmp_path, cell):
    path = tmp_path / "log.csv"
    path.write_text("t,x\n" + "".join(f"{cell},{k}\n" for k in range(20)))
    with pytest.raises(BackendError, match=r"whose ms are lost.* --rate-hz"):
        read_table(path, ("t", "x"))
