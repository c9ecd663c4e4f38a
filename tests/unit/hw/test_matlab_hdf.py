"""MATLAB files of version 7.3, written as MATLAB does: a block of its own before the HDF5 file, arrays
transposed, references in #refs#.
"""

import h5py
import numpy as np
import pytest

from hw.interface import BackendError
from hw.playback import matlab_hdf
from hw.playback.columns import read_table

T = np.arange(300) / 100
X = np.sin(T)


def put(group, name, array, kind="double"):
    item = group.create_dataset(name, data=np.atleast_2d(array).T)
    item.attrs["MATLAB_class"] = np.bytes_(kind)
    return item


def written(path, fill):
    with h5py.File(path, "w", userblock_size=512) as file:
        fill(file)
    raw = bytearray(path.read_bytes())
    raw[:512] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM" + bytes(384)
    path.write_bytes(raw)
    return path


def references(file, owner, name, arrays, kind):
    file.require_group("#refs#")
    made = [put(file["#refs#"], f"{name}{k}", array).ref for k, array in enumerate(arrays)]
    item = owner.create_dataset(name, data=np.array([made], dtype=h5py.ref_dtype).T, dtype=h5py.ref_dtype)
    item.attrs["MATLAB_class"] = np.bytes_(kind)


def test_structures_matrices_cells_and_structures_of_one_name_are_found(tmp_path):
    def fill(file):
        log = file.create_group("log")
        put(log.create_group("motor"), "tau", 2 * X)
        put(log, "t", T)
        put(log, "name", np.frombuffer("axis".encode("utf-16-le"), np.uint16), "char")
        put(file, "all", np.column_stack([T, X]))
        references(file, file, "cells", [T, X], "cell")
        references(file, file.create_group("Y"), "Data", [X, 3 * X], "struct")
        put(file, "row", X[:, None])

    path = written(tmp_path / "a.mat", fill)
    found = read_table(path, ("log.t", "log.motor.tau", "cells{2}", "Y(2).Data", "all#2", "row")).columns
    np.testing.assert_array_equal(found["log.t"], T)
    np.testing.assert_array_equal(found["log.motor.tau"], 2 * X)
    np.testing.assert_array_equal(found["cells{2}"], X)
    np.testing.assert_array_equal(found["Y(2).Data"], 3 * X)
    np.testing.assert_array_equal(found["all#2"], X)
    np.testing.assert_array_equal(found["row"], X)
    with pytest.raises(BackendError, match=r"no column 'log\.name'; the file has: .*log\.motor\.tau"):
        read_table(path, ("log.name", "log.t"))


def test_a_variable_without_a_value_beside_the_wanted_ones_is_passed_over(tmp_path):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["t"], file["x"] = T, X
        file["remark"] = h5py.Empty("f8")
    assert read_table(tmp_path / "log.h5", ("t", "x")).columns["x"].tolist() == X.tolist()


def test_a_link_to_another_file_is_not_followed(tmp_path):
    written(tmp_path / "other.mat", lambda file: put(file, "secret", T))

    def fill(file):
        put(file, "t", T)
        file["secret"] = h5py.ExternalLink(str(tmp_path / "other.mat"), "/secret")

    with pytest.raises(BackendError, match=r"no column 'secret'; the file has: t$"):
        read_table(written(tmp_path / "a.mat", fill), ("secret",))


def test_a_file_that_bursts_is_refused(tmp_path):
    def fill(file):
        file.create_dataset("t", shape=(1, 3_000_000), dtype="f8", compression="gzip", fillvalue=1.0)

    with pytest.raises(BackendError, match="unpacks to more than a log does"):
        read_table(written(tmp_path / "a.mat", fill), ("t",))


def test_objects_alone_and_files_that_are_cut_off_are_told(tmp_path):
    def fill(file):
        item = put(file, "ts", np.zeros(6), "timeseries")
        item.attrs["MATLAB_object_decode"] = 3

    with pytest.raises(BackendError, match="no array 'ts'; the file holds MATLAB objects"):
        read_table(written(tmp_path / "a.mat", fill), ("ts",))
    whole = written(tmp_path / "b.mat", lambda file: put(file, "t", T)).read_bytes()
    (tmp_path / "b.mat").write_bytes(whole[:900])
    with pytest.raises(BackendError, match=r"not a sound \.mat file"):
        read_table(tmp_path / "b.mat", ("t",))


def test_without_h5py_the_extra_is_named(tmp_path, monkeypatch):
    path = written(tmp_path / "a.mat", lambda file: put(file, "t", T))
    monkeypatch.setattr(matlab_hdf, "find_spec", lambda _: None)
    with pytest.raises(BackendError, match=r"pip install 'rtctl\[matlab73\]'.*save\(\.\.\., '-v7'\)"):
        read_table(path, ("t",))


def test_without_h5py_an_hdf5_file_is_no_matlab_file(tmp_path, monkeypatch):
    path = written(tmp_path / "a.h5", lambda file: put(file, "t", T))
    monkeypatch.setattr(matlab_hdf, "find_spec", lambda _: None)
    with pytest.raises(BackendError, match=r"pip install 'rtctl\[matlab73\]'.*\.npz"):
        read_table(path, ("t",))
