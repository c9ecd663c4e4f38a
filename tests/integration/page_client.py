"""Asks the page's server as a browser would: pages, buttons, streams, recordings."""

import contextlib
import http.client
import json
import threading

import pytest
from made_up_rig import Rig
from patience import PATIENCE_S

from rtctl.client.view_server import ViewServer

OURS = {"X-Rtctl": "view"}


@contextlib.contextmanager
def served():
    """A made-up rig, and the server of its page."""
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
