"""The page's server, with a rig that is made up: who may look, who may press, what is streamed."""

import http.client
import json
import math
import re
import socket
import threading

import numpy as np
import pytest
from made_up_rig import Rig
from patience import PATIENCE_S, until

from rtctl.control.vocabulary import Fault, State
from rtctl.tick import new_ticks
from rtctl.view.feed import EDGES_US, KEPT_BATCHES, Feed, Histogram, Signal, columns
from rtctl.view.guests import MOST_GUESTS
from rtctl.view.server import FILES, MOST_RECORDINGS, MOST_STREAMS, SCRIPTS, STATIC, ViewServer

OURS = {"X-Rtctl": "view"}


@pytest.fixture
def page():
    rig = Rig()
    server = ViewServer(rig, "127.0.0.1", 0, key="right")
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    yield rig, server
    server.close()
    thread.join()


def connection(server):
    return http.client.HTTPConnection(*server.server_address[:2], timeout=PATIENCE_S)


def get(server, path, **headers):
    link = connection(server)
    link.request("GET", path, headers=headers)
    answer = link.getresponse()
    body = answer.read()
    link.close()
    return answer, body


def press(server, name, body=b"{}", key="right", link=None, **headers):
    own = link or connection(server)
    own.request("POST", f"/do/{name}", body, {"X-Rtctl": "view", "X-Operator-Key": key, **headers})
    answer = own.getresponse()
    said = json.loads(answer.read())
    if link is None:
        own.close()
    return answer.status, said


@pytest.mark.parametrize("path", [path for path in FILES if path != "/uPlot.min.css"])
def test_the_pages_are_served_whole_and_may_load_nothing_from_elsewhere(page, path):
    answer, body = get(page[1], path)
    assert answer.status == 200
    assert len(body) == int(answer.headers["Content-Length"]) > 200
    assert "default-src 'self'" in answer.headers["Content-Security-Policy"]
    assert b"https://" not in body.replace(b"https://github.com/leeoniya/uPlot", b"")
    assert b"http://" not in body


def test_every_script_that_a_page_asks_for_is_served(page):
    named = set()
    for name in (*SCRIPTS, "index.html", "world.html"):
        text = (STATIC / name).read_text()
        named |= set(re.findall(r'(?:from "./|type="module" src=")([a-z]+\.js)"', text))
    assert named == set(SCRIPTS)


@pytest.mark.parametrize(
    "path", ["/../server.py", "/static/view.js", "/etc/passwd", "/%2e%2e/feed.py", "/nothing"]
)
def test_nothing_else_is_served(page, path):
    assert get(page[1], path, **OURS)[0].status == 404


@pytest.mark.parametrize(
    "headers", [{"Host": "evil.example"}, {"Origin": "http://evil.example"}, {"Origin": "null"}]
)
def test_other_names_and_pages_are_refused(page, headers):
    assert get(page[1], "/", **headers)[0].status == 403
    assert press(page[1], "stop", **headers)[0] == 403
    assert page[0].asked == []


@pytest.mark.parametrize("path", ["/stream", "/ticks.csv", "/hello", "/view.js"])
@pytest.mark.parametrize("site", ["cross-site", "same-site"])  # same-site: another port of this machine
def test_nothing_is_given_to_an_image_or_frame_of_another_page(page, path, site):
    fetched = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "image"}
    answer, body = get(page[1], path, **fetched, **OURS)
    assert answer.status == 403
    assert b"another name or page" in body


@pytest.mark.parametrize("path", ["/stream", "/ticks.csv?signals=tick", "/hello"])
def test_a_browser_that_tells_no_site_cannot_take_up_streams_for_another_page(page, path):
    # over a plain address of the network browsers send no Sec-Fetch-*, and images no Origin: the header decides
    for _ in range(MOST_STREAMS + 1):
        assert get(page[1], path)[0].status == 403
    assert get(page[1], "/hello", **OURS)[0].status == 200
    assert get_stream_status(page[1]) == 200


def test_a_link_from_another_page_opens_the_page_and_nothing_else(page):
    link = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}
    assert get(page[1], "/", **link)[0].status == 200
    assert get(page[1], "/world", **link)[0].status == 200
    assert get(page[1], "/hello", **link, **OURS)[0].status == 403
    assert get(page[1], "/", **{**link, "Sec-Fetch-Dest": "iframe"})[0].status == 403


def test_its_own_page_may_press(page):
    port = page[1].server_address[1]
    assert press(page[1], "stop", Origin=f"http://127.0.0.1:{port}")[0] == 200
    assert press(page[1], "stop", Origin=f"http://localhost:{port}", Host=f"localhost:{port}")[0] == 200


@pytest.mark.parametrize("key", ["", "wrong", "righ", "right ", "ü"])
def test_anyone_may_stop_and_only_the_operator_anything_else(page, key):
    rig, server = page
    for name in ("arm", "reset", "tare", "compensation", "world"):
        status, said = press(server, name, key=key.encode("latin-1", "replace").decode("latin-1"))
        assert status == 403
        assert "operator key" in said["error"]
    assert rig.asked == []
    assert press(server, "stop", key=key)[0] == 200
    assert rig.asked == [("stop", (), {})]


def test_without_the_header_that_foreign_pages_cannot_send_nothing_is_pressed(page):
    rig, server = page
    link = connection(server)
    link.request("POST", "/do/stop", b"{}", {"X-Operator-Key": "right"})
    assert link.getresponse().status == 403
    link.close()
    assert rig.asked == []


def test_buttons_reach_the_rig(page):
    rig, server = page
    for name, body, asked in [
        ("arm", b"", ("arm", (), {"wait": False})),
        ("reset", b"{}", ("reset", (), {"wait": False})),
        ("tare", b"{}", ("tare", (), {})),
        ("compensation", b'{"share": 0.5}', ("set_compensation", (0.5,), {})),
    ]:
        assert press(server, name, body) == (200, {"ok": True, "result": None})
        assert rig.asked[-1] == asked
    assert press(server, "world", b'{"kind": "spring", "stiffness_nm_rad": 12.0}')[0] == 200
    name, arguments, values = rig.asked[-1]
    assert (name, arguments, values["stiffness_nm_rad"]) == ("set_environment", ("yaw", "spring"), 12.0)


@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("compensation", b"{"),
        ("compensation", b"[]"),
        ("compensation", b"{}"),
        ("compensation", b'{"share": NaN}'),
        ("compensation", b'{"share": Infinity}'),
        ("compensation", b'{"share": "much"}'),
        ("world", b'{"kind": "moon"}'),
        ("world", b'{"kind": "wall", "stiffness_nm_rad": 1e999}'),
        ("world", b'{"kind": "wall", "stiffness_nm_rad": []}'),
        ("world", b'{"kind": "wall", "gravity": 9.81}'),
    ],
)
def test_nonsense_is_refused_with_a_reason(page, name, body):
    status, said = press(page[1], name, body)
    assert status == 400
    assert said["error"].startswith("not understood: ")
    assert page[0].asked == []


def test_what_the_daemon_refuses_is_said(page):
    page[0].refuse = "state FAULT: reset first"
    assert press(page[1], "arm") == (409, {"error": "state FAULT: reset first", "code": "not_ready"})


def test_a_refused_press_leaves_the_connection_usable(page):
    rig, server = page
    link = connection(server)
    assert press(server, "arm", b'{"a": 1}', key="wrong", link=link)[0] == 403
    assert press(server, "stop", b"{}", key="", link=link)[0] == 200
    link.close()
    assert rig.asked == [("stop", (), {})]


def test_a_body_that_is_too_long_is_not_read(page):
    assert press(page[1], "stop", b" " * 5000)[0] == 413
    assert press(page[1], "stop", b"", **{"Content-Length": "-1"})[0] == 413


def events(server, signals="", most=400):
    """Parsed events of a stream, until the test has seen enough."""
    link = connection(server)
    link.request("GET", f"/stream?signals={signals}", headers=OURS)
    answer = link.getresponse()
    assert answer.status == 200
    try:
        for _ in range(most):
            name = answer.fp.readline().decode().removeprefix("event: ").strip()
            data = answer.fp.readline().decode().removeprefix("data: ")
            answer.fp.readline()
            yield name, json.loads(data, parse_constant=pytest.fail)  # a browser takes no NaN
    finally:
        link.close()


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


def get_stream_status(server):
    link = connection(server)
    link.request("GET", "/stream", headers=OURS)
    status = link.getresponse().status
    link.close()
    return status


def recorded(server, signals):
    """Lines of a recording, as they come."""
    link = connection(server)
    link.request("GET", f"/ticks.csv?signals={signals}", headers=OURS)
    answer = link.getresponse()
    assert answer.status == 200
    try:
        while line := answer.fp.readline().decode():
            yield line.removesuffix("\n").split(",")
    finally:
        link.close()


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
    until(lambda: feed.newest is not None and feed.newest["tick"][0] == 9001)
    rows, _ = follower.take()
    assert len(rows) == 2 * KEPT_BATCHES
    assert rows["tick"][-1] == 9001
    assert follower.take()[0] is None
    feed.leave(follower)
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


def test_a_crowd_that_says_half_a_request_each_takes_neither_threads_nor_the_way_of_a_stop(page, capfd):
    rig, server = page
    before, opened = threading.active_count(), []
    for k in range(4 * MOST_GUESTS):
        opened.append(socket.create_connection(server.server_address[:2], PATIENCE_S))
        opened[-1].sendall(b"POST /do/stop HTTP/1.1\r\n"[: k % 25])
        if k == MOST_GUESTS:
            looking = connection(server)
            looking.request("GET", "/stream", headers=OURS)
            stream = looking.getresponse()
    until(lambda: threading.active_count() <= before + MOST_GUESTS + 1, "the crowd's threads to end", 10.0)
    assert press(server, "stop") == (200, {"ok": True, "result": None})
    assert rig.asked[-1][0] == "stop"
    assert b"event: " in stream.readline(), "whoever looks is not sent away for it"
    looking.close()
    for one in opened:
        one.close()
    assert capfd.readouterr() == ("", "")
