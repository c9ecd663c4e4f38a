"""Devices that do what a test says, and rigs made of them."""

from contextlib import contextmanager

import numpy as np

from hw import registry
from hw.interface import BackendInfo, Rig
from hw.member import Member
from hw.rig import compose
from rtctl.tick import new_ticks

MADE = {}


class Fake:
    """A device that does what its script says; options: name, provides, consumes."""

    def __init__(self, options, rig):
        self.name, self.rig = options["name"], rig
        self.provides, self.consumes = frozenset(options["provides"]), frozenset(options.get("consumes", ()))
        self.calls, self.count, self.values, self.faults = [], 0, {}, 0
        self.fresh, self.on = True, {}
        MADE[self.name] = self

    def _called(self, what):
        self.calls.append(what)
        self.on.get(what, lambda: None)()

    def open(self):
        self._called("open")

    def read(self, tick):
        self._called("read")
        tick["position_rad"] = tick["current_a"] = 1000.0  # whatever it writes beyond its channels is lost
        if self.fresh:
            self.count += 1
            for field, value in self.values.items():
                tick[field] = value
        tick["sample_count"], tick["link_faults"] = self.count, self.faults

    def write(self, tick):
        self._called("write")
        self.sent = tick.copy()

    def stop(self):
        self._called("stop")

    def close(self):
        self._called("close")

    def counts(self):
        return {"frames": self.count}


def rig(n_axes=1):
    return Rig(
        n_axes=n_axes,
        period_s=1e-3,
        gear_ratio=np.arange(1.0, n_axes + 1),
        gear_efficiency=np.ones(n_axes),
        torque_constant_nm_a=np.ones(n_axes),
        encoder_counts_per_rev=np.full(n_axes, 4096.0),
        lever_m=np.arange(3.0 * n_axes).reshape(n_axes, 3),
    )


@contextmanager
def known():
    """Within it, `fake` is a kind of device."""
    info = BackendInfo(factory=f"{__name__}:Fake", options="", simulated=False)
    registry.BUILT_IN["fake"] = info
    registry.lookup.cache_clear()
    try:
        yield
    finally:
        del registry.BUILT_IN["fake"]
        registry.lookup.cache_clear()
        MADE.clear()


def member(name, provides, consumes=(), axes=(0,), channels=None, **more):
    return Member(
        kind="fake",
        options={"name": name, "provides": list(provides), "consumes": list(consumes)},
        label=f"device '{name}'",
        axes=axes,
        channels=tuple(channels if channels is not None else (*provides, *consumes)),
        **more,
    )


DRIVE = ("position", "current", "estop")


def drive_and_finger(**finger):
    backend = compose([member("drive", DRIVE, ["torque"]), member("finger", ["force"], **finger)], rig())
    return backend, MADE["drive"], MADE["finger"]


def read(backend, tick=None):
    tick = new_ticks() if tick is None else tick
    backend.read(tick)
    return tick
