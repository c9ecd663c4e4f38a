"""What every rig of a judge is asked of its law: the time, whether it helps, and to begin."""

from rtctl.control.vocabulary import State


class Armed:
    """`law`: records of tick, state, parameters, command and model; `run(seconds)` goes on."""

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
