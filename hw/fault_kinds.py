"""The scripted faults there are, as one table: what each is called in a schedule, and what it does.

A fault acts on a channel by an effect; both are small integers in the compiled records
(`hw.scripted_faults`). `KINDS` gives the pairs that mean something, with the bounds of their value;
everything else (the rig file's checks, the table in docs/faults.md, random campaigns) is made from it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np

from hw.channels import QUANTITIES, READINGS

_OTHERS = {"link": 6, "actuator": 7, "loop": 8}
"""Where a fault acts that is none of a reading."""

_enum: Any = IntEnum
Channel = _enum(
    "Channel", {r.name.upper(): r.number for r in READINGS} | {n.upper(): k for n, k in _OTHERS.items()}
)
"""Where a fault acts."""


class Effect(IntEnum):
    """What a fault does there."""

    # to a reading
    NAN = 1
    INF = 2
    OFFSET = 3
    HOLD = 4  # link side: of a reading; actuator: of the current
    SET = 5
    DRIFT = 6
    SCALE = 7
    NEGATE = 8
    MIRROR = 9
    WRAP = 10
    CLIP = 11
    # to the link
    STALE = 20
    DROP = 21
    CHECKSUM = 22
    SEQUENCE = 23
    OLDER = 24
    LOST = 25
    RAISE_READ = 26
    RAISE_WRITE = 27
    # to the actuator, besides HOLD and SCALE
    DEAD = 30
    REVERSE = 31
    LIMP = 32
    # to the rest
    PRESSED = 40
    STALL = 41


@dataclass(frozen=True)
class Kind:
    """One kind of fault. `value` must lie within `low` and `high`; without a unit it has no value.

    `default` is the value when the schedule gives none; None: it must give one."""

    channel: IntEnum
    name: str
    effect: Effect
    meaning: str
    unit: str = ""
    low: float = 0.0
    high: float = 0.0
    default: float | None = 0.0


def _readings() -> tuple[Kind, ...]:
    position, current = Channel.POSITION, Channel.CURRENT
    force, temperature, velocity = Channel.FORCE, Channel.TEMPERATURE, Channel.VELOCITY
    moment = Channel.MOMENT
    return (
        Kind(position, "nan", Effect.NAN, "reads NaN"),
        Kind(position, "inf", Effect.INF, "reads infinite, with the sign of `value`", "sign", -1, 1, 1.0),
        Kind(position, "jump", Effect.OFFSET, "reads `value` too much", "rad", -1e6, 1e6, None),
        Kind(position, "frozen", Effect.HOLD, "repeats the last reading while the counter advances"),
        Kind(position, "out_of_range", Effect.SET, "reads `value`", "rad", -1e12, 1e12, 1e6),
        Kind(position, "drift", Effect.DRIFT, "error grows from zero by `value`", "rad/s", -1e3, 1e3, None),
        Kind(position, "sign", Effect.MIRROR, "runs backwards from the last reading on"),
        Kind(position, "wrap", Effect.WRAP, "is not unwrapped: signed counter", "bits", 2, 32, None),
        Kind(current, "nan", Effect.NAN, "reads NaN"),
        Kind(current, "inf", Effect.INF, "reads infinite, with the sign of `value`", "sign", -1, 1, 1.0),
        Kind(current, "stuck", Effect.HOLD, "repeats the last reading"),
        Kind(current, "offset", Effect.OFFSET, "reads `value` too much", "A", -1e4, 1e4, None),
        Kind(current, "scale", Effect.SCALE, "reads `value` times the current", "1", -100, 100, None),
        Kind(current, "sign", Effect.NEGATE, "reads with the wrong sign"),
        Kind(force, "nan", Effect.NAN, "reads NaN"),
        Kind(force, "inf", Effect.INF, "reads infinite, with the sign of `value`", "sign", -1, 1, 1.0),
        Kind(force, "saturated", Effect.SET, "reads `value`, whatever the hand does", "N", -1e5, 1e5, None),
        Kind(force, "frozen", Effect.HOLD, "repeats the last reading"),
        Kind(force, "offset", Effect.OFFSET, "reads `value` too much", "N", -1e5, 1e5, None),
        Kind(force, "clipped", Effect.CLIP, "reads at most `value` either way", "N", 0, 1e5, None),
        Kind(force, "scale", Effect.SCALE, "reads `value` times the force", "1", -100, 100, None),
        Kind(moment, "nan", Effect.NAN, "reads NaN"),
        Kind(moment, "frozen", Effect.HOLD, "repeats the last reading"),
        Kind(moment, "offset", Effect.OFFSET, "reads `value` too much", "N m", -1e4, 1e4, None),
        Kind(moment, "clipped", Effect.CLIP, "reads at most `value` either way", "N m", 0, 1e4, None),
        Kind(temperature, "value", Effect.SET, "reads `value`", "degC", -273.15, 1e4, None),
        Kind(
            temperature, "ramp", Effect.DRIFT, "error grows from zero by `value`", "degC/s", -1e3, 1e3, None
        ),
        Kind(temperature, "missing", Effect.NAN, "reads NaN, as without a sensor"),
        Kind(velocity, "nan", Effect.NAN, "reads NaN, as without a sensor"),
        Kind(velocity, "inf", Effect.INF, "reads infinite, with the sign of `value`", "sign", -1, 1, 1.0),
        Kind(velocity, "frozen", Effect.HOLD, "repeats the last reading"),
        Kind(velocity, "out_of_range", Effect.SET, "reads `value`", "rad/s", -1e12, 1e12, 1e6),
        Kind(velocity, "offset", Effect.OFFSET, "reads `value` too much", "rad/s", -1e4, 1e4, None),
        Kind(velocity, "scale", Effect.SCALE, "reads `value` times the velocity", "1", -100, 100, None),
        Kind(velocity, "sign", Effect.NEGATE, "reads with the wrong sign"),
    )


def _other_readings() -> Iterator[Kind]:
    """What any sensor may do: for channels without kinds of their own."""
    # a channel that is added to the table of readings has these at once
    known = {kind.channel for kind in _readings()}
    for reading in QUANTITIES:
        channel, unit = Channel(reading.number), reading.unit
        if channel not in known:
            yield Kind(channel, "nan", Effect.NAN, "reads NaN, as without a sensor")
            yield Kind(channel, "frozen", Effect.HOLD, "repeats the last reading")
            yield Kind(channel, "offset", Effect.OFFSET, "reads `value` too much", unit, -1e6, 1e6, None)
            yield Kind(channel, "out_of_range", Effect.SET, "reads `value`", unit, -1e12, 1e12, 1e6)


def _links() -> tuple[Kind, ...]:
    """What may happen to a sample on its way, or to all of them."""
    link = Channel.LINK
    return (
        Kind(link, "stale", Effect.STALE, "the counter stands still; the values go on"),
        Kind(link, "drop", Effect.DROP, "no sample arrives, the last one still stands; the device counts on"),
        Kind(link, "checksum", Effect.CHECKSUM, "LinkFault.CHECKSUM on the sample that came"),
        Kind(link, "sequence", Effect.SEQUENCE, "LinkFault.SEQUENCE on the sample that came"),
        Kind(
            link,
            "older",
            Effect.OLDER,
            "the last values, with a counter `value` back; 1 is a duplicate",
            "samples",
            1,
            1e9,
            1.0,
        ),
        Kind(
            link,
            "lost",
            Effect.LOST,
            "unplugged: LinkFault.LOST, nothing arrives either way; `value` 1: the counter begins anew after",
            "1",
            0,
            1,
        ),
        Kind(link, "raise_read", Effect.RAISE_READ, "as lost, and the backend raises LinkLost in read"),
        Kind(
            link, "raise_write", Effect.RAISE_WRITE, "the backend raises LinkLost in write; nothing is sent"
        ),
    )


def _actuators() -> tuple[Kind, ...]:
    """What a motor's drive may do with a command."""
    actuator = Channel.ACTUATOR
    return (
        Kind(actuator, "dead", Effect.DEAD, "no current, no torque"),
        Kind(actuator, "stuck", Effect.HOLD, "keeps the last current, also when disabled"),
        Kind(actuator, "scale", Effect.SCALE, "drives `value` times the current", "1", -100, 100, None),
        Kind(actuator, "sign", Effect.REVERSE, "wired the wrong way round: torque reversed, current as sent"),
        Kind(
            actuator,
            "limp",
            Effect.LIMP,
            "no current once it has been enabled longer than `value`",
            "s",
            0,
            1e6,
            None,
        ),
    )


def _devices() -> tuple[Kind, ...]:
    """Everything that is no reading."""
    return (
        Kind(Channel.ESTOP, "pressed", Effect.PRESSED, "the emergency stop input is pressed"),
        *_links(),
        *_actuators(),
        Kind(
            Channel.LOOP,
            "stall",
            Effect.STALL,
            "reading blocks so long that `value` slots are missed",
            "slots",
            1,
            1e4,
            1.0,
        ),
    )


KINDS: dict[tuple[str, str], Kind] = {
    (kind.channel.name.lower(), kind.name): kind for kind in (*_readings(), *_other_readings(), *_devices())
}
"""(channel, kind) as in a schedule -> the kind."""


def campaign_table() -> np.ndarray:
    """Every kind as a row of numbers, for compiled code that draws faults: channel, effect, low, high of the
    value."""
    return np.array([[kind.channel, kind.effect, kind.low, kind.high] for kind in KINDS.values()], float)
