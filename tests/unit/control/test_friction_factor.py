"""The law follows a factor that it is asked for: within bounds, by a step a tick, never above what was judged
(docs/theory.md 5.10).
"""

import math

import numpy as np
import pytest
from law_rig import LawRig, T

from rtctl.control.vocabulary import Policy, State

RAISE, STEP = 0.05, 0.001
SPEED = 0.5


def made(**params):
    keys = {"friction_raise": RAISE, "friction_change_step": STEP, "friction_policy": int(Policy.SIGN)}
    return LawRig(friction_ungated_cap_nm=0.9, energy_budget_j=1e3, **{**keys, **params}).friction()


def moved(rig, ticks=1):
    """The feed-forward of a joint that moves at a constant speed, tick by tick."""
    out = []
    for _ in range(ticks):
        rig.tick(position=rig.position[0] + SPEED * T)
        out.append(rig["feedforward_torque_nm"])
    return np.array(out)


def factors(rig, ticks):
    out = []
    for _ in range(ticks):
        rig.tick(position=rig.position[0] + SPEED * T)
        out.append(rig["friction_factor"])
    return np.array(out)


def test_the_factor_scales_the_feed_forward_and_one_is_the_certified_over_the_largest():
    rig, plain = made().arm(), made(friction_raise=0.0, friction_change_step=0.0).arm()
    full = moved(plain, 300)[-1]
    assert moved(rig, 300)[-1] == pytest.approx(full / (1 + RAISE), rel=1e-12)
    rig.command["friction_change"] = -0.2
    assert moved(rig, 300)[-1] == pytest.approx(0.8 * full / (1 + RAISE), rel=1e-12)
    assert rig["friction_factor"] == pytest.approx(0.8)


@pytest.mark.parametrize(
    ("asked", "end"), [(0.5, 1 + RAISE), (math.inf, 1 + RAISE), (-0.9, 0.7), (-math.inf, 0.7), (0.02, 1.02)]
)
def test_it_goes_by_one_step_a_tick_up_to_what_is_allowed(asked, end):
    rig = made().arm()
    moved(rig, 300)
    rig.command["friction_change"] = asked
    way = factors(rig, 400)
    assert way[-1] == end
    assert np.abs(np.diff(way, prepend=1.0)).max() <= STEP * (1 + 1e-9)
    assert (np.abs(np.diff(way))[: round(abs(end - 1) / STEP) - 2] > 0.9 * STEP).all()


def test_no_command_brings_the_feed_forward_above_what_was_judged_or_makes_a_step_of_torque():
    cap_nm = 0.2
    rig = made(friction_cap_nm=cap_nm).arm()
    before = moved(rig, 300)[-1]
    draw, most = np.random.default_rng(1), 0.0
    for _ in range(300):
        rig.command["friction_change"] = draw.choice([0.3, 1e300, math.inf, math.nan, -0.1])
        now = moved(rig)[0]
        assert now <= cap_nm
        assert abs(now - before) <= STEP * cap_nm * (1 + 1e-9)
        assert 0.7 <= rig["friction_factor"] <= 1 + RAISE
        before, most = now, max(most, now)
    assert most == cap_nm


def test_a_command_that_is_no_number_asks_for_nothing():
    rig = made().arm()
    rig.command["friction_change"] = -0.05
    factors(rig, 100)
    rig.command["friction_change"] = math.nan
    assert (factors(rig, 20) == 0.95).all()
    assert rig.mode is State.ACTIVE


def test_an_axis_that_follows_nothing_takes_no_command_and_one_that_is_off_takes_it_at_once():
    rig = made(friction_change_step=0.0, friction_raise=0.0)
    rig.command["friction_change"] = -0.2
    assert factors(rig.arm(), 10)[-1] == 1.0
    rig = made()
    rig.command["friction_change"] = -0.2
    rig.tick()
    assert rig["friction_factor"] == 0.8
