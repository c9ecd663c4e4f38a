"""Dirty logs: no wrong parameters without a warning that names the cause; clean logs: right parameters and no
alarm.
"""

import json
import re
from functools import cache
from pathlib import Path

import pytest
from dirty_changes import clean
from dirty_logs import CASES, OFF, identified, named, outcome, said_by
from moved_joint import CLEAN

RECORDINGS = Path(__file__).parents[4] / "shared" / "data" / "tue_haptic_1dof"

TRUE_OF_CLEAN_LOGS = (
    r"samples of slow motion only|strokes too short"
    r"|looks 0\.\d+ ms .* or friction is not Coulomb"
)
"""Warnings that say what a clean log lacks; that its joints have a Stribeck peak is true, too."""


VARIANTS = {
    "torque clipped at one side, 100 Hz",
    "velocity as position, motor",
    "degrees as radians, motor",
    "counts as radians",
    "turns as radians, with the rig file",
    "milli-newton-metres of the hand alone",
    "motor in mN m beside a hand in N m",
    "amperes beside a hand",
    "the hand's torque not mapped",
    "torque late by 20 ms",
    "stamps that jitter, sampling even",
    "stamps in s as ms",
    "constant torque of the motor",
    "position of one decimal of degrees, 50 Hz",
    "gravity that is not mapped",
    "a hand beside the motor in even strokes, not recorded",
    "torque AC-coupled, strokes quicker and quicker",
    "counts lost at speed, beside a velocity",
    "velocity of whole rad/s",
    "position of one digit beside a velocity",
}
"""Another joint, unit or amount of what a case beside them has: asked as volume."""


@pytest.fixture(scope="module")
def outcome_of(tmp_path_factory):
    """What comes of a dirty log, found once."""
    return cache(lambda name: outcome(name, tmp_path_factory.mktemp("dirty")))


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.volume) if name in VARIANTS else name for name in CASES]
)
def test_what_is_wrong_with_a_log_is_named(name, outcome_of):
    found = outcome_of(name)
    assert named(name, found), (found.code, found.off, found.said)


@pytest.mark.parametrize("name", CLEAN)
def test_a_clean_log_gives_its_parameters_and_no_alarm(name, tmp_path):
    found = identified(clean(name), tmp_path)
    assert found.code == 0, found.said
    for parameter, most in OFF.items():
        assert abs(found.off[parameter]) <= most, (parameter, found.off)
    true = f"{TRUE_OF_CLEAN_LOGS}|hardly tells the inertia" if "even" in name else TRUE_OF_CLEAN_LOGS
    alarms = [text for text in found.said.splitlines() if not re.search(true, text)]
    assert not alarms


@pytest.mark.parametrize(
    "name",
    [
        "one position spike",
        "small spikes of position",
        "bursts of position spikes",
        "rows repeated in place",
        "a second lost, stamps even",
        "encoder that starts over at 2 pi",
        "position that jumps",
        "uneven stamps",
        "a gap",
        "rows lost, stamps true",
    ],
)
def test_what_can_be_mended_gives_the_parameters_of_the_clean_log(name, outcome_of):
    found = outcome_of(name)
    assert all(abs(off) < 0.02 for off in found.off.values()), found.off
    assert found.code == 0


def test_the_corpus_is_as_large_as_promised():
    assert CASES.keys() > VARIANTS
    assert len(CASES) - len(VARIANTS) >= 40
    assert len(CLEAN) >= 10


@pytest.mark.realdata
@pytest.mark.skipif(not RECORDINGS.is_dir(), reason=f"no recordings in {RECORDINGS}")
@pytest.mark.parametrize("letter", "def")
@pytest.mark.parametrize(
    ("columns", "true"),
    [
        (
            ("position=pos_master_rad", "external=neg_torque_human_nm"),
            "depends on the position|looks [34]|hardly tells the inertia",
        ),
        (
            ("position=pos_slave_rad", "torque=torque_cmd_slave_nm"),
            "ms early|an offset of|is left over|hardly tells the",
        ),
    ],
)
def test_real_recordings_of_free_motion_give_no_alarm_but_true_ones(letter, columns, true):
    """The lever of the hand has a torque of about 2.5 mN m RMS that depends on its position in all of its
    recordings.

    One of them says the inertia within half of it only, and is right to say so.
    """
    arguments = ["--gear-ratio", "1", *(word for column in columns for word in ("--column", column))]
    found = said_by("--log", str(RECORDINGS / f"question1{letter}_free_motion.csv.gz"), *arguments, "--json")
    assert found[0] == 0, found
    warnings = json.loads(found[1])["warnings"]
    assert not [text for text in warnings if not re.search(f"{TRUE_OF_CLEAN_LOGS}|{true}", text)]
