import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rtctl.host.stall_watch import LOOK_S, SLACK_S, STALL_PERIODS, STALL_S, StallWatch, Verdict

PERIODS_S = (1e-4, 1e-3, 5e-3, 1e-2)


def since(watch, gaps_s, verdict, head=7):
    """When a loop that has made its last tick at time 0 is called late, or stalled."""
    assert not watch.look(head, 0.0, excused=False)
    now = 0.0
    for gap in gaps_s:
        now += gap
        if watch.look(head, now, excused=False) >= verdict:
            return now
    return None


@pytest.mark.parametrize("period_s", PERIODS_S)
def test_a_silent_loop_is_late_within_three_periods_and_ten_milliseconds_and_stalled_later(period_s):
    limit = STALL_PERIODS * period_s + STALL_S
    found = since(
        StallWatch(period_s, motor=True, punctual=True), itertools.repeat(LOOK_S, 1000), Verdict.LATE
    )
    assert limit - 2 * LOOK_S < found <= limit + 1e-9
    found = since(
        StallWatch(period_s, motor=True, punctual=True), itertools.repeat(LOOK_S, 1000), Verdict.STALLED
    )
    assert limit + SLACK_S < found <= limit + SLACK_S + LOOK_S + 1e-9


@pytest.mark.parametrize("motor", [True, False])
@pytest.mark.parametrize("period_s", PERIODS_S)
def test_without_rights_it_is_never_late_and_stalled_a_quarter_of_a_second_later(period_s, motor):
    found = since(
        StallWatch(period_s, motor=motor, punctual=False), itertools.repeat(0.02, 1000), Verdict.LATE
    )
    limit = STALL_PERIODS * period_s + STALL_S + SLACK_S
    assert limit < found <= limit + 0.02 + 1e-9


@pytest.mark.parametrize("punctual", [True, False])
@given(
    period_s=st.sampled_from(PERIODS_S),
    gaps_s=st.lists(st.floats(0.0, 2.0), max_size=60),
    after_ticks=st.integers(0, 2),
)
def test_a_loop_that_ticks_is_never_called_stalled_however_the_host_is_kept_waiting(
    punctual, period_s, gaps_s, after_ticks
):
    """Even one that makes its next tick only some periods after both were continued."""
    watch = StallWatch(period_s, motor=True, punctual=punctual)
    now = 0.0
    for gap in gaps_s:
        now += gap
        head = 1 + int(now / period_s) - min(after_ticks, int(now / period_s))
        assert not watch.look(head, now, excused=False)


@pytest.mark.parametrize("punctual", [True, False])
def test_a_standstill_of_the_host_says_nothing_about_the_loop(punctual):
    """SIGSTOP between two looks, and the loop's next tick comes after the second one."""
    watch = StallWatch(1e-2, motor=True, punctual=punctual)
    assert not watch.look(77, 100.0, excused=False)
    assert not watch.look(77, 100.6, excused=False)
    assert not watch.look(78, 100.601, excused=False)


@pytest.mark.parametrize("punctual", [True, False])
def test_silence_before_the_first_tick_and_with_an_excuse_does_not_count(punctual):
    watch = StallWatch(1e-3, motor=True, punctual=punctual)
    looks = [k * LOOK_S for k in range(2000)]
    assert not any(watch.look(0, now, excused=False) for now in looks)
    assert not any(watch.look(9, now, excused=True) for now in looks)
    assert not watch.look(9, looks[-1] + LOOK_S, excused=False)
    assert any(watch.look(9, looks[-1] + (k + 2) * LOOK_S, excused=False) for k in range(2000))


def test_silence_shows_from_the_second_look_on_until_the_next_tick():
    watch = StallWatch(1e-3, motor=True, punctual=True)
    seen = [
        watch.look(head, now, excused=False) or watch.is_silent
        for head, now in ((5, 0.0), (5, 0.002), (6, 0.004))
    ]
    assert seen == [False, True, False]
