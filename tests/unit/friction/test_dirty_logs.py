"""Dirty logs: no wrong parameters without a warning that names the cause; clean logs: right parameters and no alarm."""

import re

import pytest
from dirty_logs import CASES, OFF, clean, identified, named, outcome
from moved_joint import CLEAN

TRUE_OF_CLEAN_LOGS = r"hardly any sliding below|samples of slow motion only|strokes too short|looks 0\.\d+ ms .* or friction is not Coulomb"
"""Warnings that say what a clean log lacks; that its joints have a Stribeck peak is true, too."""


@pytest.mark.parametrize("name", CASES)
def test_what_is_wrong_with_a_log_is_named(name, tmp_path):
    found = outcome(name, tmp_path)
    assert named(name, found), (found.code, found.off, found.said)


@pytest.mark.parametrize("name", CLEAN)
def test_a_clean_log_gives_its_parameters_and_no_alarm(name, tmp_path):
    found = identified(clean(name), tmp_path)
    assert found.code == 0, found.said
    for parameter, most in OFF.items():
        assert abs(found.off[parameter]) <= most, (parameter, found.off)
    alarms = [text for text in found.said.splitlines() if not re.search(TRUE_OF_CLEAN_LOGS, text)]
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
def test_what_can_be_mended_gives_the_parameters_of_the_clean_log(name, tmp_path):
    found = outcome(name, tmp_path)
    assert all(abs(off) < 0.02 for off in found.off.values()), found.off
    assert found.code == 0


def test_the_corpus_is_as_large_as_promised():
    assert len(CASES) >= 40
    assert len(CLEAN) >= 10
