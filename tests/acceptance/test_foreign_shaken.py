"""The judge of `tests/foreign_shaken.py`: it hears a help that shakes, and few certified rigs do (decision
0094).
"""

import numpy as np
import pytest
from amounts import asked_often, seeds_of
from foreign_shaken import beyond, judged, left, rubbing
from foreign_strokes import drawn, hands_of, in_box

from rtctl.control.vocabulary import Policy

pytestmark = pytest.mark.compiled

KNOWN = {35}
"""Of the first sixty rigs: an undamped carriage of 11 Hz in a stiff hand, .79 rad/s (.53 without help)."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("rigs")


def test_a_policy_that_shakes_is_heard(folder):
    """sign, which `rtctl check` refuses on a real rig, in a hand that the rig's own policy leaves alone."""
    case = drawn(11, folder)
    little = left(case, rubbing(case.axis, 0.05), 11, Policy.OFF)[0]
    sign, own, off = (left(case, case.axis, 11, policy)[0] for policy in (Policy.SIGN, None, Policy.OFF))
    assert beyond(sign, off, little)
    assert not beyond(own, off, little)


def test_no_help_shakes_nobody(folder):
    case = drawn(1, folder)
    shaken, *_, torque = judged(case, case.axis, 1, share=0.0)
    assert not shaken
    assert torque == pytest.approx(1.0, abs=0.01)


def test_other_hands_of_a_rig_are_of_the_box_and_of_its_size(folder):
    case = drawn(2, folder)
    hands = hands_of(case, 2, 6)
    assert len(hands) == 6
    assert all(in_box(one, one.axis) for one in hands)
    joint = [name for name in case.axis.dtype.names if name in ("motor", "coulomb", "bristle", "gear")]
    assert all(np.array_equal(one.axis[name], case.axis[name]) for one in hands for name in joint)


@asked_often
def test_few_certified_rigs_shake_a_hand_beyond_both(folder):
    cases = ((seed, drawn(seed, folder)) for seed in seeds_of(60))
    found = {seed for seed, case in cases if case.loaded and judged(case, case.axis, seed)[1]}
    assert found <= KNOWN
