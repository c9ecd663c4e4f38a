"""Tables that programs of others write strangely: numbers as text, names before each value, rows that are
none, cells without a name.
"""

import json

import numpy as np
import pytest

from hw.interface import BackendError
from hw.playback.columns import read_table


def words_in(path, **columns):
    if path.suffix == ".npz":
        np.savez(path, **{name: np.array(column) for name, column in columns.items()})
    else:
        path.write_text(json.dumps(columns))
    return path


@pytest.mark.parametrize("ending", ["npz", "json"])
def test_numbers_that_were_saved_as_text_are_read_as_in_a_text_table(tmp_path, ending):
    times = ["2026-03-01T23:59:59.5Z", "2026-03-02T00:00:01Z", "2026-03-02T00:00:01.25Z"]
    path = words_in(
        tmp_path / f"log.{ending}",
        t=times,
        q=["0,5", "-1,25", "2"],
        tau=["1.234,5", "7,5", "12"],
        i=["1 A"] * 3,
    )
    found = read_table(path, ("t", "q", "tau", "i"))
    assert np.diff(found.columns["t"]).tolist() == [1.5, 0.25]
    assert found.columns["q"].tolist() == [0.5, -1.25, 2]
    assert found.columns["tau"].tolist() == [1234.5, 7.5, 12]
    assert found.units == {"t": "s", "i": "A"}
    whole = read_table(words_in(path, t=[0, 1], q=["65.536", "1.000"]), ("t", "q"), decimal=",")
    assert whole.columns["q"].tolist() == [65536, 1000]
    with pytest.raises(
        BackendError, match=r"'q' is text, and 'stopped' in row 2 is not a number; save it as"
    ):
        read_table(words_in(path, t=[0.0, 1.0], q=["0,5", "stopped"]), ("t", "q"))


def test_a_column_that_may_be_in_an_object_of_python_is_told_so(tmp_path):
    np.savez(tmp_path / "log.npz", t=[0.0, 1.0], log=np.array({"q": [1, 2]}, object))
    with pytest.raises(BackendError, match=r"'log' holds Python objects"):
        read_table(tmp_path / "log.npz", ("t", "q"))


@pytest.mark.parametrize(
    "row", ["t:{:.1f},q:{:g}\ttau:{:g}", ">t={:.1f} q={:g} tau={:g}", "t: {}; q: {}; tau: {}"]
)
def test_names_before_each_value_are_the_header(tmp_path, row):
    path = tmp_path / "log.txt"
    path.write_text("\n".join(row.format(k / 10, -k / 2, 1e-3 * k) for k in range(20)))
    found = read_table(path, ("t", "tau", "q"))
    assert found.columns["q"].tolist() == [-k / 2 for k in range(20)]
    assert found.columns["tau"][19] == pytest.approx(0.019)
    path.write_text(path.read_text() + "\nt:2.0,q:-1")
    with pytest.raises(BackendError, match=r"row 21"):
        read_table(path, ("t", "tau", "q"))


@pytest.mark.parametrize(
    "text", ["t,q\n1,0.1,5\n2,0.2,6\n", 't q\n"1" 0.1 5\n"2" 0.2 6\n', "t,q\n0,1,0,5\n0,2,0,6\n"]
)
def test_rows_of_more_cells_than_there_are_names_are_refused(tmp_path, text):
    """Each column was read for the one before it."""
    path = tmp_path / "log.csv"
    path.write_text(text)
    with pytest.raises(BackendError, match=r"every row has [34] cells or more, and the header 2 names.*#2"):
        read_table(path, ("t", "q"))
    assert read_table(path, ("#2", "#3")).columns["#3"].tolist()[0] in (5, 0)
    path.write_text("t,q\n1,5,,\n2,6, ,\n")  # delimiters that end each row are no cells
    assert read_table(path, ("t", "q")).columns["q"].tolist() == [5, 6]
    path.write_text("t,q\n1,5\n2,6,a remark\n3,7\n")
    assert read_table(path, ("t", "q")).columns["q"].tolist() == [5, 6, 7]


@pytest.mark.parametrize("footer", ['"Total","",""', "End of record\nSamples: 40\nMax,2,3"])
def test_a_footer_is_told_as_one(tmp_path, footer):
    """It was told as a column of another rate, or as a file that was cut off."""
    rows = "\n".join(f"{k},{2 * k},{3 * k}" for k in range(40))
    (tmp_path / "log.csv").write_text(f"t,q,a\n{rows}\n{footer}\n")
    with pytest.raises(BackendError, match=r"row 41: '(Total|End of record)' .*a footer.*delete them"):
        read_table(tmp_path / "log.csv", ("t", "q", "a"))


def test_settings_with_names_above_a_table_are_no_values(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("rate: 1000\nt q\n" + "\n".join(f"{k} {2 * k}" for k in range(9)))
    assert read_table(path, ("t", "q")).columns["q"].tolist() == [2 * k for k in range(9)]


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ("version https://git-lfs.github.com/spec/v1\noid sha256:a\n", r"Git LFS.*git lfs pull"),
        ("<html><table><tr><td>t</td></tr></table>", r"HTML or XML.*as CSV"),
    ],
)
def test_what_is_no_log_is_told_with_the_way_to_one(tmp_path, data, told):
    (tmp_path / "log.csv").write_text(data)
    with pytest.raises(BackendError, match=told):
        read_table(tmp_path / "log.csv", ("t", "q"))
