"""Every figure of one axis that the tests of `rtctl check` judge."""

from __future__ import annotations

from dataclasses import dataclass

from rtctl.check.force_way import ForceWay
from rtctl.check.observer_tuning import Tuning
from rtctl.control.proofs import stability
from rtctl.friction.guarantee import Guarantee
from rtctl.friction.margins import FrictionFigures


@dataclass(frozen=True)
class AxisFigures:
    """Figures of one axis; see `rtctl.control.proofs.stability` for the symbols behind them."""

    index: int
    name: str
    stiffness_nm_rad: float
    damping_nms_rad: float
    delay_ticks: float
    """The worst of what is declared, configured and measured."""
    delay_from: str
    """Who said so."""
    jitter_ticks: float
    sample_ticks: int
    sample_from: str
    current_loop_hz: float
    lag_from: str
    current_overshoot: float
    undeclared_devices: tuple[str, ...]
    motor_share: float
    joint_encoder: str
    total_damping_nms_rad: float
    """Damping of motor, joint and link, of which `device_damping_nms_rad` is what no hand can cancel."""
    device_damping_nms_rad: float
    """Guaranteed damping b of the device that the margins use."""
    damping_needed_nms_rad: float
    damping_needed_any_world_nms_rad: float
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
    dry_friction_nm: float
    """Guaranteed, with the feed-forward taken off, on the motor's side."""
    torque_limit_nm: float
    empty_account_torque_nm: float
    """Torque that may be held while the energy account is empty, N m: what the gate can take back for the
    budget."""
    torque_rate_needed_nm_s: float
    """Slope of the gate with which that is all of the torque limit, N m/s; infinite when no slope is
    enough."""
    friction: FrictionFigures | None
    guarantee: Guarantee
    """Least friction, presliding length, and the account of the compensation on both."""
    compensates: bool
    """True when feed-forward or observer help with the friction."""
    force_sensor: bool
    force_way: ForceWay
    """What the sensor's own filter makes of a force, and who said so."""
    observer: Tuning
    """How the disturbance observer goes by it."""

    @property
    def between(self) -> stability.Between:
        """What lies between law and joint."""
        return stability.Between(
            self.delay_ticks,
            self.current_loop_hz,
            self.sample_ticks,
            self.jitter_ticks,
            self.current_overshoot,
        )
