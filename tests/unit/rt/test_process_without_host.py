"""A loop process whose host dies while the law is compiled: no device is open, the rig is let go."""

import json
import os
import socket

import pytest

from hw import code_cache
from rtctl.rt import process

HOST = 4711


class LeftError(Exception):
    """In place of the end of the process."""


def left(status):
    raise LeftError(status)


@pytest.fixture
def line(monkeypatch):
    """The loop's end of a line on which an order has come, and no rig after it."""
    monkeypatch.setattr(code_cache, "on_compiled", [])
    monkeypatch.setattr(process, "_mention", lambda *_told, **_body: True)
    monkeypatch.setattr(process, "_composed", lambda *_members: None)
    monkeypatch.setattr(os, "_exit", left)
    # as when three functions are compiled
    monkeypatch.setattr(
        process, "prepare", lambda _axes: [hear(1) for _ in range(3) for hear in code_cache.on_compiled]
    )
    host, loop = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
    order = {"devices": [], "log_readers": [], "rig": {"n_axes": 1, "period_s": 1e-3}}
    with loop:
        with host:
            host.sendall(json.dumps(order).encode() + b"\n")
        yield loop


def test_it_ends_while_it_compiles(line, monkeypatch):
    monkeypatch.setattr(os, "getppid", lambda: 1)
    with pytest.raises(LeftError, match="1"):
        process._proved(line, HOST)


def test_it_compiles_on_while_the_host_lives(line, monkeypatch):
    monkeypatch.setattr(os, "getppid", lambda: HOST)
    assert process._proved(line, HOST) is None  # the host has sent no rig
    # what is compiled from here on is for devices that are open: they are stopped first
    monkeypatch.setattr(os, "getppid", lambda: 1)
    for hear in code_cache.on_compiled:
        hear(1)
