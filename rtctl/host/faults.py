"""Names and texts of faults, for people and programs. The bits are `rtctl.control.vocabulary.Fault`."""

from __future__ import annotations

from rtctl.control.vocabulary import Fault

FAULT_TEXT: dict[Fault, str] = {
    Fault.STALE: "the device sends no fresh samples: check its power and cable",
    Fault.BAD_SAMPLE: "samples are not finite or out of range: check sensor range and wiring",
    Fault.JUMP: "the position jumped further than the joint can move in a tick: check the encoder",
    Fault.LINK_LOST: "the device is gone: plug it in and restart the daemon",
    Fault.END_OF_LOG: "the recording that is played back has ended",
    Fault.OVERSPEED: "the joint is faster than its limit",
    Fault.OVERRUN: "the loop was late too often: see `rtctl bench`, real-time rights and other load",
    Fault.LAW_NOT_FINITE: "the control law gave a value that is not finite: report this as a defect",
    Fault.PASSIVITY: "a port gave out more energy than its budget: lower stiffness or compensation",
    Fault.TARGET_LOST: "the renderer stopped sending targets",
    Fault.ESTOP: "the emergency stop is pressed",
    Fault.CHECKSUM: "frames from the device fail their checksum: check cable, shield and baud rate",
}


def fault_entries(bits: int) -> list[dict[str, str]]:
    """`name` and `text` of every fault in `bits`, lowest bit first; unknown bits are named by number."""
    entries = []
    for number in range(bits.bit_length()):
        if bits >> number & 1:
            fault = Fault(1 << number)
            known = fault in FAULT_TEXT
            name = fault.name if known and fault.name else f"BIT_{number}"
            entries.append(
                {"name": name, "text": FAULT_TEXT[fault] if known else "a fault this version does not name"}
            )
    return entries
