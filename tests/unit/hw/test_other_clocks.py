"""A time that another clock in the file contradicts is told, and one that it does not is not."""

import numpy as np
import pytest

from hw.interface import BackendError
from hw.playback.options import PlaybackOptions
from hw.playback.reader import load_stretches
from rtctl.friction.logs.log_input import Gearing

ROWS = 3000


def notes(path, head, times, beside=None, **options):
    names = "t,q,tau" + (",logged" if beside else "")
    cells = [f"{t:.6f},{np.sin(t):.6f},0.1" for t in times]
    rows = [f"{row},{at}" for row, at in zip(cells, beside, strict=True)] if beside else cells
    path.write_text("\n".join([*head, names, *rows]) + "\n")
    return read(path, **options)


def read(path, **options):
    table = {"file": str(path), "axis": [{"position": {"column": "q"}, "motor_torque": {"column": "tau"}}]}
    table |= options or {"time": {"column": "t"}}
    plain = PlaybackOptions.model_validate(table, context={"folder": path.parent}).model_dump(mode="json")
    return [
        note for note in load_stretches(plain, Gearing().rig())[0].notes if "clock" in note or "wrong" in note
    ]


T = np.arange(ROWS) / 1000


def walls(times):
    return [f"2026-03-07 14:02:{10 + t:09.6f}" for t in times]


@pytest.mark.parametrize(
    "head",
    [
        "# Sample Rate: 1000 Hz",
        "Sampling rate [kHz];1",
        "Sample Interval,0.001",
        "dt = 1e-3",
        "Abtastrate: 1 kHz",
    ],
)
def test_a_rate_above_the_header_contradicts_a_slow_clock(head, tmp_path):
    path = tmp_path / "log.csv"
    assert notes(path, [head], T) == []
    (told,) = notes(path, [head], T / 1.2)
    assert "the rows are 0.001 s apart, by column 't' 0.000833" in told
    assert "inertia would be 1.44 times as large, viscous friction 1.2 times" in told
    assert notes(path, [head], 10 * T) == [], "one row of ten was kept"
    assert notes(path, [head], T, rate_hz=1000.0) == []
    assert len(notes(path, [head], T, rate_hz=1200.0)) == 1


def test_an_increment_below_its_name_contradicts_a_rate(tmp_path):
    path = tmp_path / "scope.csv"
    rows = "\n".join(f"{k},{np.sin(t):.6f},0.1," for k, t in enumerate(T))
    path.write_text(f"X,q,tau,Start,Increment,\nSequence,rad,Nm,-1.5,1.0e-03,\n{rows}\n")
    assert read(path, rate_hz=1000.0) == []
    (told,) = read(path, rate_hz=800.0)
    assert (
        "the line 'Increment: 1.0e-03' the rows are 0.001 s apart, by the rate that is given 0.00125 s"
        in told
    )


@pytest.mark.parametrize("beside", [walls, lambda t: [f"{1_772_892_130 + one:.4f}" for one in t]])
def test_a_clock_of_the_wall_beside_the_time_contradicts_it(beside, tmp_path):
    path = tmp_path / "log.csv"
    assert notes(path, [], T, beside(T)) == []
    (told,) = notes(path, [], T / 1.2, beside(T))
    assert "by column 'logged' the log lasts 2.999 s" in told
    assert "column 't' 2.49917 s" in told


def test_whole_seconds_of_the_wall_tell_a_short_log_nothing(tmp_path):
    path = tmp_path / "log.csv"
    assert notes(path, [], T / 1.2, [text[:19] for text in walls(T)]) == []


@pytest.mark.parametrize("head", ["Sample Rate: 1,000", "Sample Rate: fast", "Record Length,3000", "rate 7"])
def test_what_is_no_rate_contradicts_nothing(head, tmp_path):
    assert notes(tmp_path / "log.csv", [head], T) == []


def test_a_time_that_stands_is_refused_as_that_beside_another_clock(tmp_path):
    with pytest.raises(BackendError, match="time does not increase"):
        notes(tmp_path / "log.csv", ["dt = 0.001"], np.zeros(ROWS))
