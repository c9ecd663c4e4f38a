"""Described frames to ticks and ticks to described frames, compiled.

Freshness: with a `sequence` field a frame counts only when it is ahead of the last one by less than half the
field's range; without one every frame with a right checksum is new, and a duplicate cannot be told. A frame
with a number that is not finite, or an angle beyond its range, is a failure of the device, never a sample."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from hw.encoder import ANGLE_STATE, beyond, follow, unwrap, wrap
from hw.interface import LinkFault
from hw.jit import compiled
from hw.serial.described_plan import Target
from hw.serial.layout import SIGNED, next_frame, read_raw, seal_frame, wire_value, write_bytes, write_raw
from hw.serial.link import MORE, board_fields, judge, show_measured

_DEVICE = int(LinkFault.DEVICE)

_POSITION, _CURRENT, _FORCE = int(Target.POSITION), int(Target.CURRENT), int(Target.FORCE)
_TEMPERATURE, _ESTOP, _SEQUENCE_FIELD = int(Target.TEMPERATURE), int(Target.ESTOP), int(Target.SEQUENCE)
_VELOCITY, _ENABLED, _MOMENT = int(Target.VELOCITY), int(Target.ENABLED), int(Target.MOMENT)
_FAULT, _IDENTITY, _COMMAND, _ENABLE = (
    int(Target.FAULT),
    int(Target.IDENTITY),
    int(Target.COMMAND),
    int(Target.ENABLE),
)


FIELDS_MAX = 64
"""Most fields of a frame."""


@cache
def described_dtype(n_axes: int) -> np.dtype[np.void]:
    """State of a link to a described board."""
    axis = (n_axes,)
    return np.dtype(
        [
            *board_fields(n_axes),
            ("show_position", "<i8"),
            ("angle", "<f8", (n_axes, ANGLE_STATE)),
            ("position_rad", "<f8", axis),
            ("estop", "<i8"),
            ("fault", "<i8"),
            ("asked", "<i8"),  # the command sent last was enabled
            ("identity", "<i8"),
            ("invalid", "<i8"),
            ("raw", "<f8", (FIELDS_MAX,)),  # scratch
        ]
    )


@compiled
def _in_order(d: np.record, raw: np.ndarray, fields: np.ndarray) -> bool:
    """Check the sequence number, if there is one, and take it over."""
    for k in range(len(fields)):
        if fields[k].target == _SEQUENCE_FIELD:
            # of the type: a counter of one byte starts over every 256 frames
            span = np.int64(1) << (8 * fields[k].n_bytes)
            now = np.int64(raw[k])
            ahead = (now - d.sequence) & (span - 1)
            if d.started:
                if not 0 < ahead < span // 2:
                    return False
                d.lost += ahead - 1
            d.sequence = now
    return True


@compiled
def _store_switch(d: np.record, target: int, on: bool) -> None:
    """Take over what one bit says. A board that has said `enabled` since it was, and says it no more, has let
    go."""
    if target == _ESTOP and on:
        d.estop = 1
    elif target == _FAULT and on:
        d.fault = 1
    # as long as the host has asked for it: a board that drives unasked has not been armed by us
    elif target == _ENABLED and on:
        d.driven = d.asked
    elif target == _ENABLED and d.driven:
        d.dropped = 1


@compiled
def _count(raw: float, f: np.record) -> int:
    """Count of a counter that may be narrower than its type, without what stands above it."""
    # flags or parity of an encoder there, taken as counts at the first reading, would be whole turns
    count = wrap(int(np.int64(raw)), f.bits)
    return count if f.kind == SIGNED or count >= 0 else count + (1 << f.bits)


@compiled
def _store(d: np.record, raw: np.ndarray, fields: np.ndarray) -> None:
    """Take over the numbers of a frame that counts."""
    # cleared by a frame that counts, never by silence: a lost link does not release a button
    d.estop, d.fault = 0, 0  # several bits of a frame may say so: any one sets it
    for k in range(len(fields)):
        f, i = fields[k], fields[k].index
        value = (raw[k] - f.zero) * f.scale
        on = ((np.int64(raw[k]) & f.mask) != 0) != (f.invert != 0) if f.mask else False
        if f.target == _POSITION and f.bits:
            # unwrapped as a whole number, then scaled: a scaled one would lose the last bits of a long way
            d.position_rad[i] = (unwrap(_count(raw[k], f), f.bits, d.encoder[i]) - f.zero) * f.scale
        elif f.target == _POSITION and f.period > 0:
            d.position_rad[i] = follow(value, f.period, d.angle[i])
        elif f.target == _POSITION:
            d.position_rad[i] = value
        elif f.target == _CURRENT:
            d.current_a[i] = value
        elif f.target == _FORCE:
            d.force_n[i] = value
        elif f.target == _MOMENT:
            d.moment_nm[i] = value
        elif f.target == _TEMPERATURE:
            d.temperature_c[i] = value
        elif f.target == _VELOCITY:
            d.velocity_rad_s[i] = value
        elif f.target == _IDENTITY:
            # exact: 32 bits at most, and `raw` has 53
            d.identity = np.int64(raw[k])
        else:
            _store_switch(d, f.target, on)


@compiled
def _is_sound(d: np.record, raw: float, f: np.record) -> bool:
    """Whether a number can be one of this device: finite, and no angle that its range does not have."""
    # a float field may hold anything; whole numbers are finite by nature
    if not math.isfinite(raw):
        return False
    return f.period == 0 or not beyond((raw - f.zero) * f.scale, f.period, d.angle[f.index])


@compiled
def absorb(
    chunk: np.ndarray, n: int, link: np.ndarray, stream: np.ndarray, layout: np.ndarray, fields: np.ndarray
) -> None:
    """Take in `chunk[:n]`: every whole frame in it is checked and counted, the newest sample kept."""
    d, at, big, raw = link[0], 0, layout[0].big_endian, link[0].raw
    while True:
        at, found, broken = next_frame(stream, chunk, at, n, layout)
        if broken:
            d.damaged += broken
            d.damaged_now = 1
        if not found:
            return
        # an undamaged frame, whatever it says: the line is well
        d.good += 1
        sound = True
        for k in range(len(fields)):
            raw[k] = read_raw(stream[0].pending, 0, fields[k], big)
            sound = sound and _is_sound(d, raw[k], fields[k])
        if not sound:
            # kept apart from damage: it was sent so, and sending it again does not help
            d.invalid += 1
            d.fault = 1
        elif not _in_order(d, raw, fields):
            d.older += 1
            d.older_in_row += 1
            d.older_now = 1
        else:
            _store(d, raw, fields)
            d.started, d.fresh, d.older_in_row = 1, 1, 0


@compiled
def show(tick: np.ndarray, link: np.ndarray, end: int) -> None:
    """Write the newest sample into the tick; fresh only if it is and not out of a backlog."""
    t, d = tick[0], link[0]
    faults = judge(d, end)
    if d.fault or d.dropped:
        faults |= _DEVICE
    t.sample_count, t.link_faults = d.sample_count, faults
    for axis in range(len(d.position_rad)):
        if d.show_position:
            t.position_rad[axis] = d.position_rad[axis]
    show_measured(t, d)
    if d.show_estop:
        t.estop = d.estop


@compiled
def receive(
    tick: np.ndarray,
    chunk: np.ndarray,
    meta: np.ndarray,
    link: np.ndarray,
    stream: np.ndarray,
    layout: np.ndarray,
    fields: np.ndarray,
) -> int:
    """As `hw.serial.link.receive`: take in `chunk[:meta[0]]`, write the tick unless `meta[1]` is MORE."""
    absorb(chunk, meta[0], link, stream, layout, fields)
    if meta[1] != MORE:
        show(tick, link, meta[1])
    return int(link[0].older_in_row)


@compiled
def write_number(frame: np.ndarray, f: np.record, big: int, value: float) -> None:
    """Write `value`, in the channel's unit, as field `f` says."""
    write_raw(frame, f, big, wire_value(f, value))


@compiled
def send(
    tick: np.ndarray, link: np.ndarray, packet: np.ndarray, layout: np.ndarray, fields: np.ndarray
) -> int:
    """Write the command frame of this tick; returns its length.

    Disabled, a value of any axis not finite, or a board that has let go: every command 0 and the enable bits
    off."""
    t, d, x = tick[0], link[0], layout[0]
    if t.enabled == 0:
        d.driven, d.dropped = 0, 0
    enable = t.enabled != 0 and d.dropped == 0
    for axis in range(len(t.current_command_a)):
        value = t.torque_applied_nm[axis] if d.torque_mode else t.current_command_a[axis]
        # one axis that is none disables all: they are parts of one arm
        enable = enable and math.isfinite(value)
    d.asked = 1 if enable else 0
    for k in range(x.length):  # sync, constants and tail first: numbers and switches are put over them
        packet[k] = x.template[k]
    # endless; `write_bytes` sends as many of its low bytes as the field has
    d.command_sequence += 1
    for k in range(len(fields)):
        f = fields[k]
        if f.target == _COMMAND:
            value = t.torque_applied_nm[f.index] if d.torque_mode else t.current_command_a[f.index]
            write_number(packet, f, x.big_endian, value if enable else 0.0)
        elif f.target == _ENABLE:
            _switch(packet, f, x.big_endian, enable)
        else:  # the sequence number: a command has no other fields
            write_bytes(packet, f.at, f.n_bytes, x.big_endian, d.command_sequence)
    seal_frame(packet, layout)
    return int(x.length)


@compiled
def _switch(packet: np.ndarray, f: np.record, big: int, on: bool) -> None:
    """Set or clear the field's bits; what constants put beside them stays."""
    if on != (f.invert != 0):
        _or_bits(packet, f, big, f.mask)


@compiled
def _or_bits(packet: np.ndarray, f: np.record, big: int, bits: int) -> None:
    for k in range(f.n_bytes):
        at = f.at + (f.n_bytes - 1 - k if big else k)
        # or, not set: constants put their own bits of the byte there before
        packet[at] |= np.uint8((bits >> (8 * k)) & 0xFF)
