"""The judge of laboratories' rigs: whose a motion is that is left after two seconds."""

import foreign_laboratories as judge
import pytest

from rtctl.control.vocabulary import Fault, Policy

LOUD = judge.Left(speed=0.006, motor=0.0, late=0.003, helped_j=0.0, fed_j=0.0, swing=0.2, fault=-1)


def named(monkeypatch, helped=LOUD, **speeds):
    """What a hand is called that is left these speeds: without help, farther and later too, without help from
    the stop or .5 s on, and without help and friction."""

    def left(one, policy=None, farther=1.0, later_s=0.0, away_s=float("inf"), share=1.0):
        if policy == Policy.OFF:
            name, swing = ("later" if later_s else "off"), 0.2 * farther * speeds.get("swing", 1.0)
            speed = speeds.get("farther", 0.0) if farther > 1.0 else speeds.get(name, 0.0)
            return LOUD._replace(speed=speed, swing=swing)
        name = "rubs" if share < 1.0 else "stop" if away_s == 0.0 else "half"
        return LOUD._replace(speed=speeds.get(name, 0.0))

    monkeypatch.setattr(judge, "left", left)
    monkeypatch.setattr(judge, "_meant", lambda one: 0.05)
    return judge.cause(None, helped, None)[0]


@pytest.mark.parametrize(
    ("speeds", "word"),
    [
        ({"off": 0.005}, "own"),
        ({"later": 0.005}, "own"),
        ({"farther": 0.005, "swing": 0.5}, "own"),
        ({"farther": 0.005}, "kept up"),  # it went farther than with help
        ({"stop": 0.005}, "own from the stop"),
        ({"half": 0.005, "rubs": 0.005}, "own from .5 s"),
        ({"rubs": 0.005}, "swings out"),
        ({"off": 0.0047, "later": 0.0047, "stop": 0.0047, "half": 0.0047, "rubs": 0.0047}, "kept up"),
        ({"off": float("nan"), "rubs": float("nan")}, "kept up"),
    ],
)
def test_a_hand_is_named_by_the_first_run_without_help_that_is_as_loud(monkeypatch, speeds, word):
    assert named(monkeypatch, **speeds) == word


def test_a_fault_is_nobodys_own(monkeypatch):
    stopped = LOUD._replace(fault=int(Fault.OVERSPEED).bit_length() - 1)
    assert named(monkeypatch, stopped, off=1.0, stop=1.0) == "OVERSPEED, without help -1"
