"""One tick's records of one axis, for the functions of the safety machine one by one."""

import numpy as np
from law_rig import of_rows

from rtctl.control import detectors, states
from rtctl.control.jit import records
from rtctl.control.records import new_records
from rtctl.control.vocabulary import Fault, State
from rtctl.tick import new_ticks

STALE, LINK_LOST, OVERRUN = int(Fault.STALE), int(Fault.LINK_LOST), int(Fault.OVERRUN)
PER_S = 1000
REMEMBER = of_rows(detectors.remember_torque)


class Rows:
    """One row each of tick, state and parameters, one axis."""

    def __init__(self, state=State.INIT, **params):
        made = new_records(1)
        self.params, self.state = records(made[0]), records(made[1])
        self.tick = records(new_ticks(1, 1))
        for name, value in {
            "period_s": 1e-3, "ready_ticks": 5, "soft_start_ticks": 4, "stop_ticks": 50,
            "stale_limit_ticks": 3,
            "late_limit_ticks": 3, "arming_ticks": 3, "torque_limit_nm": 2.0, "torque_continuous_nm": 1.0,
            "count_rad": 1e-4, "arming_travel_rad": 0.1, "arming_torque_nm": 0.08, **params,
        }.items():  # fmt: skip
            self.params[name] = value
        self.state["state"], self.state["fault_first"] = state, -1
        self.now = 0

    def advance(self, faults=0, requests=0, may_arm=False, tested=False, silent=False, after=1):
        self.now += after
        changed = states.advance(
            self.state[0], self.params[0], self.now, int(faults), requests, may_arm, tested, silent
        )
        assert bool(changed) == (self["ticks_in_state"] == 0)
        return self.mode

    @property
    def mode(self):
        return State(int(self["state"]))

    def __getitem__(self, name):
        return np.asarray(self.state[name]).reshape(-1)[0].item()

    def __setitem__(self, name, value):
        self.state[name] = value


def sent(rig, *torques):
    """Have these torques been sent, the last one in the tick before the present one."""
    for torque in torques:
        rig["torque_applied_nm"] = torque
        REMEMBER(rig.state, 0)
        rig["ticks"] = rig["ticks"] + 1
