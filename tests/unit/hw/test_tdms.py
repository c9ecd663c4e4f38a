"""TDMS files of LabVIEW beyond those of `other_layouts`: clocks that differ, units, damage, no reader."""

import contextlib
import io

import numpy as np
import pytest

from hw.interface import BackendError
from hw.playback import tdms
from hw.playback.columns import read_table
from hw.playback.reader import load
from rtctl.friction.logs.log_input import Gearing, options_of

nptdms = pytest.importorskip("nptdms")

N = 400
CLOCK = {"wf_start_time": np.datetime64("2024-03-07T14:02:11"), "wf_start_offset": 0.0, "wf_increment": 2e-3}


def written(path, **channels):
    whole = io.BytesIO()
    with nptdms.TdmsWriter(whole) as file:
        file.write_segment(
            [nptdms.ChannelObject("M", name, data, about) for name, (data, about) in channels.items()]
        )
    path.write_bytes(whole.getvalue())
    return path


def test_without_nptdms_the_extra_is_named(tmp_path, monkeypatch):
    path = written(tmp_path / "a.tdms", q=(np.arange(N), CLOCK))
    monkeypatch.setattr(tdms, "find_spec", lambda _: None)
    with pytest.raises(BackendError, match=r"pip install 'rtctl\[tdms\]'.*CSV"):
        read_table(path, ("M/q",))


def test_a_channel_has_its_time_only_where_it_has_a_rate(tmp_path):
    path = written(tmp_path / "a.tdms", q=(np.arange(N), CLOCK), tau=(np.ones(N), {}))
    np.testing.assert_allclose(read_table(path, ("M/q/time",)).columns["M/q/time"], 2e-3 * np.arange(N))
    with pytest.raises(BackendError, match=r"no column 'M/tau/time'; the file has: M/q, M/tau, M/q/time"):
        read_table(path, ("M/tau/time",))


@pytest.mark.parametrize(
    "other", [{"wf_start_time": np.datetime64("2024-03-07T14:02:12")}, {"wf_increment": 1e-3}]
)
def test_channels_of_two_clocks_are_no_rows(other, tmp_path):
    path = written(tmp_path / "a.tdms", q=(np.arange(N), CLOCK), tau=(np.ones(N), CLOCK | other))
    with pytest.raises(BackendError, match=r"channels of different clocks \('M/q' from .*resample"):
        read_table(path, ("M/q", "M/tau"))


def test_the_unit_in_the_file_is_held_against_the_one_given(tmp_path):
    path = written(
        tmp_path / "a.tdms", q=(np.arange(N), CLOCK | {"unit_string": "deg"}), tau=(np.ones(N), CLOCK)
    )
    columns = {
        "time": {"column": "M/q/time"},
        "position": {"column": "M/q"},
        "motor_torque": {"column": "M/tau"},
    }
    with pytest.raises(BackendError, match=r"column 'M/q' is read in rad, the file says deg"):
        load(options_of(path, columns, None), Gearing().rig())


@pytest.mark.parametrize(("step_s", "refused"), [(2e-3, True), (1.0, False)])
def test_a_rate_that_the_file_contradicts_is_refused(step_s, refused, tmp_path):
    """Of half the step inertia would be a quarter; 1 s is what LabVIEW writes where it knows none."""
    clock = CLOCK | {"wf_increment": step_s}
    path = written(tmp_path / "a.tdms", q=(np.arange(N) * 1e-3, clock), tau=(np.ones(N), clock))
    columns = {"position": {"column": "M/q"}, "motor_torque": {"column": "M/tau"}}
    assert load(options_of(path, columns, 500.0), Gearing().rig()).rate_hz == 500.0
    told = pytest.raises(BackendError, match=r"read at 1000 Hz, and .* 0\.002 s apart \(500 Hz\)")
    with told if refused else contextlib.nullcontext():
        load(options_of(path, columns, 1000.0), Gearing().rig())


def test_channels_that_are_interleaved_are_taken_apart(tmp_path):
    q, tau = np.arange(N) * 1e-3, np.arange(N) % 7 - 3.0
    path = written(tmp_path / "a.tdms", q=(q, CLOCK), tau=(tau, CLOCK))
    raw = bytearray(path.read_bytes())
    raw[4] |= 0x20  # of the flags of a segment: its samples are in turn
    raw[-16 * N :] = np.column_stack([q, tau]).tobytes()
    path.write_bytes(raw)
    found = read_table(path, ("M/q", "M/tau")).columns
    np.testing.assert_array_equal(np.stack([found["M/q"], found["M/tau"]]), np.stack([q, tau]))


def test_whole_numbers_are_scaled_as_the_file_says(tmp_path):
    scaled = {
        "NI_Number_Of_Scales": 1,
        "NI_Scaling_Status": "unscaled",
        "NI_Scale[0]_Scale_Type": "Linear",
        "NI_Scale[0]_Linear_Slope": 1e-4,
        "NI_Scale[0]_Linear_Y_Intercept": 0.5,
        "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
    }
    path = written(tmp_path / "a.tdms", q=(np.arange(N).astype(np.int16), CLOCK | scaled))
    np.testing.assert_allclose(read_table(path, ("M/q",)).columns["M/q"], 0.5 + 1e-4 * np.arange(N))


def test_damage_is_named_and_claims_no_memory(tmp_path):
    path = written(tmp_path / "a.tdms", q=(np.arange(float(N)), CLOCK), tau=(np.ones(N), CLOCK))
    whole, random = path.read_bytes(), np.random.default_rng(7)
    for _ in range(150):
        damaged = bytearray(whole[: random.integers(20, len(whole))] if random.random() < 0.3 else whole)
        for at in random.integers(0, min(len(damaged), 700), 3):
            damaged[at] = random.integers(256)
        path.write_bytes(damaged)
        with contextlib.suppress(BackendError):  # any other is no answer
            read_table(path, ("M/q", "M/tau"))


def test_a_channel_may_be_called_time(tmp_path):
    path = written(
        tmp_path / "a.tdms", time=(2.0 * np.arange(N), {"unit_string": "ms"}), q=(np.arange(N), CLOCK)
    )
    found = read_table(path, ("M/time", "M/q", "M/q/time"))
    assert found.columns["M/time"].tolist() == (2.0 * np.arange(N)).tolist()
    np.testing.assert_allclose(found.columns["M/q/time"], 2e-3 * np.arange(N))
    assert found.units == {"M/time": "ms", "M/q/time": "s"}
