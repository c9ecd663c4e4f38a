"""The frames that the host sends to one ODrive: made once, changed in place."""

from __future__ import annotations

from typing import Any

from hw.can import odrive_codec as codec
from hw.can.bus import REMOTE, Bus
from hw.can.odrive_codec import TORQUE, TWO_WORDS, WORD, can_id


class OdriveFrames:
    """Frames of one node; `remote`: a remote frame asks, in place of an empty one (CAN FD has none)."""

    def __init__(self, bus: Bus, node: int, *, remote: bool) -> None:
        def _frame(command: int, length: int, *, ask: bool = False) -> Any:  # noqa: ANN401 - the bus's own Outgoing
            return bus.outgoing(can_id(node, command) | (REMOTE if ask and remote else 0), length)

        self.torque = _frame(codec.SET_INPUT_TORQUE, 4)
        self._state = _frame(codec.SET_AXIS_STATE, 4)
        self.mode = _frame(codec.SET_CONTROLLER_MODE, 8)
        # sent at each arming: another program may have left another mode
        TWO_WORDS.pack_into(self.mode.buffer, self.mode.offset, codec.TORQUE_CONTROL, codec.PASS_THROUGH)
        # its one byte, 0: the drive need not blink to be found
        self.clear = _frame(codec.CLEAR_ERRORS, 1)
        self.ask_encoder, self.ask_iq = (_frame(c, 0, ask=True) for c in (codec.GET_ENCODER, codec.GET_IQ))
        self.ask_address, self.ask_version = (
            _frame(c, 0, ask=True) for c in (codec.ADDRESS, codec.GET_VERSION)
        )

    def send_torque(self, bus: Bus, torque_nm: float) -> None:
        """Send Set_Input_Torque, N m at the encoder's shaft."""
        TORQUE.pack_into(self.torque.buffer, self.torque.offset, torque_nm)
        bus.send(self.torque)

    def send_state(self, bus: Bus, state: int) -> None:
        """Send Set_Axis_State."""
        WORD.pack_into(self._state.buffer, self._state.offset, state)
        bus.send(self._state)
