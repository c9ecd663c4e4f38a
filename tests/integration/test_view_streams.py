"""The page's server, with a rig that is made up: what is streamed to whoever looks, and what is recorded."""

import json
import math

import numpy as np
import pytest
from made_up_rig import Rig
from page_client import OURS, events, get, get_stream_status, recorded, served
from patience import until

from rtctl.client.view_feed import EDGES_US, KEPT_BATCHES, Feed, Histogram, Signal, columns
from rtctl.client.view_server import MOST_RECORDINGS, MOST_STREAMS
from rtctl.control.vocabulary import Fault, State
from rtctl.errors import ClientError
from rtctl.tick import new_ticks


@pytest.fixture
def page():
    with served() as made:
        yield made


def test_a_stream_carries_the_signals_asked_for_thinned_and_the_status(page):
    rig, server = page
    stream = events(server, "position_rad.1,force_n.2,energy_port_j.7")
    next(stream)
    rig.batch(200, position_rad=[[0.5, math.nan]], force_n=[[1.0, 2.0, 3.0]], state=State.ACTIVE)
    seen = next(data for name, data in stream if name == "ticks")
    assert set(seen) == {"t", "position_rad.1", "force_n.2", "energy_port_j.7"}
    assert len(seen["t"]) <= 12
    assert seen["t"][-1] == pytest.approx(0.199)
    assert set(seen["position_rad.1"]) == {None}
    assert set(seen["force_n.2"]) == {3.0}
    assert set(seen["energy_port_j.7"]) == {None}
    status = next(data for name, data in stream if name == "status" and "state" in data)
    assert status["state"] == "ACTIVE"
    assert status["position_rad"][0] == 0.5
    stream.close()


def test_faults_and_events_are_told_with_their_texts(page):
    rig, server = page
    stream = events(server)
    next(stream)
    where = {"axis": "tip", "channel": None, "device": "device[0] 'can'", "detail": "node 2 is silent"}
    rig.told.put({"event": "fault", "name": "STALE", "text": "", "tick": 7, "timestamp": 1.0, **where})
    rig.told.put({"event": "state", "from": "ACTIVE", "to": "FAULT", "tick": 7, "timestamp": 1.0})
    voice = {"device": "device[0] 'can'", "axis": "tip", "text": "", "faults": [], "silent": True}
    rig.well.put({"devices": [voice, {**voice, "axis": "base", "silent": False}]})
    rig.batch(state=State.FAULT, faults=int(Fault.STALE), fault_first=0)
    heard = {}
    for name, data in stream:
        heard[name] = data
        status = heard.get("status", {})
        if heard.get("event", {}).get("to") and status.get("first") and status["devices"]:
            break
    assert heard["event"]["sentence"] == "ACTIVE -> FAULT: the law"
    said = heard["status"]["faults"][0]["sentence"]
    assert said.startswith(
        "STALE (axis tip, device[0] 'can'): node 2 is silent: the device sends no fresh samples"
    )
    assert heard["status"]["devices"] == ["device[0] 'can', axis tip: no fresh sample"]
    assert heard["status"]["first"]["name"] == "STALE"
    assert "power and cable" in heard["status"]["faults"][0]["text"]
    stream.close()


@pytest.mark.parametrize(
    "signals", ["nothing", "position_rad.x", "position_rad.-1", "seal;drop", ",".join(["tick"] * 17)]
)
def test_signals_that_are_none_are_refused(page, signals):
    answer, body = get(page[1], f"/stream?signals={signals.replace(';', '%3B')}", **OURS)
    assert answer.status == 400
    assert json.loads(body)["error"]


def test_only_so_many_browsers_may_look_and_one_that_leaves_makes_room(page):
    server = page[1]
    streams = [events(server) for _ in range(MOST_STREAMS)]
    for stream in streams:
        next(stream)
    answer, body = get(server, "/stream", **OURS)
    assert answer.status == 503
    assert "close one" in json.loads(body)["error"]
    streams[0].close()
    until(lambda: get_stream_status(server) == 200, "room for one more")
    for stream in streams[1:]:
        stream.close()


def test_a_recording_has_every_tick_with_the_names_of_the_export(page):
    rig, server = page
    lines = recorded(server, "position_rad.1,force_n.2,state.0")
    assert next(lines) == ["tick", "time_ns", "position_rad.pitch", "force_n.z", "state"]
    rig.batch(300, position_rad=[[0.5, 0.1 + 0.2]], force_n=[[1.0, 2.0, math.inf]], state=State.ACTIVE)
    seen = [next(lines) for _ in range(300)]
    assert [int(line[0]) for line in seen] == list(range(300))
    assert [int(line[1]) for line in seen] == [k * 1_000_000 for k in range(300)]
    assert {tuple(line[2:]) for line in seen} == {(repr(0.1 + 0.2), "", "3")}
    lines.close()


def test_a_recording_of_an_axis_that_the_rig_has_not_has_an_empty_column(page):
    rig, server = page
    lines = recorded(server, "position_rad.5,force_n.7")
    assert next(lines) == ["tick", "time_ns", "position_rad", "force_n"]
    rig.batch(3)
    assert next(lines) == ["0", "0", "", ""]
    lines.close()


def test_recordings_have_places_of_their_own(page):
    server = page[1]
    lines = [recorded(server, "tick") for _ in range(MOST_RECORDINGS)]
    for line in lines:
        next(line)
    assert get(server, "/ticks.csv?signals=tick", **OURS)[0].status == 503
    assert get_stream_status(server) == 200
    for line in lines:
        line.close()


def test_a_sensor_that_is_not_a_number_does_not_end_the_page(page):
    rig, server = page
    stream = events(server)
    next(stream)
    rig.batch(position_rad=[[math.nan, 0.5]], hand_torque_nm=[[math.inf, 0.0]], state=State.FAULT)
    status = next(data for name, data in stream if name == "status" and "state" in data)
    assert status["position_rad"] == [None, 0.5]
    assert status["hand_nm"] == [None, 0.0]
    stream.close()


def test_no_text_of_a_device_reaches_the_page_with_control_characters(page):
    rig, server = page
    stream = events(server)
    next(stream)
    evil = "\x1b[2J\u202egnp.exe"
    voice = {"device": evil, "axis": None, "text": evil, "faults": [evil], "silent": True}
    rig.told.put({"event": "device", **voice, "tick": 7, "timestamp": 1.0})
    rig.well.put({"devices": [voice], evil: evil})
    rig.batch(state=State.IDLE)
    heard = {}
    for name, data in stream:
        heard[name] = json.dumps(data, ensure_ascii=False)
        if "event" in heard and "\\\\x1b" in heard.get("status", ""):
            break
    for text in (heard["event"], heard["status"]):
        assert "\\u202e" in text
        assert "\u202e" not in text
        assert "\\u001b" not in text
    stream.close()


def test_the_status_says_what_leads_on_and_why_buttons_would_be_refused(page):
    rig, server = page
    stream = events(server)
    next(stream)
    rig.batch(state=State.FAULT, faults=int(Fault.STALE), fault_first=0)
    status = next(data for name, data in stream if name == "status" and data.get("state") == "FAULT")
    assert "Reset once" in status["next"]
    assert status["hindrances"] == {"arm": "the rig is in FAULT: Reset first", "reset": "", "tare": ""}
    assert status["first"]["wrong"] == "the device sends no fresh samples"
    assert status["first"]["remedy"] == "check its power and cable"
    stream.close()


def test_a_browser_that_does_not_read_keeps_a_bounded_past():
    rig = Rig()
    feed = Feed(rig)
    follower = feed.follow()
    for k in range(KEPT_BATCHES + 50):
        rig.batch(2, first=2 * k)
    until(rig.rows.empty)
    rig.batch(2, first=9000)
    until(lambda: follower.batches and follower.batches[-1]["tick"][-1] == 9001)
    rows, _ = follower.take()
    assert len(rows) == 2 * KEPT_BATCHES
    assert rows["tick"][-1] == 9001
    assert follower.take()[0] is None
    feed.leave(follower)
    feed.close()


def test_a_rig_that_comes_back_with_another_number_of_axes_is_shown_from_then_on():
    feed = Feed(rig := Rig())
    follower = feed.follow()
    rig.batch(4)
    rig.rows.put(new_ticks(3, 1))
    until(lambda: len(follower.batches) == 2)
    assert feed.newest["position_rad"].shape == (1, 1)
    rows, _ = follower.take()
    assert rows["position_rad"].shape == (3, 1)
    feed.leave(follower)
    feed.close()


def test_a_message_that_cannot_be_read_is_told_and_the_next_one_counts():
    rig = Rig()
    feed = Feed(rig)
    topics = {"events": rig.told, "health": rig.well}
    for queue in topics.values():
        queue.put(ClientError("of another version"))
    until(lambda: all(feed.unread.values()))
    assert feed.unread == dict.fromkeys(topics, "of another version")
    for queue in topics.values():
        queue.put({"event": "fault", "name": "STALE", "axis": "tip"})
    until(lambda: not any(feed.unread.values()))
    until(lambda: feed.places.entries(int(Fault.STALE))[0]["axis"] == "tip", "its place")
    feed.close()


def test_ticks_are_read_while_somebody_looks_and_forgotten_when_nobody_does():
    rig, opened = Rig(), []
    feed = Feed(rig)
    ticks = rig.ticks
    rig.ticks = lambda: opened.append(None) or ticks()
    rig.told.put({"event": "started", "tick": 0})
    until(rig.told.empty, "an event, which is read in any case")
    assert not opened
    for times in (1, 2):
        followers = [feed.follow(), feed.follow()]
        rig.batch(20)
        until(lambda: sum(feed.histogram()["wakeup"]) == 20, "ticks")
        assert len(opened) == times
        assert feed.silent == ""
        feed.leave(followers[0])
        rig.batch(20, first=20)
        until(lambda: feed.newest["tick"][0] == 39, "the second still looks")
        feed.leave(followers[1])
        rig.batch(1, first=40)
        until(lambda: feed.newest is None, "what was seen before is not shown to who comes next")
        assert feed.silent == "connecting"
        while not rig.rows.empty():
            rig.rows.get()
    feed.close()


def test_thinning_keeps_order_and_the_newest():
    rows = new_ticks(1000, 1)
    rows["time_ns"] = np.arange(1000) * 1_000_000
    rows["position_rad"][:, 0] = np.arange(1000)
    seen = columns(rows, [Signal.parse("position_rad.0")], points=7)
    assert len(seen["t"]) <= 7
    assert seen["position_rad.0"] == sorted(seen["position_rad.0"])
    assert seen["position_rad.0"][-1] == 999


def test_the_histogram_counts_the_last_seconds_and_nothing_twice():
    histogram = Histogram()
    late_ns = np.array([500.0, 15_000.0, 15_000.0, 50_000_000.0])
    histogram.add(0, late_ns)
    assert histogram.total.sum() == 4
    assert histogram.total[0] == 1
    assert histogram.total[-1] == 1
    of_15_us = int(np.searchsorted(EDGES_US, 15.0)) - 1
    assert histogram.total[of_15_us] == 2
    histogram.add(int(9e9), late_ns[:1])
    assert histogram.total[0] == 2
    histogram.add(int(11e9), late_ns[1:2])
    assert (histogram.total[0], histogram.total[of_15_us], histogram.total.sum()) == (1, 1, 2)
    histogram.add(0, late_ns)  # the daemon was started again: its clock began anew
    assert histogram.total.sum() == 4
