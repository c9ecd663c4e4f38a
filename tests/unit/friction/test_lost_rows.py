"""Rows that are lost again and again, and an angle that starts over where the log begins or ends."""

import math

import numpy as np
import pytest

from rtctl.errors import DataError
from rtctl.friction.logs.row_faults import Rows, mended

TIME_S = np.arange(4000) / 1000


def rows(position, time_s=TIME_S):
    return mended(
        Rows("log", time_s[: len(position)], position.copy(), {"torque": np.cos(7 * TIME_S[: len(position)])})
    )


def moved(counts=1e-6):
    path = 2.5 * np.sin(2.1 * TIME_S) + 0.3 * np.sin(11 * TIME_S)
    return np.round(path / counts) * counts


@pytest.mark.parametrize(("every", "kept", "further"), [(10, 9, 1), (12, 10, 2), (5, 4, 1)])
def test_rows_that_are_missing_again_and_again_are_told(every, kept, further):
    """Under even stamps. The running median knew too little of the other rows, and the bends looked like a
    slower device's."""
    told = rf"rows are missing at \d{{3}} places, the first after row {kept} .*by {further} rows"
    with pytest.raises(DataError, match=told):
        rows(moved()[np.arange(4000) % every < kept])


def test_stamps_that_tell_of_the_lost_rows_are_right():
    kept = np.arange(4000) % 10 != 9
    assert not rows(moved()[kept], TIME_S[kept]).notes


@pytest.mark.parametrize(
    "position",
    [
        moved(),
        moved(2 * math.pi / 4096),
        moved() + 1e-4 * np.random.default_rng(1).standard_normal(4000),
        np.where(
            np.arange(4000) % 10 == 5, np.roll(moved(), 1), moved()
        ),  # rows that come late, and catch up
    ],
    ids=["fine", "12 bits", "noise", "late"],
)
def test_motion_noise_and_late_rows_are_no_lost_rows(position):
    assert not any("missing" in note for note in rows(position).notes)


@pytest.mark.parametrize("row", [0, 1, 6, 3996, 3998])
def test_an_angle_may_start_over_in_any_row(row):
    path = moved()
    turned = path - 2 * math.pi * (np.arange(4000) > row)
    found = rows(turned)
    assert "starts over 1 times" in found.notes[0]
    # what the joint went in that row is in the jump, too
    assert np.abs(found.position_rad - path).max() < 0.02


@pytest.mark.parametrize("every", [2, 3])
def test_stretches_of_another_rate_are_told(every):
    place = np.arange(4000)
    within = ((place > 600) & (place < 900)) | ((place > 2300) & (place < 2600))
    told = rows(moved()[~within | (place % every == 0)]).notes[0]
    assert f"rows come at 1/{every} of the rate in some stretches: at " in told
    assert "the first about row 60" in told
    assert not rows(moved()[~within | (place % every == 0)], TIME_S[~within | (place % every == 0)]).notes


def test_speeds_that_double_in_no_whole_ratio_are_motion():
    there = np.repeat([1.0, 2.03, 1.01, 1.57, 0.97, 2.57], 100)
    speeds = np.concatenate([there, -1.01 * there, 1.03 * there, -0.98 * there, 1.02 * there])
    assert not any("of the rate" in note for note in rows(np.cumsum(speeds) / 1000).notes)
