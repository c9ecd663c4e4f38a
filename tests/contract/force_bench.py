"""A played force sensor together with its backend, for tests of both."""

from contextlib import contextmanager

import numpy as np
from force_devices import SENSORS

from hw import registry
from hw.interface import Rig
from rtctl.tick import new_ticks

RIG = Rig(1, 1e-3, np.ones(1), np.ones(1), np.ones(1), np.ones(1), np.ones((1, 3)))


def make(device, **more):
    options = registry.options_model(device.kind).model_validate({**device.options, **device.where, **more})
    return registry.create(device.kind, options.model_dump(mode="json"), RIG)


class Bench:
    """A played sensor and its backend."""

    def __init__(self, kind, **more):
        self.device = SENSORS[kind]()
        self.backend = make(self.device, **more)
        self.backend.open()

    def send(self, *frames):
        for frame in frames:
            self.device.write(frame)
        self.device.arrived(self.backend)
        return self.read()

    def read(self):
        tick = new_ticks()
        self.backend.read(tick)
        return tick[0]

    def close(self):
        self.backend.close()
        self.device.close()


@contextmanager
def benches():
    made = []

    def _make(kind, **more):
        made.append(Bench(kind, **more))
        return made[-1]

    try:
        yield _make
    finally:
        for one in made:
            one.close()
