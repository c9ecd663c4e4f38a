"""Which points are measured: enough, apart, inside the range, in a reproducible order."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rtctl.identify.measurement_order import speeds, tasks
from rtctl.identify.settings import Settings


def test_the_default_plan_is_the_papers():
    plan = tasks(Settings())
    for direction in (1, -1):
        here = [task for task in plan if task.direction == direction]
        assert sum(task.use == "train" and task.speed_rad_s > 0 for task in here) == 54
        assert sum(task.use == "test" for task in here) == 28
        assert sum(task.speed_rad_s == 0 for task in here) == 1


@given(st.integers(4, 80), st.integers(0, 120))
def test_no_speed_is_both_for_training_and_for_test(train_levels, test_levels):
    train, test = speeds(Settings(train_levels=train_levels, test_levels=test_levels))
    assert (len(train), len(test)) == (train_levels, test_levels)
    both = np.sort(np.concatenate([train, test]))
    assert np.all(np.diff(np.log(both)) > 1e-6)
    assert both[0] == 0.005
    assert both[-1] == 2.0
    assert np.diff(np.log(train)) == pytest.approx(np.log(400) / (train_levels - 1))


def test_the_order_is_shuffled_by_the_seed_alone():
    first, again, other = tasks(Settings()), tasks(Settings()), tasks(Settings(seed=2))
    assert first == again
    assert [task.speed_rad_s for task in first] != [task.speed_rad_s for task in other]
    assert sorted(task.speed_rad_s for task in first) == sorted(task.speed_rad_s for task in other)
    assert len({task.name for task in first}) == len(first)


def test_directions_alternate_so_that_the_joint_comes_back():
    plan = tasks(Settings())
    assert [task.direction for task in plan] == [1, -1] * (len(plan) // 2)
