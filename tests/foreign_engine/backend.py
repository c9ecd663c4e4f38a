"""A rig of MuJoCo's as a backend of another package: `kind = "mujoco"`, of any model file of one axis.

Joint 0, actuator 0 (torque, N m) and the first force sensor are the rig's; actuator 1 a hand's.
"""

import math

import mujoco
import numpy as np

from foreign_engine.sound import refuse_diverged
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
        self.options, self.period_s, self.count = (
            options,
            rig.period_s,
            2 * math.pi / rig.encoder_counts_per_rev[0],
        )
        self.per_ampere = rig.gear_ratio[0] * rig.gear_efficiency[0] * rig.torque_constant_nm_a[0]
        self.draw, self.n, self.d = np.random.default_rng(options["seed"]), 0, None

    def open(self):
        self.m = mujoco.MjModel.from_xml_path(self.options["model"])
        self.d, self.steps = mujoco.MjData(self.m), round(self.period_s / self.m.opt.timestep)
        mujoco.mj_forward(self.m, self.d)

    def read(self, tick):
        self.n += 1
        o, d, noise = self.options, self.d, self.draw.standard_normal(4)
        tick["position_rad"][0, 0] = math.floor(d.qpos[0] / self.count) * self.count
        tick["current_a"][0, 0] = d.actuator_force[0] / self.per_ampere + o["current_noise_a"] * noise[0]
        tick["force_n"][0] = o["force_noise_n"] * noise[1:]
        tick["force_n"][0, 1] -= d.sensordata[1] if self.m.nsensor else 0.0
        tick["temperature_c"][0, 0] = 25.0
        tick["sample_count"], tick["link_faults"], tick["estop"] = self.n, 0, 0

    def write(self, tick):
        d, o = self.d, self.options
        d.ctrl[0] = float(tick["torque_applied_nm"][0, 0]) if tick["enabled"][0] else 0.0
        if self.m.nu > 1:
            d.ctrl[1] = o["hand"] * math.sin(2 * math.pi * o["hand_hz"] * max(d.time - o["hand_from_s"], 0.0))
        mujoco.mj_step(self.m, d, self.steps)
        refuse_diverged(d, mujoco.mjtWarning)

    def stop(self):
        if self.d is not None:
            self.d.ctrl[0] = 0.0

    def close(self):
        self.stop()
