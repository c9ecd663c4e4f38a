"""The judge of `tests/foreign_contact.py`: what a hand in contact is given stays within what docs/safety.md
says, whatever a renderer sends; walls are as stiff as configured; and few certified rigs shake a hand in
contact (decision 0125).
"""

import math
from functools import partial

import numpy as np
import pytest
from amounts import asked_often, seeds_of
from foreign_arms import AXIS, tip
from foreign_contact import contact, drawn, robbed, unlike_the_wall

from rtctl.control.jit import records

pytestmark = pytest.mark.compiled

FIRST, KNOWN = 1000, {1001}
"""Of the first ten rigs: a soft hand that swings on by 2 mrad/s."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("rigs")


def cases(folder, number, judge, **more):
    """Seed and verdict of those that are certified and armed."""
    for seed in seeds_of(number, FIRST):
        case = drawn(seed, folder, **more)
        verdict = judge(case, seed) if case.loaded else None
        if verdict is not None:
            yield seed, verdict


def test_a_fingertip_stiffens_and_never_pulls():
    a = np.zeros(1, AXIS)
    a["wrist"], a["tip"], a["pushes"] = 50.0, 0.01, 1
    press = partial(tip, rate=0.0, a=records(a)[0])
    assert press(0.01) == pytest.approx(0.5)
    assert press(0.04) == pytest.approx(8 * 0.5)
    assert press(-0.04) == 0.0


def test_a_hand_is_given_some_of_what_is_allowed(folder):
    """A judge that sees nothing given would find no fault with it."""
    case = drawn(15, folder, foes=True)
    world = case.world._replace(foe="chirp", frames_hz=1e9, store_j=None, power_w=None)
    most, given_j, _ = robbed(case._replace(world=world), 15)
    assert 0.1 < most <= 1.0
    assert given_j > 1.5 * case.loaded.config.passivity.budget_j


@asked_often
def test_no_renderer_gives_a_hand_more_than_is_allowed(folder):
    for seed, (most, _, _) in cases(folder, 20, robbed, foes=True):
        assert most <= 1.0, seed


@asked_often
def test_a_wall_that_is_held_is_as_stiff_as_configured(folder):
    for seed, off in cases(folder, 30, unlike_the_wall):
        assert math.isnan(off) or abs(off) < 1.1, seed


@asked_often
def test_few_certified_rigs_shake_a_hand_in_contact(folder):
    for seed, (moved, most) in cases(folder, 10, contact):
        assert seed in KNOWN or not moved.both, seed
        assert not any((moved.unseen, moved.false)), seed
        assert most <= 1.0, seed
