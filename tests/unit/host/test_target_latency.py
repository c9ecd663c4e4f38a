import numpy as np

from rtctl.host.exchange.target_latency import TargetLatency
from rtctl.tick import new_ticks


def rows(*seqs):
    out = new_ticks(len(seqs), 1)
    out["command_seq"] = seqs
    out["time_ns"], out["wakeup_ns"] = 1_000_000 * (1 + np.arange(len(seqs))), 50_000
    return out


def test_a_target_is_late_by_the_time_until_the_tick_that_took_it():
    latency = TargetLatency(virtual=False)
    latency.handed(7, 800_000)
    latency.handed(9, 2_500_000)
    latency.observe(rows(6, 7, 7, 9))
    told = latency.take()
    assert told["max"] == (4_050_000 - 2_500_000) / 1e3
    assert told["p50"] == ((2_050_000 - 800_000) + (4_050_000 - 2_500_000)) / 2e3
    assert latency.take() is None


def test_targets_the_loop_has_not_taken_wait_for_later_ticks_and_are_bounded():
    latency = TargetLatency(virtual=False)
    latency.handed(20, 0)
    latency.observe(rows(6, 7))
    latency.observe(rows())
    assert latency.take() is None
    latency.observe(rows(19, 21))
    assert latency.take()["max"] == 2050.0
    for seq in range(100_000):
        latency.handed(1_000_000 + seq, 0)
    assert len(latency._waiting) < 5000


def test_a_virtual_clock_is_not_compared_with_this_machines():
    latency = TargetLatency(virtual=True)
    latency.handed(1, 5)
    latency.observe(rows(1))
    assert latency.take() is None
