"""What every rig of a judge is asked of its law: the time, whether it helps, and to begin; and the
records that its law works on.
"""

import numpy as np

from rtctl.control.jit import records
from rtctl.control.records import state_dtype
from rtctl.control.vocabulary import State
from rtctl.tick import new_ticks


def law_of(plan):
    """Records of tick, state, parameters, command and model, from the start of a run on."""
    n = plan.n_axes
    own = new_ticks(1, n), np.zeros(1, state_dtype(n)), plan.params, plan.command, plan.model
    return tuple(map(records, own))


class Armed:
    """`law`: what `law_of` gives; `run(seconds)` goes on."""

    @property
    def time_s(self):
        return int(self.law[0]["tick"][0]) * self.period_s

    @property
    def active(self):
        return self.law[1]["state"][0] == State.ACTIVE

    @property
    def fault(self):
        """Bit number of the first fault, -1 for none."""
        return int(self.law[1]["fault_first"][0])

    def arm_until(self, most_s):
        """True once it is ACTIVE, at this time at the latest."""
        _, state, _, command, _ = self.law
        while self.time_s < most_s:
            command["arm_count"] += 1
            command["epoch"], command["seq"] = state["epoch"], command["seq"] + 1
            command["compensation"] = 1.0
            self.run(0.05)
            if self.active:
                return True
        return False
