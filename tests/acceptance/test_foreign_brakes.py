"""The judge of `tests/foreign_brakes.py`: it hears a brake and a controller that ring, and a certified late
rig neither rings nor feeds a hand in any state (decision 0177).
"""

import foreign_brakes
import pytest
from amounts import asked_often, seeds_of
from foreign_trials import drawn

pytestmark = pytest.mark.compiled

LATE = 1000
"""A rigid joint, late: with the servo's damping the hand that had stopped it was swung at 2.2 rad/s."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("rigs")


def test_a_late_rigid_joint_rings_by_no_brake(folder, monkeypatch):
    case = drawn(LATE, folder)
    assert foreign_brakes.brake(case, LATE).words == ()
    # BRAKE of the servo's damping for good, as it was
    as_it_was = foreign_brakes.Trial
    monkeypatch.setattr(foreign_brakes, "Trial", lambda *told: _hard(as_it_was(*told)))
    assert {"rings", "fed"} <= set(foreign_brakes.brake(case, LATE).words)


def _hard(trial):
    trial.rig.law[2]["hold_damping_nms_rad"] = 1e3
    return trial


@asked_often
def test_no_state_rings_or_feeds_a_hand(folder):
    for seed in seeds_of(20):
        case = drawn(seed, folder)
        if case.loaded is not None:
            found = {name: seen.words for name, seen in foreign_brakes.asked(case, seed)}
            assert not any(found.values()), (seed, found)
