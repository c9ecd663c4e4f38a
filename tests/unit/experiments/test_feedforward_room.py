"""What a feed-forward can take off a sine: the formula against the torques over a period."""

from pathlib import Path

import numpy as np
import pytest

from rtctl.experiments.feedforward_room import most_taken_off
from rtctl.experiments.free_motion import LOW
from rtctl.experiments.virtual import FAST_SINE
from rtctl.rig_file.config import load

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(("gain", "most"), [(0.9, 59), (0.95, 62), (1.0, 66)])
def test_the_bound_is_that_of_the_torques_and_the_one_that_the_document_names(gain, most):
    loaded = load(ROOT / "configs/mock.toml")
    found = most_taken_off(loaded, FAST_SINE, LOW * gain)
    phase, w = np.linspace(0, 2 * np.pi, 20_000, endpoint=False), np.pi
    v, a = 0.3 * w * np.sin(phase), 0.3 * w**2 * np.cos(phase)
    left, all_of_it = (
        np.sqrt(np.mean((kept * 0.25 * np.sign(v) + 0.05 * v + 0.012 * a) ** 2))
        for kept in (1 - 0.75 * gain, 1.0)
    )
    assert found == pytest.approx(1 - left / all_of_it, abs=1e-4)
    assert round(100 * found) == most
    assert f"{most} % at " in (ROOT / "docs/experiments.md").read_text()
