"""Logs as programs of other makes write them are read as they are, or refused with what they are and the
remedy.
"""

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from other_layouts import every_layout
from other_layouts_of_carriages import LEVER_M
from other_loggers import Logger, log_of
from other_rigs import BLIMAN_SORINE, Rig

from hw.motion import of_units
from rtctl.cli.columns import tables
from rtctl.cli.identify_log import ROLES
from rtctl.errors import RtctlError
from rtctl.friction.logs.log_input import Gearing, options_of, read_log
from rtctl.recording.as_columns import register

pytestmark = pytest.mark.compiled

LAYOUTS = every_layout()

REFUSED = {
    "ODrive, turns taken for radians": None,  # nothing in the file says turns
    "CiA 402, per mille taken for newton-metres": r"torque actual.*the file says ‰",
    "N cm, read as N m": r"read in N m, the file says N cm; give the unit",
    "Simulation Data Inspector, one time for each rate": r"more than one column 'time'.*#1 or #3",
    "stamps of whole milliseconds at 1 kHz, some twice": r"duplicated timestamps.*--rate-hz 1000",
    "last row cut off": r"the file may be cut off",
    "zeros above and below, as a buffer not yet full": r"time does not increase.*in row \d+",
    "the wrong case in the name": r"no column 'position'; the header has: Time, Position, Torque",
    "an .xlsx given as it is": r"a spreadsheet.*CSV",
    "TDMS called .dat": r"TDMS.*\.tdms",
    "a bag of ROS 2 without joint states": r"topics: /chatter",
    "SQLite bag": r"SQLite.*CSV",
    "candump -L": r"a trace of a CAN bus.*DBC.*docs/logs\.md",
    "candump -t a": r"a trace of a CAN bus.*DBC.*docs/logs\.md",
    "two messages, a row each, the other held": r"rows come in bursts, 0\.0002 s apart with 0\.0008 s between"
    r".*keep the rows of the slowest",
    "MATLAB timeseries": r"no array 'ts'; the file holds MATLAB objects.*save",
    "LabVIEW measurement in segments": r"row 2000 begins another table.*cut it there",
    "a bag of ROS 2, each message packed": r"no message of /joint_states can be read: packed one by one"
    r".*ros2 bag convert",
    "mean and deviation below the rows": r"row \d+: 'Mean' .*on 2 row.s. are none of the log.*delete",
    "TwinCAT, the torque at a quarter of the rate with its own times": r"'#4' row \d+: the column ends there"
    r".*of another rate.*its own times",
    "a dict in an npz": r"'log' holds Python objects.*save each column as numbers",
    "nanoseconds since 1970 taken for seconds, some twice": r"correct the unit of the time",
    "Unix time in six digits": r"every row has the stamp 1700000000 s.*more digits.*--rate-hz",
    "a row for each signal": r"'value' is mapped twice.*a column of each first",
    "no time, and no rate given": r"no column 'time_s'.*time=NAME:UNIT.*--rate-hz",
    "no time in an npz, and no rate given": r"no column 'time_s'.*time=NAME:UNIT.*--rate-hz",
    "a row for each signal, asked for by their names": r"'q' stands in the rows of 'signal'.*pivot_table",
    "a row for each signal in an npz, asked for by their names": r"'q' stands in the rows of 'signal'.*pivot",
    "a night in which summer time ends, without zones": r"set back by an hour, as summer time ends; cut it",
    "ros2 topic echo as it is shown": r"ros2 topic echo --csv",
    "carriage: kilograms of a load cell, taken for newtons": r"Force \(kgf\).*says kgf.*give 9\.80665 N",
    "carriage: kN in the header, taken for newtons": r"'Kraft' is read in N, the file says kN; give",
    "carriage: millimetres and newton-metres": r"'tau_nm' is read in 'Nm', which this axis does not have",
    "a bag as csv, lists in quoted cells": r"'position' row 1: '\[0\.1, .*but a list.*a column of its own",
    "blocks of a USB transfer: 64 rows of one stamp each": r"\d+ duplicated.*in blocks.*give the rate.*100\d",
    "two decimals of the time: ten rows of one stamp each": r"too few digits: give the rate.*--rate-hz 1000",
    "remarks behind some rows": r"'tau' row 1001: .*# hand on.*a remark behind one; delete the remark",
    "Grafana, a prefix of its own in each cell": r"'torque' is read in N m, the file says mN m",
    "Data Inspector, times of all signals in one column and empty cells": r"keep the rows of the slower one",
    "µNm taken for newton-metres": r"'M1' is read in N.?m, the file says uN m.*give 1e-06 N m",
    "oscilloscope, volts taken for what they stand for": r"'1' is read in rad.*says V, .*give the scale",
    "pandas, two rows of names, asked for by the upper one": r"'arm' is mapped twice.*map the places",
    "a bag of ROS 2 in SQLite, with its table of messages": r"SQLite.*ros2 bag convert",
    "times of the wall beside a counter that is 20 % off": None,  # read, and told
    "the folder of a bag": r"is a folder: give a file in it \(bag\.mcap",
}
"""Layouts that are not read, and what must be said; None: read, and judged by what comes of it."""


GEAR = {
    "--torque-constant": "torque_constant_nm_a",
    "--counts-per-rev": "counts_per_rev",
    "--lead-m": "lead_m",
}


@cache
def log():
    return log_of(Rig(law=BLIMAN_SORINE, program="moves", seconds=6.0), Logger())


def read(name, folder):
    """What the reader of `rtctl identify --log` makes of a layout, by its command line."""
    register()
    words = iter(LAYOUTS[name](log(), folder))
    columns, path, gear, rate = [], None, {}, None
    for option in words:
        value = next(words)
        if option == "--column":
            columns.append(value)
        elif option == "--log":
            path = value
        elif option == "--rate-hz":
            rate = float(value)
        else:
            gear[GEAR[option]] = float(value)
    mapped = {ROLES[role]: table for role, table in tables(tuple(columns), None, tuple(ROLES)).items()}
    units = of_units(table.get("unit") for table in mapped.values())
    gearing = Gearing(motion="linear" if "lead_m" in gear else units, **gear).of_screw()
    return read_log(options_of(path, mapped, rate), gearing, 0.0)


@pytest.mark.parametrize("name", [name for name in LAYOUTS if name not in REFUSED])
def test_a_layout_is_read_as_it_is(name, tmp_path):
    (found,) = read(name, tmp_path)
    n, lever = len(found.position_rad), LEVER_M if name.startswith("carriage: ") else 1.0
    assert abs(n - len(log().time)) <= 2
    assert found.rate_hz == pytest.approx(1000, rel=1e-4)
    off = found.position_rad / lever - log().position[:n]
    # counts that wrap begin somewhere: their zero is as good as any
    assert np.abs(off - (off[0] if "wrap" in name else 0)).max() < 2e-4
    assert np.abs(found.torque_nm * lever - log().torque[:n]).max() < 2.5e-3


@pytest.mark.parametrize("name", [name for name, said in REFUSED.items() if said])
def test_what_is_not_read_is_named_with_its_remedy(name, tmp_path):
    with pytest.raises(RtctlError) as refused:
        read(name, tmp_path)
    assert re.search(REFUSED[name], str(refused.value)), str(refused.value)


def test_a_counter_that_starts_over_is_continued_and_that_is_said(tmp_path):
    (found,) = read("microseconds of a counter of 32 bits that overflows", tmp_path)
    assert any("a counter of 32 bits starts over" in note for note in found.notes)


DBC = """VERSION ""
BU_: ODrive
BO_ 105 Encoder_Estimates: 8 ODrive
 SG_ Pos_Estimate : 0|32@1- (1,0) [0|0] "rev" Vector__XXX
 SG_ Vel_Estimate : 32|32@1- (1,0) [0|0] "rev/s" Vector__XXX
BO_ 116 Iq: 8 ODrive
 SG_ Iq_Setpoint : 0|32@1- (1,0) [0|0] "A" Vector__XXX
 SG_ Iq_Measured : 32|32@1- (1,0) [0|0] "A" Vector__XXX
SIG_VALTYPE_ 105 Pos_Estimate : 1;
SIG_VALTYPE_ 105 Vel_Estimate : 1;
SIG_VALTYPE_ 116 Iq_Setpoint : 1;
SIG_VALTYPE_ 116 Iq_Measured : 1;
"""


def test_the_lines_that_the_document_gives_make_a_log_of_a_trace(tmp_path, monkeypatch):
    LAYOUTS["candump -L"](log(), tmp_path)
    (tmp_path / "drive.dbc").write_text(DBC)
    document = (Path(__file__).parents[3] / "docs" / "logs.md").read_text()
    monkeypatch.chdir(tmp_path)
    exec(document.split("```python\n")[1].split("```")[0], {})
    found = np.load("log.npz")
    assert np.abs(2 * np.pi * found["position"] - log().position).max() < 1e-6
    assert np.abs(np.diff(found["t"]) - 1e-3).max() < 1e-5
    late = np.interp(found["t"], found["t"] + 2e-4, log().current)
    assert np.abs(found["current"] - late)[1:].max() < 1e-4
