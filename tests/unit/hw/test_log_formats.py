"""Logs as other programs write them: text of all kinds, gzip, npz, npy, MATLAB, Parquet; each written by that
library.
"""

import csv
import gzip
import json
import sys

import numpy as np
import pytest
import scipy.io

from hw.interface import BackendError
from hw.playback import arrow as arrow_files
from hw.playback.columns import read_table

T = np.arange(50) * 0.002
X = np.sin(3 * T)
TAU = 0.25 * np.cos(3 * T)
NAMES = ("t", "x", "tau")


def check(path, names=NAMES, digits=6, **options):
    found = read_table(path, names, **options)
    for name, truth in zip(names, (T, X, TAU), strict=True):
        np.testing.assert_allclose(found.columns[name], truth, atol=0.6 * 10.0**-digits)
    return found


def text_of(
    delimiter=",", decimal=".", head=("t", "x", "tau"), above=(), units=None, comment=None, quote=False
):
    def cell(value):
        text = f"{value:.6f}".replace(".", decimal)
        return f'"{text}"' if quote else text

    lines = [*above, delimiter.join(head), *([delimiter.join(units)] if units else [])]
    for k, row in enumerate(zip(T, X, TAU, strict=True)):
        lines += [comment] if comment and k == 10 else []
        lines.append(delimiter.join(map(cell, row)))
    return "\n".join(lines) + "\n"


EPOS = (
    "Date:;2020-07-06 15:32:33",
    "Sampling period:;6.400",
    'Trigger:;1;0.000000;"Channel 1"',
    "TriggerAttributes:;1;4;0x30D3",
)

TEXTS = {
    "semicolons": text_of(";"),
    "tabs": text_of("\t"),
    "blanks": text_of("   "),
    "bars": text_of("|"),
    "decimal commas": text_of(";", ","),
    "decimal commas and tabs": text_of("\t", ","),
    "quoted cells, decimal commas, commas between": text_of(",", ",", quote=True),
    "quoted cells": text_of(",", quote=True),
    "units below the header": text_of(units=("[s]", "rad", "Nm")),
    "lines above the header": text_of(";", above=EPOS),
    "comments": text_of(above=("# made by a scope", "# gain 3"), comment="# pause"),
    "header in a comment": text_of(" ", head=("# t", "x", "tau")),
    "lines end as on Windows": text_of().replace("\n", "\r\n"),
    "a comma behind each line": text_of(";").replace("\n", ",,\n"),
}


@pytest.mark.parametrize("name", TEXTS)
def test_text_is_read_without_being_told_how_it_is_written(tmp_path, name):
    path = tmp_path / "log.txt"
    path.write_text(TEXTS[name])
    check(path)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_text_of_windows_programs_is_read(tmp_path, encoding):
    path = tmp_path / "log.csv"
    path.write_bytes(
        text_of(";", ",", head=("t", "x", "tau"), above=("Motor 1: 20 \u00b0C",)).encode(encoding)
    )
    check(path)


def test_what_was_written_by_the_csv_module_and_by_savetxt_is_read(tmp_path):
    table = np.column_stack([T, X, TAU])
    with (tmp_path / "a.csv").open("w", newline="") as file:
        writer = csv.writer(file, dialect="excel", delimiter=";", quoting=csv.QUOTE_ALL)
        writer.writerow(NAMES)
        writer.writerows(table.tolist())
    check(tmp_path / "a.csv")
    np.savetxt(tmp_path / "b.txt", table, header="t x tau")
    check(tmp_path / "b.txt")
    np.savetxt(tmp_path / "c.dat", table)
    check_places = read_table(tmp_path / "c.dat", ("#1", "#3")).columns
    np.testing.assert_allclose(check_places["#3"], TAU)
    with gzip.open(tmp_path / "d.csv.gz", "wt") as file:
        file.write(text_of("\t", ","))
    check(tmp_path / "d.csv.gz")


def test_a_column_without_a_name_is_named_by_its_place(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(
        text_of(";", head=("", "Position actual value", "Torque"), above=EPOS, units=("ms", "rad", "%"))
    )
    found = check(path, ("#1", "Position actual value", "Torque"))
    assert found.units["#1"] == "ms"
    assert np.array_equal(read_table(path, ("#1", "#2")).columns["#1"], found.columns["#1"])
    with pytest.raises(
        BackendError, match=r"no column 'Current'.*\(no name\), Position.*by its place, too: #1"
    ):
        read_table(path, ("Current",))


@pytest.mark.parametrize(
    "line",
    [
        "Vertical Units,V,V",
        "Units,,V",
        "Einheit,V,V",
        "Y_Unit_Label,V,V",
        "Horizontal Units,s,\nVertical Units,V,V",
    ],
)
def test_units_that_a_scope_writes_above_the_names_are_kept(tmp_path, line):
    path = tmp_path / "scope.csv"
    path.write_text(text_of(above=("Record Length,50", *line.split("\n"), "Unit 3 of the bench,left,right")))
    found = check(path)
    assert (found.units["x"], found.units["tau"]) == ("V" if ",V,V" in line else "left", "V")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text.replace("0.002000", "", 1), "column 't' row 2: an empty cell"),
        (lambda text: text.replace("0.002000", "n/a", 1), "column 't' row 2: 'n/a' is not a number"),
        (
            lambda text: text + text,
            "row 51 begins another table, with the header again: two logs or more in one file",
        ),
        (lambda text: text[:-20], "the file may be cut off"),
    ],
)
def test_what_cannot_be_read_is_told_by_column_and_row(tmp_path, change, said):
    path = tmp_path / "log.csv"
    path.write_text(change(text_of()))
    with pytest.raises(BackendError, match=said):
        read_table(path, NAMES)


def test_numpy_files_are_read_and_code_in_them_is_not_run(tmp_path):
    np.savez_compressed(
        tmp_path / "a.npz", t=T, x=X[:, None], data=np.column_stack([TAU, X]), odd=np.array([{}])
    )
    check(tmp_path / "a.npz", ("t", "x", "data#1"))
    with pytest.raises(BackendError, match=r"'odd' holds Python objects .*save each column as numbers"):
        read_table(tmp_path / "a.npz", ("odd",))
    with pytest.raises(BackendError, match=r"'data' has shape \(50, 2\); name one column of it: data#1"):
        read_table(tmp_path / "a.npz", ("data",))
    np.save(tmp_path / "b.npy", np.column_stack([T, X, TAU]))
    check(tmp_path / "b.npy", ("#1", "#2", "#3"))
    np.savez(tmp_path / "c.npz", t=T, x=X[:-1])
    with pytest.raises(BackendError, match="different lengths"):
        read_table(tmp_path / "c.npz", ("t", "x"))


def test_matlab_files_are_read_with_their_structures(tmp_path):
    scipy.io.savemat(
        tmp_path / "a.mat",
        {"t": T[:, None], "log": {"x": X, "motor": {"tau": TAU}}, "all": np.column_stack([T, X])},
        do_compression=True,
    )
    check(tmp_path / "a.mat", ("t", "log.x", "log.motor.tau"))
    check(tmp_path / "a.mat", ("all#1", "all#2", "log.motor.tau"))
    (tmp_path / "c.mat").write_bytes((tmp_path / "a.mat").read_bytes()[:300])
    with pytest.raises(BackendError, match=r"not a sound \.mat file|no column"):
        read_table(tmp_path / "c.mat", ("t",))


def test_parquet_is_read_where_pyarrow_is_installed(tmp_path):
    arrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(arrow.table({"t": T, "x": X, "tau": TAU, "note": ["a"] * 50}), tmp_path / "a.parquet")
    check(tmp_path / "a.parquet")
    with pytest.raises(BackendError, match="no column 'y'; the file has: t, x, tau, note"):
        read_table(tmp_path / "a.parquet", ("y",))


def test_feather_is_read_where_pyarrow_is_installed(tmp_path):
    arrow = pytest.importorskip("pyarrow")
    feather = pytest.importorskip("pyarrow.feather")
    feather.write_feather(
        arrow.table({"t": T, "x": X, "tau": TAU, "note": ["a"] * 50}), tmp_path / "a.feather"
    )
    check(tmp_path / "a.feather")
    (tmp_path / "b.feather").write_bytes(b"ARROW1\0\0 no more")
    with pytest.raises(BackendError, match="not a sound Feather file"):
        read_table(tmp_path / "b.feather", ("t",))


def test_parquet_without_pyarrow_names_the_extra(tmp_path, monkeypatch):
    (tmp_path / "a.parquet").write_bytes(b"PAR1")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.setattr(arrow_files, "find_spec", lambda _: None)
    with pytest.raises(BackendError, match=r"pip install 'rtctl\[parquet\]'"):
        read_table(tmp_path / "a.parquet", ("t",))


def test_packed_files_that_burst_are_refused(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", t=np.zeros(2_000_000))
    scipy.io.savemat(tmp_path / "a.mat", {"t": np.zeros(2_000_000)}, do_compression=True)
    for name in ("a.npz", "a.mat"):
        with pytest.raises(BackendError, match="which no log does"):
            read_table(tmp_path / name, ("t",))


@pytest.mark.parametrize(
    ("ending", "data"),
    [
        (".json", b"[" * 200_000),  # RecursionError
        (".mat", b""),  # SciPy's own MatReadError, no ValueError
        (".mat", b"MATLAB 5.0 MAT-file".ljust(126) + b"IM" + bytes(3)),
        (".npy", b"\x93NUMPY\x01\x00\x76\x00" + b"{'descr': '<f8', (".ljust(0x76)),  # TokenError
    ],
)
def test_a_damaged_file_is_refused_by_name_whatever_its_library_raises(tmp_path, ending, data):
    path = tmp_path / f"log{ending}"
    path.write_bytes(data)
    with pytest.raises(BackendError, match=f"not a sound {ending} file"):
        read_table(path, NAMES)


def test_a_single_number_is_no_column(tmp_path):
    np.savez(tmp_path / "log.npz", t=[0.0, 1.0], q=3.0)
    with pytest.raises(BackendError, match=r"'q' has shape \(\); map one that has a value for each row"):
        read_table(tmp_path / "log.npz", ("t", "q"))


@pytest.mark.parametrize(
    ("stamps", "seconds"),
    [
        (["1601-01-01T00:00", "2026-01-01T00:00"], 86400.0 * 155_228),  # a clock that was set in the log
        (["2020", "2021"], 86400.0 * 366),
    ],
)
def test_dates_far_apart_neither_run_over_nor_have_mean_years(tmp_path, stamps, seconds):
    np.savez(tmp_path / "log.npz", t=np.array(stamps, "datetime64"), q=[1.0, 2.0])
    assert read_table(tmp_path / "log.npz", ("t", "q")).columns["t"].tolist() == [0.0, seconds]


def test_a_data_frame_without_rows_is_told_so(tmp_path):
    (tmp_path / "log.json").write_text(json.dumps({"columns": ["t", "q"], "index": [], "data": []}))
    with pytest.raises(BackendError, match=r"0 row\(s\); at least 2 are needed"):
        read_table(tmp_path / "log.json", ("t", "q"))
