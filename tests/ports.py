"""Ports that nobody uses and that no outgoing connection of this machine is given by chance."""

import itertools
import os
import socket

_LOW, _HIGH = 10_000, 30_000
"""Below the kernel's ephemeral range: a client that asks for one of those before its server listens may reach
itself."""

_next = itertools.count(os.getpid() * 37)


def free_ports(count=1):
    """The first of some free ports in a row; another at each call."""
    for _ in range(2000):
        first = _LOW + next(_next) * 8 % (_HIGH - _LOW)
        held = []
        try:
            held.extend(socket.create_server(("127.0.0.1", port)) for port in range(first, first + count))
        except OSError:
            continue
        finally:
            for one in held:
                one.close()
        return first
    raise AssertionError("no free ports")
