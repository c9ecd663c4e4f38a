"""Friction that changes at once: what was before is forgotten, and nothing is where nothing has changed."""

import numpy as np
import pytest
from test_drift import RATE_HZ, watch

from tests.drifting_joint import PEOPLE, Joint, ticks_of

CHANGE_S, AFTER_S = 45.0, 16.0


def followed(rows, until_s):
    """The axis after these seconds of ticks, and how often it forgot what was before a change."""
    rig, changes = watch(), []
    (axis,) = rig.axes
    keep = axis.strokes.keep_newest
    axis.strokes.keep_newest = lambda count: (changes.append(len(axis.strokes.table) - count), keep(count))
    for k in range(0, round(until_s * RATE_HZ), 200):
        rig.follow(rows[k : k + 200])
    return axis, sum(gone > 1 for gone in changes)


@pytest.mark.parametrize("later", [0.9, 1.1, 0.7])
def test_a_factor_is_not_between_what_was_and_what_is(later):
    """It was for as long as a window of sliding: 24 s."""
    joints = [Joint(sines=PEOPLE[k], later=later, later_s=CHANGE_S) for k in (1, 3, 5)]
    for joint, rows in zip(joints, ticks_of(joints, CHANGE_S + AFTER_S), strict=True):
        axis, changes = followed(rows, CHANGE_S + AFTER_S)
        assert 0 < changes < 4, joint
        assert abs(axis.found.factor - later) < 0.02, joint
        assert axis.warning, joint


@pytest.mark.parametrize(("swing_s", "people"), [(None, (0, 3)), (45.0, (1, 4)), (90.0, (2, 5))])
def test_nothing_is_forgotten_where_nothing_has_changed_or_a_zero_swings(swing_s, people):
    joints = [Joint(sines=PEOPLE[i], elements=8 * (i % 2)) for i in people]
    for joint, rows in zip(joints, ticks_of(joints, 120.0), strict=True):
        if swing_s is not None:
            t = np.arange(len(rows)) / RATE_HZ
            rows["hand_torque_nm"] += 0.03 * np.sin(2 * np.pi * t / swing_s)[:, None]
        axis, changes = followed(rows, 120.0)
        assert changes == 0, joint
        assert not axis.warning, joint
