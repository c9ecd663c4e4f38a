"""The host's end of an `rtctl-frame` link, compiled: newest good state packet to tick, tick to command
packet.

A state packet is fresh when both its sequence number and its sample time are after those of the last one
accepted, by less than half their range. Duplicates, older ones, and new packets around an old sample are
counted and never shown. Nothing out of a backlog is shown as fresh: newer packets may have been lost behind
it."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from hw.encoder import ENCODER_STATE, unwrap
from hw.interface import LinkFault
from hw.jit import compiled
from hw.serial import deframer, frame
from hw.serial.framing import seal, unseal

_CHECKSUM = int(LinkFault.CHECKSUM)
_SEQUENCE = int(LinkFault.SEQUENCE)
_DEVICE = int(LinkFault.DEVICE)
_ESTOP = int(frame.Status.ESTOP)
_HELD = int(frame.Status.HELD)
_ENABLED = int(frame.Status.ENABLED)
_NO_VELOCITY, _NO_MOMENT = int(frame.Status.VELOCITY_MISSING), int(frame.Status.MOMENT_MISSING)

MORE, DRAINED, BACKLOGGED = 0, 1, 2
"""What a chunk is: more will follow in this cycle; all there is; the last of a backlog."""

SHOWN = ("current", "force", "moment", "temperature", "velocity", "estop")
"""Channels that a board may have besides the position."""


def board_fields(n_axes: int) -> list[tuple[Any, ...]]:
    """Settings and state of a link to any board of `n_axes` axes that speaks in frames."""
    axis = (n_axes,)
    return [
        # settings
        ("torque_mode", "<i8"),
        *((f"show_{channel}", "<i8") for channel in SHOWN),
        # newest accepted sample
        ("started", "<i8"),
        ("sequence", "<i8"),
        ("encoder", "<i8", (n_axes, ENCODER_STATE)),
        ("current_a", "<f8", axis),
        ("temperature_c", "<f8", axis),
        ("velocity_rad_s", "<f8", axis),
        ("force_n", "<f8", (3,)),
        ("moment_nm", "<f8", (3,)),
        # this cycle
        *((name, "<i8") for name in ("fresh", "damaged_now", "older_now")),
        # since the start; lost: gaps of the sequence number
        *((name, "<i8") for name in ("sample_count", "good", "damaged", "older", "older_in_row", "lost")),
        # commands
        ("command_sequence", "<i8"),
        ("driven", "<i8"),  # the board has driven the motor since the host enabled it
        ("dropped", "<i8"),  # and let go of it; until the host disables
    ]


@cache
def link_dtype(n_axes: int) -> np.dtype[np.void]:
    """Settings and state of a link to a board of `n_axes` axes that speaks `rtctl-frame`."""
    axis = (n_axes,)
    return np.dtype(
        [
            *board_fields(n_axes),
            ("rad_per_count", "<f8", axis),  # signed
            ("offset_rad", "<f8", axis),
            ("motor_sign", "<f8", axis),  # of current and command
            ("time_to_live", "<i8"),
            ("unusable_status", "<i8"),  # status bits that make a sample unusable
            ("time_us", "<i8"),
            ("status", "<i8"),
            ("command_acknowledged", "<i8"),
            ("position_counts", "<i8", axis),  # unwrapped, also over a re-plug
            ("foreign", "<i8"),  # undamaged packets of another type, version or number of axes
            ("identified", "<i8"),
            ("enabled_in_row", "<i8"),
        ]
    )


@compiled
def _accept(link: np.ndarray, state: np.ndarray) -> None:
    """Make the state packet the newest sample, unless it is no newer than that."""
    ln, s = link[0], state[0]
    ln.good += 1
    # after a (new) opening the first sample has nothing to be newer than
    if ln.started:
        # differences modulo the range: both counters start over, the sequence every 65 s at 1 kHz
        ahead = (s.sequence - ln.sequence) & 0xFFFF
        later_us = (s.time_us - ln.time_us) & 0xFFFFFFFF  # microseconds, which start over every 71 minutes
        if not (0 < ahead < 0x8000 and 0 < later_us < 0x80000000):
            ln.older += 1
            ln.older_in_row += 1
            ln.older_now = 1
            return
        # counted, and no fault: the newest sample is whole, and what is missing makes it older by itself
        ln.lost += ahead - 1
    ln.started, ln.fresh, ln.older_in_row = 1, 1, 0
    ln.sequence, ln.time_us = s.sequence, s.time_us
    # a packet without velocities is one whose velocities are missing: one bit says both
    ln.status = s.status | (0 if s.has_velocity else _NO_VELOCITY) | (0 if s.has_moment else _NO_MOMENT)
    ln.command_acknowledged = s.command_sequence
    for axis in range(len(ln.position_counts)):
        # unwrapped as a whole number: counts of a long way are exact
        ln.position_counts[axis] = unwrap(s.position_counts[axis], 32, ln.encoder[axis])
        # the motor's sign, not the encoder's: they are wired independently of each other
        ln.current_a[axis] = ln.motor_sign[axis] * (s.current_ua[axis] * 1e-6)
        ln.temperature_c[axis] = s.temperature_cdeg[axis] * 1e-2
        ln.velocity_rad_s[axis] = ln.rad_per_count[axis] * (s.velocity_dcounts_s[axis] * 1e-1)
    for k in range(3):
        ln.force_n[k] = s.force_un[k] * 1e-6
        ln.moment_nm[k] = s.moment_unm[k] * 1e-6


@compiled
def absorb(
    chunk: np.ndarray,
    n: int,
    link: np.ndarray,
    stream: np.ndarray,
    state: np.ndarray,
    identity: np.ndarray,
    body: np.ndarray,
) -> None:
    """Take in `chunk[:n]`: every whole packet in it is checked and counted, the newest sample kept."""
    ln, at = link[0], 0
    while True:
        at, length = deframer.next_packet(stream, chunk, at, n)
        if length == 0:
            return
        size = unseal(stream[0].pending, length, body)
        if size < 0:
            ln.damaged += 1
            ln.damaged_now = 1
        elif frame.decode_state(body, size, state):
            _accept(link, state)
        # a board may say who it is at any time: after a reset, or when another program has asked
        elif frame.decode_identity(body, size, identity):
            ln.identified = 1
        else:
            ln.foreign += 1


@compiled
def _dropped(ln: np.record) -> bool:
    """True when the board is torque-free by its own decision although it has seen `enable`.

    A power stage may take its time to switch on. One that was on and is off again has let go, unless the
    board shows an emergency stop, which the host is told by a channel of its own. The verdict holds until the
    host disables the board, whatever the board says later."""
    # only a command that was sent since the host has enabled it is answered by what the board says now
    # 16 bits, as on the wire: the counter may start over between command and answer
    since = (ln.command_sequence - ln.command_acknowledged) & 0xFFFF
    if since < ln.enabled_in_row:
        if ln.status & _ENABLED:
            ln.driven = 1
        elif ln.status & _HELD or (ln.driven and not (ln.show_estop and ln.status & _ESTOP)):
            ln.dropped = 1
    return bool(ln.dropped)


@compiled
def judge(link: np.record, end: int) -> int:
    """Count a fresh sample, or tell by `LinkFault` bits why there is none; ready for the next cycle.

    Damaged packets in a backlog are not counted as damage on the wire: where the kernel drops bytes it cuts a
    packet in two. As the kernel may have dropped any number of packets, sequence numbers are compared anew
    after a backlog."""
    # of this cycle only: a fault of a cycle ago is no news
    fresh, damaged, older = link.fresh, link.damaged_now, link.older_now
    link.fresh, link.damaged_now, link.older_now = 0, 0, 0
    # older_in_row too: frames that the kernel has dropped are no board that has started over
    if end == BACKLOGGED:
        link.started, link.older_in_row = 0, 0
        return 0
    if fresh:
        link.sample_count += 1
        return 0
    # a fresh sample beside a damaged one is a sample: `damaged` counts it, the law need not
    return _CHECKSUM if damaged else (_SEQUENCE if older else 0)


@compiled
def show_measured(t: np.record, link: np.record) -> None:
    """Write into the tick what the newest sample measured besides the position, as far as the device has
    it."""
    for axis in range(len(link.current_a)):
        if link.show_current:
            t.current_a[axis] = link.current_a[axis]
        if link.show_temperature:
            t.temperature_c[axis] = link.temperature_c[axis]
        if link.show_velocity:
            t.device_velocity_rad_s[axis] = link.velocity_rad_s[axis]
    for k in range(3):
        if link.show_force:
            t.force_n[k] = link.force_n[k]
        if link.show_moment:
            t.moment_nm[k] = link.moment_nm[k]


@compiled
def show(tick: np.ndarray, link: np.ndarray, end: int) -> None:
    """Write the newest sample into the tick; fresh only if it is and nothing newer may be waiting."""
    t, ln = tick[0], link[0]
    faults = judge(ln, end)
    if ln.status & ln.unusable_status or _dropped(ln):
        faults |= _DEVICE
    t.sample_count = ln.sample_count
    t.link_faults = faults
    for axis in range(len(ln.position_counts)):
        # from the whole count each time: increments would add up their rounding
        t.position_rad[axis] = ln.position_counts[axis] * ln.rad_per_count[axis] + ln.offset_rad[axis]
    show_measured(t, ln)
    # shown out of an old sample, too: a pressed button stays pressed until a sample says otherwise
    if ln.show_estop:
        t.estop = 1 if ln.status & _ESTOP else 0


@compiled
def receive(
    tick: np.ndarray,
    chunk: np.ndarray,
    meta: np.ndarray,
    link: np.ndarray,
    stream: np.ndarray,
    state: np.ndarray,
    identity: np.ndarray,
    body: np.ndarray,
) -> int:
    """Take in `chunk[:meta[0]]`; unless `meta[1]` is MORE, write the tick.

    Returns
    -------
    int
        How many packets in a row were no newer than the last accepted one."""
    absorb(chunk, meta[0], link, stream, state, identity, body)
    if meta[1] != MORE:
        show(tick, link, meta[1])
    return int(link[0].older_in_row)


@compiled
def send(
    tick: np.ndarray, link: np.ndarray, command: np.ndarray, body: np.ndarray, packet: np.ndarray
) -> int:
    """Write the command packet of this tick; returns its length.

    Disabled, a value of any axis not finite, or a board that has let go: every value 0 and enable 0."""
    t, ln, c = tick[0], link[0], command[0]
    # the host has disabled: what the board did before is forgiven, and is judged anew when armed
    if t.enabled == 0:
        ln.driven, ln.dropped = 0, 0
    enable = t.enabled != 0 and ln.dropped == 0
    for axis in range(len(c.value)):
        value = t.torque_applied_nm[axis] if ln.torque_mode else t.current_command_a[axis]
        enable = enable and math.isfinite(value)
        # before `enable` is known: every axis is looked at, for one that is not finite disables all
        c.value[axis] = frame.micro(ln.motor_sign[axis] * value)
    if not enable:
        for axis in range(len(c.value)):
            c.value[axis] = 0
    # how many commands back the board may answer and still speak of this arming (`_dropped`)
    ln.enabled_in_row = ln.enabled_in_row + 1 if enable else 0
    # counts disabled commands, too: a board obeys one that enables only if it is ahead of the last
    ln.command_sequence = (ln.command_sequence + 1) & 0xFFFF
    c.sequence, c.enable = ln.command_sequence, 1 if enable else 0
    c.torque_mode, c.time_to_live = ln.torque_mode, ln.time_to_live
    return seal(body, frame.encode_command(command, body), packet)


@compiled
def request(kind: int, sequence: int, body: np.ndarray, packet: np.ndarray) -> int:
    """Write a stop or identify packet; returns its length."""
    return seal(body, frame.encode_request(kind, sequence, body), packet)
