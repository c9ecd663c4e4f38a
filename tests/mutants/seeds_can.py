"""Seeded bugs of what stands between a CAN bus and the tick: fields, codecs, arming of drives, compiled
cycles.
"""

from __future__ import annotations

from seed import Seed

HW = "tests/unit/hw"
FIELDS = (f"{HW}/test_can_fields.py",)
CODECS = (f"{HW}/test_can_codecs.py",)
AXES = (f"{HW}/test_can_axes.py", f"{HW}/test_can_cia402_axis.py")
FIRMWARE = (f"{HW}/test_can_odrive_firmware.py",)
ARMED = (f"{HW}/test_can_armed.py",)
STRICT = ("tests/contract/test_cia402_strict.py",)
CAN_CYCLE = ("tests/unit/hw/test_can_steady.py", "tests/unit/hw/test_can_left_to_python.py")
IN_PROCESS = ("tests/unit/hw/test_can_batch.py",)

SEEDS = (
    Seed(
        "a frame is taken without a word to who waits for room", "hw/can/adapter.py",
        "if inbox.maxsize <= 0:", "if True:",
        ("tests/unit/hw/test_can_batch.py"
         "::test_who_waits_for_room_in_a_bounded_in_process_bus_goes_on_when_a_frame_was_taken",),
    ),
    Seed(
        "peers on the in-process bus share one frame's data with who sends", "hw/can/adapter.py",
        "message.is_remote_frame, message.dlc, message.data[:]",
        "message.is_remote_frame, message.dlc, message.data", IN_PROCESS,
    ),
    Seed(
        "frames of one's own are not given back by an in-process bus that is to", "hw/can/adapter.py",
        "if not self._bus.receive_own_messages and not", "if not", IN_PROCESS,
    ),
    Seed(
        "a peer's full queue is no error", "hw/can/adapter.py",
        "        if full:\n", "        if False:\n", IN_PROCESS,
    ),
    Seed(
        "what stands behind a moteus reply is not looked at", "hw/can/moteus_codec.py",
        "buffer[offset + REPLY.size : offset + length] == _PADDING[:rest]", "rest >= 0", CODECS,
    ),
    Seed(
        "a temperature is read out of a longer frame", "hw/can/odrive_codec.py",
        "if length != 8:", "if length < 8:", ("tests/unit/hw/test_can_odrive_frames.py",),
    ),
    Seed(
        "an infinite speed of an ODrive is fresh", "hw/can/odrive.py",
        "or speed - speed != 0.0:", "or speed != speed:", AXES,
    ),
    Seed(
        "a CiA 402 sample is complete without its velocity", "hw/can/cia402.py",
        "self._velocity_bit = sample.need() if units else 0", "self._velocity_bit = 1 << 40 if units else 0",
        AXES,
    ),
    Seed(
        "a CAN counter wraps in one direction only", "hw/can/fields.py",
        "((raw - self._last + self._half) & self._mask) - self._half", "(raw - self._last) & self._mask",
        FIELDS,
    ),
    Seed(
        "a CAN frame may come twice", "hw/can/fields.py",
        "if 0 < ahead <= self._half:", "if 0 <= ahead <= self._half:", FIELDS,
    ),
    Seed(
        "a large CAN value wraps instead of saturating", "hw/can/fields.py",
        "    if x >= high:\n        return high\n", "", FIELDS,
    ),
    Seed(
        "NaN goes onto the CAN bus", "hw/can/fields.py",
        "(0.0 if value != value else value)", "value", FIELDS,
    ),
    Seed(
        "an ODrive current of NaN is fresh", "hw/can/odrive.py",
        "        if current - current != 0.0:\n            self._sample.not_finite()\n            return\n",
        "", CODECS,
    ),
    Seed(
        "a moteus reply is read beyond its end", "hw/can/moteus_codec.py",
        "if at + size * count > end:", "if at > end:", CODECS,
    ),
    Seed(
        "a CiA 402 drive is enabled though nobody asked", "hw/can/cia402.py",
        "return DISABLE_VOLTAGE if state in (FAULT, QUICK_STOP) else SHUT_DOWN",
        "return DISABLE_VOLTAGE if state in (FAULT, QUICK_STOP) else _NEXT.get(state, SHUT_DOWN)", CODECS,
    ),
    Seed(
        "a CiA 402 fault is reset into motion", "hw/can/cia402.py",
        "    return _NEXT.get(state, DISABLE_VOLTAGE)", "    return _NEXT.get(state, FAULT_RESET)", CODECS,
    ),
    Seed(
        "an ODrive is asked for its serial number whatever its firmware", "hw/can/odrive.py",
        "if self.version >= ADDRESS_SINCE:", "if True:", FIRMWARE,
    ),
    Seed(
        "a drive that has let go may come back by itself", "hw/can/armed.py",
        "return wanted and not self.dropped", "return wanted", ARMED,
    ),
    Seed(
        "a drive that has let go is forgiven when it says so", "hw/can/armed.py",
        "            self.reached = True\n", "            self.reached, self.dropped = True, False\n", ARMED,
    ),
    Seed(
        "bit 30 of a PDO's identifier is lost", "hw/can/cia402_setup.py",
        "wanted = before & _NO_REMOTE | cob_id", "wanted = cob_id", STRICT,
    ),
    Seed(
        "a late answer of a drive is taken for one to the next request", "hw/can/cia402_setup.py",
        "mine = of == self._asked and kind in (self._answer, _ABORT)", "mine = True", STRICT,
    ),
    Seed(
        "the mode that a CiA 402 drive shows is not looked at", "hw/can/cia402_setup.py",
        "if shown == CYCLIC_SYNCHRONOUS_TORQUE:", "if shown >= 0:", STRICT,
    ),
    Seed(
        "a drive gets a current of NaN", "hw/can/sample.py",
        "        if current_a - current_a != 0.0:\n            return 0.0\n", "", CODECS,
    ),
    Seed(
        "frames kept for Python are dropped", "hw/can/raw.py",
        "return kept if kept[0] < kept[1] else (0, self._batch.take())", "return (0, self._batch.take())",
        CAN_CYCLE,
    ),
    Seed(
        "a compiled CAN cycle outlives what is due", "hw/can/steady_cycle.py",
        "b.on != ON or b.passed >= b.budget or", "b.on != ON or", CAN_CYCLE,
    ),
    Seed(
        "a compiled CAN cycle goes on when the rig is disarmed", "hw/can/steady_cycle.py",
        " or words[b.enabled_at] != b.enabled:", ":", CAN_CYCLE,
    ),
    Seed(
        "a drive's new state is not told to Python", "hw/can/steady_codec.py",
        "    return _guarded(data, at, r, numbers, LEAVES)\n", "    return False\n", CAN_CYCLE,
    ),
)  # fmt: skip
