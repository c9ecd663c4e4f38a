"""A joint of an engine's as a backend of another package, `kind = "engine"`: nobody is at the handle."""

import math

import numpy as np

from foreign_engine.engines import made
from foreign_engine.plants import Device, Hand, Joint, World
from hw.interface import BackendInfo, Channels, Timing

CHANNELS = Channels(frozenset({"position", "current", "force", "temperature"}), frozenset({"torque"}))
INFO = BackendInfo(
    factory="foreign_engine.backend:Engine", options="foreign_engine.options:EngineOptions", simulated=True,
    channels=CHANNELS, timing="foreign_engine.backend:timing",
)  # fmt: skip


def timing(options, rig):
    """Nothing is late but the current."""
    return [Timing(current_loop_hz=options["current_loop_hz"])] * rig.n_axes


class Engine:
    """One axis; `options` are those of `EngineOptions`."""

    provides, consumes = CHANNELS.provides, CHANNELS.consumes

    def __init__(self, options, rig):
        self.options, self.count = options, 2 * math.pi / rig.encoder_counts_per_rev[0]
        self.steps = round(rig.period_s / options["step_s"])
        self.per_ampere = rig.gear_ratio[0] * rig.gear_efficiency[0] * rig.torque_constant_nm_a[0]
        self.draw, self.n, self.moved = np.random.default_rng(options["seed"]), 0, None

    def open(self):
        o = self.options
        lag_s = 1 / (2 * math.pi * o["current_loop_hz"]) if o["current_loop_hz"] else 0.0
        device = Device(lag_s=lag_s, step_s=o["step_s"], engine=o["engine"])
        self.moved = made(Joint(**o["joint"]), Hand("nobody"), World(), device)

    def read(self, tick):
        self.n += 1
        o, m, noise = self.options, self.moved, self.draw.standard_normal(4)
        tick["position_rad"][0, 0] = math.floor(m.qpos[0] / self.count) * self.count
        tick["current_a"][0, 0] = m.given[0] / self.per_ampere + o["current_noise_a"] * noise[0]
        tick["force_n"][0] = o["force_noise_n"] * noise[1:]
        tick["force_n"][0, 1] += m.sensed[1] * m.lever
        tick["temperature_c"][0, 0] = 25.0
        tick["sample_count"], tick["link_faults"], tick["estop"] = self.n, 0, 0

    def write(self, tick):
        m = self.moved
        m.ctrl[0] = float(tick["torque_applied_nm"][0, 0]) if tick["enabled"][0] else 0.0
        for _ in range(self.steps):
            m.step(*m.pointers)
        m.sound()

    def stop(self):
        if self.moved is not None:
            self.moved.ctrl[0] = 0.0

    def close(self):
        self.stop()
