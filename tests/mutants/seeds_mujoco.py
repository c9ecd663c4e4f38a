"""Seeded bugs that joints of a makers' engine found, driven as a backend of another package."""

from __future__ import annotations

from seed import Seed

ORDERS = ("tests/unit/identify/test_orders_on_a_virtual_clock.py",)

SEEDS = (
    Seed(
        "virtual time runs half a ring ahead of a host that gives orders",
        "rtctl/rt/clock.py",
        'return int(header["ahead_rows"] + 1',
        'return int(header["ring_rows"] // 2 + 1',
        ("tests/unit/rt/test_clock.py",),
    ),
    Seed(
        "an identification does not ask virtual time to wait for its orders",
        "rtctl/identify/observer.py",
        "            host.keep_up()\n",
        "",
        ORDERS,
    ),
    Seed(
        "the host looks no oftener for ticks that a virtual clock waits with",
        "rtctl/host/supervisor.py",
        "self._batch_s = KEEPING_UP_S",
        "pass",
        ORDERS,
    ),
    Seed(
        "a joint that hardly bends is blamed on the encoder, with nothing to do about it",
        "rtctl/cli/identify_report.py",
        "why = TOO_SHORT if seen",
        'why = "the encoder is too coarse for it" if seen',
        ("tests/unit/cli/test_identify_report.py",),
    ),
)
