"""The judge of `tests/foreign_rests.py`: it hears what shakes an arm that rests, and certified rigs
shake none (decision 0111).
"""

import numpy as np
import pytest
from amounts import asked_often, seeds_of
from foreign_arms import AXIS, bend
from foreign_rests import QUIET, drawn, judged, rest

from rtctl.control.jit import records
from rtctl.control.vocabulary import Fault, Policy

pytestmark = pytest.mark.compiled


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("rigs")


def test_a_policy_that_shakes_is_heard(folder):
    """sign, in fingers that the rig's own policy leaves alone."""
    case = drawn(3, folder)
    sign, own, off = (rest(case, case.axis, 3, policy) for policy in (Policy.SIGN, None, Policy.OFF))
    assert sign.speed > QUIET
    assert max(own.speed, off.speed) < 0.1 * QUIET


@pytest.mark.parametrize(("kind", "slow"), [(0, 1.27), (1, 1.27), (2, 1.11)])
def test_each_friction_is_a_spring_at_first_and_slides_at_its_level(kind, slow):
    a = np.zeros(1, AXIS)
    a["coulomb"], a["breakaway"], a["stribeck"], a["bristle"], a["kind"] = 1.0, 1.3, 0.1, 1000.0, kind
    first, kept = records(a)[0], np.zeros(6)
    bend(kept, 1e-4, 1e-5, first)
    assert kept[0] == pytest.approx(0.1, rel=0.06)
    for speed, level in ((0.01, slow), (-0.01, -slow), (1.0, 1.0)):
        for _ in range(10_000):
            bend(kept, speed * 1e-4, 1e-4, first)
        assert kept[0] == pytest.approx(level, rel=0.06)


@asked_often
def test_no_certified_rig_shakes_an_arm_that_rests(folder):
    cases = ((seed, drawn(seed, folder)) for seed in seeds_of(40))
    for seed, case in cases:
        verdict = case.loaded and judged(case, seed)
        if verdict:
            assert not verdict[3], seed
            assert verdict[0].fault != int(Fault.PASSIVITY).bit_length() - 1, seed
