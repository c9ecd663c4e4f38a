"""What `rtctl monitor` shows: a live table for a terminal, single lines for a pipe."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hw.motion import name, of_axes, unit, words
from rtctl.control.vocabulary import Display
from rtctl.wire.event_words import device_line
from rtctl.wire.fault_words import Entry, sentence

NO_DATA_S = 0.5
"""Without a sample for so long, what was seen last is no state of the rig any more."""


if TYPE_CHECKING:
    from rtctl.client import RigState


@dataclass(frozen=True)
class Shown:
    """Everything one drawing needs.

    Attributes
    ----------
    sample
        The newest, its age as of now.
    silent_s
        Time since it came, s.
    faults
        Those present in it, with their places.
    cause
        What the rig stands still for, None while it does not."""

    sample: RigState
    silent_s: float
    lost: int
    health: dict[str, Any] | None = None
    faults: Sequence[Entry] = ()
    cause: Entry | None = None

    @property
    def no_data(self) -> str:
        """Why the sample must not be taken for the rig; empty while it may."""
        if self.silent_s < NO_DATA_S:
            return ""
        return f"NO DATA for {self.silent_s:.1f} s (was {self.sample.state.name}); waiting for the daemon"


_UNITS = ("rad", "rad/s", "N m", "N m", "N m")
"""Units of the columns, of a rotary axis."""


def table(hello: dict[str, Any], shown: Shown) -> list[str]:
    """Lines of the live table."""
    sample, health = shown.sample, shown.health
    # all that are present, by name; what each means stands below it
    names = ", ".join(str(fault.name) for fault in sample.faults) or "none"
    state = f"{sample.state.name:<10} authority {sample.authority:4.0%}   epoch {sample.epoch}"
    lines = [
        f"{hello['rig']}   {hello['rate_hz']:g} Hz   rtctl {hello['version']}   Ctrl-C ends, the rig runs on",
        "",
        f"state   {shown.no_data or state}",
        f"faults  {names}" + (" (when it was last heard)" if shown.no_data else ""),
        *_trouble(shown),
        "",
        f"{'axis':<12}{'position':>12}{'velocity':>12}{'hand':>12}{'feed-fwd':>12}{'applied':>12}",
    ]
    told = ""
    for a, axis in enumerate(hello["axes"]):
        motion = axis.get("motion", "rotary")
        # units again only where they change: most rigs have one motion
        if motion != told:
            lines.append(f"{'':<12}" + "".join(f"{unit(one, motion):>12}" for one in _UNITS))
            told = motion
        # in the order of `_UNITS`
        columns = (
            sample.position_rad,
            sample.velocity_rad_s,
            sample.hand_torque_nm,
            sample.feedforward_torque_nm,
            sample.torque_applied_nm,
        )
        # a daemon that came back may have fewer axes than `hello` said
        cells = [f"{values[a]:>12.4f}" if a < len(values) else f"{'-':>12}" for values in columns]
        lines.append(f"{axis['name']:<12}" + "".join(cells))
        lines += [words(line, motion) for line in _display(sample.fields, a)]
    lines += [
        *_friction(health, hello["axes"]),
        "",
        *_latency(health),
        *([f"EVENT LOG BROKEN: {broken(health, 'log')}"] if broken(health, "log") else []),
        *([f"RECORDING BROKEN: {broken(health, 'recording')}"] if broken(health, "recording") else []),
        *[f"WARNING: {warning['text']}" for warning in _warnings(health)],
        f"missed {sample.missed_ticks}   lost here {shown.lost}   age {_age(shown)}",
    ]
    return lines


def _display(fields: Mapping[str, Any], axis: int) -> list[str]:
    """The virtual mass of an axis that is displayed as an admittance, and the damping added to it."""
    # get: a daemon of before has no displays
    kinds = fields.get("display_kind", ())
    if axis >= len(kinds) or int(kinds[axis]) != Display.ADMITTANCE:
        return []
    mass, damping, more = (
        fields[name][axis] for name in ("mass_kgm2", "mass_damping_nms_rad", "injected_damping_nms_rad")
    )
    added = f", {more:.3g} more added" if more > 0 else ""
    return [f"{'':<12}admittance: mass {mass:.4g} kg m^2, damping {damping:.4g} N m s/rad{added}"]


def _trouble(shown: Shown) -> list[str]:
    """A line for the cause of a stop, for each fault present, and for each device that complains."""
    present = [entry["name"] for entry in shown.faults]
    # a cause that is still present is a line of its own below
    latched = shown.cause is not None and shown.cause["name"] not in present
    lines = [f"cause   {sentence(shown.cause)}"] if latched and shown.cause is not None else []
    lines += [f"        {sentence(entry)}" for entry in shown.faults]
    devices = (shown.health or {}).get("devices", [])
    return lines + [f"device  {device_line(one)}" for one in devices if one["faults"] or one["silent"]]


def _age(shown: Shown) -> str:
    age_s = shown.sample.age_s
    # NaN: a virtual clock, of which the time since it came is all that is known
    return f"{(age_s if math.isfinite(age_s) else shown.silent_s) * 1e3:.1f} ms"


def broken(health: dict[str, Any] | None, what: str) -> str:
    """Why the daemon could not write its event log (`log`) or its recording; empty while it can."""
    return ((health or {}).get(what) or {}).get("broken") or ""


def _warnings(health: dict[str, Any] | None) -> list[dict[str, str]]:
    """Warnings the daemon gives: nothing that stops the rig."""
    found: list[dict[str, str]] = (health or {}).get("warnings", [])
    return found


def _friction(health: dict[str, Any] | None, axes: Sequence[Mapping[str, Any]]) -> list[str]:
    """A line for each axis whose friction is known: factor of what was learned, with its interval, and the
    offset."""
    # without a factor nothing was seen yet: no line, and no zero
    told = [one for one in (health or {}).get("friction", []) if one["factor"] is not None]
    # health names the axis and not its motion; a daemon that came back may have an axis that `hello` had not
    motions = {axis["name"]: axis.get("motion", "rotary") for axis in axes}
    return [words(_followed(one), motions.get(one["axis"], "rotary")) for one in told]


def _followed(one: dict[str, Any]) -> str:
    return (
        f"friction {one['axis']}: {one['factor']['value']:.3f} of what was learned "
        f"({one['factor']['low']:.3f} to {one['factor']['high']:.3f}; forward {one['forward']['value']:.2f}, "
        f"backward {one['backward']['value']:.2f}), offset {1e3 * one['offset_nm']['value']:+.1f} mN m, by "
        f"{one['seconds']:.0f} s"
        + ("" if one.get("followed") is None else f"; compensation {_follows(one)}: {one['followed']:.3f}")
    )


def _follows(one: dict[str, Any]) -> str:
    return "is held" if one.get("adapting") is False else "follows it"


def _latency(health: dict[str, Any] | None) -> list[str]:
    # None: too few ticks so far for percentiles
    if health is None or health["wakeup_us"] is None:
        return ["latency: once a second, wait ..."]
    names, early = list(health["wakeup_us"]), health.get("early_us", 0.0)
    lines = [f"{'us':<12}" + "".join(f"{name:>12}" for name in names)]
    lines += [
        f"{phase:<12}" + "".join(f"{health[f'{phase}_us'][n]:>12.1f}" for n in names)
        for phase in ("wakeup", "cycle")
    ]
    return [
        *lines,
        f"rate {health['measured_rate_hz']:.1f} Hz"
        + (f", awake {early:.0f} us early ({health.get('early_share', 0.0):.1%} of a core)" if early else "")
        + ("   WAIVER: no real-time rights" if health["waiver"] else ""),
        *_late(health),
    ]


def _late(health: dict[str, Any]) -> list[str]:
    """A line about ticks that came late since the start, and why."""
    # a daemon of before tells none
    late = health.get("late") or {"ticks": 0}
    if not late["ticks"]:
        return []
    # the most frequent first
    causes = ", ".join(
        f"{cause} {count}" for cause, count in sorted(late["causes"].items(), key=lambda one: -one[1])
    )
    return [f"late ticks (above {late['above_us']:.0f} us): {late['ticks']}: {causes}"]


_OF_LINE = ("position_rad", "velocity_rad_s", "hand_torque_nm", "feedforward_torque_nm")


def line(hello: dict[str, Any], shown: Shown) -> str:
    """One plain line, for a log or a pipe; names are those of m and N where every axis is linear."""
    # a line has one name for all axes, a table one for each
    motion = of_axes(hello["axes"])
    sample, health = shown.sample, shown.health
    faults = ",".join(str(fault.name) for fault in sample.faults) or "-"
    # a dash in place of figures: columns of a log stay where they are
    latency = "-"
    if health is not None and health["wakeup_us"] is not None:
        latency = f"{health['wakeup_us']['p50']:.1f}/{health['wakeup_us']['p99']:.1f}"
    # one word: lines are read by programs, too
    state = f"NO_DATA silent_s={shown.silent_s:.1f} was={sample.state.name}"
    cause = f" cause={shown.cause['name']}:{shown.cause['axis'] or '-'}" if shown.cause else ""
    return (
        f"{sample.timestamp:.3f} {state if shown.no_data else sample.state.name} faults={faults}{cause} "
        + "".join(f"{name(one, motion)}={_vector(getattr(sample, one))} " for one in _OF_LINE)
        + f"wakeup_us_p50/p99={latency} "
        f"missed={sample.missed_ticks} lost={shown.lost}"
        + "".join(f" {what}=BROKEN" for what in ("log", "recording") if broken(health, what))
        + "".join(f" warning={warning['name']}:{warning['axis']}" for warning in _warnings(health))
    )


def _vector(values: tuple[float, ...]) -> str:
    return ",".join(f"{value:.4f}" for value in values)
