"""Logs that are packed (gzip, xz, bzip2, zip), and records in npz and HDF5: read as they are, and no bomb of
them.
"""

import bz2
import gzip
import io
import lzma
import zipfile

import h5py
import numpy as np
import pytest

from hw.interface import BackendError
from hw.playback.columns import read_table
from hw.playback.units import said_unit
from rtctl.cli.columns import tables

T = np.arange(50) * 0.002
TEXT = ("t,x\n" + "".join(f"{t:.6f},{2 * t:.6f}\n" for t in T)).encode()


def zipped(content, *names):
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in names or ("run/", "run/log.csv", "__MACOSX/run/._log.csv"):
            archive.writestr(name, b"" if name.endswith("/") else content)
    return whole.getvalue()


PACKED = {".csv.gz": gzip.compress, ".csv.xz": lzma.compress, ".csv.bz2": bz2.compress, ".zip": zipped}


@pytest.mark.parametrize("ending", PACKED)
def test_a_packed_log_is_read_and_a_damaged_one_or_a_bomb_is_named(ending, tmp_path):
    path = tmp_path / f"log{ending}"
    path.write_bytes(whole := PACKED[ending](TEXT))
    np.testing.assert_allclose(read_table(path, ("t", "x")).columns["x"], 2 * T)
    path.write_bytes(whole[:-30])
    with pytest.raises(BackendError, match=r"(cut off|not a sound \w+ file).*copy it again"):
        read_table(path, ("t", "x"))
    path.write_bytes(PACKED[ending](bytes(20_000_000)))
    with pytest.raises(BackendError, match="which no log does"):
        read_table(path, ("t", "x"))


def test_an_archive_of_several_files_names_them(tmp_path):
    (tmp_path / "log.zip").write_bytes(zipped(TEXT, "a.csv", "b.csv"))
    with pytest.raises(BackendError, match=r"2 files \(a\.csv, b\.csv\); unpack it"):
        read_table(tmp_path / "log.zip", ("t", "x"))


@pytest.mark.parametrize(
    ("first", "said"), [(b"\x28\xb5\x2f\xfd", "zstd -d"), (b"PAR1", r"\.parquet"), (b"\x89HDF\r\n", r"\.h5")]
)
def test_what_is_packed_or_called_otherwise_is_named(first, said, tmp_path):
    (tmp_path / "log.csv").write_bytes(first + bytes(range(256)))
    with pytest.raises(BackendError, match=said):
        read_table(tmp_path / "log.csv", ("t", "x"))


def test_records_are_read_by_their_fields(tmp_path):
    records = np.zeros(50, [("t", "f8"), ("name", "S2"), ("x", "f4")])
    records["t"], records["x"] = T, 2 * T
    np.savez(tmp_path / "a.npz", run=records)
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        file["day 1/run"] = records
        file["far"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "/far")
    for path, names in (("a.npz", ("run.t", "run.x")), ("a.hdf5", ("day 1/run/t", "day 1/run/x"))):
        found = read_table(tmp_path / path, names).columns
        np.testing.assert_allclose(found[names[1]], 2 * T, rtol=1e-6)
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file.create_dataset("t", data=np.zeros(2_000_000), compression="gzip")
    with pytest.raises(BackendError, match="more than a log does"):
        read_table(tmp_path / "b.h5", ("t",))


@pytest.mark.parametrize(
    ("given", "column", "unit"),
    [
        ("time=stamp:d", "stamp", "days"),
        ("position=q:degrees", "q", "deg"),
        ("torque=a:b:nm", "a:b", "N m"),
        ("torque=Axis 1::Trq", "Axis 1::Trq", None),
    ],
)
def test_a_unit_may_be_spelt_as_programs_do(given, column, unit):
    (table,) = tables((given,), None, ("time", "position", "torque")).values()
    assert (table["column"], table.get("unit")) == (column, unit)


def test_stamps_that_know_their_unit_are_held_against_the_one_given(tmp_path):
    stamps = np.datetime64("2025-10-26T02:59:59.5") + np.arange(20).astype("timedelta64[ms]")
    np.savez(tmp_path / "a.npz", t=stamps, x=np.arange(20.0))
    found = read_table(tmp_path / "a.npz", ("t", "x"))
    assert found.units == {"t": "s"}
    assert found.columns["t"][1] == pytest.approx(1e-3)


def test_a_speed_per_minute_is_no_time():
    assert said_unit("Drehzahl U/min", "") != "min"
    assert said_unit("Laufzeit in min", "") == "min"
    assert said_unit("stamp [d]", "") == "days"
