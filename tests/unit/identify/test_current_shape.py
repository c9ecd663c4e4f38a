"""The shape of a current loop by many test pulses: loops of other makes (`tests/foreign_currents.py`), and a
rig that is armed and stopped for them."""

import math
from pathlib import Path

import numpy as np
import pytest
from foreign_currents import DEADBEAT, LINEAR, PI, Loop, overshoot, pulse, shown

from rtctl.control.vocabulary import State
from rtctl.errors import DataError, FaultError
from rtctl.identify.current_shape import Pulses, declared, step_answer, to_declare, told
from rtctl.identify.pulses import PulseRun, only_pulses, sent_and_shown
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

CONFIGS = Path(__file__).parents[3] / "configs"


def found(loop, **more):
    draw = np.random.default_rng(1)
    given = {"pulses": 60, "noise": 0.1, "gain": 0.9, "offset": 0.2} | more
    return told(Pulses(pulse(), shown(pulse(), loop, draw, **given)))


@pytest.mark.parametrize(
    ("loop", "shape"),
    [
        (Loop(LINEAR, 1.0, 2.0), "first order"),
        (Loop(LINEAR, 0.4, 2.0, 1.0), "two lags"),
        (Loop(LINEAR, 1.3, 2.0, 0.6), "overshoots"),
        (Loop(DEADBEAT, 1.0, period=0.1), "too quick"),
        (Loop(PI, 0.0, 2.0, beside=5.0, winding=4.0), "another"),
    ],
)
def test_the_shape_is_told_and_the_range_holds_the_overshoot(loop, shape):
    told = found(loop)
    assert told.shape == shape
    if shape in ("another", "too quick"):
        assert math.isnan(told.overshoot_high)
        assert to_declare(told, lambda *_: 1.0) is None
        return
    assert told.overshoot_low <= overshoot(loop) + 1e-3 <= told.overshoot_high + 2e-3
    assert told.best.delay + told.best.lag == pytest.approx(loop.delay + loop.lag, abs=0.1)
    assert told.best.gain == pytest.approx(0.9, abs=0.02)


def test_what_is_declared_is_what_the_coupling_bears_least_of_all_that_may_be():
    told = found(Loop(LINEAR, 0.4, 2.0, 1.0), pulses=20, noise=0.3)
    worst = to_declare(told, lambda delay, lag, over: -over)
    assert declared(worst) == max(declared(one) for one in told.possible) > declared(told.best)
    # nothing is borne: of all that may be the largest overshoot
    assert declared(to_declare(told, lambda *_: 0.0)) == declared(worst)


def test_two_equal_lags_are_the_limit_of_two():
    t = np.linspace(-1.0, 9.0, 50)
    since = np.maximum(t, 0.0)
    assert step_answer(t, 2.0, 0.25) == pytest.approx(1 - np.exp(-since) * (1 + since), abs=1e-4)
    assert step_answer(t, 2.0, 0.0) == pytest.approx(1 - np.exp(-since / 2), abs=1e-12)


class Bench:
    """A simulated rig as an observer of a host sees it."""

    def __init__(self, loaded):
        self.simulation = Simulation(loaded)
        self.plan, self.command = self.simulation.plan, self.simulation.command
        self.writer = self.gateway = self
        self.finished, self.stops = False, 0

    def set_compensation(self, share):
        self.command["compensation"] = share

    def arm(self, epoch):
        self.command["arm_count"] += 1
        self.command["epoch"] = epoch
        self.command["seq"] += 1

    def stop(self):
        self.stops += 1
        self.command["stop_count"] += 1
        self.command["seq"] += 1

    def finish(self):
        self.finished = True

    def follow(self, run):
        while not self.finished:
            run(self, self.simulation.run(0.05).view(np.ndarray))


@pytest.fixture(scope="module")
def slow_drive():
    return load(CONFIGS / "mock-slow-drive.toml")


def test_a_rig_is_armed_and_stopped_for_its_pulses_and_nothing_else_acts(slow_drive):
    bench, run = Bench(only_pulses(slow_drive)), PulseRun(12)
    bench.follow(run)
    assert run.complete
    assert (len(run.blocks), bench.stops) == (12, 11)
    ticks = 4 * int(bench.plan.params["arming_ticks"][0])
    for block in run.blocks:
        assert len(block) == ticks + 1
        assert set(block["state"][:-1]) == {State.ARMING}
    sent, shows = sent_and_shown(run.blocks, 0, ticks)
    assert np.max(np.abs(sent)) == float(bench.plan.params["arming_torque_nm"][0, 0])
    assert np.isnan(shows).any()  # a sample every second tick
    # the file says 1.5 ticks and 200 Hz
    what = told(Pulses(sent, shows))
    assert what.shape != "another"
    assert what.best.delay + what.best.lag == pytest.approx(1.5 + 1e3 / (2 * math.pi * 200), abs=0.6)
    with pytest.raises(DataError, match="only 3 of 3"):
        sent_and_shown(run.blocks[:3], 0, ticks)


def test_a_stop_by_somebody_else_ends_the_pulses(slow_drive):
    bench, run = Bench(only_pulses(slow_drive)), PulseRun(12)

    def follow():
        since = 0
        while since < 5:
            rows = bench.simulation.run(0.05).view(np.ndarray)
            run(bench, rows)
            since += bench.stops > 2
            if len(run.blocks) == 2 and rows[-1]["state"] == State.IDLE and bench.stops == 2:
                bench.stop()

    with pytest.raises(FaultError, match="stopped"):
        follow()
    assert len(run.blocks) == 2
