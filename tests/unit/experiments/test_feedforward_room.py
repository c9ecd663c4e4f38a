"""What docs/experiments.md says a feed-forward can take off a sine, against the torques over a period."""

from pathlib import Path

import numpy as np
import pytest

from rtctl.experiments.free_motion import LOW
from rtctl.experiments.virtual import FAST_SINE
from rtctl.rig_file.config import load

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    ("gain", "said"), [(0.9, "{} % at gain .9,"), (0.95, "{} % at .95,"), (1.0, "{} % at 1;")]
)
def test_the_most_that_a_feed_forward_takes_off_is_what_the_document_says(gain, said):
    axis, dry_nm = load(ROOT / "configs/mock.toml").config.axis[0], 0.25
    phase, w = np.linspace(0, 2 * np.pi, 20_000, endpoint=False), 2 * np.pi * FAST_SINE.frequency_hz
    top = FAST_SINE.amplitude_rad * w
    v, moved = top * np.sin(phase), axis.inertia_kgm2 * w * top * np.cos(phase)
    left, all_of_it = (
        np.sqrt(np.mean((kept * dry_nm * np.sign(v) + axis.viscous_nms_rad * v + moved) ** 2))
        for kept in (1 - LOW * gain, 1.0)
    )
    assert said.format(round(100 * (1 - left / all_of_it))) in (ROOT / "docs/experiments.md").read_text()
