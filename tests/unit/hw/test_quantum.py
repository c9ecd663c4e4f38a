"""The step of a column."""

import numpy as np
import pytest

from hw.playback.quantum import quantum


def test_brisk_motion_on_few_rows_has_the_step_of_its_grid():
    t = np.arange(0, 20, 0.01)
    position = np.round(np.sin(t) / 1e-6) * 1e-6  # hardly two of 2000 rows are one step apart
    assert quantum(position) == pytest.approx(1e-6, rel=1e-6)


def test_what_is_on_no_grid_has_a_tiny_one():
    assert quantum(np.random.default_rng(1).normal(size=2000)) < 1e-3


def test_steps_of_which_a_few_were_resampled_are_those_of_the_others():
    position = np.repeat(np.arange(100.0), 5)
    position[7] += 0.1234567
    assert quantum(position) == pytest.approx(1.0, rel=0.01)
