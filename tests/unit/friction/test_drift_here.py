"""A hand at one place of a joint whose friction differs by place, watched by speed alone: what is a place is
no drift, and what changed at a place seen before is one.
"""

import numpy as np
import pytest
from test_drift import RATE_HZ, arrays
from test_followed_drift import kept

from rtctl.friction import drift_state as state
from rtctl.friction.drift_deployed import deployed
from rtctl.friction.drift_watch import RigWatch
from rtctl.rig_file.friction_tables import DriftTable
from tests.drifting_joint import PEOPLE, Joint, ticks_of

HERE, THERE, ELSEWHERE = 0.0, 1.6, 2.8
"""Where friction is 1.18, .99 and .82 times the curve of speed: a wave of .19 whose crest is at 0."""


def moves(parts, seconds=70.0):
    """Ticks of strokes at the place of each part, where friction is its factor of what it was learned as."""
    by, out, first = deployed(*arrays(), 0), [], 0
    for rows, (place, factor) in zip(
        ticks_of([Joint(sines=PEOPLE[3])] * len(parts), seconds), parts, strict=True
    ):
        v = rows["velocity_rad_s"][:, 0]
        more = factor * (1 + 0.19 * (np.cos(rows["position_rad"][:, 0] + place) - np.cos(THERE))) - 1
        rows["hand_torque_nm"][:, 0] += np.sign(v) * more * by.dry_nm(v)
        rows["position_rad"] += place
        rows["tick"] += first
        first += len(rows) + 100  # a hand that goes elsewhere
        out.append(rows)
    return np.concatenate(out)


def watch(places_nm):
    """A rig whose model says that its places differ by so much."""
    params, model = arrays()
    params["friction_sliding_doubt_nm"] = params["friction_place_doubt_nm"] = places_nm
    return RigWatch(params, model, [DriftTable()])


def told(rig, rows):
    """The words at the end of each second."""
    words = []
    for k in range(0, len(rows), round(RATE_HZ)):
        rig.follow(rows[k : k + round(RATE_HZ)])
        words.append(rig.axes[0].warning)
    return words


def test_a_hand_that_goes_from_place_to_place_is_not_warned_of_what_the_model_says_that_places_differ_by():
    rows = moves([(HERE, 1.0), (THERE, 1.0), (HERE, 1.0)])
    assert not any(told(watch(0.09), rows))
    assert any(told(watch(0.01), rows)), "of a model that knows no such places it is news"


def test_a_hand_on_its_way_between_places_is_not_compared_with_another_way():
    """Strokes of both ends of a way have the middle and the reach of another: it was warned of for 74 s."""
    a, b, c = 0.07, 2.7, -2.14
    assert not any(told(watch(0.09), moves([(place, 1.0) for place in (a, b, c, a, c, b)], seconds=50.0)))


@pytest.mark.parametrize(("place", "factor"), [(HERE, 0.9), (THERE, 1.1)])
def test_a_tenth_is_told_at_a_place_that_was_seen_before(place, factor):
    rig = watch(0.09)
    assert not any(told(rig, moves([(HERE, 1.0), (THERE, 1.0)])))
    changed = moves([(place, factor), (ELSEWHERE, factor)])
    changed["tick"] += 10**6
    half = len(changed) // 2
    words = told(rig, changed[:half])
    assert "at this place before" in words[60]
    assert told(rig, changed[half:])[-1], "nothing says that it is gone where nobody was before"
    back = moves([(place, 1.0)])
    back["tick"] += 10**7
    assert told(rig, back)[-1] == ""


def test_a_place_is_seen_since_the_start_alone(tmp_path):
    """An encoder may count from elsewhere after a restart."""
    rig = watch(0.09)
    told(rig, moves([(HERE, 1.0)]))
    other = watch(0.09)
    assert state.restore(other.axes[0], kept(tmp_path, rig.axes[0]))
    assert not any(told(other, moves([(HERE, 0.9)])))
