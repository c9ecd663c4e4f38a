"""The host's watch over the friction: events, warnings, health, the order to stop, and what is kept."""

from functools import cache

import numpy as np

from rtctl.check.law_plan import build
from rtctl.friction import drift_state as state
from rtctl.host.exchange.events import EventDetector
from rtctl.host.exchange.friction_watch import FrictionWatch
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.rig_file.config import load
from rtctl.rig_file.friction_tables import DriftTable
from tests.drifting_joint import Joint, ticks_of

RIG = RigDescription("mock", (AxisDescription("joint", {}),), 400.0, session=7, virtual=True)


@cache
def plan():
    return build(load("configs/mock.toml"))


def watch(folder=None, **keys):
    params = plan().params.copy()
    params["period_s"] = 1 / RIG.rate_hz
    return FrictionWatch(RIG, params, plan().model, [DriftTable(**keys)], folder)


def over(rows, found, detector=None):
    """Events of these ticks, and how often the rig was to be stopped."""
    events, stops = [], 0
    for k in range(0, len(rows), 200):
        stops += found.follow(rows[k : k + 200])
        if detector is not None:
            events += detector.detect(rows[k : k + 200])
    return [event for event in events if "warning" in event["event"]], stops


def test_a_warning_comes_and_goes_as_one_event_each_and_stands_in_health_between():
    (rows,) = ticks_of([Joint(factor=1.2, later=1.0, later_s=32.0)], 70.0)
    found = watch()
    assert found.status() == [
        {"axis": "joint", "factor": None, "seconds": 0.0, "strokes": 0, "followed": None, "adapting": None}
    ]
    half = round(31.0 * RIG.rate_hz)
    detector = EventDetector(RIG, None, found)
    events, stops = over(rows[:half], found, detector)
    assert [(event["event"], event["name"], event["axis"]) for event in events] == [
        ("warning", "FRICTION_DRIFT", "joint")
    ]
    assert "1.20 (" in events[0]["text"]
    assert "rtctl identify" in events[0]["text"]
    (warning,) = found.warnings()
    assert warning["text"].startswith("axis joint: dry friction is 1.2")
    (health,) = found.status()
    assert health["factor"]["low"] < 1.2 < health["factor"]["high"]
    assert set(health) == {
        "axis",
        "factor",
        "forward",
        "backward",
        "offset_nm",
        "seconds",
        "strokes",
        "place_trust",
        "followed",
        "adapting",
    }
    later, more = over(rows[half:], found, detector)
    assert [event["event"] for event in later] == ["warning_cleared"]
    assert found.warnings() == []
    assert stops == more == 0


def test_the_rig_is_stopped_once_each_time_it_was_armed():
    (rows,) = ticks_of([Joint(factor=0.85)], 40.0)
    found = watch()
    assert over(rows, found)[1] == 1
    assert [one["name"] for one in found.warnings()] == ["FRICTION_DRIFT", "OVERCOMPENSATION"]
    disarmed = rows[:200].copy()
    disarmed["state"] = 1
    assert over(disarmed, found)[1] == 0
    again = rows.copy()
    again["tick"] += len(rows) + 1000
    assert over(again, found)[1] == 1
    assert over(rows, watch(stop=False))[1] == 0


def test_what_the_rig_was_stopped_for_hinders_arming_until_the_cause_is_gone_or_somebody_says_so():
    (rows,) = ticks_of([Joint(factor=0.85)], 40.0)
    found = watch()
    assert found.hindrance(np.ones(1)) == ""
    assert over(rows, found)[1] == 1
    disarmed = rows[:200].copy()
    disarmed["state"] = 1
    over(disarmed, found)
    assert found.hindrance(np.ones(1)).startswith("axis joint: dry friction is at most 0.")
    assert found.hindrance(np.full(1, 0.5)) == "", "half of the compensation is less than the friction"
    assert found.dismiss()
    assert (found.hindrance(np.ones(1)), found.dismiss()) == ("", False)
    assert [one["name"] for one in found.warnings()] == ["FRICTION_DRIFT"]
    over(rows, found)
    assert found.hindrance(np.ones(1)), "stopped again, after some motion"


def test_the_state_is_written_once_a_minute_where_something_is_new_and_read_again(tmp_path):
    (rows,) = ticks_of([Joint(factor=0.9)], 30.0)
    found = watch(tmp_path)
    assert found.to_keep() is None
    over(rows, found)
    assert found.to_keep(5_000_000_000) is None
    assert found.to_keep(64_000_000_000) is None
    task = found.to_keep(65_000_000_000)
    assert task is not None
    task()
    assert found.to_keep() is None, "nothing is new"
    again = watch(tmp_path)
    assert again.status() == found.status()
    (tmp_path / state.NAME).write_text('{"devices_sha256": "", "axes": {"joint": {"strokes": []}}}')
    assert watch(tmp_path).status()[0]["factor"] is None


def following(raised=0.0, folder=None):
    """A watch over a rig that follows its friction, quicker than a rig file can ask, up to 1 + `raised`."""
    params = plan().params.copy()
    params["period_s"], params["friction_raise"] = 1 / RIG.rate_hz, raised
    params["friction_change_step"] = 0.2 / 60 / RIG.rate_hz
    return FrictionWatch(RIG, params, plan().model, [DriftTable()], folder)


def test_the_law_is_asked_for_what_is_new_and_after_a_restart_for_what_was_followed(tmp_path):
    (rows,) = ticks_of([Joint(factor=0.95)], 60.0)
    rows["friction_factor"] = 1.0
    found = following(folder=tmp_path)
    assert found.changes() is None
    over(rows, found)
    (health,) = found.status()
    assert abs(health["followed"] - 0.95) < 0.02
    assert found.changes().tolist() == [health["followed"] - 1.0]
    assert found.changes() is None, "nothing is new"
    found.to_keep()()
    again = following(folder=tmp_path)
    assert again.changes().tolist() == [health["followed"] - 1.0]
    assert watch(tmp_path).changes() is None, "nobody asked for it"
    (axis,) = found._watch.axes
    axis.strokes.forget()
    axis.strokes.taken += 1
    found.to_keep()()
    assert following(folder=tmp_path).changes().tolist() == [health["followed"] - 1.0], (
        "what it goes by stays"
    )


def test_an_axis_that_follows_is_held_where_it_is_and_goes_on_from_there():
    (rows,) = ticks_of([Joint(factor=0.95)], 60.0)
    rows["friction_factor"] = 1.0
    held, on = round(14 * RIG.rate_hz), round(35 * RIG.rate_hz)
    found = following()
    assert found.adapting(0) is True
    over(rows[:held], found)
    before = found.status()[0]["followed"]
    assert 0.96 < before < 1.0
    assert found.adapt(None, on=False) == ""
    assert found.adapting(0) is found.status()[0]["adapting"] is False
    over(rows[held:on], found)
    assert found.status()[0]["followed"] == before
    assert found.adapt(0, on=True) == ""
    over(rows[on:], found)
    assert found.status()[0]["adapting"] is True
    assert found.status()[0]["followed"] < before
    nobody = watch()
    assert nobody.adapting(0) is nobody.status()[0]["adapting"] is None
    for on in (True, False):
        assert "adapt_per_min" in nobody.adapt(0, on=on)


def test_a_friction_beyond_what_may_be_followed_is_told_as_long_as_it_is():
    (rows,) = ticks_of([Joint(factor=1.2, later=1.0, later_s=40.0)], 90.0)
    rows["friction_factor"] = 1.0
    found = following(raised=0.02)
    detector = EventDetector(RIG, None, found)
    events, _ = over(rows, found, detector)
    told = [(event["event"], event["text"][:60]) for event in events if event["name"] == "ADAPTATION_BOUND"]
    assert [kind for kind, _ in told] == ["warning", "warning_cleared"]
    assert told[0][1].startswith("axis joint: dry friction is 1.")


def test_two_axes_are_watched_each_by_itself():
    two = build(load("configs/mock-2axis.toml"))
    params = two.params.copy()
    params["period_s"] = 1 / RIG.rate_hz
    rig = RigDescription("mock", (AxisDescription("a", {}), AxisDescription("b", {})), 400.0)
    found = FrictionWatch(rig, params, two.model, [DriftTable(), DriftTable(watch=False)])
    assert [one["axis"] for one in found.status()] == ["a"]
