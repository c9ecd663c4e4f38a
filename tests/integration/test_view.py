"""The page's server, with a rig that is made up: who may look, who may press, what is streamed."""

import http.client
import json
import math
import queue
import threading

import numpy as np
import pytest
from patience import PATIENCE_S, until

from rtctl.control.vocabulary import Fault, State
from rtctl.errors import RefusedError
from rtctl.tick import new_ticks
from rtctl.view.feed import EDGES_US, KEPT_BATCHES, Feed, Histogram, Signal, columns
from rtctl.view.server import MOST_STREAMS, ViewServer

HELLO = {"rig": "made-up", "rate_hz": 1000.0, "axes": [{"name": "yaw"}, {"name": "pitch"}]}


class Stream:
    def __init__(self, items):
        self.items = items

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def receive(self, timeout_s):
        try:
            return self.items.get(timeout=min(timeout_s, 0.05))
        except queue.Empty:
            return None


class Rig:
    """Stands for RigClient: notes what it is asked, and lets a test put telemetry in."""

    def __init__(self):
        self.asked, self.refuse = [], None
        self.rows, self.told, self.well = queue.Queue(), queue.Queue(), queue.Queue()

    def hello(self):
        return HELLO

    def ticks(self):
        return Stream(self.rows)

    def events(self):
        return Stream(self.told)

    def health(self):
        return Stream(self.well)

    def __getattr__(self, name):
        def ask(*arguments, **values):
            if self.refuse:
                raise RefusedError("not_ready", self.refuse)
            self.asked.append((name, arguments, values))
            return {"environment": {"kind": arguments[1], **values}} if name == "set_environment" else {}

        return ask

    def batch(self, n=20, first=0, **fields):
        rows = new_ticks(n, 2)
        rows["tick"] = np.arange(first, first + n)
        rows["time_ns"] = rows["tick"] * 1_000_000
        for name, value in fields.items():
            rows[name] = value
        self.rows.put(rows)
        return rows


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


@pytest.mark.parametrize(
    "path", ["/", "/world", "/view.js", "/common.js", "/world.js", "/view.css", "/uPlot.iife.min.js"]
)
def test_the_pages_are_served_whole_and_may_load_nothing_from_elsewhere(page, path):
    answer, body = get(page[1], path)
    assert answer.status == 200
    assert len(body) == int(answer.headers["Content-Length"]) > 200
    assert "default-src 'self'" in answer.headers["Content-Security-Policy"]
    assert b"https://" not in body.replace(b"https://github.com/leeoniya/uPlot", b"")
    assert b"http://" not in body


@pytest.mark.parametrize(
    "path", ["/../server.py", "/static/view.js", "/etc/passwd", "/%2e%2e/feed.py", "/nothing"]
)
def test_nothing_else_is_served(page, path):
    assert get(page[1], path)[0].status == 404


@pytest.mark.parametrize(
    "headers", [{"Host": "evil.example"}, {"Origin": "http://evil.example"}, {"Origin": "null"}]
)
def test_other_names_and_pages_are_refused(page, headers):
    assert get(page[1], "/", **headers)[0].status == 403
    assert press(page[1], "stop", **headers)[0] == 403
    assert page[0].asked == []


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
    assert press(page[1], "arm") == (409, {"error": "not_ready: state FAULT: reset first"})


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
    link.request("GET", f"/stream?signals={signals}")
    answer = link.getresponse()
    assert answer.status == 200
    try:
        for _ in range(most):
            name = answer.fp.readline().decode().removeprefix("event: ").strip()
            data = answer.fp.readline().decode().removeprefix("data: ")
            answer.fp.readline()
            yield name, json.loads(data)
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
    answer, body = get(page[1], f"/stream?signals={signals.replace(';', '%3B')}")
    assert answer.status == 400
    assert json.loads(body)["error"]


def test_only_so_many_browsers_may_look_and_one_that_leaves_makes_room(page):
    server = page[1]
    streams = [events(server) for _ in range(MOST_STREAMS)]
    for stream in streams:
        next(stream)
    assert get(server, "/stream")[0].status == 503
    streams[0].close()
    until(lambda: get_stream_status(server) == 200, "room for one more")
    for stream in streams[1:]:
        stream.close()


def get_stream_status(server):
    link = connection(server)
    link.request("GET", "/stream")
    status = link.getresponse().status
    link.close()
    return status


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
