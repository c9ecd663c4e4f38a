"""A recording goes straight into identification: missed ticks are missing rows."""

import subprocess
import sys

import numpy as np
import pytest
from dirty_changes import clean
from run_maker import setup, write

from hw.interface import BackendError
from hw.member import Member
from hw.playback.columns import read_table
from hw.playback.reader import load
from rtctl.control.records import command_dtype
from rtctl.friction.logs.log_input import Gearing, options_of, read_log
from rtctl.friction.logs.regression import joint_fit
from rtctl.friction.logs.regressors import of_stretches
from rtctl.recording import as_columns
from rtctl.tick import tick_dtype

COLUMNS = {
    "position": {"column": "position_rad"},
    "motor_torque": {"column": "motor_torque_nm"},
    "hand_torque": {"column": "hand_torque_raw_nm"},
}


@pytest.fixture
def recorded(tmp_path):
    return record(tmp_path, slice(5000, 5400))


def record(folder, gap):
    log = clean("hand against a spring of the motor")
    rows = np.zeros(len(log.time), tick_dtype(1))
    rows["tick"] = np.arange(len(rows))
    rows["time_ns"] = 2_000_000 * rows["tick"] + 5_000_000_000_000_000_000
    rows["position_rad"][:, 0], rows["motor_torque_nm"][:, 0] = log.position, log.motor
    rows["hand_torque_raw_nm"][:, 0] = log.hand
    kept = np.random.default_rng(1).uniform(size=len(rows)) > 0.02
    kept[gap] = False
    as_columns.register()
    (path,) = write(folder, rows[kept], np.zeros(0, command_dtype(1)), setup("mock.toml")).files
    return path, log


def test_a_recording_with_missed_ticks_gives_the_parameters(recorded):
    path, log = recorded
    parts = read_log(options_of(path, COLUMNS, None), Gearing())
    assert len(parts) >= 2, "the missing 400 ticks part the log"
    found = joint_fit(of_stretches(parts)).symmetric.parameters
    for name, truth in log.truth.items():
        assert found[name].value == pytest.approx(truth, rel=0.02)


def test_a_loop_may_play_missed_ticks_back_but_no_gap(recorded, tmp_path):
    with pytest.raises(BackendError, match=r"ticks are missing for 0\.8\d* s after"):
        load(options_of(recorded[0], COLUMNS, None), Gearing().rig())
    (tmp_path / "few").mkdir()
    path, log = record(tmp_path / "few", slice(300, 302))
    found = load(options_of(path, COLUMNS, None), Gearing().rig())
    assert found.rate_hz == pytest.approx(500, rel=0.03)
    assert found.rate_hz == pytest.approx(500, rel=1e-9), "a loop at the recording's rate takes it"
    assert len(found) * 0.002 == pytest.approx(log.time[-1], rel=0.04)
    at = np.arange(len(found)) / found.rate_hz
    np.testing.assert_allclose(found.position_rad[:, 0], np.interp(at, log.time, log.position), atol=1e-3)


def test_a_part_without_a_gap_is_played_whatever_is_missing_elsewhere(recorded):
    path, log = recorded
    options = options_of(path, COLUMNS, None)
    for start_s, end_s in ((1.0, 9.0), (11.0, None), (10.9, 14.0)):
        found = load({**options, "start_s": start_s, "end_s": end_s}, Gearing().rig())
        at = start_s + np.arange(len(found)) / found.rate_hz
        np.testing.assert_allclose(found.position_rad[:, 0], np.interp(at, log.time, log.position), atol=1e-3)
        assert at[-1] == pytest.approx(log.time[-1] if end_s is None else end_s, abs=0.01)
    for start_s, end_s in ((1.0, None), (9.0, 12.0), (10.3, 12.0)):
        with pytest.raises(BackendError, match="ticks are missing for"):
            load({**options, "start_s": start_s, "end_s": end_s}, Gearing().rig())


def test_the_loop_of_a_device_that_plays_a_recording_learns_to_read_it(recorded):
    played = Member("playback", {"file": str(recorded[0])}, "device[0] 'playback'", (0,), (), 0, 0, ())
    others = Member("playback", {"file": "log.csv"}, "device[0] 'playback'", (0,), (), 0, 0, ())
    assert as_columns.log_readers([others]) == []
    (module,) = as_columns.log_readers([played])
    code = (
        "import importlib, sys; from hw.playback.columns import READERS; assert '.mcap' not in READERS\n"
        f"importlib.import_module({module!r}).register(); assert '.mcap' in READERS\n"
        "bad = {'zmq', 'msgpack', 'pydantic', 'sklearn', 'asyncio', 'matplotlib', 'click'} & "
        "set(sys.modules); assert not bad, bad"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_fields_go_by_the_names_of_the_export_and_what_is_missing_is_told(recorded):
    path, log = recorded
    found = read_table(path, ("time_s", "position_rad.joint", "position_rad")).columns
    assert np.array_equal(found["position_rad.joint"], found["position_rad"])
    assert found["time_s"][0] == 0
    assert found["time_s"][-1] == pytest.approx(log.time[-1])
    with pytest.raises(BackendError, match="no column 'speed'; the file has: tick, "):
        read_table(path, ("speed",))


def test_another_mcap_file_is_refused(tmp_path):
    as_columns.register()
    (tmp_path / "other.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(100))
    with pytest.raises(BackendError, match=r"other\.mcap"):
        read_table(tmp_path / "other.mcap", ("t",))
