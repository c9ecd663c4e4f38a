"""What the playback reader makes of good files, and what it says about bad ones."""

import gzip
import math

import numpy as np
import pytest
from pydantic import ValidationError

from hw.interface import BackendError, Rig
from hw.playback.columns import read_table
from hw.playback.options import PlaybackOptions
from hw.playback.reader import load

RIG = Rig(
    n_axes=1,
    period_s=1e-3,
    gear_ratio=np.array([80.0]),
    gear_efficiency=np.array([0.75]),
    torque_constant_nm_a=np.array([0.02]),
    encoder_counts_per_rev=np.array([160_000.0]),
    lever_m=np.array([[0.0, 0.1, 0.0]]),
)


def write(folder, text, name="log.csv"):
    path = folder / name
    if name.endswith(".gz"):
        path.write_bytes(gzip.compress(text.encode()))
    else:
        path.write_text(text)
    return path


def options(folder, name="log.csv", **more):
    table = {"file": name, "time": {"column": "t"}, "axis": [{"position": {"column": "x"}}], **more}
    return PlaybackOptions.model_validate(table, context={"folder": folder}).model_dump(mode="json")


def rows(times, values):
    return "t,x\n" + "".join(f"{t!r},{x!r}\n" for t, x in zip(times, values, strict=True))


EVEN = [k / 1000 for k in range(50)]


@pytest.mark.parametrize("name", ["log.csv", "log.csv.gz"])
def test_a_plain_and_a_gzipped_log_read_alike(tmp_path, name):
    write(tmp_path, rows(EVEN, range(50)), name)
    recording = load(options(tmp_path, name), RIG)
    assert recording.rate_hz == pytest.approx(1000)
    assert recording.position_rad[:, 0].tolist() == list(range(50))
    assert recording.current_a is None
    assert recording.force_n is None


def test_a_unit_a_scale_and_an_offset_apply_in_the_order_documented(tmp_path):
    write(tmp_path, "ms,deg,mNm\n" + "".join(f"{k},{90 + k},{k}\n" for k in range(5)))
    table = options(
        tmp_path,
        time={"column": "ms", "unit": "ms"},
        axis=[
            {
                "position": {"column": "deg", "unit": "deg", "scale": -2.0, "offset": 90.0},
                "motor_torque": {"column": "mNm", "unit": "mN m"},
            }
        ],
    )
    recording = load(table, RIG)
    assert recording.rate_hz == pytest.approx(1000)
    np.testing.assert_allclose(recording.position_rad[:, 0], -2 * np.deg2rad(np.arange(5)), rtol=1e-15)
    torque = recording.current_a[:, 0] * 80 * 0.75 * 0.02
    np.testing.assert_allclose(torque, np.arange(5) * 1e-3, rtol=1e-15)


def test_encoder_counts_follow_the_rigs_encoder(tmp_path):
    write(tmp_path, rows(EVEN, range(50)))
    recording = load(options(tmp_path, axis=[{"position": {"column": "x", "unit": "counts"}}]), RIG)
    assert recording.position_rad[10, 0] == pytest.approx(10 * 2 * math.pi / 160_000, rel=1e-15)


def test_a_window_keeps_both_its_ends(tmp_path):
    write(tmp_path, rows(EVEN, range(50)))
    recording = load(options(tmp_path, start_s=0.01, end_s=0.02), RIG)
    assert recording.position_rad[[0, -1], 0].tolist() == [10, 20]


def test_a_log_without_time_takes_its_rate_from_the_options(tmp_path):
    write(tmp_path, rows(EVEN, range(50)))
    assert load(options(tmp_path, time=None, rate_hz=123.0), RIG).rate_hz == 123.0


GAP = [k / 1000 if k < 20 else (k + 1) / 1000 for k in range(50)]
TWICE = [*EVEN[:10], EVEN[9], *EVEN[11:30], EVEN[29], *EVEN[31:]]
BACK = [*EVEN[:30], 0.0285, *EVEN[31:]]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the file is empty"),
        ("t,x\n", "no rows"),
        ("t,x\n0,1\n", "at least 2"),
        ("t,y\n0,1\n1,2\n", "no column 'x'.*t, y"),
        ("t,x,x\n0,1,1\n1,2,2\n", "more than one column 'x'"),
        ("t,x\n0,1\n0.001,\n0.002,3\n", "must be a number"),
        ("t,x\n0,1\n0.001,spam\n0.002,3\n", "spam"),
        ("t,x\n0,1\n0.001\n0.002,3\n", "must be a number"),
        ("t,x\n0,1\n0.001,nan\n0.002,3\n", "'x' row 2: nan"),
        ("t,x\n0,1\n0.001,2\n0.002,-inf\n", "'x' row 3: -inf"),
        ("t,x\n0,1\nnan,2\n0.002,3\n", "'t' row 2"),
        (rows(GAP, range(50)), r"uneven sampling: row 21 comes 0.002 s"),
        (rows(BACK, range(50)), "unsorted time: row 31 .*1 such rows.*sort the log"),
        (rows(TWICE, range(50)), "2 duplicated timestamps, the first 0.009 s in rows 10 and 11; remove"),
        (rows([0.0] * 5, range(5)), "does not increase"),
        (rows(EVEN[::-1], range(50)), "does not increase"),
    ],
)
def test_a_bad_log_is_refused_by_name_and_cause(tmp_path, text, said):
    path = write(tmp_path, text)
    with pytest.raises(BackendError, match=said) as caught:
        load(options(tmp_path), RIG)
    assert str(path) in str(caught.value)


def test_a_truncated_gzip_file_is_refused(tmp_path):
    path = write(tmp_path, rows(EVEN, np.random.default_rng(0).random(50).tolist()), "log.csv.gz")
    table = options(tmp_path, "log.csv.gz")
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(BackendError, match="cut off"):
        load(table, RIG)


def test_a_damaged_gzip_file_is_refused(tmp_path):
    path = write(tmp_path, rows(EVEN, range(50)), "log.csv.gz")
    table = options(tmp_path, "log.csv.gz")
    packed = bytearray(path.read_bytes())
    packed[30] ^= 0xFF
    path.write_bytes(packed)
    with pytest.raises(BackendError, match=r"log\.csv\.gz"):
        load(table, RIG)


def test_a_binary_file_and_one_that_vanished_are_refused(tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(b"\xff\xfe\x00t,x\n")
    table = options(tmp_path)
    with pytest.raises(BackendError, match="not a text file"):
        load(table, RIG)
    path.unlink()
    with pytest.raises(BackendError, match="No such file"):
        load(table, RIG)


def test_another_number_of_axes_than_the_rigs_is_refused(tmp_path):
    write(tmp_path, rows(EVEN, range(50)))
    axis = {"position": {"column": "x"}}
    with pytest.raises(BackendError, match="maps 2 axes, the rig has 1"):
        load(options(tmp_path, axis=[axis, axis]), RIG)


def test_a_window_outside_the_log_is_refused(tmp_path):
    write(tmp_path, rows(EVEN, range(50)))
    with pytest.raises(BackendError, match=r"leaves 0 samples of a log of 0\.050 s"):
        load(options(tmp_path, start_s=1.0), RIG)


def test_columns_that_are_not_mapped_may_hold_text(tmp_path):
    path = write(tmp_path, "t,note,x\n0,hello,1\n1,,2\n")
    assert read_table(path, ("x", "t", "x")).columns["x"].tolist() == [1, 2]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"file": "absent.csv"}, "no file"),
        ({"time": None}, "either a time column or rate_hz"),
        ({"rate_hz": 1000.0}, "either a time column or rate_hz"),
        ({"rate_hz": math.nan, "time": None}, "finite"),
        ({"start_s": 2.0, "end_s": 1.0}, "must be after start_s"),
        ({"speed": 2}, "Extra inputs"),
        ({"loop": 1}, "boolean"),
        ({"axis": []}, "at least 1"),
        ({"axis": [{"position": {"column": "x", "scale": 0.0}}]}, "scale of column 'x' is 0"),
        ({"axis": [{"position": {"column": "x", "unit": "grad"}}]}, "'rad', 'deg'"),
        (
            {
                "axis": [
                    {"position": {"column": "x"}, "current": {"column": "i"}, "motor_torque": {"column": "q"}}
                ]
            },
            "not both",
        ),
        (
            {
                "force": [{"column": "a"}, {"column": "b"}, {"column": "c"}],
                "axis": [{"position": {"column": "x"}, "hand_torque": {"column": "h"}}],
            },
            "not both",
        ),
        (
            {
                "axis": [
                    {"position": {"column": "x"}, "hand_torque": {"column": "h"}},
                    {"position": {"column": "y"}},
                ]
            },
            "every axis, or for none",
        ),
    ],
)
def test_wrong_options_are_refused(tmp_path, change, said):
    write(tmp_path, rows(EVEN, range(50)))
    with pytest.raises(ValidationError, match=said):
        options(tmp_path, **change)
