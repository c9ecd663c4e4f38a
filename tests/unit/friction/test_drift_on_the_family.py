"""No false alarm on the simulated joints, moved as people move: minutes here, an hour as volume, ten in
`rtctl bench drift`.
"""

import pytest

from rtctl.rig_file.config import Config, load
from rtctl.simulation.family import FAMILY, merged, with_plant
from tests.bench import drift

OTHER_FRICTION = ("harmonic-drive", "strong-stiction", "load-dependent", "drifted")
"""Not the friction that the shipped model was taught, at the place where the hand is."""

PLANTS = [name for name in FAMILY if name not in OTHER_FRICTION]
PEOPLE = [name for name in drift.MOTIONS if name not in ("trembling", "slowly")]


def with_its_bristles(name):
    """The shipped rig with this plant, told the presliding length that `rtctl identify` finds on it: the
    model's is another joint's.
    """
    loaded = with_plant(load("configs/mock.toml"), name)
    friction = loaded.options["axis"][0]["friction"]
    length_rad = friction["breakaway_nm"] / friction["bristle_stiffness_nm_rad"]
    table = loaded.config.model_dump(mode="json", by_alias=True)
    table["axis"] = [merged(axis, {"friction": {"presliding_rad": length_rad}}) for axis in table["axis"]]
    return loaded.model_copy(update={"config": Config.model_validate(table)})


def watched(plant, motion, seconds):
    found = drift.Sum()
    rig = drift.Plant(drift.moved(with_its_bristles(plant), drift.MOTIONS[motion]), {})
    drift.undrifted(rig, "", seconds, found)
    return found


@pytest.mark.parametrize("i", range(len(PLANTS)), ids=PLANTS)
def test_nothing_is_told_of_a_joint_that_is_as_it_was_learned(i):
    found = watched(PLANTS[i], PEOPLE[i % len(PEOPLE)], 50.0)
    assert found.alarms == found.stops == found.of_account == found.faults == []
    assert found.factors, "it was moved enough to be told"
    assert 0.95 < min(found.factors) <= max(found.factors) < 1.03


@pytest.mark.volume
@pytest.mark.parametrize("plant", PLANTS)
def test_nothing_is_told_within_an_hour(plant):
    for motion in drift.MOTIONS:
        found = watched(plant, motion, 3600.0 / len(PLANTS) / len(drift.MOTIONS))
        assert found.alarms == found.stops == []
