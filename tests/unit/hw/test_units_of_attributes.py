"""A unit that a file keeps beside a column, in its attributes or in the same structure, is held against the
one it is read in."""

import json

import numpy as np
import pytest

from hw.interface import BackendError
from hw.playback.columns import read_table
from hw.playback.units import require_unit, unit_of, units_beside

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


def pandas_attrs(path):
    pytest.importorskip("pyarrow")
    frame = pytest.importorskip("pandas").DataFrame({"q": Q, "tau": TAU})
    frame.attrs["units"] = {"tau": "mNm", "x": 3}
    frame.to_parquet(path)
    return "q", "tau"


def hdf_beside(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["arm/q"], file["hand/value"], file["hand/rate"], file["hand/unit"] = Q, TAU, 1000.0, "mNm"
    return "arm/q", "hand/value"


def matlab(path):
    scipy = pytest.importorskip("scipy.io")
    signals = np.zeros((1, 2), [("Name", "O"), ("Data", "O"), ("Unit", "O"), ("XIndex", "O")])
    signals[0] = [("q", Q, "", 1), ("tau", TAU, "mNm", 1)]
    scipy.savemat(path, {"run": {"Y": signals}})
    return "run.Y(1).Data", "run.Y(2).Data"


def matlab_hdf(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        parts = {}
        for name, value in (
            ("q", Q),
            ("tau", TAU),
            ("unit", np.frombuffer(b"mNm", np.uint8).astype(np.uint16)),
        ):
            parts[name] = file.create_dataset(f"#refs#/{name}", data=value[:, None])
            parts[name].attrs["MATLAB_class"] = np.bytes_("char" if name == "unit" else "double")
        file["run/Y/Data"] = np.array([parts["q"].ref, parts["tau"].ref], h5py.ref_dtype)
        file["run/Y/Unit"] = np.array([h5py.Reference(), parts["unit"].ref], h5py.ref_dtype)
    return "run.Y(1).Data", "run.Y(2).Data"


def json_lines(path):
    rows = [{"q": q, "hand": {"value": tau, "unit": "mNm"}} for q, tau in zip(Q, TAU, strict=True)]
    path.write_text("\n".join(map(json.dumps, rows)))
    return "q", "hand.value"


@pytest.mark.parametrize(
    ("ending", "written"),
    [
        ("h5", hdf),
        ("parquet", parquet),
        ("parquet", pandas_attrs),
        ("hdf5", hdf_beside),
        ("mat", matlab),
        ("mat", matlab_hdf),
        ("jsonl", json_lines),
    ],
)
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


def test_a_unit_beside_several_arrays_is_of_none():
    arrays = {"run.t": Q, "run.q": Q, "run.rate": 1.0}
    assert units_beside(arrays, {"run.unit": "deg"}) == {}
    assert units_beside({**arrays, "run.arm.q": Q}, {"run.arm.unit": "deg", "unit": "s"}) == {
        "run.arm.q": "deg"
    }
