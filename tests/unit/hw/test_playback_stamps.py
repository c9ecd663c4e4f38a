"""Stamps of a log: even, rounded, uneven, with gaps."""

from pathlib import Path

import numpy as np
import pytest

from hw.interface import BackendError, Rig
from hw.playback.reader import load_stretches
from hw.playback.rising import jittered
from hw.playback.stamps import grid_of, interpolated, is_even, resolution

LOG = Path("log.csv")


def made(time_s, q=0.0):
    return grid_of(LOG, np.asarray(time_s, float), q)


def test_even_stamps_are_left_as_they_are():
    grid = made(5.0 + 0.002 * np.arange(500))
    assert grid.rate_hz == pytest.approx(500)
    assert [each.instants_s for each in grid.stretches] == [None]
    assert grid.notes == ()


@pytest.mark.parametrize("period_ms", [10 / 3, 2.5, 7.3])
def test_stamps_that_only_rounding_makes_uneven_are_even(period_ms):
    ms = np.floor(period_ms * np.arange(2000) + 0.45)
    assert resolution(ms) == 1.0
    grid = made(1e-3 * ms, 1e-3)
    assert grid.rate_hz == pytest.approx(1e3 / period_ms, rel=5e-4)
    assert grid.stretches[0].instants_s is None


@pytest.mark.parametrize("period_ms", [2.0, 5.0, 8.0])
def test_whole_milliseconds_of_a_clock_that_jitters_by_less_are_even_and_a_lost_row_shows(period_ms):
    rng = np.random.default_rng(1)
    taken = period_ms * 1.0001 * np.arange(5000) + rng.uniform(-0.2, 0.2, 5000) + 0.3
    ms = np.floor(taken)
    grid = made(1e-3 * ms, 1e-3)
    assert grid.rate_hz == pytest.approx(1e3 / period_ms, rel=2e-4)
    assert [each.instants_s for each in grid.stretches] == [None]
    lost = made(1e-3 * np.delete(ms, 1700), 1e-3)
    assert lost.stretches[0].instants_s is not None
    if period_ms > 3:  # the others are known to be where they were
        assert np.std(lost.stretches[0].stamps_s - 1e-3 * np.delete(taken, 1700)) < 2e-4


def test_a_clock_that_jitters_by_more_than_its_rounding_is_resampled():
    taken = 10.0 * np.arange(2000) + np.random.default_rng(1).uniform(-2, 2, 2000)
    assert made(1e-3 * np.round(taken), 1e-3).stretches[0].instants_s is not None


def test_stamps_that_alternate_are_no_rounding():
    ms = np.cumsum([0, *([10, 12] * 300)])
    assert not is_even(1e-3 * ms, 0.011, 1e-3 * resolution(ms))
    grid = made(1e-3 * ms, 1e-3)
    assert grid.rate_hz == pytest.approx(1 / 0.011)
    np.testing.assert_allclose(np.diff(grid.stretches[0].instants_s), 0.011)
    assert "10 to 12 ms: resampled on the stamps, every 11 ms" in grid.notes[0]


def test_a_lost_row_of_whole_milliseconds_is_not_taken_for_rounding():
    grid = made(1e-3 * np.delete(np.arange(1000.0), 400), 1e-3)
    assert grid.stretches[0].instants_s is not None


def test_a_gap_parts_the_log_and_two_lost_rows_do_not():
    t = 0.01 * np.arange(400)
    grid = made(np.delete(t, [50, 51, *range(200, 250)]))
    assert [(each.first, each.last) for each in grid.stretches] == [(0, 198), (198, 348)]
    assert grid.stretches[0].instants_s is not None
    assert len(grid.stretches[0].instants_s) == pytest.approx(200, abs=2)
    assert "1 gap(s), the longest 0.51 s after row 198" in grid.notes[0]


def test_a_signal_is_that_of_its_instants():
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.uniform(0.008, 0.012, 1000))
    grid = made(t)
    (whole,) = grid.stretches
    both = whole.signal(np.column_stack([np.sin(9 * t), np.cos(9 * t)]))
    at = whole.instants_s
    np.testing.assert_allclose(both, np.column_stack([np.sin(9 * at), np.cos(9 * at)]), atol=1e-5)
    assert at[0] == t[0]
    assert at[-1] <= t[-1]


@pytest.mark.parametrize("counts", [0, 4096])
def test_stamps_that_jitter_where_the_rows_do_not_are_told_and_no_others(counts):
    even = 0.004 * np.arange(3000)
    stamps = even + np.random.default_rng(1).uniform(-0.0015, 0.0015, 3000)

    def position(taken_s):
        angle = np.sin(2 * np.pi * taken_s) + 0.3 * np.sin(11 * taken_s)
        return np.round(angle * counts) / counts if counts else angle

    (told,) = jittered(LOG, stamps, position(even))
    assert "their stamps jitter" in told
    assert "--rate-hz 25" in told
    assert not jittered(LOG, stamps, position(stamps))
    assert all(not jittered(LOG, stamps[:n], position(even[:n])) for n in range(2, 20))
    (told,) = jittered(LOG, stamps, even, 3)
    assert "is far rougher over its stamps" in told
    assert "is the mean; each part between gaps as a log of its own)" in told
    assert not jittered(LOG, stamps, np.round(8 * position(even)) / 8)  # steps alone are rough over both


def read(path, stamps, position):
    """Stretches of a log of one axis with these rows."""
    rows = "".join(f"{t:.9f},{q:.9f}\n" for t, q in zip(stamps, position, strict=True))
    path.write_text(f"t,q\n{rows}")
    one = np.ones(1)
    options = {"file": str(path), "time": {"column": "t"}, "axis": [{"position": {"column": "q"}}]}
    return load_stretches(options, Rig(1, 1e-3, one, one, one, one, np.ones((1, 3))))


def test_the_rate_of_jittering_rows_is_that_between_gaps(tmp_path):
    even = 0.004 * np.arange(400) + 100.0 * (np.arange(400) >= 300)
    stamps = even + np.random.default_rng(2).uniform(-0.0015, 0.0015, 400)
    first, _last = read(tmp_path / "a.csv", stamps, np.sin(6 * even))
    assert len(first) == 300
    assert any("--rate-hz 249.7" in note and "each part between gaps" in note for note in first.notes)


@pytest.mark.parametrize("rows", [3, 4, 5])
def test_a_few_uneven_rows_are_read(tmp_path, rows):
    (one,) = read(tmp_path / "a.csv", [0.0, 0.01, 0.0233, 0.03, 0.041][:rows], np.arange(rows))
    assert len(one) == rows


def test_few_rows_are_joined_by_straight_lines():
    assert interpolated(np.array([0.0, 1.0]), np.array([0.0, 2.0]), np.array([0.25]))[0] == 0.5


def test_stamps_without_a_usual_step_are_refused():
    t = np.cumsum(np.random.default_rng(2).exponential(0.01, 500))
    with pytest.raises(BackendError, match=r"log.csv: uneven sampling: .* record at a steady rate"):
        made(t)


@pytest.mark.parametrize("rows", [5, 40])
def test_rows_that_are_stamped_as_a_packet_arrives_are_given_their_rate(rows):
    taken = 1e-3 * np.arange(4000)
    packet = np.arange(4000) // rows
    late = np.random.default_rng(1).uniform(0, 2e-4 * rows, packet[-1] + 1)[packet]
    arrived = taken[np.minimum(rows * (packet + 1), 4000) - 1] + late + 2e-5 * (np.arange(4000) % rows)
    with pytest.raises(BackendError, match=rf"bunches of {rows}, 2e-05 s apart .*--rate-hz (999|1000)"):
        made(arrived)


@pytest.mark.parametrize("pause_s", [np.full(20, 5.0), np.r_[np.full(10, 0.04), np.full(10, 9.0)]])
def test_strokes_with_pauses_between_them_are_no_packets(pause_s):
    rows = 200 if pause_s[0] > 1 else 20
    time_s = np.repeat(pause_s.cumsum(), rows) + 1e-3 * np.arange(20 * rows)
    assert len(made(time_s).stretches) == 20


def test_seconds_of_single_precision_are_even_on_both_sides_of_a_gap():
    t = np.arange(6000) * 1e-3
    stamps = (10800 + t + 3 * (t >= 2.5)).astype(np.float32).astype(float)
    assert resolution(stamps) == np.spacing(np.float32(10800))
    grid = made(stamps, resolution(stamps))
    assert grid.rate_hz == pytest.approx(1000, rel=1e-4)
    assert [each.instants_s for each in grid.stretches] == [None, None]


def test_a_lost_row_among_seconds_of_single_precision_is_seen():
    stamps = (10800 + np.delete(np.arange(6000), 3000) * 1e-3).astype(np.float32).astype(float)
    assert made(stamps, resolution(stamps)).stretches[0].instants_s is not None
