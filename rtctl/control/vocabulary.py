"""The numbers behind the words: kinds, methods, policies, states, faults, gate flags.

Integer enums, because compiled functions compare integers; every other place shows the names."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum, IntFlag
from typing import Any

from rtctl.control.environments.kind import CENTER as CENTER
from rtctl.control.environments.kind import STIFFNESS as STIFFNESS
from rtctl.control.environments.kind import Parameter as Parameter
from rtctl.control.environments.table import NAMES as NAMES
from rtctl.control.environments.table import PARAMETERS as PARAMETERS
from rtctl.control.environments.table import Environment as Environment
from rtctl.control.environments.table import KindName as KindName
from rtctl.control.environments.table import meaning as meaning


class VelocityMethod(IntEnum):
    """Velocity estimator."""

    FOAW = 0
    DIFFERENCE = 1
    LOWPASS = 2
    KALMAN = 3


class Display(IntEnum):
    """What an axis shows to the hand: a force for a motion, or the motion of a mass for a force
    (`control.virtual_mass`)."""

    IMPEDANCE = 0
    ADMITTANCE = 1


class PlaceUse(IntEnum):
    """Whether the law goes by what a friction model says of place (`control.place_trust`)."""

    OFF = 0
    SEEN = 1
    GIVEN = 2


class DeviceVelocity(IntEnum):
    """What the law does with the velocity that a device measures (control.device_velocity)."""

    RECORD = 0
    CHECK = 1
    USE = 2


class Policy(IntEnum):
    """What decides the direction of the friction feed-forward near zero velocity (docs/theory.md 5.6)."""

    OFF = 0
    HYBRID = 1
    """Force-gated blend of tanh(v) and the force's intent; the default, with the disturbance observer on
    top."""
    SIGN = 2
    DEADBAND = 3
    TANH = 4
    DITHER = 5
    INTENT = 6
    STOP = 7
    """Stop (play) operator on displacement: for rigs without a force sensor."""
    STOP_GATED = 8
    OBSERVER = 9
    """No feed-forward: the disturbance observer alone (control.disturbance_observer)."""
    LUGRE = 10
    """LuGre observer: bristles driven by the measured motion, with the learned curve as their envelope."""


class Program(IntEnum):
    """Excitation program of one axis (control.program)."""

    OFF = 0
    BRAKE = 1
    SERVO = 2
    RAMP = 3
    TRACK = 4


class Shape(IntEnum):
    """Reference of a TRACK program (control.position)."""

    STEP = 0
    SINE = 1
    TRIANGLE = 2


class ProgramFlag(IntFlag):
    """Why a program ended in BRAKE."""

    REFUSED = 1
    """The program's numbers are not finite or outside the rig's limits."""
    HAND = 2
    """Torque on the force sensor above the program's limit: a hand is on the rig."""
    TRAVEL = 4
    DONE = 8
    """The program's time was over."""
    SLIPPED = 16
    """RAMP: the joint broke away. TRACK: it is too far from its reference."""
    LIMIT = 32
    """RAMP: the largest torque was reached and nothing moved."""


class State(IntEnum):
    """States of the machine (safety contract)."""

    INIT = 0
    IDLE = 1
    ARMING = 2
    ACTIVE = 3
    HOLD = 4
    STOPPING = 5
    FAULT = 6
    ESTOP = 7
    LOCKOUT = 8
    SHUTDOWN = 9


class Fault(IntFlag):
    """Faults, one bit each; `fault_first` in the tick is the bit's number. Rows of `control.faults.TABLE`."""

    STALE = 1 << 0
    BAD_SAMPLE = 1 << 1
    JUMP = 1 << 2
    LINK_LOST = 1 << 3
    END_OF_LOG = 1 << 4
    OVERSPEED = 1 << 5
    OVERRUN = 1 << 6
    LAW_NOT_FINITE = 1 << 7
    PASSIVITY = 1 << 8
    TARGET_LOST = 1 << 9
    ESTOP = 1 << 10
    CHECKSUM = 1 << 11
    STALLED = 1 << 12
    ACTUATOR_LAG = 1 << 13
    ACTUATOR_WRONG = 1 << 14
    OVERTEMPERATURE = 1 << 15
    PASSIVITY_GROSS = 1 << 16
    OVERTORQUE = 1 << 17
    GATE = 1 << 18
    WIRING = 1 << 19
    ARMING_MOVED = 1 << 20
    REALTIME = 1 << 21
    DEVICE = 1 << 22
    VELOCITY = 1 << 23
    CURRENT = 1 << 24
    DELAY = 1 << 25
    SAMPLE_AGE = 1 << 26
    HOST_SILENT = 1 << 27
    FORCE_FROZEN = 1 << 28
    FORCE_CLIPPED = 1 << 29
    FORCE_OFFSET = 1 << 30
    OFF_AXIS = 1 << 31


def state_and_cause(tick: Mapping[str, Any]) -> str:
    """State of a tick for people, with the first fault that led there: "FAULT by JUMP"."""
    state, first, now = State(int(tick["state"])).name, int(tick["fault_first"]), Fault(int(tick["faults"]))
    if first >= 0:
        return f"{state} by {Fault(1 << first).name}"
    return f"{state}, faults {now.name}" if now else state


class Reaction(IntEnum):
    """What a fault does while torque may leave (safety contract)."""

    REFUSE = 0
    """Nothing while powered; the rig is not ready to arm."""
    STOP = 1
    """Ramp down, then IDLE: nothing is broken."""
    RAMP = 2
    """Ramp down, then FAULT."""
    CUT = 3
    """Zero torque and disabled in the tick that sees it: FAULT."""
    ESTOP = 4
    LOCKOUT = 5
    """Zero torque; only a person who restarts the process gets any further."""
    END = 6
    """Ramp down, then SHUTDOWN: the recording played back is over."""


class GateFlag(IntFlag):
    """What the gate did to the wanted torque of one axis."""

    NOT_FINITE = 1
    ABSOLUTE = 2
    RATE = 4
    DISABLED = 8
    OVERSPEED = 16
    SHARE = 32
    """The share of the limit that the state, the temperature, a waiver or the energy account leaves."""
    WINDOW = 64
    """The mean of the last 250 ms nears the continuous limit."""
    VIOLATION = 128
    """The gate found its own inputs or output broken: LOCKOUT."""
