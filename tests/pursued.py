"""A passive hand on the simulated rig, and a renderer after its energy: what the hand is given, by the
plant's truth.
"""

import numpy as np

from hw.simulators.mock_records import Hand
from rtctl.control.vocabulary import Environment, Program, State
from rtctl.rig_file import config
from rtctl.simulation.campaign_drive import drive
from rtctl.simulation.campaign_monitor import memory_dtype
from rtctl.simulation.campaign_pursuit import FOE
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.jit import records
from rtctl.simulation.shipped_files import shipped_config


class Pursued:
    """The mock of the shipped file; `run` judges every tick by invariants 13 and 21 (and all others)."""

    def __init__(self):
        self._made = Simulation(config.load(shipped_config("mock.toml")))
        self._made.params["late_limit_ticks"] = 3
        self._fresh = {
            name: getattr(self._made, name).copy()
            for name in ("params", "state", "command", "plant_params", "plant_state", "tick")
        }

    def run(self, foe, hand, ticks, *, compensation=1.0, seed=1, **params):
        """J given to the hand (stiffness, damping, inertia) since arming, J of store and power, and the
        violated bits.
        """
        made = self._made
        for name, values in self._fresh.items():
            getattr(made, name)[:] = values
        for name, value in params.items():
            made.params[name] = value
        plant, command = made.plant_params, made.command
        plant["hand_kind"], plant["hand_start_s"] = int(Hand.REST), 0.0
        plant["hand_stiffness_nm_rad"], plant["hand_damping_nms_rad"], plant["hand_inertia_kgm2"] = hand
        command["compensation"], command["environment_kind"] = compensation, int(Environment.REMOTE)
        pursuer = np.zeros(1, FOE)
        for name, value in foe.items():
            pursuer[name] = value
        memory = records(np.zeros(1, memory_dtype(1)))
        memory["stop_age"] = -1
        bits, _ = drive(
            made.addresses(),
            made.params, made.state, command, made.model, plant, made.plant_state, made.tick,
            memory, records(np.zeros_like(made.state)), memory.copy(),
            np.arange(1, 5, dtype=np.uint64) * seed,
            records(pursuer), ticks, True, np.zeros(len(State), np.int64), np.zeros(64, np.int64),
            np.zeros(len(Program), np.int64), records(np.zeros(0, made.tick.dtype)),
        )  # fmt: skip
        p, armed_s = made.params[0], int(memory["armed_ticks"][0]) * made.plan.period_s
        allowed = float(p["renderer_store_j"]) + float(p["renderer_power_w"]) * armed_s
        return float(memory["given_j"][0, 0]), allowed, bits
