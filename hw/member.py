"""One device of a rig, as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hw.interface import Options


@dataclass(frozen=True)
class Member:
    """One device of a rig, as plain data.

    Attributes
    ----------
    kind, options
        Backend and its validated options.
    label
        Names the device in every error, such as `device[1] 'finger'`.
    axes
        Indices of the rig's axes it serves; its own axes are these, in this order.
    channels
        Those of its channels the rig uses.
    max_age_ticks
        Oldest sample that still counts as fresh, in cycles; 0: a new one is due in every cycle.
    budget_ns
        Time its `read` may take; 0: no limit (simulated devices).
    claims
        What of a shared wire is to be this process' alone while it drives the device (`hw.claims`)."""

    kind: str
    options: Options
    label: str
    axes: tuple[int, ...]
    channels: tuple[str, ...]
    max_age_ticks: int = 0
    budget_ns: int = 0
    claims: tuple[str, ...] = ()

    @property
    def place(self) -> str:
        """Names the device, with its axes as a rig file counts them: `device[1] 'finger' (axis[0])`."""
        return f"{self.label} ({', '.join(f'axis[{axis}]' for axis in self.axes)})"

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Member:
        """Back from JSON."""
        tuples = {name: tuple(data[name]) for name in ("axes", "channels", "claims")}
        return cls(**{**data, **tuples})
