"""A rig that is made up, for the page: tests put telemetry in and see what it was asked."""

import math
import queue
import threading
import time

import numpy as np

from rtctl.control.vocabulary import State
from rtctl.errors import RefusedError
from rtctl.tick import new_ticks

HELLO = {"rig": "made-up", "rate_hz": 1000.0, "axes": [{"name": "yaw"}, {"name": "pitch"}]}


class Stream:
    """As of the client; `patience_s`: None comes as soon as this, so that closing takes no time. An exception
    among the items is raised."""

    def __init__(self, items, patience_s=0.05):
        self.items, self.patience_s = items, patience_s

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def receive(self, timeout_s):
        try:
            item = self.items.get(timeout=min(timeout_s, self.patience_s))
        except queue.Empty:
            return None
        if isinstance(item, Exception):
            raise item
        return item


class Rig:
    """Stands for RigClient: notes what it is asked, and lets a test put telemetry in."""

    def __init__(self, hello=HELLO):
        self.asked, self.refuse, self._hello = [], None, hello
        self.rows, self.told, self.well = queue.Queue(), queue.Queue(), queue.Queue()

    def hello(self):
        return self._hello

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
        rows = new_ticks(n, len(self._hello["axes"]))
        rows["tick"] = np.arange(first, first + n)
        rows["time_ns"] = rows["tick"] * 1_000_000
        for name, value in fields.items():
            rows[name] = value
        self.rows.put(rows)
        return rows


class MovingRig(Rig):
    """One that swings and sends 50 messages a second of 20 ticks each, in the state that `be` says; silent
    after `silence`.
    """

    def __init__(self, hello=HELLO):
        super().__init__(hello)
        self._fields = {"state": State.IDLE, "fault_first": -1}
        self._sends, self._ended = threading.Event(), threading.Event()
        self._sends.set()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def ticks(self):
        return Stream(self.rows, patience_s=0.5)  # a busy machine sends late: that is no silence

    def be(self, state, **fields):
        self._fields = {"state": state, "fault_first": -1, **fields}
        self._sends.set()

    def silence(self):
        self._sends.clear()

    def close(self):
        self._ended.set()
        self._thread.join()

    def _run(self):
        first, rng = 0, np.random.default_rng(1)
        while not self._ended.wait(0.02):
            if self._sends.is_set():
                self._swing(first, rng)
                first += 20
            time.sleep(0)

    def _swing(self, first, rng):
        t = np.arange(first, first + 20)[:, None] * 1e-3
        live = self._fields["state"] in (State.ACTIVE, State.HOLD)
        swing = 0.35 * np.sin(math.pi * t + np.array([0.0, 1.0])) * live
        speed = 0.35 * math.pi * np.cos(math.pi * t + np.array([0.0, 1.0])) * live
        hand = 0.3 * np.tanh(speed / 0.05) + 0.05 * speed + 0.01 * rng.standard_normal(speed.shape)
        n = len(self._hello["axes"])
        times = {name: rng.gamma(2.0, 8e3, 20).astype(int) for name in ("wakeup_ns", "cycle_ns")}
        self.batch(20, first, position_rad=swing[:, :n], velocity_rad_s=speed[:, :n],
            hand_torque_nm=hand[:, :n],
                   torque_applied_nm=-0.8 * hand[:, :n] * live, authority=float(live), enabled=int(live),
                   compensation=1.0, **times, **self._fields)  # fmt: skip
