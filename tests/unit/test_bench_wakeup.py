"""`rtctl bench wakeup`: its rows, its rounds, its picture; nothing is measured here."""

import os
from pathlib import Path

import numpy as np
import pytest

from rtctl.errors import RtctlError
from tests.bench import loads, wakeup
from tests.bench.cyclictest import Latencies


def measured(ours_us, theirs_us, rate_hz=1000.0):
    pair = wakeup.Beside(rate_hz, "idle", cost=[0.04], early_us=[60.0], missed=2)
    pair.ours += Latencies.of(np.array(ours_us) * 1000)
    pair.theirs += Latencies.of(np.array(theirs_us) * 1000)
    return pair


def test_every_percentile_is_judged_against_cyclictest():
    rows = list(measured([0.2] * 990 + [30] * 10, [20] * 990 + [50] * 10).rows())
    by_name = {row.name.split(",")[1].strip(): row for row in rows if row.name.startswith("start")}
    assert by_name["p50"].value == pytest.approx(0.2 / 20.5, rel=0.05)
    assert by_name["p50"].ok
    assert by_name["p99.9"].ok
    assert by_name["latest"].value == pytest.approx(30 / 50)
    late = {row.name.split(",")[1].strip(): row for row in measured([40] * 100, [20] * 100).rows()}
    assert late["p50"].ok is False
    assert late["p99.9"].ok is False


def test_starts_are_known_to_ten_nanoseconds_and_late_ones_to_a_microsecond():
    early = Latencies.of(np.array([130, 170, 210, 250])) + Latencies.of(np.array([150]))
    assert early.percentile_us(50.0) == pytest.approx(0.17, abs=0.011)
    assert early.percentile_us(99.9) == pytest.approx(0.25, abs=0.011)
    late = Latencies.of(np.array([100, 45_300]))
    assert late.percentile_us(50.0) == pytest.approx(0.1, abs=0.011)
    assert 45.0 <= late.percentile_us(99.0) <= 46.0
    assert Latencies.of(np.array([3e9])).percentile_us(50.0) == 200_000.0


def test_the_cost_has_a_bound_at_one_kilohertz_only():
    cost = next(row for row in measured([0], [1]).rows() if "of a core" in row.unit)
    assert (cost.value, cost.target) == (0.04, wakeup.MOST_COST)
    assert next(row for row in measured([0], [1], 4000.0).rows() if "of a core" in row.unit).target is None


def test_minutes_become_rounds():
    turn_s = 2 * 5.0 + wakeup.BESIDES_S
    for named, apart, count in (((), True, 1), (("cpu",), False, 2), (("cpu", "disk"), True, 5)):
        round_s = len(wakeup.RATES_HZ) * count * turn_s
        rounds = wakeup.rounds_in(10.0, 5.0, wakeup.Conditions(named, apart))
        assert rounds * round_s == pytest.approx(600.0, abs=0.5 * round_s)
    assert wakeup.rounds_in(0.3, 5.0, wakeup.Conditions(("cpu", "disk"))) == 1


def test_apart_each_load_is_measured_on_all_cores_and_on_all_but_the_loops():
    pairs = wakeup.Conditions(("cpu",), apart=True, cpu=1).pairs()
    assert [pair.name for pair in pairs if pair.rate_hz == 1000.0] == [
        "1 kHz, idle",
        "1 kHz, cpu",
        "1 kHz, cpu on other cores",
    ]
    assert {pair.core for pair in pairs} == {1}


def test_a_load_that_keeps_off_a_core_does_and_there_must_be_another():
    own = os.sched_getaffinity(0)
    for off in own:
        if own == {off}:
            with pytest.raises(RtctlError, match="only one"), loads.running("cpu", off):
                pass
            continue
        with loads.running("cpu", off):
            children = [
                int(pid) for pid in Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
            ]
            found = [
                os.sched_getaffinity(pid)
                for pid in children
                if "tests.bench.loads" in Path(f"/proc/{pid}/cmdline").read_text()
            ]
        assert found == [own - {off}] * (len(own) - 1)
        break


def test_the_picture_is_drawn(tmp_path):
    wakeup.picture([measured([0, 3, 900], [20, 30]), measured([1], [2], 10_000.0)], tmp_path / "w.svg")
    assert "cyclictest" in (tmp_path / "w.svg").read_text() or (tmp_path / "w.svg").stat().st_size > 5000
