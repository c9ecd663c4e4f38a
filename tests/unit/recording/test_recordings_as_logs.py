"""A recording goes straight into identification: missed ticks are missing rows."""

import numpy as np
import pytest
from dirty_changes import clean
from run_maker import setup, write

from hw.interface import BackendError
from hw.playback.tables import read_table
from rtctl.control.records import command_dtype
from rtctl.friction.log_input import Gearing, options_of, read_log
from rtctl.friction.regression import joint_fit
from rtctl.friction.regressors import of_stretches
from rtctl.recording import as_columns
from rtctl.tick import tick_dtype


@pytest.fixture
def recorded(tmp_path):
    log = clean("hand against a spring of the motor")
    rows = np.zeros(len(log.time), tick_dtype(1))
    rows["tick"] = np.arange(len(rows))
    rows["time_ns"] = 2_000_000 * rows["tick"] + 5_000_000_000_000_000_000
    rows["position_rad"][:, 0], rows["motor_torque_nm"][:, 0] = log.position, log.motor
    rows["hand_torque_raw_nm"][:, 0] = log.hand
    kept = np.random.default_rng(1).uniform(size=len(rows)) > 0.02
    kept[5000:5400] = False
    as_columns.register()
    (path,) = write(tmp_path, rows[kept], np.zeros(0, command_dtype(1)), setup("mock.toml")).files
    return path, log


def test_a_recording_with_missed_ticks_gives_the_parameters(recorded):
    path, log = recorded
    columns = {
        "position": {"column": "position_rad"},
        "motor_torque": {"column": "motor_torque_nm"},
        "hand_torque": {"column": "hand_torque_raw_nm"},
    }
    parts = read_log(options_of(path, columns, None), Gearing())
    assert len(parts) >= 2, "the missing 400 ticks part the log"
    found = joint_fit(of_stretches(parts)).symmetric.parameters
    for name, truth in log.truth.items():
        assert found[name].value == pytest.approx(truth, rel=0.02)


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
