"""What the watch makes of it: motion that counts, what freezes it, what it goes on from after a restart."""

import copy
from functools import cache

import numpy as np
import pytest

from rtctl.check.law_plan import build
from rtctl.control.vocabulary import State
from rtctl.friction import drift_state as state
from rtctl.friction.drift_watch import RigWatch
from rtctl.rig_file.config import load
from rtctl.rig_file.friction_tables import DriftTable
from tests.drifting_joint import Joint, ticks_of

RATE_HZ = 400.0
PER_S = 0.01 / 60


@cache
def plan():
    return build(load("configs/mock.toml"))


def watch(raised=0.05, per_s=PER_S, **keys):
    """A rig that follows its friction up to 1 + `raised`."""
    params = plan().params.copy()
    params["period_s"], params["friction_raise"] = 1 / RATE_HZ, raised
    params["friction_change_step"] = per_s / RATE_HZ
    return RigWatch(params, plan().model, [DriftTable(**keys)])


@cache
def motion(factor, seconds=60.0):
    (rows,) = ticks_of([Joint(factor=factor)], seconds)
    rows["friction_factor"] = 1.0
    return rows


def over(rig, rows, batch=200):
    """The one axis after these ticks, and its factor after each batch."""
    way = []
    for k in range(0, len(rows), batch):
        rig.follow(rows[k : k + batch])
        way.append(rig.axes[0].factor)
    return rig.axes[0], np.array(way)


@cache
def _followed():
    rig = watch()
    return rig, *over(rig, motion(0.93))


def followed():
    """A rig after a minute of friction that is .93 of what was learned, its axis, and its factors: a copy."""
    return copy.deepcopy(_followed())


@pytest.mark.parametrize(("truth", "sign"), [(0.93, -1), (1.04, 1)])
def test_it_goes_towards_the_friction_by_no_more_than_the_motion_pays_for(truth, sign):
    axis, way = over(watch(), motion(truth))
    steps = sign * np.diff(way, prepend=1.0)
    assert steps.min() >= 0.0
    assert steps.max() <= PER_S * 0.75, "a block, and what the last one had not decided yet"
    moved_s = float((np.abs(motion(truth)["velocity_rad_s"]) > axis.by.speed_min_rad_s).mean()) * 60.0
    assert 0.3 * PER_S * moved_s < steps.sum() <= PER_S * moved_s


def test_a_joint_that_stands_still_changes_nothing_and_pays_for_nothing_later():
    rig, _, way = followed()
    rows = motion(0.93).copy()
    rows["tick"] += len(rows)
    rows["position_rad"], rows["velocity_rad_s"] = rows["position_rad"][:1], 0.0
    _, still = over(rig, rows)
    assert way[-1] - PER_S * 0.2 <= still.min() <= still.max() <= way[-1]
    again = motion(0.93).copy()
    again["tick"] += 2 * len(rows)
    _, later = over(rig, again[: round(2 * RATE_HZ)])
    assert still[-1] - later[-1] <= PER_S * 2.0


def test_it_is_frozen_beside_a_fault_after_a_stop_and_while_the_motor_is_off():
    for field, value in (("faults", 1), ("state", int(State.IDLE))):
        rig, _, way = followed()
        rows = motion(0.93).copy()
        rows["tick"] += len(rows)
        rows[field][99::100] = value  # in each block that is looked at
        _, frozen = over(rig, rows)
        assert (frozen == way[-1]).all(), field
    rig = watch(per_s=PER_S)
    _, way = over(rig, motion(0.82))
    stopped = int(np.argmax(way != 1.0))
    assert rig.axes[0].stopped
    assert (way[-20:] == way[-1]).all()
    assert stopped > 0
    _, free = over(watch(stop=False), motion(0.82))
    assert free[-1] < way[-1] < 1.0


def test_what_is_followed_is_no_longer_too_much():
    rows = motion(0.85).copy()
    assert over(watch(per_s=0.0), rows)[0].stopped
    rows["friction_factor"] = 0.85
    assert over(watch(per_s=1e-9), rows)[0].stopped == "", (
        "the feed-forward in force is as much less as the friction"
    )
    rows["friction_factor"] = 1.05
    assert over(watch(per_s=1e-9), rows)[0].stopped


def test_an_axis_that_follows_nothing_stays_as_learned():
    axis, way = over(watch(per_s=0.0), motion(0.93))
    assert axis.bounds is None
    assert (way == 1.0).all()


# -- kept from run to run


def kept(tmp_path, axis):
    state.write(tmp_path, "d", {"joint": state.packed(axis)})
    return state.read(tmp_path, "d")["joint"]


def test_a_restart_goes_on_from_the_factor_within_the_bounds_of_now(tmp_path):
    _, before, _ = followed()
    whole = kept(tmp_path, before)
    after = watch().axes[0]
    assert state.restore(after, whole)
    assert after.factor == before.factor < 1.0
    before.factor = 1.04
    higher = watch(raised=0.0).axes[0]
    assert state.restore(higher, kept(tmp_path, before))
    assert higher.factor == 1.0
    before.factor = 0.2
    lower = watch().axes[0]
    assert state.restore(lower, kept(tmp_path, before))
    assert lower.factor == 0.7
    off = watch(per_s=0.0).axes[0]
    assert state.restore(off, whole)
    assert off.factor == 1.0


def test_another_model_begins_as_learned(tmp_path):
    _, before, _ = followed()
    whole = kept(tmp_path, before)
    other = plan().model.copy()
    other["coefficient"] *= 1.001
    params = plan().params.copy()
    params["friction_change_step"] = PER_S * params["period_s"]
    axis = RigWatch(params, other, [DriftTable()]).axes[0]
    assert not state.restore(axis, whole)
    assert axis.factor == 1.0


@pytest.mark.parametrize("wrong", [float("nan"), float("inf"), "0.9", None, True, [0.9]])
def test_a_damaged_factor_is_as_learned(tmp_path, wrong):
    _, before, _ = followed()
    axis = watch().axes[0]
    assert state.restore(axis, {**kept(tmp_path, before), "factor": wrong})
    assert axis.factor == 1.0
