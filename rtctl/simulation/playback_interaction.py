"""What the hand felt in a run over a recorded log, and what is left of it, as figures.

With ``tau_h`` the torque of the hand and ``tau_ff`` the feed-forward (both positive when they accelerate the
joint), the same motion under compensation would have needed ``tau_h - tau_ff`` from the hand: that is *what
is left*. It assumes that the hand would have moved as it did. `J a` is the part of it that accelerates the
joint, a spring's torque the part that it stores: no friction model can take them away."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rtctl.control.vocabulary import State
from rtctl.errors import DataError
from rtctl.friction.logs.dynamics import smooth
from rtctl.friction.logs.springs import Spring


def rms(values: np.ndarray) -> float:
    """Root of the mean square; NaN for no values."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


@dataclass(frozen=True)
class Trace:
    """Signals of axis 0 over the counted ticks of a run: full authority, away from the filter's ends.

    `place_nm` is the torque of a spring or of gravity, as far as the log tells it."""

    time_s: np.ndarray
    velocity_rad_s: np.ndarray
    hand_nm: np.ndarray
    feedforward_nm: np.ndarray
    inertial_nm: np.ndarray
    place_nm: np.ndarray | float = 0.0

    @property
    def left_nm(self) -> np.ndarray:
        """Torque the hand would have needed for the same motion under compensation."""
        return np.asarray(self.hand_nm - self.feedforward_nm)


def trace(
    rows: np.ndarray, rate_hz: float, inertia_kgm2: float, cutoff_hz: float, spring: Spring | None = None
) -> Trace:
    """Signals of a run with J a, and the torque of a spring, from the recorded motion without delay.

    Raises
    ------
    DataError
        No tick with full authority."""
    fresh = rows[rows["sample_age_ticks"] == 0]  # held samples would be steps of the velocity
    position = smooth(fresh["position_rad"][:, 0], rate_hz, cutoff_hz)
    velocity = np.gradient(position, 1.0 / rate_hz)
    # of the same smoothed motion: two filters would leave their difference as friction
    inertial = inertia_kgm2 * np.gradient(velocity, 1.0 / rate_hz)
    counted = (fresh["state"] == State.ACTIVE) & (fresh["authority"] >= 1.0)
    edge = round(rate_hz / cutoff_hz)  # a smoothed end is one-sided: its derivative is wrong
    counted[:edge] = counted[len(counted) - edge :] = False
    if not counted.any():
        raise DataError("no tick had full authority: arming and soft start outlast the log; use a longer one")
    return Trace(
        # the first sample has number 1, at 0 s of the log
        time_s=(fresh["sample_count"][counted] - 1) / rate_hz,
        velocity_rad_s=velocity[counted],
        hand_nm=fresh["hand_torque_nm"][counted, 0],
        feedforward_nm=fresh["feedforward_torque_nm"][counted, 0],
        inertial_nm=inertial[counted],
        place_nm=spring.torque(position[counted]) if spring else 0.0,
    )


def interaction(signals: Trace, speed_min_rad_s: float) -> dict[str, Any]:
    """RMS of what the hand felt, of the feed-forward and of what is left, in all and by direction."""
    v = signals.velocity_rad_s
    parts = {
        "all": np.ones(len(v), dtype=bool),
        "forward": v >= speed_min_rad_s,
        "backward": v <= -speed_min_rad_s,
        "slow": np.abs(v) < speed_min_rad_s,
    }
    return {name: _part(signals, chosen) for name, chosen in parts.items()}


def _part(signals: Trace, chosen: np.ndarray) -> dict[str, float]:
    hand, left = signals.hand_nm[chosen], signals.left_nm[chosen]  # as recorded, and with help
    inertial = signals.inertial_nm[chosen]
    # neither is friction: a model takes away none of it
    stored = inertial + np.broadcast_to(signals.place_nm, len(chosen))[chosen]
    # what it needed as recorded, without any help
    felt = rms(hand)
    return {
        "share": float(chosen.mean()),  # of the time that counts
        "hand_rms_nm": felt,
        "feedforward_rms_nm": rms(signals.feedforward_nm[chosen]),
        "left_rms_nm": rms(left),
        # of nothing nothing is a share
        "reduction": 1.0 - rms(left) / felt if felt > 0 else float("nan"),
        "inertia_rms_nm": rms(inertial),
        "friction_rms_nm": rms(hand - stored),
        "friction_left_rms_nm": rms(left - stored),
    }
