"""That what is read and what is sent mean what they say: sign, unit, and at once. A part of `Contract`."""

from __future__ import annotations

import numpy as np
import pytest

from hw.interface import CHANNEL_FIELDS
from rtctl.backend_contract.subject import Case, Received, Subject

CYCLES_TO_OBEY = 200
"""A drive may need some cycles to be enabled."""

STEP_RAD = 0.4
"""Turn of a joint from one sample to the next: less than half the range of any counter it may have."""

SHOWN: dict[str, float] = {
    "velocity": 0.7, "current": 1.5, "temperature": 31.0, "force": 2.5, "moment": 0.3
}  # fmt: skip
"""What a device is to show of a channel, in the unit of the tick."""

TORQUE = 0.1
"""What a device is to be told, N m at the joint or A of the motor."""


def heard(found: Received | None) -> Received:
    """What the device was told, which it has to tell."""
    assert found is not None, "the device heard nothing: does Device.received tell what it was told last?"
    return found


class Units:
    """Tests of `Contract`, which has the fixtures `running` and `actuator`."""

    def _showing(self, running: Subject, channel: str, values: np.ndarray) -> np.ndarray:
        """What the tick has of a channel once the device shows these values."""
        assert running.device.show(channel, [float(one) for one in values]), (
            f"play what it measures: Device.show({channel!r}, ...), or Case(shows=False)"
        )
        tick = running.tick()
        for _ in range(2):  # a device that answers commands had answered the one before already
            running.read(tick)
            running.write(tick)
        shown: np.ndarray = tick[CHANNEL_FIELDS[channel]][0]
        return shown.copy()

    @pytest.fixture
    def shown(self, case: Case, request: pytest.FixtureRequest) -> Subject:
        """A subject whose device shows what it is asked to."""
        if not case.shows:
            pytest.skip("the case says that its device does not show what it is asked to")
        running: Subject = request.getfixturevalue("running")
        if running.info.simulated:
            pytest.skip("simulated: no device beside it")
        return running

    def test_a_joint_is_followed_over_many_turns_in_rad(self, shown: Subject) -> None:
        """Sign and unit, and no start over at the end of a turn."""
        if "position" not in shown.backend.provides:
            pytest.skip("measures no position")
        # eight radians: more than a turn, so that a counter starts over
        there = np.arange(21) * STEP_RAD
        path = np.concatenate((there, there[-2::-1], -there[1:]))[:, None] * np.ones(shown.rig.n_axes)
        found = np.array([self._showing(shown, "position", place) for place in path])
        # a zero of its own is as good
        assert found - found[0] == pytest.approx(path - path[0], rel=1e-3, abs=2e-3)

    def test_what_is_measured_has_its_sign_and_unit_at_once(self, shown: Subject) -> None:
        """A velocity, too: one that follows from positions is not what the device measures."""
        for channel in sorted(shown.backend.provides & SHOWN.keys()):
            size = shown.tick()[CHANNEL_FIELDS[channel]].shape[-1]
            for sign in (1, -1) if channel != "temperature" else (1,):
                # another value for each axis: exchanged ones show
                wanted = sign * SHOWN[channel] * (1 + 0.2 * np.arange(size))
                found = self._showing(shown, channel, wanted)
                assert found == pytest.approx(wanted, rel=0.02, abs=0.01), channel

    def test_a_torque_arrives_with_its_sign_and_size(self, actuator: Subject) -> None:
        """With one turned round, a spring pushes away: the rig would find out by its arming pulse."""
        for value in (TORQUE, -TORQUE):
            for slot in range(CYCLES_TO_OBEY):
                told = heard(actuator.told(slot, enabled=1, torque=value))
                if told.enabled and told.torque[0] == pytest.approx(value, rel=0.05):
                    break
            assert told.torque == pytest.approx([value] * len(told.torque), rel=0.05)
