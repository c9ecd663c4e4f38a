"""The figures of `rtctl bench feel` from torques whose delay, softening and arrival are known."""

import numpy as np
import pytest

from tests.bench.feel import LATEST_MS, arrival_ticks, compare

FAST = np.sin(2 * np.pi * np.arange(4000) / 700)


@pytest.mark.parametrize("delay", [0, 8, LATEST_MS])
@pytest.mark.parametrize("softer", [-5.0, 0.0, 10.0])
def test_delay_and_softening_are_found_again(delay, softer):
    slow = (1 - softer / 100) * np.roll(FAST, delay)
    found = compare(slow[LATEST_MS:], FAST[LATEST_MS:])
    assert found[0] == delay
    assert found[1] == pytest.approx(softer, abs=1e-9)
    assert found[2] == pytest.approx(np.sqrt(np.mean((slow - FAST)[LATEST_MS:] ** 2)))


@pytest.mark.parametrize(("before_nm", "end_nm"), [(0.0, 1.0), (0.4, -0.4), (1.0, 0.0)])
def test_a_jump_arrives_with_the_first_tick_that_stays_near_its_end(before_nm, end_nm):
    share = np.array([0.3, 0.6, 0.97, 0.9, 0.96, 1.0, 1.0])
    torque = before_nm + share * (end_nm - before_nm)
    assert arrival_ticks(torque, before_nm) == 5


def test_what_is_there_in_the_first_tick_took_one():
    assert arrival_ticks(np.ones(5), 0.0) == 1
