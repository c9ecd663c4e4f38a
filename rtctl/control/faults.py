"""The fault table of the safety contract: one row per fault, from which reactions, texts and docs follow.

The masks below are what the compiled state machine reads; `rtctl.wire.fault_names` shows the texts and
`docs/safety.md` the table."""
# longer than 300 lines: the fault table is one thing, a row for each fault, with its words

from __future__ import annotations

from dataclasses import dataclass

from rtctl.control.vocabulary import Fault, Reaction

CLEARED = "cause absent for 1 s, then an operator's reset"


@dataclass(frozen=True)
class FaultRow:
    """One fault: what it does, how it is seen, how it is left, and what a person should do.

    `latches_at_rest`: it leads to FAULT even while no torque can leave; the others only make the rig not
    ready. `within_ticks`: from the first bad tick to the reaction, that tick counted."""

    fault: Fault
    reaction: Reaction
    within_ticks: int
    detection: str
    text: str
    clears: str = CLEARED
    latches_at_rest: bool = False

    @property
    def name(self) -> str:
        """The fault's name in events, status and documents."""
        return str(self.fault.name)


TABLE: tuple[FaultRow, ...] = (
    FaultRow(
        Fault.STALE,
        Reaction.CUT,
        3,
        "no fresh sample for 3 ticks: counter stuck, frame lost, late or older than the last; ages 1 and 2 "
        "hold the last value",
        "the device sends no fresh samples: check its power and cable",
    ),
    FaultRow(
        Fault.BAD_SAMPLE,
        Reaction.CUT,
        3,
        "a measured value is not finite or outside its range in 3 samples in a row; single ones are "
        "discarded",
        "samples are not finite or out of range: check sensor range and wiring",
    ),
    FaultRow(
        Fault.JUMP,
        Reaction.CUT,
        2,
        "the position moves by more than 1.5 v_max per tick, twice in a row; a single one is discarded",
        "the position jumped further than the joint can move in a tick: check the encoder",
    ),
    FaultRow(
        Fault.CHECKSUM,
        Reaction.CUT,
        3,
        "frames fail their checksum 3 times in a row, or in more than 5 % of 1000 ticks",
        "frames from the device fail their checksum: check cable, shield and baud rate",
    ),
    FaultRow(
        Fault.LINK_LOST,
        Reaction.CUT,
        1,
        "the device reports end of file, an I/O error or that it is gone",
        "the device is gone: plug it in again, wait until it is found, reset",
        latches_at_rest=True,
    ),
    FaultRow(
        Fault.DEVICE,
        Reaction.CUT,
        1,
        "the drive or sensor sets a fault bit of its own, or the drive leaves its enabled state while armed",
        "the drive or sensor reports a fault of its own, or let go by itself: see its display or manual, "
        "clear it there",
    ),
    FaultRow(
        Fault.ACTUATOR_LAG,
        Reaction.RAMP,
        20,
        "commanded and Hall-measured torque differ by more than 20 % of the limit for 20 ticks",
        "the motor does not give the torque asked for: check supply, current limit of the drive, torque "
        "constant",
    ),
    FaultRow(
        Fault.ACTUATOR_WRONG,
        Reaction.CUT,
        1,
        "commanded and Hall-measured torque differ by more than 50 % of the limit",
        "the motor's torque is far from the one asked for: check wiring, drive and Hall sensor",
    ),
    FaultRow(
        Fault.VELOCITY,
        Reaction.CUT,
        3,
        "3 samples in a row of a checked device velocity are not finite, beyond 1.5 v_max, or its sum over "
        "about 16 ticks is further from the encoder's travel than its tolerance",
        "encoder and the device's own velocity disagree: one of them is wrong; check coupling, gear_ratio, "
        "direction, units",
    ),
    FaultRow(
        Fault.OVERSPEED,
        Reaction.CUT,
        1,
        "speed above 1.2 v_max; above v_max torque times velocity is kept at or below zero",
        "the joint is faster than its limit",
    ),
    FaultRow(
        Fault.OVERTORQUE,
        Reaction.RAMP,
        1,
        "mean torque magnitude of 250 ms above 1.1 times the continuous limit, which the gate defends",
        "the torque stayed above the continuous limit in spite of the gate: report this as a defect",
    ),
    FaultRow(
        Fault.GATE,
        Reaction.LOCKOUT,
        1,
        "the gate finds limits, its own memory or the encoded value broken",
        "the last stage before the motor found itself broken: restart the daemon, report this as a defect",
        clears="a person restarts the process",
        latches_at_rest=True,
    ),
    FaultRow(
        Fault.OVERTEMPERATURE,
        Reaction.RAMP,
        1,
        "motor at its trip temperature, or its configured sensor silent for 3 ticks; torque is derated "
        "from the warning on",
        "the motor is too hot, or its temperature sensor is missing: let it cool, check the sensor",
    ),
    FaultRow(
        Fault.OVERRUN,
        Reaction.RAMP,
        3,
        "3 late ticks in a row, or more than 1 % of 1000",
        "the loop was late too often: see `rtctl doctor`, real-time rights and other load",
    ),
    FaultRow(
        Fault.STALLED,
        Reaction.CUT,
        1,
        "one tick more than 10 periods late: nothing of it is sent",
        "the loop stood still for more than 10 periods: see `rtctl doctor`, real-time rights and other load",
    ),
    FaultRow(
        Fault.REALTIME,
        Reaction.REFUSE,
        1,
        "a real rig runs without the real-time rights asked for, and its rig file does not waive them",
        "no real-time rights: see `rtctl doctor`, or waive them (loop.realtime = 'waive': a quarter of the "
        "torque)",
        clears="restart with the rights, or with the waiver",
    ),
    FaultRow(
        Fault.PASSIVITY,
        Reaction.RAMP,
        1,
        "a port gave out more than 1.35 budgets of energy: damping is injected from the first deficit on, "
        "and the torque bounded so that 1.5 are never reached",
        "a port gave out more energy than its budget: lower stiffness or compensation",
    ),
    FaultRow(
        Fault.PASSIVITY_GROSS,
        Reaction.CUT,
        1,
        "a port gave out more than 3 budgets of energy",
        "a port gave out three times its energy budget: check signs and wiring, lower stiffness or "
        "compensation",
    ),
    FaultRow(
        Fault.WIRING,
        Reaction.CUT,
        80,
        "the test pulse of ARMING moves the joint, or its current, the wrong way or not at all",
        "the test pulse found current or motion of the wrong sign: check motor polarity, encoder "
        "direction, Hall sensor",
    ),
    FaultRow(
        Fault.ARMING_MOVED,
        Reaction.CUT,
        1,
        "the joint moves further in ARMING than a quarter of v_max allows",
        "the joint moved too far during the test pulse: hold it still while arming",
    ),
    FaultRow(
        Fault.CURRENT,
        Reaction.CUT,
        80,
        "the current's answer to the test pulse, or to what is sent while running in 2 windows of 1 s in a "
        "row, is surely off the gain 1 by more than drive.current_gain_error (.3), or off by more than "
        "drive.current_offset_share (10 %) of the torque limit, or exceeds a step of the pulse by more than "
        "drive.current_overshoot (.05)",
        "the measured current is not the one asked for: check torque constant, scale and offset of the "
        "Hall sensor, current limit of the drive; tune a current loop that overshoots, or declare it",
    ),
    FaultRow(
        Fault.DELAY,
        Reaction.RAMP,
        80,
        "the current answers the test pulse surely later than the proof of the coupling covers; while "
        "running: the same in 2 windows of 1 s in a row",
        "torque comes later than declared, and the coupling is not proven for that: declare the delay "
        "(`rtctl probe` shows it beside the declared one), then let `rtctl check` name a softer coupling; "
        "or mend link and drive",
    ),
    FaultRow(
        Fault.SAMPLE_AGE,
        Reaction.RAMP,
        51,
        "more than 5 % of 1000 ticks had a sample older than the proof of the coupling covers; single lost "
        "ones are held",
        "samples do not come in every tick, and the coupling is not proven for their age: lower "
        "loop.rate_hz to the device's own, mend the link, or a softer coupling (`rtctl check`)",
    ),
    FaultRow(
        Fault.FORCE_FROZEN,
        Reaction.RAMP,
        500,
        "powered, no component of the force changed by one bit for .5 s or longer, and meanwhile the "
        "joint, back where it was, has taken more energy than motor and force shown gave it, by a budget "
        "and what the sensor's steps may hide; or it is off as FORCE_OFFSET has it",
        "the force sensor repeats one value while a hand moves the joint: check its cable and mode; power "
        "it anew, tare, reset",
    ),
    FaultRow(
        Fault.FORCE_CLIPPED,
        Reaction.RAMP,
        3,
        "a component of the force or moment is exactly at its limit in 3 samples in a row: it may be any "
        "larger",
        "the force sensor is at the end of its range: push less, or give axis.force.limit_n and "
        "force_sensor.limit_nm as its data sheet has them",
    ),
    FaultRow(
        Fault.FORCE_OFFSET,
        Reaction.RAMP,
        250,
        "powered, the friction seen over a second of sliding each way shows that the force is off by more "
        "than axis.force.offset_nm (10 % of the torque limit) at the joint, for 250 ms of sliding",
        "the force sensor is off by more than it may be, or a weight pulls at the joint: hands off, `rtctl "
        "tare --hands-off`; check the sensor's mounting and cable, force_sensor.tip_kg, or allow more "
        "(axis.force.offset_nm)",
    ),
    FaultRow(
        Fault.OFF_AXIS,
        Reaction.RAMP,
        3,
        "the tared force or moment beside those that turn a joint is above force_sensor.off_axis_n or "
        "off_axis_nm in 3 samples in a row (0, the default, watches nothing)",
        "the tip is pushed or twisted across its joints: guide it along them; check lever_m, "
        "axis_direction and the sensor's matrix",
    ),
    FaultRow(
        Fault.LAW_NOT_FINITE,
        Reaction.CUT,
        1,
        "a model, an estimate or a torque is not finite",
        "the control law gave a value that is not finite: report this as a defect",
        latches_at_rest=True,
    ),
    FaultRow(
        Fault.TARGET_LOST,
        Reaction.STOP,
        1,
        "no target of the lease holder for 100 ms (100 ticks below 1 kHz) of a remote environment; HOLD from "
        "20 on",
        "the renderer stopped sending targets, or the daemon refused them (`targets.refused` in `health` "
        "counts): mend or start the renderer, then arm",
        clears="a new lease and an operator's arm",
    ),
    FaultRow(
        Fault.HOST_SILENT,
        Reaction.STOP,
        1,
        "powered, and no beat from the host's own turn for 200 ms (2 s on a simulated rig without "
        "real-time rights; virtual clock: not watched)",
        "the host stood still, so that no STOP could have come through: see what else runs on the machine, "
        "and `rtctl events`; then arm",
        clears="the host's next beat and an operator's arm",
    ),
    FaultRow(
        Fault.ESTOP,
        Reaction.ESTOP,
        1,
        "the emergency-stop input is open",
        "the emergency stop is pressed",
        clears="released, then an operator's reset",
    ),
    FaultRow(
        Fault.END_OF_LOG,
        Reaction.END,
        1,
        "the recording that is played back has ended",
        "the recording that is played back has ended",
        clears="nothing more will come: the daemon ends",
    ),
)

ROW: dict[Fault, FaultRow] = {row.fault: row for row in TABLE}


def mask(reaction: Reaction) -> int:
    """Bits of all faults with this reaction."""
    return sum(int(row.fault) for row in TABLE if row.reaction is reaction)


CUT = mask(Reaction.CUT)
RAMP = mask(Reaction.RAMP)
STOP = mask(Reaction.STOP)
ESTOP = mask(Reaction.ESTOP)
LOCKOUT = mask(Reaction.LOCKOUT)
END = mask(Reaction.END)
REFUSE = mask(Reaction.REFUSE)
# LOCKOUT closes a rig at rest by a row of its own in `states.TRANSITIONS`
LATCHING_AT_REST = sum(
    int(row.fault) for row in TABLE if row.latches_at_rest and row.reaction is Reaction.CUT
)
"""Faults that are latched even while no torque can leave."""

LATCHED = CUT | RAMP | STOP | ESTOP | LOCKOUT
"""Faults that may be the first cause of a stop."""
