"""Scripted faults, compiled: what they do to a sample and to the actuator, tick by tick.

A schedule is a set of columns in the device's parameters record (`schedule_fields`), one place per fault,
at most `FAULTS`; what the faults must remember is in its state record (`memory_fields`). The functions
here take any two records that have these fields. With `fault_count` 0 none of them need be called, and
the fields cost nothing. A compiled campaign may write the columns itself, between two ticks or in them.

| column | meaning |
|---|---|
| `fault_count` | places in use |
| `fault_channel`, `fault_effect` | a pair from `hw.fault_kinds.KINDS`; any other does nothing |
| `fault_axis` | joint (force and moment: sensor axis) it acts on; -1: all |
| `fault_from_tick` | first tick, counted from the device's first sample |
| `fault_ticks` | how many ticks it is due; 0: for ever |
| `fault_every_ticks` | comes again after so many; 0: never |
| `fault_probability` | of acting in each tick in which it is due, drawn anew each tick |
| `fault_value` | in the unit of its kind |

Faults act on a reading in the order of their places; then those of the link act on the whole sample. The
state `fault_on` holds one bit per place that acts in this tick. Draws come from `fault_rng`, a stream of
its own: with or without faults, the noise of the device stays the same."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import literal_unroll

from hw.channels import QUANTITIES
from hw.encoder import wrap
from hw.fault_kinds import Channel, Effect
from hw.generator import uniform
from hw.interface import LinkFault
from hw.jit import compiled
from hw.kept_readings import FIELDS, copy_readings, kept_field

FAULTS = 32
"""Most faults of one schedule."""

_POSITION, _ESTOP, _LINK = int(Channel.POSITION), int(Channel.ESTOP), int(Channel.LINK)
_ACTUATOR, _LOOP = int(Channel.ACTUATOR), int(Channel.LOOP)
_NUMBERS = tuple(reading.number for reading in QUANTITIES)

_NAN, _INF, _OFFSET, _HOLD, _SET = (
    int(e) for e in (Effect.NAN, Effect.INF, Effect.OFFSET, Effect.HOLD, Effect.SET)
)
_DRIFT, _SCALE, _NEGATE = int(Effect.DRIFT), int(Effect.SCALE), int(Effect.NEGATE)
_MIRROR, _WRAP, _CLIP = int(Effect.MIRROR), int(Effect.WRAP), int(Effect.CLIP)
_STALE, _DROP, _OLDER = int(Effect.STALE), int(Effect.DROP), int(Effect.OLDER)
_CHECKSUM, _SEQUENCE = int(Effect.CHECKSUM), int(Effect.SEQUENCE)
_LOST, _RAISE_READ, _RAISE_WRITE = int(Effect.LOST), int(Effect.RAISE_READ), int(Effect.RAISE_WRITE)
_DEAD, _REVERSE, _LIMP = int(Effect.DEAD), int(Effect.REVERSE), int(Effect.LIMP)
_PRESSED, _STALL = int(Effect.PRESSED), int(Effect.STALL)

_BIT_CHECKSUM, _BIT_SEQUENCE = int(LinkFault.CHECKSUM), int(LinkFault.SEQUENCE)
_BIT_LOST = int(LinkFault.LOST)

IN_READ = 1
"""Value of `fault_raise` when the backend is to raise LinkLost in `read`."""

IN_WRITE = 2
"""Value of `fault_raise` when the backend is to raise LinkLost in `write`."""


def schedule_fields() -> list[tuple[Any, ...]]:
    """Columns of a schedule, for a parameters record that also has `period_s` and `count_rad`."""
    places = (FAULTS,)
    return [
        ("fault_count", "<i8"),
        ("fault_channel", "<i8", places),
        ("fault_effect", "<i8", places),
        ("fault_axis", "<i8", places),
        ("fault_from_tick", "<i8", places),
        ("fault_ticks", "<i8", places),
        ("fault_every_ticks", "<i8", places),
        ("fault_probability", "<f8", places),
        ("fault_value", "<f8", places),
    ]


def memory_fields(n_axes: int) -> list[tuple[Any, ...]]:
    """What scripted faults remember, for a state record. Zeros to begin, but for `fault_rng`."""
    axis = (n_axes,)
    return [
        ("fault_rng", "<u8", (4,)),
        ("fault_on", "<i8"),  # bit of each place that acts in this tick
        ("fault_raise", "<i8"),  # IN_READ or IN_WRITE in this tick, else 0
        ("fault_unplugged", "<i8"),  # 1 when nothing sent arrives in this tick
        ("fault_stall_ticks", "<i8"),  # slots the loop misses after this tick
        ("fault_counts_lost", "<i8"),  # by how much the shown counter lags the device's
        ("fault_enabled_ticks", "<i8"),  # ticks in a row with the actuator enabled
        ("fault_anchor_rad", "<f8", axis),  # where a mirrored position turned back
        ("shown_ready", "<i8"),  # the sample shown last, faults included:
        ("shown_count", "<i8"),
        kept_field("shown", n_axes),
    ]


@compiled
def due_ticks(p: np.record, k: int, elapsed: int) -> int:
    """Ticks since fault `k` became due, `elapsed` ticks after the first sample; -1 when it is not due."""
    since = int(elapsed - p.fault_from_tick[k])
    if since < 0:
        return -1
    if p.fault_every_ticks[k] > 0:
        # the period counts from the first time on, whether it acted then or not
        since %= p.fault_every_ticks[k]
    if 0 < p.fault_ticks[k] <= since:
        return -1
    return since


@compiled
def _altered(
    effect: int, value: float, reading: float, last: float, anchor: float, since_s: float, count_rad: float
) -> float:
    """The reading as the fault shows it."""
    if effect == _NAN:
        return math.nan
    if effect == _INF:
        return math.copysign(math.inf, value)
    if effect == _OFFSET:
        return reading + value
    if effect == _HOLD:
        return last
    if effect == _SET:
        return value
    if effect == _DRIFT:
        return reading + value * since_s
    if effect == _SCALE:
        return reading * value
    if effect == _NEGATE:
        return -reading
    if effect == _MIRROR:
        return 2.0 * anchor - reading
    if effect == _CLIP:
        return min(max(reading, -value), value)
    if effect == _WRAP and math.isfinite(reading):
        return wrap(math.floor(reading / count_rad + 0.5), int(value)) * count_rad
    return reading


@compiled
def _alter(
    readings: np.ndarray, last: np.ndarray, anchor: np.ndarray, p: np.record, k: int, since: int
) -> None:
    """Let fault `k` act on the readings of its axes."""
    axis, effect, value = p.fault_axis[k], p.fault_effect[k], p.fault_value[k]
    since_s = (since + 1) * p.period_s
    for i in range(len(readings)):
        if axis < 0 or axis == i:
            j = min(i, len(anchor) - 1)  # the force has three components, a rig any number of axes
            readings[i] = _altered(effect, value, readings[i], last[i], anchor[j], since_s, p.count_rad[j])


@compiled
def _show_again(t: np.record, s: np.record) -> None:
    """Nothing arrived: what the last sample left still stands."""
    t.sample_count = s.shown_count
    copy_readings(s.shown, t)


@compiled
def _remember(t: np.record, s: np.record) -> None:
    """Keep the sample as it is shown."""
    s.shown_ready = 1
    s.shown_count = t.sample_count
    copy_readings(t, s.shown)


@compiled
def _sensor(t: np.record, s: np.record, p: np.record, k: int, since: int) -> None:
    """Let fault `k` act, if it is one of a sensor or of the loop."""
    channel, effect = p.fault_channel[k], p.fault_effect[k]
    if channel == _POSITION and effect == _MIRROR and not (s.fault_on >> k) & 1:
        for axis in range(len(t.position_rad)):
            if p.fault_axis[k] < 0 or p.fault_axis[k] == axis:
                s.fault_anchor_rad[axis] = s.shown.position_rad[axis]
    if channel == _ESTOP and effect == _PRESSED:
        t.estop = 1
    elif channel == _LOOP and effect == _STALL:
        s.fault_stall_ticks += int(p.fault_value[k])
    reading = -1
    for field in literal_unroll(FIELDS):
        reading += 1
        if channel == _NUMBERS[reading]:
            _alter(t[field], s.shown[field], s.fault_anchor_rad, p, k, since)


@compiled
def _link(t: np.record, s: np.record, p: np.record, k: int, count: int) -> None:
    """Let fault `k` of the link act on the whole sample, the device's own `count` of it given."""
    effect, value = p.fault_effect[k], p.fault_value[k]
    if effect == _CHECKSUM:
        # NumPy has no | of unsigned and signed (NUMBA_DISABLE_JIT)
        t.link_faults = np.int64(t.link_faults) | _BIT_CHECKSUM
    elif effect == _SEQUENCE:
        t.link_faults = np.int64(t.link_faults) | _BIT_SEQUENCE
    elif effect == _STALE:
        s.fault_counts_lost += t.sample_count - s.shown_count
        t.sample_count = s.shown_count
    elif effect == _DROP:
        _show_again(t, s)
    elif effect == _OLDER:
        _show_again(t, s)
        t.sample_count = count - s.fault_counts_lost - int(value)
    elif effect in (_LOST, _RAISE_READ):
        _show_again(t, s)
        t.link_faults = np.int64(t.link_faults) | _BIT_LOST
        s.fault_unplugged = 1
        if effect == _RAISE_READ:
            s.fault_raise = IN_READ
        elif value >= 1.0:
            s.fault_counts_lost = count
    elif effect == _RAISE_WRITE:
        s.fault_unplugged = 1
        if s.fault_raise == 0:
            s.fault_raise = IN_WRITE


@compiled
def inject(t: np.record, s: np.record, p: np.record, elapsed: int) -> None:
    """Let the schedule act on a fresh sample.

    Parameters
    ----------
    t : record
        Tick with the sample as the device would show it: readings, `sample_count`, `link_faults`, `estop`.
    s, p : record
        State and parameters with `memory_fields` and `schedule_fields`.
    elapsed : int
        Ticks since the device's first sample."""
    count, on = t.sample_count, 0
    t.sample_count = count - s.fault_counts_lost
    s.fault_raise, s.fault_unplugged, s.fault_stall_ticks = 0, 0, 0
    # a hold at the first sample has nothing before it: it holds that sample
    if s.shown_ready == 0:
        _remember(t, s)  # nothing to hold yet but the first sample itself
    places = min(p.fault_count, FAULTS)
    for k in range(places):
        since = due_ticks(p, k, elapsed)
        if since < 0 or (p.fault_probability[k] < 1.0 and uniform(s.fault_rng) >= p.fault_probability[k]):
            continue
        on |= 1 << k
        _sensor(t, s, p, k, since)
    s.fault_on = on
    for k in range(places):
        if (on >> k) & 1 and p.fault_channel[k] == _LINK:
            _link(t, s, p, k, count)
    _remember(t, s)


@compiled
def driven(
    s: np.record, p: np.record, axis: int, elapsed: int, wanted_a: float, before_a: float
) -> tuple[float, float]:
    """Current that flows instead of `wanted_a`, and the direction of its torque (1 or -1).

    `before_a` is the current of the period before, `elapsed` this period in ticks since the device's first
    sample: a fault that acted on the last sample ends in time even where the loop misses slots. The amplifier
    still saturates at `current_max_a`."""
    current, direction = wanted_a, 1.0
    for k in range(min(p.fault_count, FAULTS)):
        if not (s.fault_on >> k) & 1 or p.fault_channel[k] != _ACTUATOR or due_ticks(p, k, elapsed) < 0:
            continue
        if p.fault_axis[k] >= 0 and p.fault_axis[k] != axis:
            continue
        effect, value = p.fault_effect[k], p.fault_value[k]
        if effect == _DEAD or (effect == _LIMP and s.fault_enabled_ticks * p.period_s > value):
            current = 0.0
        elif effect == _HOLD:
            current = before_a
        elif effect == _SCALE:
            current *= value
        elif effect == _REVERSE:
            direction = -direction
    limit = p.current_max_a[axis]
    return min(max(current, -limit), limit), direction
