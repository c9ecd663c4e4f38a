"""The place of a fault against the law itself: what it raises on the second of two axes is laid at the
second.
"""

import math

import numpy as np
import pytest
from law_rig import LawRig

from rtctl.control.vocabulary import Fault
from rtctl.host.exchange.fault_book import FaultBook
from rtctl.host.exchange.rig_description import AxisDescription, DeviceDescription, RigDescription

BOTH = {
    "follow_kind": 1, "follow_delay_ticks": 1, "arming_torque_nm": 0.1, "temperature_kind": 1,
    "temperature_warn_c": 60.0,
    "temperature_trip_c": 90.0, "device_velocity_kind": 1, "device_tolerance_rad_s": 0.5,
}  # fmt: skip
DEVICE = DeviceDescription("device[0] 'rig'", (0, 1), ("current", "current_command", "position"))


class Rig(LawRig):
    """Two axes that stand still; their motors follow, but for what `spoil` does to a tick."""

    def __init__(self):
        super().__init__(2, **BOTH)
        axes = (AxisDescription("base", {}), AxisDescription("tip", {}))
        rig = RigDescription("law", axes, 1000.0, devices=(DEVICE,), params=self.params)
        self.book, self.spoil = FaultBook(rig), {}
        self.sent_a = np.zeros(2)

    def tick(self, position=None, fresh=True, skipped=0, **measured):
        wanted = {"current_a": self.sent_a, "temperature_c": 20.0, "device_velocity_rad_s": 0.0, **measured}
        super().tick(position, fresh, skipped, **{**wanted, **{k: v(self) for k, v in self.spoil.items()}})
        self.sent_a = self.now["current_command_a"][0].copy()
        self.book.follow(np.asarray(self.now).copy())
        return self

    def place(self, fault):
        for _ in range(400):
            if self.faults & fault:
                return self.book.entries(int(fault))[0]
            self.tick()
        raise AssertionError(f"the law did not raise {fault.name}")


def tip(value):
    return lambda rig: np.array([0.0, value])


def swing(speed_rad_s):
    def moved(rig):
        rig.moved = getattr(rig, "moved", 0.0) + speed_rad_s * 1e-3
        return np.array([0.0, rig.moved])

    return moved


@pytest.mark.parametrize(
    ("fault", "spoil", "channel"),
    [
        (Fault.BAD_SAMPLE, {"position_rad": tip(math.nan)}, "position"),
        (Fault.BAD_SAMPLE, {"current_a": tip(math.inf)}, "current"),
        (Fault.JUMP, {"position_rad": tip(0.5)}, "position"),
        (Fault.OVERSPEED, {"position_rad": swing(12.6)}, None),
        (Fault.ACTUATOR_WRONG, {"current_a": tip(1.9)}, "current"),
        (Fault.ACTUATOR_LAG, {"current_a": tip(0.7)}, "current"),
        (Fault.OVERTEMPERATURE, {"temperature_c": tip(95.0)}, "temperature"),
        (Fault.OVERTEMPERATURE, {"temperature_c": tip(math.nan)}, "temperature"),
        (Fault.VELOCITY, {"device_velocity_rad_s": tip(5.0)}, "velocity"),
        (Fault.VELOCITY, {"device_velocity_rad_s": tip(math.nan)}, "velocity"),
    ],
)
def test_what_the_law_raises_on_an_axis_is_laid_at_that_axis(fault, spoil, channel):
    rig = Rig().arm()
    rig.spoil = spoil
    entry = rig.place(fault)
    assert (entry["axis"], entry["channel"]) == ("tip", channel), entry


@pytest.mark.parametrize(
    ("fault", "spoil", "channel"),
    [
        (Fault.WIRING, {"current_a": lambda rig: rig.sent_a * [1.0, 0.0]}, "current"),
        (Fault.WIRING, {"current_a": lambda rig: rig.sent_a * [1.0, -1.0]}, "current"),
        (Fault.CURRENT, {"current_a": lambda rig: rig.sent_a * [1.0, 0.5]}, "current"),
        (Fault.ARMING_MOVED, {"position_rad": swing(3.5), "device_velocity_rad_s": tip(3.5)}, "position"),
    ],
)
def test_what_the_test_pulse_finds_on_an_axis_is_laid_at_that_axis(fault, spoil, channel):
    rig = Rig().run(40)
    rig.params["arming_ticks"] = 20
    rig.command["epoch"] = rig.state["epoch"]
    rig.request("arm_count")
    rig.tick().tick()
    rig.spoil = spoil
    entry = rig.place(fault)
    assert (entry["axis"], entry["channel"]) == ("tip", channel), entry


def test_a_force_that_is_bad_is_no_axis_of_its_own():
    rig = Rig().arm()
    rig.spoil = {"force_n": lambda _rig: np.array([0.0, 0.0, 60.0])}
    entry = rig.place(Fault.BAD_SAMPLE)
    assert (entry["axis"], entry["channel"], entry["detail"]) == (None, "force", "force z 60 N, range +-50")
