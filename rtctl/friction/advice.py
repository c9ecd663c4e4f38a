"""What a rig file's gain and cap are, beside what the two-line test of its friction model recommends."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from hw.motion import words
from rtctl.control.compensation_limit import is_force_gated
from rtctl.control.vocabulary import Policy
from rtctl.friction import artefact
from rtctl.friction import gain as report_gain
from rtctl.friction.margins import friction_figures
from rtctl.friction.model import FrictionModel
from rtctl.rig_file.axis_tables import AxisTable
from rtctl.rig_file.config import LoadedConfig


@dataclass(frozen=True)
class Advice:
    """Gain and cap of one axis with a model and a feed-forward: as set, and as recommended.

    `margin_nm` is the two-line margin of what is set, N m; `gated` is whether its policy has a force gate.
    `gain_max` is the largest gain that passes, with the cap at that gain times the least dry friction;
    `gain_recommended` and `cap_share_recommended` are what `rtctl fit` suggests to begin with. Temperatures
    (degC) are those the model was learned at, None unknown."""

    axis: str
    gain: float
    cap_share: float
    margin_nm: float
    gated: bool
    gain_max: float
    gain_recommended: float
    cap_share_recommended: float
    temperature_min_c: float | None
    temperature_max_c: float | None
    motion: str = "rotary"

    @property
    def ok(self) -> bool:
        """True when what is set passes the two-line test."""
        return self.margin_nm >= 0

    @property
    def text(self) -> str:
        """What is set, what is recommended, and why it matters, in a sentence; "" when they agree."""
        # exactly: the recommended ones are rounded, and were pasted or not
        same = (self.gain, self.cap_share) == (self.gain_recommended, self.cap_share_recommended)
        if self.ok and same:
            return ""
        set_to = f"axis {self.axis}: gain = {self.gain:g} with cap_share = {self.cap_share:g}"
        if self.gain_max <= 0:
            advised = "no gain passes it with this coupling and encoder"
        else:
            advised = (
                f"it recommends gain = {self.gain_recommended:g} with cap_share = "
                f"{self.cap_share_recommended:g} (largest gain: {report_gain.told(self.gain_max)})"
            )
        if self.ok:
            return f"{set_to} passes the two-line test of its model; {advised}"
        gate = (
            ". Until then the force gate and the account of the compensation keep a feed-forward of the "
            "wrong sign from driving the device"
        )
        short = words(f"{-self.margin_nm:.4g} N m", self.motion)
        failed = f"{set_to} fails the two-line test of its model by {short}; {advised}"
        return failed + (gate if self.gated else "")


def advise(loaded: LoadedConfig) -> list[Advice]:
    """Advice for every axis that has a friction model and a policy that uses it.

    Raises
    ------
    ModelError
        A friction model that cannot be believed, or is of another rig."""
    found = []
    for axis in loaded.config.axis:
        path = loaded.model_in_use(axis)
        if path is None:
            continue
        model = artefact.load(path)
        artefact.require_rig(model, loaded.config.rig.name, path, axis.motion)
        found.append(_advise(model, axis, loaded.config.period_s))
    return found


def _advise(model: FrictionModel, axis: AxisTable, T: float) -> Advice:
    best = report_gain.of_axis(model, axis, T)
    count = 2 * math.pi / axis.counts_of_turn
    figures = friction_figures(model, Path(axis.friction.model), axis, T, count)
    return Advice(
        axis=axis.name,
        gain=axis.friction.gain,
        cap_share=axis.friction.cap_share,
        margin_nm=figures.two_line_margin_nm,
        gated=is_force_gated(Policy[axis.friction.policy.upper()]),
        gain_max=best.gain,
        gain_recommended=best.start_gain,
        cap_share_recommended=best.start_cap_share,
        temperature_min_c=model.temperature_min_c,
        temperature_max_c=model.temperature_max_c,
        motion=axis.motion,
    )
