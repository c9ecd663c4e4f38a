"""Drives an identification on the real loop: an observer in the host that feeds the procedure with ticks."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from rtctl.identify.motion import Order, Steps

if TYPE_CHECKING:
    from rtctl.host.supervisor import Host

ARM_EVERY_S = 0.2


class Identifier:
    """Observer: hands every batch of ticks to the procedure and gives its orders to the loop.

    A tick counts as an answer to an order only from the first one that ran under it (`command_seq`).
    Errors of the procedure leave through `Host.run`, whose end ramps the torque down. `watch` receives every
    tick of the procedure's time, before the procedure does.

    Attributes
    ----------
    complete
        True once the procedure came to its end; False when the run was ended before (Ctrl-C)."""

    def __init__(
        self, steps: Steps[None], axis: int, watch: Callable[[np.ndarray], None] = lambda _rows: None
    ) -> None:
        self._steps, self._axis, self._watch = steps, axis, watch
        self._order: Order | None = None
        self._since_seq = 0
        self._armed_at = 0.0
        self._waiting: list[np.ndarray] = []
        self._period_s = 0.0
        self.complete = False

    def __call__(self, host: Host, rows: np.ndarray) -> None:
        """Follow the ticks."""
        if self.complete or host.writer.command["shutdown_count"][0] > 0:
            return  # the run is ending (Ctrl-C): what the rig does now is not the procedure's
        self._period_s = host.plan.period_s
        if self._order is None:
            host.set_compensation(0.0)
            host.keep_up()
            self._advance(host, None)
            return
        self._watch(rows)
        # ticks under way when an order was given belong to the one before
        rows = rows[rows["command_seq"] >= self._since_seq]
        if len(rows):
            self._waiting.append(rows)
        # each request counts as one: in every batch it would be a burst of them
        if self._order.arm_in is not None and time.monotonic() - self._armed_at < ARM_EVERY_S:
            return
        wanted = max(1, round(self._order.look_s / self._period_s))
        if sum(map(len, self._waiting)) >= wanted:
            seen = np.concatenate(self._waiting)
            self._waiting = []
            self._advance(host, seen)

    def _advance(self, host: Host, rows: np.ndarray | None) -> None:
        try:
            self._order = next(self._steps) if rows is None else self._steps.send(rows)
        except StopIteration:
            self.complete = True
            host.finish()
            return
        command = host.writer.command
        for name, value in self._order.fields.items():
            command[name][0, self._axis] = value
        if self._order.arm_in is not None:
            self._armed_at = time.monotonic()
            host.arm(self._order.arm_in)
        elif self._order.fields:
            host.writer.send()
        if self._order.arm_in is not None or self._order.fields:
            self._since_seq = int(command["seq"][0])
