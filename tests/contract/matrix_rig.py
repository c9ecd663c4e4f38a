"""A rig of the matrix of faults: backend, law and the loop's order of work without a clock; how it gets into
a phase, and what a reaction is.
"""

import numpy as np

from hw import registry
from hw.fault_script import SampleScript, fill_schedule
from rtctl.check import law_plan as plan
from rtctl.control import law
from rtctl.control.faults import ROW
from rtctl.control.jit import records
from rtctl.control.records import state_dtype
from rtctl.control.vocabulary import Environment, Fault, Reaction, State
from rtctl.rig_file import config
from rtctl.rt.replug import Replug
from rtctl.simulation.shipped_files import shipped_config
from rtctl.tick import new_ticks

LEASE = 5


def scheduled(channel, kind, value, at_tick):
    return {
        "channel": channel, "kind": kind, "axis": None, "at_tick": at_tick, "for_ticks": 0, "every_ticks": 0,
        "probability": 1.0, "value": value,
    }  # fmt: skip


NEVER = scheduled("link", "stale", 0.0, 10**9)
"""Keeps the script of a backend at work before its fault begins."""


SOONER = {"ready_ticks": 100, "tare_ticks": 100}
"""A rig may be armed after a fifth of the ticks. From there on all takes as many as anywhere."""

ARMABLE_TICKS = 200


class Scripted:
    """A real device with a script of faults on its samples: what the mock and playback have built in."""

    provides = frozenset({"position", "velocity", "current", "force", "temperature", "estop"})
    consumes = frozenset({"current_command"})

    def __init__(self, backend, hardware, tick):
        self._backend = backend
        self._script = SampleScript([NEVER], hardware, 1)
        self._script.bind(tick)
        self.open, self.stop, self.close = backend.open, backend.stop, backend.close
        self.release = getattr(backend, "release", backend.close)

    def read(self, tick):
        self._backend.read(tick)
        self._script.after_read()

    def write(self, tick):
        if self._script.before_write():
            self._backend.write(tick)


class Rig:
    """A backend, the law, and the loop's order of work; no clock."""

    def __init__(self, path, in_step=None):
        loaded = config.load(path)
        made = plan.build(loaded)
        device = loaded.config.device[0]
        self.hardware = loaded.config.hardware()
        self.tick = records(new_ticks(1, made.n_axes))
        if device.kind in ("mock", "playback"):
            self.backend = registry.create(device.kind, {**loaded.options, "faults": [NEVER]}, self.hardware)
        else:
            real = registry.create(device.kind, loaded.options, self.hardware)
            self.backend = Scripted(in_step(real), self.hardware, self.tick)
        self.backend.open()
        self.device = Replug(self.backend)
        self.params, self.model, self.command = (
            records(part) for part in (made.params, made.model, made.command)
        )
        for name, ticks in SOONER.items():
            self.params[name] = ticks
        self.state = records(np.zeros(1, state_dtype(made.n_axes)))
        self.targets = False
        self.torque_before = 0.0

    def run(self, n=1):
        for _ in range(n):
            self.torque_before = self["torque_applied_nm"]
            if self.targets:
                self.command["target_count"] += 1
                self.command["target_epoch"], self.command["target_lease"] = self.state["epoch"], LEASE
            self.device.read(self.tick)
            law.step(self.tick, self.state, self.params, self.command, self.model)
            self.device.write(self.tick)
            self.tick["tick"] += 1
        return self

    def ask(self, name):
        self.command[name] += 1
        self.command["epoch"] = self.state["epoch"]

    def fault_now(self, channel, kind, value):
        """Let a fault begin with the next tick and last."""
        params = self.backend.params if hasattr(self.backend, "params") else self.backend._script._params
        fill_schedule(params, [scheduled(channel, kind, value, int(self.tick["tick"][0]))], self.hardware)

    def __getitem__(self, name):
        return float(np.asarray(self.tick[name]).reshape(1, -1)[0, 0])

    @property
    def mode(self):
        return State(int(self["state"]))

    @property
    def faults(self):
        return Fault(int(self["faults"]))


def edited(folder, name, *changes):
    text = shipped_config(name).read_text()
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / name
    path.write_text(text)
    return path


def enter(rig, phase):
    """Bring the rig into `phase`; 200 to 1500 ticks."""
    if isinstance(rig.backend, Scripted):
        rig.command["environment_kind"] = int(Environment.SPRING)
        rig.command["environment_stiffness_nm_rad"], rig.command["environment_center_rad"] = 2.0, 0.4
        return go_on(rig, phase)
    remote = phase == "hold"
    if remote:
        rig.command["environment_kind"], rig.targets = int(Environment.REMOTE), True
    else:
        rig.command["environment_kind"] = int(Environment.SPRING)
        rig.command["environment_stiffness_nm_rad"], rig.command["environment_center_rad"] = 1e6, 0.025
    return go_on(rig, phase)


def go_on(rig, phase):
    rig.run(ARMABLE_TICKS)
    rig.ask("arm_count")
    rig.run(1)
    assert rig.mode is State.ARMING
    if phase == "test pulse":
        rig.run(30)
        assert rig["torque_applied_nm"] > 0.0
        return
    rig.run(80)
    assert rig.mode is State.ACTIVE
    if phase == "soft start":
        rig.run(200)
        assert 0.1 < rig["authority"] < 0.9
        return
    rig.run(520)
    assert rig["authority"] == 1.0
    if phase == "hold":
        rig.targets = False
        rig.run(40)
        assert rig.mode is State.HOLD
    elif phase == "stopping":
        rig.ask("stop_count")
        rig.run(10)
        assert rig.mode is State.STOPPING


def expect(rig, phase, fault, within):
    """Run up to the reaction: nothing before, all of it then."""
    epoch, state = rig["epoch"], rig.mode
    if within > 1:
        rig.run(within - 1)
        assert not rig.faults & fault, "too early"
        assert rig.mode is state
    rig.run(1)
    assert rig.faults & fault, "too late"
    reaction = ROW[fault].reaction
    if reaction is Reaction.RAMP:
        assert rig.mode is State.STOPPING
        assert abs(rig["torque_applied_nm"]) <= abs(rig.torque_before)
        rig.run(51)
        assert rig.mode is State.FAULT
    else:
        assert rig.mode is (State.ESTOP if reaction is Reaction.ESTOP else State.FAULT)
    assert rig["torque_applied_nm"] == 0.0
    assert rig["current_command_a"] == 0.0
    assert rig["enabled"] == 0.0
    assert int(rig["fault_first"]) == fault.value.bit_length() - 1 or phase == "stopping"
    assert rig["epoch"] > epoch
