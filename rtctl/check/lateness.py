"""How late torque and samples of an axis are: what its devices declare, its rig file says, and was measured.

The worse counts, of every part by itself: the coupling is proved for it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hw import registry
from hw.rig_words import subset
from rtctl.check.devices_of_axis import members_of
from rtctl.control.proofs.stability import Between, lag_ticks
from rtctl.rig_file.config import LoadedConfig
from rtctl.rig_file.measured_timing import AxisTiming

STALE_LIMIT_TICKS = 3
"""Age of a sample that is a fault (STALE): one that comes every fourth tick and later is so at each turn."""

_SLACK_TICKS = 1e-6
"""A device's period in seconds over the loop's is not a whole number to the last bit."""


@dataclass(frozen=True)
class Lateness:
    """What lies between law and joint of one axis, and who said so."""

    between: Between
    delay_from: str
    lag_from: str
    sample_from: str
    undeclared: tuple[str, ...]
    """Devices of the axis that declare nothing of their delay."""

    def declared_s(self, T: float) -> float:
        """Delay and time constant of the current loop together, s, at the control period `T`."""
        return (self.between.delay + lag_ticks(self.between.lag_hz, T)) * T

    def answer_s(self, T: float) -> float:
        """Longest time from a place that the joint passes to the torque that answers it, s: the same from the
        next fresh sample on."""
        return self.declared_s(T) + self.between.sample_ticks * T


@dataclass(frozen=True)
class _Claim:
    who: str
    between: Between


def of_axis(loaded: LoadedConfig, axis: int, pulse: AxisTiming | None = None) -> Lateness:
    """What is declared, configured and measured of one axis, the worse of each.

    `pulse` is what the last test pulse of ARMING measured of it, where that is known."""
    table = loaded.config.axis[axis]
    measured = table.measured
    devices, undeclared = _declared(loaded, axis)
    claims = [
        _Claim("rig file", Between(table.coupling.delay_ticks, table.drive.current_loop_hz)),
        *devices,
        _Claim(
            "measured",
            Between(
                measured.delay_ticks, measured.current_loop_hz, measured.sample_ticks, measured.jitter_ticks
            ),
        ),
    ]
    if pulse is not None:
        claims.append(_Claim(f"test pulse of {pulse.date}", _measured(pulse, loaded.config.period_s)))
    # part by part: the worst delay may be one device's, the slowest loop another's
    late = max(claims, key=lambda claim: claim.between.delay)
    old = max(claims, key=lambda claim: claim.between.sample_ticks)
    # 0 is an ideal loop, not the slowest
    slow = min(claims, key=lambda claim: claim.between.lag_hz or math.inf)
    jitter = max(claim.between.jitter for claim in claims)
    return Lateness(
        Between(
            late.between.delay,
            slow.between.lag_hz,
            old.between.sample_ticks,
            min(jitter, late.between.delay),  # a delay does not become less than none
            table.drive.current_overshoot if slow.between.lag_hz > 0 else 0.0,
        ),
        late.who,
        slow.who,
        old.who,
        tuple(undeclared),
    )


def _measured(pulse: AxisTiming, T: float) -> Between:
    """A test pulse's answer in ticks: delay, lag behind it, period of the samples."""
    lag_hz = 1 / (2 * math.pi * pulse.lag_s) if pulse.lag_s > 0 else 0.0
    return Between(
        # the pulse tells both together; a lag counted in the delay too would count twice
        max(pulse.delay_s - pulse.lag_s, 0.0) / T,
        lag_hz,
        # rounded, where a declared period is taken up: a measured one is never a whole number of ticks
        max(round(pulse.sample_period_s / T), 1),
    )


def _declared(loaded: LoadedConfig, axis: int) -> tuple[list[_Claim], list[str]]:
    """What the devices of an axis declare together: delays add up, of samples and current loops the slowest
    counts."""
    T = loaded.config.period_s
    delay = jitter = 0.0
    lag_hz, sample_ticks, names, undeclared = 0.0, 1, [], []
    for member, at in members_of(loaded, axis):
        rig = subset(loaded.config.hardware(), member.axes)
        found = registry.timing(member.kind, member.options, rig)
        # named in a row: no delay is not the same as none declared
        if found is None:
            undeclared.append(member.label)
            continue
        one = found[at]
        names.append(member.label)
        # one device behind the other: what reads and what sends both cost time
        delay, jitter = delay + one.delay_s / T, jitter + one.jitter_s / T
        if one.current_loop_hz > 0:
            lag_hz = min(lag_hz or math.inf, one.current_loop_hz)
        if "position" in member.channels:  # an old force delays no coupling
            sample_ticks = max(sample_ticks, math.ceil(one.sample_period_s / T - _SLACK_TICKS))
    # a delay that was given in ticks is a whole number again: whole ones have closed forms
    delay = round(delay) if abs(delay - round(delay)) < _SLACK_TICKS else delay
    claim = _Claim(" and ".join(names), Between(float(delay), lag_hz, sample_ticks, jitter))
    return [claim] if names else [], undeclared
