"""Tables of a rig file: how an axis is helped with its friction, and what the hand feels of the rest."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from rtctl.rig_file.fields import Table, number

CAP_SHARE_MAX = 0.3
"""Most of the torque limit that the feed-forward may take."""


class ObserverTable(Table):
    """[axis.friction.observer]: disturbance observer from the force sensor; off while gain is 0, or without a
    sensor"""

    gain: float = number(0, 0.98, "share of what the feed-forward leaves that it compensates", default=0.95)
    bandwidth_hz: float = number(
        0,
        200,
        "of its low-pass; too much rings on a stiff hand; 0: rate_hz/20, at most 20, less behind a force "
        "sensor that is late and on a late rig whose gear is not known (drive.resonance_hz)",
        default=0.0,
    )
    deadband_nm: float = number(
        0,
        1e3,
        "friction left alone: more than the force sensor may be off after its tare; 0: .015 of the least "
        "dry friction, .003 N m at most",
        default=0.0,
    )

    def bandwidth_at(self, rate_hz: float) -> float:
        """Bandwidth in Hz of a loop of this rate, behind a force sensor that is not late."""
        return self.bandwidth_hz or min(20.0, rate_hz / 20)  # a slower loop lags more


class DriftTable(Table):
    """[axis.friction.drift]: is the friction still what was learned? Watched in ordinary motion, with a force
    sensor and a model"""

    watch: bool = Field(True, description="watch it (docs/friction.md)")
    warn_share: float = number(
        0.05,
        0.5,
        "change of the dry friction, share of the learned, that is warned of; told from 0.7 of it on",
        default=0.1,
    )
    window_s: float = number(10, 300, "sliding motion that an estimate is made of", default=24.0)
    stop: bool = Field(
        True,
        description="STOP where the compensation exceeds the friction for sure: the whole interval of the "
        "factor lies below the guaranteed friction and below the feed-forward",
    )
    # off: `rtctl check` judges every row at the largest factor, which costs gain
    adapt_per_min: float = number(
        0,
        0.01,
        "most by which the feed-forward follows the dry friction that is seen, share of the learned in a "
        "minute of motion, from 0.7 to 1.1 of it and no further than the two-line test allows; 0: it does "
        "not",
        default=0.0,
    )

    @model_validator(mode="after")
    def _follows(self) -> DriftTable:
        # the factor that is followed is what the watch estimates
        if self.adapt_per_min > 0 and not self.watch:
            msg = f"adapt_per_min {self.adapt_per_min}: what is not watched is not followed; set watch = true"
            raise ValueError(msg)
        return self


class FrictionTable(Table):
    """[axis.friction]"""

    model: str = Field("", max_length=500, description="model file, relative to the rig file; empty: none")
    policy: Literal[
        "off",
        "hybrid",
        "sign",
        "deadband",
        "tanh",
        "dither",
        "intent",
        "stop",
        "stop_gated",
        "observer",
        "lugre",
    ] = Field(
        "hybrid", description="what decides the direction of the feed-forward near rest (docs/theory.md 5.6)"
    )
    gain: float = number(0, 1, "kappa: share of Coulomb and Stribeck friction compensated", default=0.9)
    # 0: the guaranteed damping is what the coupling's proof lives on
    viscous_gain: float = number(0, 1, "kappa_v: share of the viscous part compensated", default=0.0)
    load_gain: float = number(
        0,
        1,
        "kappa_l: share compensated of the friction that the torque through the gear adds, of a model that "
        "knows it (`rtctl fit --by-load`); 0: the law does not go by load",
        default=0.0,
    )
    cap_share: float = number(
        0, CAP_SHARE_MAX, "cap of the feed-forward, share of the torque limit", default=CAP_SHARE_MAX
    )
    tanh_rad_s: float = number(1e-4, 10, "speed scale of tanh", default=0.02)
    blend_rad_s: float = number(
        1e-4, 10, "hybrid: speed above which motion decides, not intent", default=0.08
    )
    deadband_rad_s: float = number(0, 10, "deadband policy: slower motion has no direction", default=0.01)
    dither_hz: float = number(1, 1000, "dither policy: frequency", default=80.0)
    intent_nm: float = number(
        0, 1e3, "hand torque at which intent saturates; 0: .2 of the least dry friction", default=0.0
    )
    intent_lowpass_hz: float = number(
        0,
        5000,
        "low-pass of the hand's torque for the intent: the mass of a hand buzzes without; 0: rate_hz/20, "
        "at most 50",
        default=0.0,
    )
    gate_deadband_nm: float = number(
        0,
        1e3,
        "hand torque below which the gate stays shut; 0: .01 of the least dry friction, .002 N m at most",
        default=0.0,
    )
    gate_nm: float = number(
        0, 1e3, "hand torque that opens the gate fully; 0: .1 of the least dry friction", default=0.0
    )
    gate_lowpass_s: float = number(0, 1, "time constant of the gate", default=0.01)
    presliding_rad: float = number(
        0, 1, "F_s / sigma0: motion over which friction is a spring; 0: as the model says", default=0.0
    )
    stop_rad: float = number(
        0,
        1,
        "hybrid, stop and lugre policies: length over which their direction turns; 0: .8 of the presliding "
        "length (lugre: all of it)",
        default=0.0,
    )
    drift_nm: float = number(0, 1e3, "how far friction may have drifted below the model", default=0.0)
    place: Literal["off", "seen", "given"] = Field(
        "seen",
        description="what a model says of place: seen: compensated once the force sensor sees it there; "
        "given: from the start (an absolute encoder), until the sensor contradicts",
    )
    place_shift_rad: float = number(
        -1e4, 1e4, "position at which the model has its 0, where the encoder's zero has moved", default=0.0
    )
    observer: ObserverTable = ObserverTable()
    drift: DriftTable = DriftTable()

    def intent_lowpass_at(self, rate_hz: float) -> float:
        """Low-pass of the intent in Hz of a loop of this rate."""
        # a slower loop lags more, as with the observer
        return self.intent_lowpass_hz or min(50.0, rate_hz / 20)


class ForceFeedbackTable(Table):
    """[axis.force_feedback]: off while gain is 0"""

    gain: float = number(0, 20, "torque per torque the hand feels beyond the virtual force", default=0.0)
    lowpass_hz: float = number(
        0.1, 5000, "filter of that torque: its lag is negative damping in a stiff grip", default=200.0
    )
    deadband_nm: float = number(0, 1e3, "hand torque that is not fed back", default=0.002)
    cap_share: float = number(0, CAP_SHARE_MAX, "its cap, share of the torque limit", default=CAP_SHARE_MAX)
    share: float = number(
        0,
        0.98,
        "most of what friction and spare damping surely take out, with the feed-forward",
        default=0.95,
    )
