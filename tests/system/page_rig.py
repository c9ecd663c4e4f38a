"""A made-up rig behind the page, in a state that the test wants, and what a test looks for."""

import threading
import time
from contextlib import contextmanager

import pytest
from made_up_rig import HELLO, MovingRig
from page_in_chromium import Page

from rtctl.client.view_server import ViewServer
from rtctl.control.vocabulary import Fault, State
from tests.bench.browser import browser, installed

ONE_AXIS = {**HELLO, "rig": "mock", "axes": [{"name": "joint"}]}


HEALTH = {
    "devices": [],
    "measured_rate_hz": 1000.0,
    "cycle_us": {"p50": 8.0, "p99": 20.0, "p99.9": 30.0, "max": 40.0},
}


WHERE = {
    "axis": "joint",
    "channel": "position",
    "device": "device[0] 'mock'",
    "detail": "no fresh sample for 3 ticks",
}


@contextmanager
def served(hello=ONE_AXIS):
    rig = MovingRig(hello)
    rig.well.put(HEALTH)
    try:
        with serving(ViewServer(rig, "127.0.0.1", 0, key="right")) as server:
            yield rig, server
    finally:
        rig.close()


@contextmanager
def serving(server):
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield server
    finally:
        server.close()
        thread.join()


def fault(rig):
    rig.told.put(
        {
            "event": "fault",
            "name": "STALE",
            "text": "...: ...",
            "tick": 9,
            "timestamp": time.time_ns() * 1e-9,
            **WHERE,
        }
    )
    rig.be(State.FAULT, faults=int(Fault.STALE | Fault.CHECKSUM), fault_first=0)


def held_back(page, *names):
    found = (
        "[...document.querySelectorAll('[data-do]')].filter((one) => one.ariaDisabled === "
        "'true').map((one) => one.dataset.do)"
    )
    page.becomes(f"{found}.join() === {','.join(names)!r}")


def asked(rig, name):
    return sum(what[0] == name for what in rig.asked)


@contextmanager
def opened():
    """A browser; the test is skipped where none is installed."""
    program = installed()
    if program is None:
        pytest.skip("needs a browser: apt-get install chromium")
    with browser(program) as started:
        yield started


@contextmanager
def at_a_desk(chromium, rig):
    """The page at a desk's size, in the light, with the operator's key; the rig and the server."""
    made, server = rig
    page = Page(chromium, f"{server.url}#key=right", "desk", "light")
    page.state("IDLE")
    yield page, made, server
    page.close()
