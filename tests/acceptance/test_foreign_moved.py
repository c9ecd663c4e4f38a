"""The judge of `tests/foreign_moved.py`: it hears a help that shakes an arm in motion, and few certified rigs
do (decision 0117).
"""

import numpy as np
import pytest
from amounts import asked_often, seeds_of, some_of
from foreign_arms import AXIS, wish
from foreign_moved import MANNERS, drawn, drawn_with_an_end, judged, motion
from foreign_rests import rubbing
from foreign_shaken import beside, beyond
from foreign_transients import WINDOW_S, decay_s, kind_of, longest_s, loudness

from rtctl.control.jit import records
from rtctl.control.vocabulary import Policy

pytestmark = pytest.mark.compiled

FIRST, KNOWN = 1000, {1028, 1032}
"""Of the first forty rigs: an arm that pays for a motor of 53 mrad/s, a soft one that swings on by 2."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("rigs")


def test_a_policy_that_shakes_is_heard(folder):
    """sign, in an arm that the rig's own policy leaves alone."""
    case = drawn(3, folder)
    little = motion(case, rubbing(case.axis, 0.05), 3, Policy.OFF).left
    sign, own, off = (motion(case, case.axis, 3, policy).left for policy in (Policy.SIGN, None, Policy.OFF))
    assert beyond(sign, off, little)
    assert not beyond(own, off, little)


@pytest.mark.parametrize("manner", range(len(MANNERS)))
def test_an_arm_wishes_what_its_rate_says(manner):
    a = np.zeros(1, AXIS)
    a["amplitude"], a["omega"], a["manner"], a["from_s"], a["to_s"] = 0.4, 2.0, manner, 1.0, 9.0
    first, dt = records(a)[0], 1e-4
    x, v = np.array([wish(first, t) for t in np.arange(0.0, 10.0, dt)]).T
    assert np.abs(np.diff(x) - 0.5 * dt * (v[1:] + v[:-1])).max() < 1e-4
    assert np.abs(np.diff(x)).max() < 1.3 * 0.8 * dt
    assert x[-1] == pytest.approx(x[np.argmin(np.abs(np.arange(0.0, 10.0, dt) - 9.0))])


def _ring(fades_s, size=1.0):
    """rad/s, at 1 kHz: what is left beside a slow motion of 20 Hz that begin after 2 s of 6 and die as
    told."""
    t = np.arange(6000) * 1e-3 - 2.0
    speed = size * np.sin(40 * np.pi * t) * np.exp(-t / fades_s) * (t > 0) + 0.1 * np.sin(3 * t)
    return beside(speed, 60)


def test_what_dies_by_itself_is_told_from_what_lasts():
    loud = {fades_s: loudness(_ring(fades_s), 1e-3) for fades_s in (0.2, 0.4)}
    for fades_s, one in loud.items():
        assert decay_s(one, 1e-3) == pytest.approx(fades_s, rel=0.3)
        after_s = fades_s * np.log(1 / np.sqrt(2) / 0.02)
        assert longest_s(one, 0.02, 1e-3) == pytest.approx(after_s, abs=2 * WINDOW_S)
    assert loudness(_ring(0.2, size=0.0), 1e-3).max() < 5e-3, "a hand's own motion is none"
    assert longest_s(loud[0.2], 2.0, 1e-3) == 0.0
    assert decay_s(np.ones(50), 0.1) == pytest.approx(5.0), "it never dies"


def test_a_transient_is_fed_nothing_dies_as_soon_and_does_not_last():
    assert kind_of(False, [0.5, 0.2, 0.41], False) == "transient"
    assert kind_of(False, [0.6, 0.2, 0.41], False) == "dies slower"
    assert kind_of(False, [0.5], False) == "alone"
    assert kind_of(False, [0.1, 0.4], True) == "lasts"
    assert kind_of(True, [0.1, 0.4], False) == "fed"


@asked_often
def test_few_certified_rigs_shake_an_arm_that_moves(folder):
    cases = ((seed, drawn(seed, folder)) for seed in seeds_of(40, FIRST))
    for seed, case in cases:
        verdict = case.loaded and judged(case, seed)
        if verdict:
            assert seed in KNOWN or not verdict.both, seed
            assert not any((verdict.unseen, verdict.false)), seed


@asked_often
def test_an_arm_that_is_faster_than_friction_was_measured_is_not_shaken_there(folder):
    """Some seeds of the rigs that help shook by a steep end (decision 0134)."""
    for seed in (35, 53, 68, 97)[: some_of(4)]:
        case = drawn_with_an_end(seed, folder)
        verdict = judged(case, seed)
        assert not verdict.both, seed
        assert verdict.helped.torque < 0.6 * verdict.plain.torque, seed
