"""Is this rig file's coupling provably passive? Ties config, friction model and margins together.

`examine` reads the friction models and returns every figure; the daemon refuses to start where `.ok` is
false, and `rtctl check` prints the same report.

How the guaranteed damping comes about, per axis:

- without a friction model: `viscous_nms_rad` of the rig file;
- with one: the secant damping left after feed-forward (theory reference 2.2) over the trained range, with
  the friction at its lower bound (model minus its largest known error minus `drift_nm`);
- where the velocity limit lies beyond the trained range, friction there is taken to rise from that lower
  bound with `viscous_nms_rad` only, while the feed-forward fades out.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rtctl.config import LoadedConfig
from rtctl.config_tables import AxisTable
from rtctl.control import stability
from rtctl.errors import StabilityError
from rtctl.friction import artefact
from rtctl.friction.margins import FrictionFigures, friction_figures

_ROUNDING = 1e-12


@dataclass(frozen=True)
class AxisReport:
    """Figures of one axis; see `rtctl.control.stability` for the symbols behind them."""

    index: int
    name: str
    stiffness_nm_rad: float
    damping_nms_rad: float
    delay_ticks: int
    device_damping_nms_rad: float
    """Guaranteed damping b of the device that the margins use."""
    damping_needed_nms_rad: float
    sampled_data_margin_nms_rad: float
    sampled_data_k_max_nm_rad: float
    adams_hannaford_margin_nms_rad: float
    adams_hannaford_k_max_nm_rad: float
    recommended_stiffness_nm_rad: float
    recommended_damping_nms_rad: float
    environment_stiffness_nm_rad: float | None
    felt_stiffness_nm_rad: float | None
    ring_hz: float
    ring_damping_ratio: float
    count_rad: float
    quantisation_torque_nm: float
    torque_limit_nm: float
    empty_account_torque_nm: float
    """Torque that may be held while the energy account is empty, N m: what the gate can take back for the budget."""
    torque_rate_needed_nm_s: float
    """Slope of the gate with which that is all of the torque limit, N m/s; infinite when no slope is enough."""
    friction: FrictionFigures | None

    @property
    def ok(self) -> bool:
        """True when the exact sampled-data test passes (to rounding). NaN does not."""
        return self.sampled_data_margin_nms_rad >= -_ROUNDING * (1 + self.damping_needed_nms_rad)


@dataclass(frozen=True)
class Report:
    """The check of a whole rig file."""

    path: Path
    rig: str
    period_s: float
    axes: tuple[AxisReport, ...]

    @property
    def ok(self) -> bool:
        """True when every axis passes."""
        return all(axis.ok for axis in self.axes)

    def refusal(self) -> str:
        """Why the file is refused: file, key, value, bound, remedy, one line per failing axis; "" if ok."""
        return "\n".join(_refusal(self.path, axis) for axis in self.axes if not axis.ok)

    def require(self) -> None:
        """Raise StabilityError unless every axis passes."""
        if not self.ok:
            raise StabilityError(self.refusal())

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; a number that is not finite becomes None."""
        body = {"file": str(self.path), "rig": self.rig, "period_s": self.period_s, "ok": self.ok}
        axes = [{**asdict(axis), "ok": axis.ok} for axis in self.axes]
        plain: dict[str, Any] = _finite({**body, "refusal": self.refusal(), "axes": axes})
        return plain


def examine(loaded: LoadedConfig) -> Report:
    """Compute the margins of every axis of a rig file.

    Raises
    ------
    ModelError
        A friction model that cannot be believed, or is of another rig.
    """
    config = loaded.config
    axes = [_examine_axis(loaded, index, axis) for index, axis in enumerate(config.axis)]
    return Report(path=loaded.path, rig=config.rig.name, period_s=config.period_s, axes=tuple(axes))


def _examine_axis(loaded: LoadedConfig, index: int, axis: AxisTable) -> AxisReport:
    T = loaded.config.period_s
    k_c, b_c, d = axis.coupling.stiffness_nm_rad, axis.coupling.damping_nms_rad, axis.coupling.delay_ticks
    count = 2 * math.pi / axis.encoder_counts_per_rev
    figures, b = None, axis.viscous_nms_rad
    path = loaded.model_path(axis)
    if path is not None:
        model = artefact.load(path)
        artefact.require_rig(model, loaded.config.rig.name, path)
        figures = friction_figures(model, path, axis, T, count)
        beyond = figures.beyond_damping_nms_rad
        b = min(figures.secant_damping_nms_rad, math.inf if beyond is None else beyond)
    needed = stability.damping_needed_sampled_data(k_c, b_c, T, d)
    recommended = stability.recommended_coupling(b, T, d)
    k_e = _environment_stiffness(axis)
    held, rate_needed = _empty_account(loaded, axis)
    ring, ratio = stability.coupling_ring(axis.inertia_kgm2, max(b, 0.0), k_c, b_c)
    return AxisReport(
        index=index,
        name=axis.name,
        stiffness_nm_rad=k_c,
        damping_nms_rad=b_c,
        delay_ticks=d,
        device_damping_nms_rad=b,
        damping_needed_nms_rad=needed,
        sampled_data_margin_nms_rad=b - needed,
        sampled_data_k_max_nm_rad=stability.k_max_sampled_data(b, b_c, T, d),
        adams_hannaford_margin_nms_rad=stability.margin_adams_hannaford(b, k_c, b_c, T),
        adams_hannaford_k_max_nm_rad=stability.k_max_adams_hannaford(b, b_c, T),
        recommended_stiffness_nm_rad=recommended[0],
        recommended_damping_nms_rad=recommended[1],
        environment_stiffness_nm_rad=k_e,
        felt_stiffness_nm_rad=None if k_e is None else stability.felt_stiffness(k_c, k_e),
        ring_hz=ring / (2 * math.pi),
        ring_damping_ratio=ratio,
        count_rad=count,
        quantisation_torque_nm=k_c * count / 2 + b_c * count / T,
        torque_limit_nm=axis.torque_limit_nm,
        empty_account_torque_nm=held,
        torque_rate_needed_nm_s=rate_needed,
        friction=figures,
    )


def _empty_account(loaded: LoadedConfig, axis: AxisTable) -> tuple[float, float]:
    """Torque that an empty energy account can pay for, N m, and the slope at which that is the limit, N m/s."""
    from rtctl.control import take_back  # reading a report's names must not load the compiler
    from rtctl.control.jit import plain

    most_torque = plain(take_back.most_torque)
    T, limit = loaded.config.period_s, axis.torque_limit_nm
    way = take_back.OVERSPEED_FACTOR * axis.velocity_limit_rad_s * T
    left = take_back.FLOOR_FACTOR * loaded.config.passivity.budget_j
    held = min(limit, most_torque(left, axis.torque_rate_nm_s * T, way))
    if most_torque(left, limit, way) < limit:
        return held, math.inf
    low, high = 0.0, limit
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if most_torque(left, middle, way) < limit else (low, middle)
    return held, high / T


def _environment_stiffness(axis: AxisTable) -> float | None:
    springy = axis.environment.kind in ("spring", "wall", "detents")
    return axis.environment.stiffness_nm_rad if springy else None


def _down(value: float) -> str:
    """Four significant digits, rounded down, so that the printed bound itself passes."""
    if not value > 0 or not math.isfinite(value):
        return "0"
    value *= 1 + _ROUNDING
    step = 10.0 ** (math.floor(math.log10(value)) - 3)
    return f"{math.floor(value / step * (1 + _ROUNDING)) * step:.4g}"


def _refusal(path: Path, axis: AxisReport) -> str:
    """File, axis, key, value, bound and remedy, on one line."""
    b, where = axis.device_damping_nms_rad, f"{path}: axis[{axis.index}]"
    k_max, found = _down(axis.sampled_data_k_max_nm_rad), axis.friction
    pair = (
        f"recommended: stiffness_nm_rad = {_down(axis.recommended_stiffness_nm_rad)}, "
        f"damping_nms_rad = {_down(axis.recommended_damping_nms_rad)}"
    )
    if found is not None and not b > 0:
        return (
            f"{where}.friction.gain: axis {axis.name}: the feed-forward may exceed the friction: at "
            f"{found.secant_speed_rad_s:.3g} rad/s it leaves {b:.4g} N m s/rad of damping, the bound is > 0; "
            f"no coupling passes; a gain of at most {_down(found.gain_max)} does for this coupling, or a "
            f"better model (its largest error is {found.error_max_nm:.3g} N m)"
        )
    if axis.damping_nms_rad > b:
        return (
            f"{where}.coupling.damping_nms_rad: axis {axis.name}: {axis.damping_nms_rad:g} is above its "
            f"bound {_down(b)} N m s/rad, the damping the device surely has, so no stiffness passes; {pair}"
        )
    return (
        f"{where}.coupling.stiffness_nm_rad: axis {axis.name}: {axis.stiffness_nm_rad:g} is not provably "
        f"passive; the largest that passes is {k_max} N m/rad with damping_nms_rad = "
        f"{axis.damping_nms_rad:g}, delay_ticks = {axis.delay_ticks} and {b:.4g} N m s/rad of "
        f"guaranteed damping; {pair}"
    )


def _finite(value: Any) -> Any:  # noqa: ANN401
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
