"""The page's server, with a rig that is made up: who may look, and who may press."""

import re
import socket
import threading

import pytest
from page_client import OURS, connection, get, get_stream_status, press, served
from patience import PATIENCE_S, until

from rtctl.client.view_guests import MOST_GUESTS
from rtctl.client.view_pages import FILES, SCRIPTS, STATIC
from rtctl.client.view_server import MOST_STREAMS

SOON_S = 25.0
"""Less than the 30 s after which the server lets go by itself of whoever does not end a request."""


@pytest.fixture
def page():
    with served() as made:
        yield made


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
    # over a plain address of the network browsers send no Sec-Fetch-*, and images no Origin: the header
    # decides
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
        ("tare", b"{}", ("tare", (), {"hands_off": False})),
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
        ("compensation", b'{"share": 1' + 400 * b"0" + b"}"),
        ("compensation", 2000 * b"[" + 2000 * b"]"),
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
    assert press(page[1], "stop", b"", **{"Content-Length": "9" * 5000})[0] == 413


def test_a_stop_counts_whatever_was_sent_with_it(page):
    assert press(page[1], "stop", b"stop!", key="")[0] == 200
    assert page[0].asked == [("stop", (), {})]


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
    until(lambda: threading.active_count() <= before + MOST_GUESTS + 1, "the crowd's threads to end", SOON_S)
    assert press(server, "stop") == (200, {"ok": True, "result": None})
    assert rig.asked[-1][0] == "stop"
    assert b"event: " in stream.readline(), "whoever looks is not sent away for it"
    looking.close()
    for one in opened:
        one.close()
    assert capfd.readouterr() == ("", "")
