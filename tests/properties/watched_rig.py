"""The simulated rig and the compiled law, tick by tick, with the campaign's monitor and checks of its own
behind it.
"""

import math

import numpy as np

from hw.simulators.mock_plant import plant_read, plant_write
from hw.simulators.mock_records import Hand
from rtctl.control import law
from rtctl.control.jit import compiled, records
from rtctl.control.vocabulary import Environment, Fault, State
from rtctl.rig_file import config
from rtctl.simulation.campaign_monitor import INVARIANTS, memory_dtype, watch
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.shipped_files import shipped_config

POWERED = (State.ARMING, State.ACTIVE, State.HOLD, State.STOPPING)
CLOSED = (State.LOCKOUT, State.SHUTDOWN)
LEASE = 5
PUSH_RAD = 0.025
RECORDS = ("params", "state", "command", "plant_params", "plant_state", "tick", "memory")


@compiled
def _watched(tick, state, params, command, model, memory):
    return watch(tick[0], state[0], params[0], command[0], model, memory[0], False)


class WatchedRig:
    """A hand that holds still, and a stiff spring that pushes against it with 1.4 N m once the rig is
    armed.
    """

    def __init__(self, **params):
        made = Simulation(config.load(shipped_config("mock.toml")))
        self.params, self.state, self.command, self.model = made.params, made.state, made.command, made.model
        self.plant_params, self.plant_state, self.tick = made.plant_params, made.plant_state, made.tick
        self.memory = records(np.zeros(1, memory_dtype(1)))
        self.memory["stop_age"] = -1
        self.plant_params["hand_kind"], self.plant_params["hand_stiffness_nm_rad"] = int(Hand.REST), 1000.0
        for name, value in {
            "ready_ticks": 20,
            "soft_start_ticks": 50,
            "late_limit_ticks": 3,
            **params,
        }.items():
            self.params[name] = value
        self.world(Environment.SPRING, 1e6, PUSH_RAD)
        self._fresh = {name: getattr(self, name).copy() for name in RECORDS}
        self.torque_before, self.mode_before = 0.0, State.INIT

    def begin_again(self):
        """Everything as it was made: another rig."""
        for name, values in self._fresh.items():
            getattr(self, name)[:] = values
        return self

    def restart(self):
        """A new process on the same device."""
        for name in ("params", "state", "command", "memory"):
            getattr(self, name)[:] = self._fresh[name]

    def world(self, kind, stiffness=0.0, center=0.0):
        self.command["environment_kind"] = int(kind)
        self.command["environment_stiffness_nm_rad"], self.command["environment_center_rad"] = (
            stiffness,
            center,
        )

    def step(self, skipped=0, fresh=True, heard=True, **measured):
        """One tick without judgement. `heard`: the device gets the command."""
        now, count = self.tick, int(self.tick["sample_count"][0])
        self.torque_before, self.mode_before = self["torque_applied_nm"], self.mode
        self.command["seq"] += 1
        now["tick"] += 1 + skipped
        now["missed_ticks"] += skipped
        plant_read(now, self.plant_state, self.plant_params)
        if not fresh:
            now["sample_count"] = count
        for name, value in measured.items():
            now[name] = value
        law.step(now, self.state, self.params, self.command, self.model)
        bits = _watched(now, self.state, self.params, self.command, self.model, self.memory)
        if heard:
            plant_write(now, self.plant_state, self.plant_params)
        return {number for number in INVARIANTS if bits >> number & 1}

    def run(self, n=1, **how):
        """`n` ticks, each judged."""
        for _ in range(n):
            broken = self.step(**how)
            assert not broken, [INVARIANTS[number] for number in broken]
            self.judge()
        return self

    def judge(self):
        """What the tick says by itself and beside the one before; nothing of it is taken from the law."""
        torque, before = self["torque_applied_nm"], self.torque_before
        current, limit = self["current_command_a"], float(self.params["torque_limit_nm"][0, 0])
        assert math.isfinite(torque)
        assert math.isfinite(current)
        assert abs(current * self.per_ampere - torque) <= 1e-9 * limit
        assert abs(torque) <= limit
        assert (self["enabled"] == 1.0) == (self.mode in POWERED)
        assert torque == 0.0 or self.mode in POWERED
        assert torque == 0.0 or abs(torque - before) <= float(self.params["torque_rate_nm"][0, 0]) * (
            1 + 1e-9
        )
        if self.mode is State.ACTIVE:
            assert self.mode_before in (State.ARMING, State.ACTIVE, State.HOLD)

    def ask(self, *names):
        """Requests of the present epoch."""
        for name in names:
            self.command[name] += 1
            self.command["epoch"] = self.state["epoch"]

    def target(self, position=0.0, lease=LEASE, epoch=0):
        """A renderer's target; `epoch` counts from the present one."""
        self.command["target_count"] += 1
        self.command["target_epoch"], self.command["target_lease"] = (
            int(self.state["epoch"][0]) + epoch,
            lease,
        )
        self.command["target_position_rad"] = position

    def arm(self):
        """ACTIVE with full authority, within 3000 ticks."""
        for _ in range(300):
            if self.mode is State.IDLE:
                self.ask("arm_count")
            self.run(10)
            if self.mode is State.ACTIVE and self["authority"] == 1.0:
                return self
        raise AssertionError(f"not armed: {self.mode}, {self.faults}")

    def enter(self, state):
        """Into this state, by the ordinary way."""
        if state is State.HOLD:
            self.world(Environment.REMOTE)
            self.arm_with_targets()
            self.run(40)
        elif state is State.ARMING:
            for _ in range(1000):
                self.ask("arm_count")
                if self.run().mode is State.ARMING:
                    break
            self.run(30)
        elif state in (State.ACTIVE, State.STOPPING):
            self.arm()
            if state is State.STOPPING:
                self.ask("stop_count")
                self.run(10)
        elif state is State.IDLE:
            self.run(600)
        elif state is State.ESTOP:
            self.arm().run(estop=1)
        elif state is State.FAULT:
            self.arm().run(3, fresh=False)
        assert self.mode is state, (state, self.mode, self.faults)
        return self

    def arm_with_targets(self):
        for _ in range(2000):
            if self.mode is State.IDLE:
                self.ask("arm_count")
            self.target()
            self.run()
            if self.mode is State.ACTIVE and self["authority"] == 1.0:
                return self
        raise AssertionError(f"not armed: {self.mode}, {self.faults}")

    def copy_records(self):
        return {name: getattr(self, name).copy() for name in RECORDS}

    def put_back(self, saved):
        for name, values in saved.items():
            getattr(self, name)[:] = values

    def __getitem__(self, name):
        return float(np.asarray(self.tick[name]).reshape(1, -1)[0, 0])

    @property
    def per_ampere(self):
        p = self.params
        return float((p["gear_ratio"] * p["gear_efficiency"] * p["torque_constant_nm_a"])[0, 0])

    @property
    def mode(self):
        return State(int(self.tick["state"][0]))

    @property
    def faults(self):
        return Fault(int(self.tick["faults"][0]))
