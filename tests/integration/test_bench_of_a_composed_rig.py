"""The judge of `rtctl bench io`'s composed rig can tell stale from fresh, and the measurement runs."""

import math
from types import SimpleNamespace

import pytest

from rtctl.tick import new_ticks
from tests.bench import io_composed


def judged(*cycles):
    ages, tick = io_composed.Ages(), new_ticks(1, 1)
    for count, turns, force, now in cycles:
        tick["sample_count"], tick["position_rad"], tick["force_n"][0, 0] = count, turns * math.tau, force
        ages.judge(tick, now, SimpleNamespace(turns=now, force_n=now))
    return ages


def test_a_sample_that_repeats_under_a_new_count_is_stale_shown_as_fresh():
    assert judged((1, 1.0, 1.0, 1.0), (2, 1.001, 1.001, 1.001)).stale_as_fresh == 0
    assert judged((1, 1.0, 1.0, 1.0), (1, 1.0, 1.0, 1.001)).stale_as_fresh == 0, "repeated, and told so"
    assert judged((1, 1.0, 1.0, 1.0), (2, 1.0, 1.001, 1.001)).stale_as_fresh == 1, "the drive's is old"
    once = [(1 + k, 1.0 + k, 1.0, 1.0) for k in range(2)]
    assert judged(*once).stale_as_fresh == 0, "the sensor may miss a cycle"
    assert judged(*once, (3, 3.0, 1.0, 1.0)).stale_as_fresh == 1, "but not two"


def test_the_older_part_of_a_sample_is_its_age():
    ages = judged((1, 1.0, 1.0, 1.001), (2, 1.003, 1.0, 1.003), (3, 1.0, 1.004, 1.004))
    assert (ages.cycles, ages.old, ages.old_bare) == (3, 2, 0)


def test_both_readers_follow_the_devices():
    ages = io_composed.measure(1.0)
    assert ages.stale_as_fresh == 0
    assert ages.fresh > 10
    assert ages.cycles > ages.old_bare
    assert ages.cycles > ages.old


def test_a_rig_that_gives_no_samples_is_no_figure(monkeypatch):
    monkeypatch.setattr(io_composed, "measure", lambda _: io_composed.Ages(cycles=100, fresh=3))
    with pytest.raises(io_composed.RtctlError, match="only 3 samples in 100 cycles"):
        io_composed.rows(1.0)
