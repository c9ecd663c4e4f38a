"""A unit that a file keeps beside a column, as HDF5 and Parquet do, is held against the one it is read in."""

import numpy as np
import pytest

from hw.interface import BackendError
from hw.playback.columns import read_table
from hw.playback.units import require_unit, unit_of

Q, TAU = np.arange(4.0), np.arange(4.0) / 8


def hdf(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["arm/q"], file["arm/tau"] = Q, TAU
        file["arm/tau"].attrs["Units"] = np.bytes_("mNm")
    return "arm/q", "arm/tau"


def parquet(path):
    arrow = pytest.importorskip("pyarrow")
    fields = [
        arrow.field("q", arrow.float64()),
        arrow.field("tau", arrow.float64(), metadata={"unit": "mNm"}),
        arrow.field("stamp", arrow.timestamp("ms"), metadata={"unit": "ms"}),
    ]
    columns = [arrow.array(Q), arrow.array(TAU), arrow.array(range(4), arrow.timestamp("ms"))]
    table = arrow.table(columns, arrow.schema(fields))
    pytest.importorskip("pyarrow.parquet").write_table(table, path)
    return "q", "tau", "stamp"


@pytest.mark.parametrize(("ending", "written"), [("h5", hdf), ("parquet", parquet)])
def test_a_torque_of_which_the_file_says_another_unit_is_refused(tmp_path, ending, written):
    path = tmp_path / f"log.{ending}"
    q, tau, *stamp = names = written(path)
    found = read_table(path, names)
    assert (found.columns[tau] == TAU).all()
    assert [found.units.get(name, "") for name in (q, tau)] == ["", "mNm"]
    assert [found.units[name] for name in stamp] == ["s" for _ in stamp], (
        "a date is in seconds when it is read"
    )
    with pytest.raises(BackendError, match="read in Nm, the file says mN m"):
        require_unit(path, tau, found.units[tau], {"column": tau, "unit": "Nm"}, ("Nm", "mN m"))


def test_attributes_that_say_nothing_of_a_unit_are_none():
    assert unit_of({b"long_name": b"torque", "count": 3, "unit": ""}) == ""
