"""A host that is late by seconds: all ticks of that time come in one batch, and the order before them stood.

Nothing of it is an error of the joint, and what is measured is its friction all the same."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from identified import CONFIG, SMALL, Kept, true_friction_nm, variant

from rtctl.control.vocabulary import ProgramFlag, State
from rtctl.errors import DataError
from rtctl.experiments.simulated_identification import drive
from rtctl.identify import points
from rtctl.identify.cogging import Cogging
from rtctl.identify.collected import FORGIVEN, Collected
from rtctl.identify.measurement_order import tasks
from rtctl.identify.motion import Motion, Order
from rtctl.identify.session import identify
from rtctl.identify.settings import rig_of, without_feedforward
from rtctl.identify.sweep import TRIES, look_for_cogging
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation
from rtctl.tick import new_ticks

TRAVEL = (
    "current_limit_a = 10.0",
    "position_min_rad = -0.5\nposition_max_rad = 0.6\ncurrent_limit_a = 10.0",
)
LITTLE = replace(SMALL, train_levels=2, test_levels=1, warm_up_s=1.0)


def late(steps, share, rng):
    """The same steps from a host that is .3 to 4 s late in this share of its looks."""
    order = next(steps)
    while True:
        rows = yield order
        if rng.random() < share:
            rows = np.concatenate([rows, (yield Order(look_s=rng.uniform(0.3, 4.0)))])
        try:
            order = steps.send(rows)
        except StopIteration:
            return


@pytest.mark.parametrize(
    ("limits", "share", "seed"), [([], 0.02, 1), ([TRAVEL], 0.02, 1)], ids=["free", "limited"]
)
def test_a_late_host_makes_no_error_and_no_other_friction(tmp_path, limits, share, seed):
    settings = replace(LITTLE, speed_max_rad_s=1.0 if limits else LITTLE.speed_max_rad_s)
    loaded = without_feedforward(load(variant(tmp_path, *limits)))
    rig, store, simulation = rig_of(loaded, settings), Kept(), Simulation(loaded)
    steps = identify(rig, settings, store, lambda *_: None, lambda _text: None)

    def watch(rows):
        assert np.all(rows["faults"] == 0)
        if limits:
            assert np.all(np.abs(rows["position_rad"] - 0.05) < 0.55)

    drive(simulation, late(steps, share, np.random.default_rng(seed)), rig.axis, watch)
    assert (len(store.points), store.skipped) == (2 * (1 + 2 + 1), [])
    off = [p.friction_torque_nm - true_friction_nm(p.velocity_rad_s, p.direction) for p in store.points]
    assert np.abs(off).max() < 0.03 * 0.25


def at_the_end(here_rad, rows=1):
    """A motion whose joint stands there, and so many ticks of it."""
    motion = Motion(rig_of(load(CONFIG), SMALL), SMALL)
    motion.low_rad, motion.high_rad = -0.35, 0.35
    ticks = new_ticks(rows, 1)
    ticks["state"], ticks["position_rad"] = State.ACTIVE, here_rad
    motion.last = ticks[0]
    return motion, ticks


@pytest.mark.parametrize("way", [1, -1])
def test_the_way_back_from_beyond_the_guard_is_open_whatever_the_velocity_is_thought_to_be(way):
    """The guard trips on a filtered velocity: one that a brake leaves at 1e-12 outward ended every order."""
    motion, _ = at_the_end(0.376 * way)
    back, on = (motion.turn(sign * 0.5 * way).fields for sign in (-1, 1))
    outer, other = ("max", "min") if way > 0 else ("min", "max")
    assert way * back[f"program_{outer}_rad"] > 0.376
    assert way * on[f"program_{outer}_rad"] == pytest.approx(0.375), "outward the guard stays where it is"
    assert way * back[f"program_{other}_rad"] == pytest.approx(-0.375)
    motion.rig = replace(motion.rig, position_max_rad=0.38, position_min_rad=-0.38)
    assert way * motion.turn(-0.5 * way).fields[f"program_{outer}_rad"] == 0.38, "never beyond the rig's own"


def test_a_joint_that_passed_its_goal_in_a_late_batch_has_followed():
    motion, rows = at_the_end(0.0, 10_000)
    steps = motion.advance(0.2, 0.5)
    next(steps)
    rows["position_rad"][:, 0] = np.linspace(0.0, 0.3, len(rows))
    with pytest.raises(StopIteration):
        steps.send(rows)
    assert motion.late == 1


def test_tries_that_a_late_host_spoilt_count_for_nothing_but_not_for_ever():
    got = Collected()
    for _ in range(FORGIVEN):
        got.discard(late=True)
    assert (got.discarded, got.in_vain) == (0, 0)
    got.discard(late=True)
    got.discard()
    assert (got.discarded, got.in_vain) == (2, 2)


def test_a_place_that_a_late_host_ran_past_is_gone_to_again(monkeypatch):
    """Even places, and phases of a ripple, are what cancels."""
    motion, _ = at_the_end(0.0)
    gone, task = [], next(one for one in tasks(SMALL) if one.speed_rad_s > 0)

    def go_on(_motion, _direction, spot, *_):
        gone.append(spot)
        yield from ()

    def settle(*_):
        motion.late += len(gone) == 2
        yield from ()
        return True

    monkeypatch.setattr(points, "go_on", go_on)
    monkeypatch.setattr(points, "settle", settle)
    monkeypatch.setattr(points, "measure", lambda *_: SimpleNamespace(position_rad=0.0))
    monkeypatch.setattr(points, "is_even", lambda *_: True)
    monkeypatch.setattr(points, "stops_and_starts", lambda *_: False)
    monkeypatch.setattr(Motion, "rest", lambda _self: iter(()))
    monkeypatch.setattr(Motion, "room_rad", lambda *_: 10.0)
    monkeypatch.setattr(Motion, "watch", lambda *_: (yield from ()) or new_ticks(100, 1))
    monkeypatch.setattr(Cogging, "noted", lambda _self, measurement: measurement)
    with pytest.raises(StopIteration) as end:
        next(points.collect(motion, task, 0.0))
    assert (end.value.value.forgiven, len(gone)) == (1, SMALL.spots + 1)
    assert gone[1] is gone[2] is not gone[0]
    assert gone[3] is not gone[2]


def test_a_turn_that_a_late_host_never_lets_be_seen_ends_with_words():
    motion, rows = at_the_end(0.0, 100)
    rows["program_flags"] = ProgramFlag.TRAVEL
    steps = look_for_cogging(motion)

    def run():
        order = next(steps)
        for _ in range(100_000):
            # it goes where it is sent, and each look ends braked
            there = motion.position_rad + order.fields.get("program_velocity_rad_s", 0.0) * 0.2
            rows["position_rad"] = np.clip(there, -0.36, 0.36)
            order = steps.send(rows.copy())

    with pytest.raises(DataError, match=rf"{TRIES} turns .* late each time"):
        run()
