"""A loop that is late now and then: what was measured beside late ticks is measured again, and told.

A loop that lost a tick of twenty saw cogging that was none, and said .079 N m of a joint that breaks away at
.11."""

from dataclasses import replace

import numpy as np
import pytest
from identified import CONFIG, SMALL, Kept, variant

from rtctl.control.vocabulary import State
from rtctl.experiments.simulated_identification import drive
from rtctl.identify import points
from rtctl.identify.collected import FORGIVEN, Collected, UnsteadyError
from rtctl.identify.late_ticks import on_every_slot
from rtctl.identify.measurement_order import tasks
from rtctl.identify.motion import Motion
from rtctl.identify.places import HERE
from rtctl.identify.session import identify
from rtctl.identify.settings import rig_of, without_feedforward
from rtctl.identify.sweep import look_for_cogging
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation
from rtctl.tick import new_ticks

LIGHT = (("coulomb_nm = 0.25 ", "coulomb_nm = 0.08 "), ("breakaway_nm = 0.35 ", "breakaway_nm = 0.11 "))
QUICK = replace(
    SMALL,
    train_levels=2,
    test_levels=0,
    measurements=6,
    spots=1,
    warm_up_s=0.1,
    bias_s=0.5,
    ramp_nm_s=0.2,
    speed_min_rad_s=0.2,
    speed_max_rad_s=0.5,
)
OFTEN = {"channel": "loop", "kind": "stall", "at_s": 0.0, "for_ticks": 0, "value": 1.0, "probability": 0.05}
BURSTS = {"at_s": 35.0, "for_ticks": 8, "every_s": 0.7, "probability": 1.0}


def found(folder, *stalls, store=None):
    """The store of a joint whose loop stalls like that, and of each slot whether it was missed."""
    loaded = without_feedforward(load(variant(folder, *LIGHT)))
    rig, store, simulation = rig_of(loaded, QUICK), store or Kept(), Simulation(loaded)
    ran = []
    simulation.script(stalls)
    steps = identify(rig, QUICK, store, lambda *_: None, lambda _text: None)
    drive(simulation, steps, rig.axis, lambda rows: ran.append(rows["tick"].copy()))
    missed = np.ones(int(ran[-1][-1]) + 1, bool)
    missed[np.concatenate(ran)] = False
    return store, missed


@pytest.mark.compiled
def test_late_ticks_make_no_other_friction_and_are_told(tmp_path):
    # through warm-up and the look for cogging one of twenty, then bursts
    store, missed = found(tmp_path, {**OFTEN, "for_ticks": 35_000}, {**OFTEN, **BURSTS})
    assert store.skipped == []
    assert sum(point.late for point in store.points) >= 5
    for point, measurements in zip(store.points, store.measurements, strict=True):
        if point.target_rad_s == 0:
            assert abs(point.friction_torque_nm) == pytest.approx(0.1131, rel=0.05)
        for one in measurements:
            slots = missed[one.first_tick : one.first_tick + one.ticks]
            assert np.count_nonzero(slots) <= 1


class Strict(Kept):
    """A store that ends where a point is given up."""

    def skip(self, task, why):
        raise UnsteadyError(why)


@pytest.mark.compiled
def test_a_loop_that_is_always_late_is_named_as_the_cause(tmp_path):
    with pytest.raises(UnsteadyError, match=r"came late too often .*rtctl doctor"):
        found(tmp_path, OFTEN, store=Strict())


def test_every_slot_has_a_tick_with_the_place_in_between_and_the_torque_that_was_held():
    rows = new_ticks(3, 1)
    rows["tick"], rows["position_rad"][:, 0], rows["motor_torque_nm"][:, 0] = [5, 6, 9], [0, 1, 4], [7, 8, 9]
    whole = on_every_slot(rows, 0)
    assert whole["position_rad"][:, 0].tolist() == [0, 1, 2, 3, 4]
    assert whole["motor_torque_nm"][:, 0].tolist() == [7, 8, 9, 9, 9]
    assert len(on_every_slot(whole, 0)) == 5


def answers(steps, motion, plant):
    """Run a motion on a plant that gives the ticks of an order, without compiled code."""
    order = next(steps)
    try:
        while True:
            order = steps.send(plant(order, motion))
    except StopIteration:
        return


class Turned:
    """A joint without cogging that goes as it is told, at .02 N m; a tick of twenty is left out."""

    def __init__(self):
        self.tick, self.x, self.v, self.lost = 0, 0.0, 0.0, 0.05
        self.draw = np.random.default_rng(1)

    def __call__(self, order, motion):
        self.v = order.fields.get("program_velocity_rad_s", self.v)
        rows = new_ticks(max(20, round(order.look_s / motion.rig.period_s)), 1)
        rows["state"], rows["tick"] = State.ACTIVE, self.tick + 1 + np.arange(len(rows))
        rows["position_rad"][:, 0] = self.x + self.v * motion.rig.period_s * (1 + np.arange(len(rows)))
        rows["motor_torque_nm"] = 0.02 * np.sign(self.v)
        self.tick, self.x = int(rows["tick"][-1]), float(rows["position_rad"][-1, 0])
        return rows[self.draw.random(len(rows)) > self.lost]


def motion_at_rest():
    motion = Motion(rig_of(load(CONFIG), QUICK), QUICK)
    motion.last = new_ticks(1, 1)[0]
    motion.choose_travel()
    return motion


def test_slots_that_were_left_out_are_no_cogging():
    motion = motion_at_rest()
    answers(look_for_cogging(motion), motion, Turned())
    assert not motion.cogging.matters


def test_a_measurement_beside_late_ticks_is_taken_again(monkeypatch):
    motion, got = motion_at_rest(), Collected()
    task = next(one for one in tasks(QUICK) if one.speed_rad_s > 0 and one.direction > 0)
    monkeypatch.setattr(points, "go_on", lambda *_: iter(()))
    monkeypatch.setattr(points, "settle", lambda *_: (yield from ()) or True)
    plant = Turned()
    plant.v, plant.lost = task.speed_rad_s, 0.2
    answers(points._run(motion, task, got, HERE, 0.0), motion, plant)
    assert (got.measurements, got.forgiven) == ([], 1)
    assert got.late > 3


def test_a_point_that_late_ticks_spoilt_says_so():
    motion, task = motion_at_rest(), tasks(QUICK)[0]
    for late, why in ((0, "hardly any dry friction"), (FORGIVEN + 1, "came late too often .*rtctl doctor")):
        with pytest.raises(UnsteadyError, match=why):
            answers(points._other_servo(motion, task, Collected(late=late)), motion, Turned())
