"""Names of what drives report as numbers: states, modes, error codes."""

from __future__ import annotations

ODRIVE_STATES = {
    0: "UNDEFINED", 1: "IDLE", 2: "STARTUP_SEQUENCE", 3: "FULL_CALIBRATION_SEQUENCE", 4: "MOTOR_CALIBRATION",
    6: "ENCODER_INDEX_SEARCH", 7: "ENCODER_OFFSET_CALIBRATION", 8: "CLOSED_LOOP_CONTROL", 9: "LOCKIN_SPIN",
    10: "ENCODER_DIR_FIND", 11: "HOMING", 12: "ENCODER_HALL_POLARITY_CALIBRATION",
    13: "ENCODER_HALL_PHASE_CALIBRATION",
}  # fmt: skip

MOTEUS_MODES = {
    0: "stopped", 1: "fault", 2: "enabling", 3: "calibrating", 4: "calibration complete", 5: "pwm",
    6: "voltage",
    7: "voltage foc", 8: "voltage dq", 9: "current", 10: "position", 11: "timeout", 12: "zero velocity",
    13: "stay within", 14: "measure inductance", 15: "brake",
}  # fmt: skip

MOTEUS_FAULTS = {
    32: "calibration fault", 33: "motor driver fault", 34: "over voltage", 35: "encoder fault",
    36: "motor not configured",
    37: "pwm cycle overrun", 38: "over temperature", 39: "outside limit", 40: "under voltage",
    41: "config changed",
    42: "theta invalid", 43: "position invalid", 44: "driver enable fault", 45: "stop position deprecated",
    46: "timing violation",
}  # fmt: skip

_EMERGENCIES = {
    0x2310: "continuous over-current", 0x2320: "short circuit or earth leakage", 0x3110: "mains over-voltage",
    0x3120: "mains under-voltage", 0x3210: "DC link over-voltage", 0x3220: "DC link under-voltage",
    0x4210: "drive too hot", 0x4310: "drive too hot", 0x7121: "motor blocked", 0x7305: "incremental sensor 1",
    0x8110: "CAN overrun", 0x8120: "CAN error-passive", 0x8130: "heartbeat or life guard lost",
    0x8140: "recovered from bus-off", 0x8150: "CAN identifier collision", 0x8210: "PDO too short",
    0x8220: "PDO too long", 0x8250: "RPDO did not come in time", 0x8611: "following error",
}  # fmt: skip
"""Emergency error codes of CiA 301 and CiA 402-2 that say more than their class."""

_CLASSES = {
    0x10: "generic error", 0x20: "current", 0x21: "current, device input", 0x22: "current inside the device",
    0x23: "current, device output", 0x30: "voltage", 0x31: "mains voltage", 0x32: "voltage inside the device",
    0x33: "output voltage", 0x40: "temperature", 0x41: "ambient temperature", 0x42: "device temperature",
    0x43: "drive temperature", 0x44: "supply temperature", 0x50: "device hardware", 0x60: "device software",
    0x61: "internal software", 0x62: "user software", 0x63: "data set", 0x70: "additional modules",
    0x71: "power",
    0x73: "sensor", 0x75: "communication", 0x80: "monitoring", 0x81: "communication", 0x82: "protocol",
    0x84: "velocity controller", 0x85: "position controller", 0x90: "external error",
    0xF0: "additional functions",
    0xFF: "of this manufacturer",
}  # fmt: skip


def named(number: int, names: dict[int, str]) -> str:
    """The name of a number with the number, or the number alone."""
    return f"{names[number]} ({number})" if number in names else str(number)


def emergency_name(code: int) -> str:
    """What an emergency error code of CANopen means, with the code: `0x3220 (DC link under-voltage)`."""
    found = _EMERGENCIES.get(code) or _CLASSES.get(code >> 8) or _CLASSES.get(code >> 8 & 0xF0)
    return f"0x{code:04x} ({found})" if found else f"0x{code:04x}"
