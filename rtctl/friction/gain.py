"""Which compensation gain and cap a friction model allows, by the two-line test of the rig file."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rtctl.control import compensation_limit as limits
from rtctl.control.proofs import friction_passivity as friction
from rtctl.friction.margins import friction_figures
from rtctl.friction.model import FrictionModel
from rtctl.rig_file.axis_tables import AxisTable
from rtctl.rig_file.config import LoadedConfig
from rtctl.rig_file.friction_tables import CAP_SHARE_MAX

_HALVINGS = 10  # the gain to .001, from below
_GRID = 4000

START_SHARE = 0.9
"""Share of the largest gain that passes with which a rig file should begin. The rest is for what no test
knows."""


def told(gain: float) -> str:
    """A largest gain in three digits, rounded down: what is printed passes, too."""
    return f"{math.floor(1e3 * gain) / 1e3:.3f}"


@dataclass(frozen=True)
class AxisGain:
    """Figures of one axis. Torques in N m.

    `gain` passes the two-line test when the feed-forward is capped at `cap_nm` = gain times the least dry
    friction, whatever its sign errors; `cap_share` is that cap as the rig file names it. The law keeps
    the cap itself for the ungated policies only: hybrid needs the `cap_share`. `gain_uncapped` passes it
    without that cap. 0: not even none does, `margin_at_zero_nm` says by how much. `gain_sampled_data` is the
    share of the whole curve that leaves the damping the sampled-data test needs. `viscous_gain` and
    `drift_nm` are those of the rig file, which all of this holds for; its gain and cap do not matter."""

    axis: str
    gain: float
    cap_nm: float
    cap_share: float
    margin_nm: float
    gain_uncapped: float
    gain_sampled_data: float
    margin_at_zero_nm: float
    viscous_gain: float
    drift_nm: float

    @property
    def start_gain(self) -> float:
        """Gain to begin with: `START_SHARE` of the largest, rounded down to .01; 0 when none passes."""
        return math.floor(100 * START_SHARE * self.gain) / 100

    @property
    def start_cap_share(self) -> float:
        """`cap_share` that belongs to `start_gain`, rounded down to .0001."""
        share = self.cap_share * self.start_gain / self.gain if self.gain > 0 else 0.0
        return math.floor(1e4 * share) / 1e4

    def snippet(self, model: str) -> str:
        """Lines for the rig file, ready to paste; `model` is the model's path relative to it."""
        lines = [
            f"[axis.friction]                     # axis {self.axis}",
            f"model = {json.dumps(model)}",
            f"gain = {self.start_gain:g}".ljust(36) + f"# {START_SHARE:g} of the largest that passes",
            f"viscous_gain = {self.viscous_gain:g}",
            f"cap_share = {self.start_cap_share:g}".ljust(36) + "# gain times the least dry friction",
            f"drift_nm = {self.drift_nm:g}",
        ]
        return "\n".join(lines)


@dataclass(frozen=True)
class Gains:
    """`gain_model` needs no rig: the share of the curve that is surely below the true friction."""

    gain_model: float
    friction_min_nm: float
    axes: tuple[AxisGain, ...]
    config: str = ""
    config_sha256: str = ""


def recommend(model: FrictionModel, loaded: LoadedConfig | None) -> Gains:
    """Largest gains that pass, of the model alone and, with a rig file, of each of its axes of that
    motion.

    Notes
    -----
    docs/theory.md 5.2 and 5.3: kappa <= min over v of F_lo(v)/Fhat(v); the two-line margin falls as kappa
    rises, so the largest kappa with margin >= 0 is found by halving, from the safe side."""
    # without a rig nothing is needed of the damping: only that no help exceeds what is surely there
    alone = []
    for branch in model.branches:
        v = np.unique(np.append(np.linspace(0, branch.speed_max_rad_s, _GRID), branch.curve.knots))
        v = v[v <= branch.speed_max_rad_s]
        F_hat = branch.magnitude(v)
        alone.append(friction.gain_max(v, np.maximum(F_hat - branch.error_max_nm, 0.0), F_hat, 0.0))
    least = float(model.friction_min_nm.min())
    if loaded is None:
        return Gains(min(alone), least, ())
    # of the model's motion: on the others its speeds and torques are none
    axes = tuple(
        of_axis(model, axis, loaded.config.period_s)
        for axis in loaded.config.axis
        if axis.motion == model.motion
    )
    return Gains(min(alone), least, axes, loaded.path.name, loaded.sha256)


def of_axis(model: FrictionModel, axis: AxisTable, T: float) -> AxisGain:
    """Recommend for one axis; `T` is the control period, s."""
    count = 2 * math.pi / axis.counts_of_turn

    def margins(gain: float) -> tuple[float, float, float]:
        """(capped, uncapped margin; share of the sampled-data test) at a gain, with a gated policy."""
        # the rig file's own cap must not bound what is sought
        update = {"gain": gain, "policy": "hybrid", "cap_share": CAP_SHARE_MAX}
        table = axis.friction.model_copy(update=update)
        figures = friction_figures(model, Path(), axis.model_copy(update={"friction": table}), T, count)
        return figures.two_line_capped_margin_nm, figures.two_line_margin_nm, figures.gain_max

    def largest(which: int) -> float:
        # all of the friction may be taken out: no gain above 1 is ever asked for
        if margins(1.0)[which] >= 0:
            return 1.0
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if margins(middle)[which] >= 0 else (low, middle)
        return low

    gain = largest(0)
    ungated = limits.ungated_cap(gain, float(model.friction_min_nm.min()))
    cap = limits.cap_in_force(False, CAP_SHARE_MAX * axis.torque_limit_nm, ungated)
    at_zero = margins(0.0)
    return AxisGain(
        axis=axis.name,
        gain=gain,
        cap_nm=cap,
        cap_share=cap / axis.torque_limit_nm,
        margin_nm=margins(gain)[0],
        gain_uncapped=largest(1),
        gain_sampled_data=at_zero[2],
        margin_at_zero_nm=at_zero[0],
        viscous_gain=axis.friction.viscous_gain,
        drift_nm=axis.friction.drift_nm,
    )
