"""A drive comes up in time and stays up, or it is ill until the host disarms it."""

from hw.can.armed import Armed


def told(armed, wanted, *words):
    allowed = [armed.order(wanted)]
    for word in words:
        armed.saw(word)
        allowed.append(armed.order(wanted))
    return allowed


def test_a_drive_that_does_not_come_up_in_time_is_ill():
    armed = Armed(3)
    assert told(armed, True, False, False) == [True] * 3
    assert not armed.ill
    assert told(armed, True) == [True]
    assert armed.ill
    armed.saw(True)
    assert not armed.ill, "late, but the law has judged that by then"


def test_one_that_was_up_and_is_down_stays_ill_whatever_it_says_later():
    armed = Armed(1000)
    assert told(armed, True, False, True, True, False, True, True) == [True] * 4 + [False] * 3
    assert armed.ill


def test_what_it_says_while_disarmed_counts_for_nothing():
    armed = Armed(3)
    assert told(armed, False, True, False, True) == [False] * 4
    assert not armed.ill
    told(armed, True, True, False)
    assert armed.ill
    assert told(armed, False) == [False]
    assert not armed.ill
    assert told(armed, True, True, True) == [True] * 3
