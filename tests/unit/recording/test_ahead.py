"""Working ahead changes nothing but the time: order, errors and ends come as they would have."""

import threading

import pytest

from rtctl.recording.read_ahead import ahead


def threads():
    return [one for one in threading.enumerate() if one.name == "ahead"]


def test_items_come_in_order_and_the_thread_ends():
    assert list(ahead(iter(range(1000)))) == list(range(1000))
    assert not threads()


def test_an_error_comes_after_the_items_before_it():
    def broken():
        yield 1
        yield 2
        raise OSError("gone")

    seen = []
    with pytest.raises(OSError, match="gone"):
        seen.extend(iter(one for one in _kept(ahead(broken()), seen)))
    assert seen == [1, 2]
    assert not threads()


def _kept(items, seen):
    for item in items:
        seen.append(item)
        yield from ()


def test_a_caller_that_stops_early_closes_the_iterator_and_its_thread():
    closed = []

    def endless():
        try:
            k = 0
            while True:
                yield k
                k += 1
        finally:
            closed.append(True)

    items = ahead(endless())
    assert [next(items), next(items)] == [0, 1]
    items.close()
    assert closed == [True]
    assert not threads()


def test_it_is_really_ahead_and_never_by_more_than_it_may():
    made, two = [], threading.Event()

    def counting():
        for k in range(10):
            made.append(k)
            if k == 2:
                two.set()
            yield k

    items = ahead(counting(), depth=2)
    assert next(items) == 0
    assert two.wait(30)
    assert len(made) <= 4
    assert list(items) == list(range(1, 10))
