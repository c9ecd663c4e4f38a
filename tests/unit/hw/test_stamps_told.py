"""Stamps of another unit or epoch than they are read in, of several runs, or of no clock at all."""

from pathlib import Path

import numpy as np
import pytest

from hw.interface import BackendError
from hw.playback.reader import TIME_UNITS
from hw.playback.rising import counts_rows, require_epoch, require_rising

LOG = Path("log.csv")


@pytest.mark.parametrize(
    ("first", "unit", "says"),
    [
        (638_769_529_310_000_000, "us", r"ticks of \.NET.*t:s:1e-7"),
        (638_769_529_310_000_000, "ns", r"ticks of \.NET.*t:s:1e-7"),
        (133_900_000_000_000_000, "ns", r"FILETIME.*t:s:1e-7"),
        (1_741_356_131_000_000, "ms", "as us it is since 1970"),
        (1_741_356_131_000, "s", "as ms it is since 1970"),
    ],
)
def test_a_stamp_that_says_another_unit_is_refused_with_it(first, unit, says):
    with pytest.raises(BackendError, match=says):
        require_epoch(LOG, "t", float(first), unit, TIME_UNITS)


@pytest.mark.parametrize(
    ("first", "unit"),
    [
        (1_741_356_131, "s"),
        (1_741_356_131_000_000, "us"),
        (1_741_356_131e9, "ns"),
        (1.7e15, "ns"),  # since the machine was started, twenty days ago
        (739_683.58, "days"),  # MATLAB's
        (3.82e9, "s"),  # LabVIEW's, since 1904
        (0.0, "s"),
    ],
)
def test_a_stamp_of_any_usual_epoch_is_read(first, unit):
    require_epoch(LOG, "t", float(first), unit, TIME_UNITS)


def test_runs_one_after_the_other_are_cut_and_a_clock_set_back_a_little_is_sorted():
    t = np.arange(3000) * 0.001
    with pytest.raises(
        BackendError, match=r"starts over in row 1001 .*2 such rows.*cut it there, not sorted"
    ):
        require_rising(LOG, np.concatenate([t[:1000], t[:1000], t[:1500]]))
    swapped = t.copy()
    swapped[[500, 501]] = swapped[[501, 500]]
    with pytest.raises(BackendError, match="unsorted time: row 502"):
        require_rising(LOG, swapped)


def test_a_column_that_counts_rows_is_no_clock():
    rows = np.arange(100.0)
    for name in ("sample", "Sample No.", "index", "n", "#", "Unnamed: 0"):
        assert "counts rows" in counts_rows(LOG, name, rows, "ms")[0]
    assert not counts_rows(LOG, "time", rows, "ms")
    assert not counts_rows(LOG, "n", 2 * rows, "ms")
