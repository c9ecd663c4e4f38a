"""A recording goes straight into identification: missed ticks are missing rows."""

import numpy as np
import pytest
from dirty_changes import clean
from run_maker import setup, write

from hw.interface import BackendError
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
    assert len(found) * 0.002 == pytest.approx(log.time[-1], rel=0.04)
    at = np.arange(len(found)) / found.rate_hz
    np.testing.assert_allclose(found.position_rad[:, 0], np.interp(at, log.time, log.position), atol=1e-3)


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
