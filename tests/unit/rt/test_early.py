"""Awake before the deadline: how long, who decides, and what follows the wake-ups."""

import time

import numpy as np
import pytest

from rtctl.rt import clock, early

AUTO_1_KHZ = {"asked": "auto", "period_s": 1e-3, "cores": 2, "granted": True, "share": 0.95}


def chosen(**changed):
    ns = np.zeros(early.PLACES, np.int64)
    order = {**AUTO_1_KHZ, **changed}
    grant = early.choose(ns, order.pop("asked"), order.pop("period_s"), order.pop("cores"), **order)
    return ns, grant


def test_auto_looks_no_longer_than_200_us_78_on_average_and_40_percent_of_the_period():
    ns, grant = chosen()
    assert (ns[early.MARGIN], ns[early.INCOME], ns[early.MOST]) == (78_000, 78_000, 200_000)
    assert "up to 200 us" in grant.detail
    assert "7.8% of its core" in grant.detail
    quick = chosen(period_s=1e-4)[0]
    assert quick[early.INCOME] == quick[early.MOST] == 40_000


@pytest.mark.parametrize(("changed", "why"), [({"granted": False}, "rights"), ({"cores": 1}, "only core")])
def test_auto_leaves_the_time_to_others_where_they_need_it(changed, why):
    ns, grant = chosen(**changed)
    assert not ns[: early.STEP].any()
    assert not grant.granted
    assert not grant.required
    assert why in grant.detail


def test_a_number_is_kept_to_and_does_not_move():
    ns, grant = chosen(asked=25.0, granted=False, cores=1)
    assert list(ns[: early.STEP]) == [25_000, 0]
    assert "25 us" in grant.detail
    before = ns.copy()
    clock._follow(ns, 90_000)
    assert list(ns) == list(before)
    assert chosen(asked=0.0)[0][early.MARGIN] == 0


def test_more_than_the_bound_is_cut_and_told():
    ns, grant = chosen(asked=3000.0)
    assert ns[early.MARGIN] == 400_000
    assert "3000 us were asked (loop.early_us)" in grant.detail


def test_what_the_kernel_throttles_bounds_the_look(tmp_path):
    (tmp_path / "sched_rt_runtime_us").write_text("100000\n")
    (tmp_path / "sched_rt_period_us").write_text("1000000\n")
    share = early.realtime_share(tmp_path)
    assert share == pytest.approx(0.1)
    assert chosen(asked=500.0, share=share)[0][early.MARGIN] == 50_000
    (tmp_path / "sched_rt_runtime_us").write_text("-1\n")
    assert early.realtime_share(tmp_path) == 1.0
    assert early.realtime_share(tmp_path / "hidden from a service") == 0.95


def test_the_margin_settles_where_one_wake_up_of_two_hundred_is_later():
    ns, _ = chosen()
    late_ns = np.random.default_rng(1).exponential(8_000.0, 200_000).astype(np.int64)
    kept = []
    for late in late_ns:
        clock._follow(ns, int(late))
        kept.append(int(ns[early.MARGIN]))
    wanted = np.quantile(late_ns, 1 - early.LATE_SHARE)
    assert np.mean(kept[50_000:]) == pytest.approx(wanted, rel=0.1)
    assert max(kept) <= 200_000


def test_what_a_quiet_stretch_saves_a_later_one_spends_and_no_more():
    """The look by its own definition, from outside: from wake-up to deadline, where that is ahead."""
    draw = np.random.default_rng(2)
    quiet, late = draw.exponential(8_000.0, 60_000), draw.exponential(90_000.0, 60_000)
    ns, _ = chosen()
    looked, margins = [], []
    for one in np.concatenate([quiet, late]).astype(np.int64):
        margins.append(int(ns[early.MARGIN]))
        looked.append(max(margins[-1] - int(one), 0))
        clock._follow(ns, int(one))
    spent, saved_ns = np.cumsum(looked), 78_000 * 10_000
    assert ns[early.LOOKED] == spent[-1]
    for window in (1, 1000, 20_000, len(spent)):
        most = np.max(spent[window - 1 :] - np.concatenate([[0], spent[:-window]]))
        assert most <= 78_000 * window + saved_ns
    assert max(margins) == 200_000
    after = np.array(looked[80_000:])
    assert np.mean(after) == pytest.approx(78_000, rel=0.02), "all of the income is spent"
    assert min(margins[80_000:]) >= 78_000, "never less than the income"


def test_the_host_tells_the_share_since_it_last_told():
    ns, _ = chosen()
    look = early.Look(ns)
    look.told(5_000_000_000)
    for _ in range(1000):
        clock._follow(ns, 20_000)
    told = look.told(6_000_000_000)
    assert told["early_us"] == pytest.approx(68.0)
    assert told["early_share"] == pytest.approx(1000 * (73_000 - 20_000) / 1e9, rel=0.01)


def test_the_margin_stays_within_its_bounds_whatever_the_wake_ups():
    ns, _ = chosen()
    for late in (10**9, -(10**9)):
        for _ in range(100_000 if late < 0 else 100):
            clock._follow(ns, late)
        assert ns[early.MARGIN] == (200_000 if late > 0 else 0)


@pytest.mark.compiled
def test_a_clock_that_looks_never_comes_before_the_deadline_and_keeps_its_margin_in_the_array():
    ns, _ = chosen()
    wall = clock.WallClock(ns)
    assert ns[early.MARGIN] == 78_000, "compiling moves nothing"
    ns[early.MARGIN] = 40_000
    for _ in range(20):
        deadline = time.monotonic_ns() + 1_000_000
        assert deadline <= wall.sleep_until(deadline) <= time.monotonic_ns()
    assert wall.early is ns
    assert ns[early.MARGIN] != 40_000, "it follows"
    behind = ns.copy()
    wall.sleep_until(time.monotonic_ns() - 1_000_000)
    assert list(ns) == list(behind), "a grid that is behind tells nothing of wake-ups"
