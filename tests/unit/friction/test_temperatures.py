"""The motor's temperature along logs, for the friction points made of them."""

import math

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction.logs.log_input import options_of
from rtctl.friction.logs.logs import FrictionSamples
from rtctl.friction.logs.regressors import Regressors, pooled
from rtctl.friction.logs.temperatures import with_temperature

COLUMNS = {
    "time": {"column": "t", "unit": "ms"},
    "position": {"column": "x"},
    "motor_torque": {"column": "y"},
}
SIGNALS = ("position_rad", "velocity_rad_s", "acceleration_rad_s2", "jerk_rad_s3", "direction", "torque_nm")
WARMTH = {"column": "warm [degC]"}


def written(path, since_ms, celsius, head="t,x,y,warm [degC]"):
    rows = (f"{since_ms + 2 * k},{0.01 * k},0.1,{one}" for k, one in enumerate(celsius))
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


def logs_of(times_s):
    """Logs with rows at these times each, as `identify` has them, one after the other."""
    parts = []
    for time_s in map(np.array, times_s):
        signals = dict.fromkeys(SIGNALS, time_s)
        parts.append(
            Regressors(
                time_s,
                **signals,
                sliding=time_s >= 0,
                log=0 * time_s.astype(int),
                cutoff_hz=10.0,
                sources=("made",),
            )
        )
    return pooled(parts)


def sampled(options, *times_s):
    signals = logs_of(times_s)
    at = signals.time_s
    samples = FrictionSamples(at, at, at, "made", "0" * 64, {"log": signals.log.astype(float)})
    return with_temperature(samples, signals, options, WARMTH).columns


def test_each_log_has_the_temperature_of_its_own_time_whenever_its_clock_began(tmp_path):
    files = [
        written(tmp_path / "cold.csv", 0, np.linspace(20, 30, 101)),
        written(tmp_path / "warm.csv", 86_000, np.linspace(40, 41, 101)),
    ]
    options = [options_of(file, COLUMNS, None) for file in files]
    columns = sampled(options, [0.0, 0.1, 0.2], [0.1, 0.2])
    assert columns["temperature_c"] == pytest.approx([20, 25, 30, 40.5, 41])
    assert columns["log"].tolist() == [0, 0, 0, 1, 1]


def test_a_log_without_a_clock_goes_by_its_rate(tmp_path):
    file = written(tmp_path / "log.csv", 0, np.linspace(20, 30, 101))
    assert sampled([options_of(file, COLUMNS, 100.0)], [0.5])["temperature_c"] == pytest.approx([25])


@pytest.mark.parametrize(
    ("celsius", "head", "told"),
    [
        ([240.0, 1e4], "t,x,y,warm [degC]", "row 2: 'warm [degC]' is 10000 degC"),
        ([20.0, math.nan], "t,x,y,warm [degC]", "warm"),
        ([20.0, 21.0], "t,x,y,other", "warm"),
    ],
)
def test_what_is_no_temperature_is_refused(tmp_path, celsius, head, told):
    options = options_of(written(tmp_path / "log.csv", 0, celsius, head), COLUMNS, None)
    with pytest.raises(DataError) as refused:
        sampled([options], [0.0])
    assert told in str(refused.value)
