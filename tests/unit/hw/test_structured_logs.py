"""Logs in structures: several of one name and cells of MATLAB, signals in rows, JSON; foreign files by
name.
"""

import json

import numpy as np
import pytest
from scipy.io import savemat

from hw.interface import BackendError
from hw.playback.columns import read_table

T = np.arange(20.0)


def structures(*entries):
    found = np.empty((1, len(entries)), [(name, object) for name in entries[0]])
    for k, entry in enumerate(entries):
        found[0, k] = tuple(entry.values())
    return found


def test_structures_of_one_name_and_cells_are_numbered_from_1(tmp_path):
    path = tmp_path / "log.mat"
    cells = np.empty((1, 2), object)
    cells[0, 0], cells[0, 1] = {"x": T + 3}, {"x": T + 4}
    savemat(
        path, {"m": {"Y": structures({"Name": "a", "Data": T + 1}, {"Name": "b", "Data": T + 2})}, "c": cells}
    )
    found = read_table(path, ("m.Y(1).Data", "m.Y(2).Data", "c{2}.x")).columns
    assert [column[0] for column in found.values()] == [1, 2, 4]
    with pytest.raises(BackendError, match=r"no column 'x'; the file has: .*m\.Y\(1\)\.Data"):
        read_table(path, ("x",))


def test_signals_in_rows_are_numbered_as_signals_in_columns(tmp_path):
    path = tmp_path / "log.mat"
    for matrix in (np.stack([T, T + 1, T + 2]), np.stack([T, T + 1, T + 2], axis=1)):
        savemat(path, {"ans": matrix})
        assert read_table(path, ("ans#3",)).columns["ans#3"].tolist() == (T + 2).tolist()
    with pytest.raises(BackendError, match="3 columns, not 4"):
        read_table(path, ("ans#4",))


ROWS = [{"t": k, "motor": {"tau": 2.0 * k}, "q": [k, -k], "mode": "on"} for k in range(20)]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.jsonl", "\n".join(json.dumps(row) for row in ROWS)),
        ("a.json", json.dumps(ROWS)),
        (
            "a.json",
            json.dumps({"t": T.tolist(), "motor": {"tau": (2 * T).tolist()}, "q": [[k, -k] for k in T]}),
        ),
    ],
)
def test_json_of_rows_and_of_lists_goes_by_its_keys(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    found = read_table(path, ("t", "motor.tau", "q#2")).columns
    assert found["motor.tau"].tolist() == (2 * T).tolist()
    assert found["q#2"].tolist() == (-T).tolist()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"t": 1}\n{"t": oops}\n', "line 2 is no JSON"),
        ("[1, 2]", "no rows"),
        ("7", "no rows"),
        ('[{"t": 1}, {"x": 2}]', "no column 't'"),
        ('[{"t": 1}, {"t": null}]', "column 't' row 2: nan is not a finite number"),
        ('{"t": [null, 1, 2]}', "column 't' row 1: nan is not a finite number"),
    ],
)
def test_json_that_holds_no_table_is_refused(tmp_path, text, said):
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(BackendError, match=said):
        read_table(path, ("t",))


@pytest.mark.parametrize(
    ("name", "first", "said"),
    [("a.xlsx", b"PK\x03\x04", "a spreadsheet.*CSV"), ("a.pkl", b"\x80\x04", "pickle.*npz"),
        ("a.bag", b"#ROSBAG V2.0", "ROS 1.*CSV")],
)  # fmt: skip
def test_a_file_of_another_kind_is_named(tmp_path, name, first, said):
    path = tmp_path / name
    path.write_bytes(first + bytes(range(200)))
    with pytest.raises(BackendError, match=said):
        read_table(path, ("t",))
