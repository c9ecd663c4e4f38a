"""What ODrive's firmwares read and say differently. Command 6 above all: until 0.6.8 any frame of it, a
remote one too, sets the node's id to what its data holds; from 0.6.9 on a remote one asks for the serial
number.

Commands that all of them read alike, and the only ones sent before the version is known: 07, 0B, 0E, 18, and
remote frames of 00 (which 0.5 ignores), 09 and 14."""

from __future__ import annotations

from hw.can.fields import Buffer

Version = tuple[int, int, int]

OLD: Version = (0, 5, 0)
"""Taken for one that tells no version: 0.5 and its descendants do not know the question."""

NAMED_ERRORS: Version = (0, 6, 0)
"""From here on the errors are of one kind, and command 15 holds temperatures (before: the sensorless
estimate)."""

ADDRESS: Version = (0, 6, 9)
"""From here on command 6 tells the serial number."""

ERRORS = {
    0x1: "INITIALIZING", 0x2: "SYSTEM_LEVEL", 0x4: "TIMING_ERROR", 0x8: "MISSING_ESTIMATE",
    0x10: "BAD_CONFIG",
    0x20: "DRV_FAULT", 0x40: "MISSING_INPUT", 0x100: "DC_BUS_OVER_VOLTAGE", 0x200: "DC_BUS_UNDER_VOLTAGE",
    0x400: "DC_BUS_OVER_CURRENT", 0x800: "DC_BUS_OVER_REGEN_CURRENT", 0x1000: "CURRENT_LIMIT_VIOLATION",
    0x2000: "MOTOR_OVER_TEMP", 0x4000: "INVERTER_OVER_TEMP", 0x8000: "VELOCITY_LIMIT_VIOLATION",
    0x10000: "POSITION_LIMIT_VIOLATION", 0x20000: "REQUESTED_CURRENT_TOO_HIGH",
    0x1000000: "WATCHDOG_TIMER_EXPIRED",
    0x2000000: "ESTOP_REQUESTED", 0x4000000: "SPINOUT_DETECTED", 0x8000000: "BRAKE_RESISTOR_DISARMED",
    0x10000000: "THERMISTOR_DISCONNECTED", 0x40000000: "CALIBRATION_ERROR",
}  # fmt: skip
"""Error bits of an axis since firmware 0.6."""

ERRORS_05 = {
    0x1: "INVALID_STATE", 0x40: "MOTOR_FAILED", 0x80: "SENSORLESS_ESTIMATOR_FAILED", 0x100: "ENCODER_FAILED",
    0x200: "CONTROLLER_FAILED", 0x800: "WATCHDOG_TIMER_EXPIRED", 0x1000: "MIN_ENDSTOP_PRESSED",
    0x2000: "MAX_ENDSTOP_PRESSED", 0x4000: "ESTOP_REQUESTED", 0x20000: "HOMING_WITHOUT_ENDSTOP",
    0x40000: "OVER_TEMP",
    0x80000: "UNKNOWN_POSITION",
}  # fmt: skip
"""Error bits of an axis in firmware 0.5."""


def decode_version(buffer: Buffer, offset: int, length: int) -> Version | None:
    """Major, minor and revision of the firmware; None for a frame of another length."""
    if length != 8:
        return None
    # before these: protocol and hardware; behind: whether it is unreleased (ODrive's Get_Version)
    major, minor, revision = buffer[offset + 4 : offset + 7]
    return major, minor, revision


def version_text(version: Version) -> str:
    """For people."""
    return "older than 0.6" if version < NAMED_ERRORS else ".".join(map(str, version))
