"""The observer on a gear that nobody declared: what `observer_match.in_gears` says of it against the loop in
time, written anew, with a link that a hand holds fast.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rtctl.check import observer_tuning, stability_report
from rtctl.control.proofs import observer_match
from rtctl.control.proofs.drive_in_hand import RESONANCES_HZ, frequency_hz, unknown_gears
from rtctl.control.proofs.observer_loop import Loop
from rtctl.control.proofs.observer_margin import BANDWIDTHS_HZ
from rtctl.rig_file.config import Config, load
from rtctl.simulation.family import merged

CONFIGS = Path(__file__).parents[3] / "configs"
RIG = Loop(0.012, 0.05, 1e-3, 0.95, 20.0)
LATE = replace(RIG, delay=2.0, acting_ticks=2)
SLOWER = [float(hz) for hz in reversed(BANDWIDTHS_HZ) if hz <= 20]
PARTS = 10
ROW = "disturbance observer, gear not declared"


def growth_1_s(loop, hz, seconds=2.0):
    """Rate at which a motor on its gear swings up, whose link does not move: two equal masses that would
    swing at `hz` freely.
    """
    T, g, J, w = loop.period_s, loop.gain, loop.inertia_kgm2, 2 * math.pi * loop.bandwidth_hz
    stiffness = J / 4 * (2 * math.pi * hz) ** 2
    damping, motor = 2 * 0.01 * J / 4 * 2 * math.pi * hz, J / 2
    quick, slow = 1 - math.exp(-4 * w * T), 1 - math.exp(-w * T)
    x, v, before, hand = 1e-3, 0.0, 1e-3, 0.0
    sent, path = [0.0] * 10, []
    q1 = q2 = w1 = w2 = 0.0
    for _ in range(round(seconds / T)):
        moved, before = (x - before) / T, x
        q1 += quick * (sent[-1 - loop.acting_ticks] + hand - q1)
        w1 += quick * (moved - w1)
        behind = w1 - w2
        q2, w2 = q2 + slow * (q1 - q2), w2 + slow * behind
        hand = -stiffness * x - damping * v
        sent.append(g * (q2 - J * w * behind - loop.viscous_nms_rad * w2))
        for _ in range(PARTS):
            pull = sent[-1 - round(loop.delay)] - stiffness * x - (damping + loop.viscous_nms_rad) * v
            v += T / PARTS * pull / motor
            x += T / PARTS * v
        path.append(x)
    quarter = len(path) // 4
    early, last = np.abs(path[quarter : 2 * quarter]), np.abs(path[3 * quarter :])
    return math.log(last.max() / early.max()) / (2 * quarter * T)


@pytest.mark.parametrize("loop", [RIG, LATE])
def test_the_largest_bandwidth_that_gears_bear_rings_in_none_that_a_hand_holds(loop):
    gears = unknown_gears(loop.inertia_kgm2, 0.0)
    hz = observer_match.largest_in_gears(loop, gears, SLOWER)
    quiet = [growth_1_s(replace(loop, bandwidth_hz=hz), one) for one in RESONANCES_HZ]
    assert max(quiet) < -0.25
    usual = [growth_1_s(loop, one) for one in RESONANCES_HZ]
    assert (hz == 20.0) == (max(usual) < 0.0) == (loop is RIG)


def test_where_another_loop_rang_is_only_asked_first():
    gears, hard, said = unknown_gears(LATE.inertia_kgm2, 0.0), observer_match._Hard(), []
    for hz in SLOWER:
        loop = replace(LATE, bandwidth_hz=hz)
        said.append(observer_match.bears(loop, gears, hard))
        assert said[-1] == observer_match.in_gears(loop, gears).ok
    assert set(said) == {False, True}, "or it asks nothing"


def test_a_known_resonance_leaves_out_softer_gears():
    assert unknown_gears(0.012, 101.0) == ()
    known = [frequency_hz(0.012, one) for one in unknown_gears(0.012, 60.0)]
    assert known == pytest.approx([60.0, 70.0, 100.0])
    assert observer_match.in_gears(LATE, ()) is None
    assert observer_match.bears(LATE, ())


def rig(drive=None, **observer):
    """The shipped rig, two ticks late, with these keys."""
    loaded = load(CONFIGS / "mock.toml")
    table = loaded.config.model_dump(mode="json", by_alias=True)
    told = {"coupling": {"delay_ticks": 2.0, "stiffness_nm_rad": 15.0}, "drive": drive or {}}
    table["axis"][0] = merged(
        table["axis"][0], {**told, "friction": {"observer": observer, "intent_lowpass_hz": 18.0}}
    )
    return loaded.model_copy(update={"config": Config.model_validate(table)})


def rows(loaded):
    return {row.name: row for row in stability_report.examine(loaded).axes[0].verdicts}


def test_a_late_rig_has_a_slower_observer_until_its_gear_is_known_and_a_named_bandwidth_is_refused():
    slower = observer_tuning.of_axis(rig(), 0).bandwidth_hz
    assert slower < 20.0
    assert rows(rig())[ROW].outcome.label == "PASS"
    stiff = rig({"resonance_hz": 200.0})
    assert observer_tuning.of_axis(stiff, 0).bandwidth_hz == 20.0
    assert ROW not in rows(stiff)
    refused = rows(rig(bandwidth_hz=20.0))[ROW]
    assert refused.outcome.label == "FAIL"
    assert f"bandwidth_hz = {slower:g}" in refused.refusal
    assert "drive.resonance_hz" in refused.refusal


def test_a_slow_loop_keeps_its_bandwidth_where_what_gears_bear_is_too_slow_for_its_own_joint():
    """At 100 Hz gears bear 3 Hz, with which a rigid joint in a hand hardly damps: the file that passed was
    refused.
    """
    loaded = load(CONFIGS / "mock.toml")
    table = loaded.config.model_dump(mode="json", by_alias=True)
    table["loop"]["rate_hz"], table["axis"][0]["coupling"]["stiffness_nm_rad"] = 100.0, 5.0
    slow = loaded.model_copy(update={"config": Config.model_validate(table)})
    found = rows(slow)
    assert observer_tuning.of_axis(slow, 0).bandwidth_hz == 5.0
    assert found[ROW].outcome.label == "NOT PROVED"
    assert not [row.name for row in found.values() if row.refusal]
