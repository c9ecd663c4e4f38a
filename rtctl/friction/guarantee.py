"""What is known for sure of an axis' dry friction: its least torque, its presliding length, and the account
on both.

One place for the rules, used by the plan of the law and by `rtctl check`."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hw.motion import own_size
from rtctl.control.vocabulary import Policy
from rtctl.friction.model import FrictionModel
from rtctl.rig_file.axis_tables import AxisTable

LENGTH_FACTOR = 1.5
"""The credited bristles are this much longer than the presliding length: LuGre's approach sliding slowly. By
brute force over loops of any amplitude 1.0 is enough for LuGre and Maxwell-slip in slow motion; the rest is
for fast motion."""

SPREADS = 2.0
"""Standard deviations of the measured length that are added to it."""

LENGTH_UNKNOWN_RAD = 0.005
"""Presliding length where nobody measured one: longer than that of most geared joints (.5 to 2 mrad)."""

BANK_LONGEST_RAD = 0.0115
"""The account of the compensation holds what one turn costs, of bristles of this length at most (7.7 mrad of
presliding): 4 mJ of a joint that holds .35 N m. Where the bank is less than a turn costs, help goes in the
middle of each stroke. What a hand may be given by it grows with the joint's own friction: a joint of 10 N m
whose bank was 4 mJ lost its help at each turn."""

TURN_SHARE = 0.8
"""Share of the presliding length over which a stop operator turns: bristles bent to one end turn up to twice
as steeply as the straight line of the length, LuGre's, or just as steeply, elasto-plastic ones."""

INTENT_SHARE, GATE_SHARE = 0.2, 0.1
"""Hand torques at which intent saturates and the gate is open, of the least dry friction: which hands are
left at rest was measured with these."""

GATE_DEADBAND_SHARE, GATE_DEADBAND_MOST_NM = 0.01, 0.002
OBSERVER_DEADBAND_SHARE, OBSERVER_DEADBAND_MOST_NM = 0.015, 0.003
"""Dead bands of gate and observer where the rig file names none: of the least dry friction, and at most so
much. On a joint whose friction is less than they the gate never opened."""

DRY_UNKNOWN_NM = 0.25
"""Dry friction that intent and gate go by where no model and no rig file tells any."""

ASSUMED, AT_MOST = "assumed", "model, at most"
"""Sources of a presliding length that nobody measured or gave, and of one that is only known not to be
longer."""


@dataclass(frozen=True)
class Guarantee:
    """Facts of one axis. Torques in N m, lengths in rad, energies in J."""

    floor_nm: float
    """Dry friction that is there at every trained speed, place and within the stated drift; 0 without a
    model."""
    doubt_nm: float
    """How far below the learned curve friction may be, with what was measured of its error and its places,
    and the drift."""
    sliding_doubt_nm: float
    """Doubt of sliding alone, without what is known to be off where the joint may stick: for the drift watch,
    no proof rests on it."""
    place_doubt_nm: float
    """The same without what places differ by, where the watch goes by them."""
    peak_nm: float
    """Largest dry friction that is ever compensated or credited."""
    length_rad: float
    """Presliding length, as measured, given, or assumed."""
    length_source: str
    """"model", "model, at most", "rig file", or "assumed"."""
    credited_rad: float
    """Length x_b of the credited bristles (`control.dry_friction`)."""
    bank_j: float
    """Bank of the compensation's account (`control.assistance`)."""
    intent_nm: float
    """Torque of the hand at which intent saturates: as the rig file says, or a share of the least dry
    friction."""
    gate_nm: float
    """Torque of the hand that opens the force gate, likewise."""
    gate_deadband_nm: float
    """Torque of the hand below which it stays shut, likewise."""
    observer_deadband_nm: float
    """Friction that the observer leaves alone, likewise."""

    @property
    def measured(self) -> bool:
        """True when the length is surely no longer than that: what the account asks for."""
        return self.length_source != ASSUMED

    @property
    def may_be_shorter(self) -> bool:
        """True when the length may be any that is shorter: then the bristles are stiffer."""
        return self.length_source in (ASSUMED, AT_MOST)

    @property
    def length_in_doubt(self) -> str:
        """What is known of a length that may be shorter, in words."""
        mrad = f"{self.length_rad * 1e3:.3g} mrad"
        if self.measured:
            return f"the presliding length is known to be {mrad} at most, and may be shorter"
        return f"nobody says what the presliding length is ({mrad} are assumed)"

    @property
    def bristle_nm_rad(self) -> float:
        """Stiffness of a joint that sticks, N m/rad."""
        return self.peak_nm / self.length_rad

    def turn_rad(self, policy: Policy) -> float:
        """Length over which the direction of the help turns where the rig file names none, rad."""
        return self.length_rad * (1.0 if policy == Policy.LUGRE else TURN_SHARE)

    @property
    def given_most_j(self) -> float:
        """Most energy that the compensation gives a hand over any stretch of time, J
        (`control.assistance`)."""
        return 2 * self.bank_j + 0.5 * self.peak_nm * self.credited_rad


RELEASE_COUNTS = 3.5
"""Counts by which the torque of a coupling that is answered late may be off where a flicker of the encoder
ends (`control.flicker`)."""


def holding_friction_nm(axis: AxisTable, dry_share: float) -> float:
    """Dry friction, at the joint, from which on a flicker of the encoder is not answered, N m; infinite where
    none of it is on the encoder's side."""
    if dry_share == 0.0:
        return math.inf
    stiffness_nm_rad = axis.coupling.stiffness_nm_rad
    if axis.may_show("admittance"):
        stiffness_nm_rad = max(stiffness_nm_rad, axis.admittance.position_gain_nm_rad)
    return RELEASE_COUNTS * stiffness_nm_rad * 2 * math.pi / axis.counts_of_turn / dry_share


def holds_flicker(axis: AxisTable, sure: Guarantee, dry_share: float) -> bool:
    """True where dry friction surely holds the joint while a flicker of its encoder is not answered, and when
    that ends.

    Where it may not, a joint would glide from one edge of two counts to the other, on and on. `dry_share`: of
    the friction, on the encoder's side of an elastic joint."""
    holds_nm = max(sure.floor_nm, axis.dry_friction_nm)
    return holds_nm > 0 and holds_nm >= holding_friction_nm(axis, dry_share)


def _doubts_of_sliding(axis: AxisTable, model: FrictionModel, doubt_nm: float) -> tuple[float, float]:
    """How far sliding may be off by the drift watch, N m, places included and without them.

    A change of `warn_share` is news whatever else the model doubts, but not where places were seen to differ
    by more: at one of them friction is what it was."""
    friction, seen_nm, places = axis.friction, model.sliding_doubt_nm, model.place_spread_nm
    if seen_nm is None and model.place is not None and places is not None:
        # a model of before single places were kept says what places differ by all the same
        seen_nm = float(places.max())
    # doubt beyond what is warned of would hide what is to be told (decision 0028)
    most_nm = friction.drift.warn_share * float(model.friction_min_nm.min())
    sliding_nm = min(doubt_nm, most_nm)
    if seen_nm is not None:
        sliding_nm = min(doubt_nm, max(seen_nm, min(friction.drift_nm + seen_nm, most_nm)))
    if model.place is None:
        return sliding_nm, sliding_nm
    return sliding_nm, min(sliding_nm, most_nm, friction.drift_nm + float(model.error_max_nm.max()))


def assumed_rad(motion: str) -> float:
    """Presliding length where none is known, rad; of a linear axis m."""
    return own_size("length_rad", LENGTH_UNKNOWN_RAD, motion)


def bank_j(peak_nm: float, credited_rad: float, longest_rad: float = BANK_LONGEST_RAD) -> float:
    """Bank of the account of the help, J: what one turn costs a joint that holds `peak_nm` by bristles of
    `credited_rad`."""
    return peak_nm * min(credited_rad, longest_rad)


def _dry_nm(axis: AxisTable, model: FrictionModel | None) -> float:
    """Least dry friction by model or rig file, N m, that a hand's push is measured by."""
    known_nm = axis.dry_friction_nm if model is None else float(model.friction_min_nm.min())
    return known_nm if known_nm > 0 else own_size("dry_nm", DRY_UNKNOWN_NM, axis.motion)


def guarantee(axis: AxisTable, model: FrictionModel | None) -> Guarantee:
    """Gather the facts of `axis`, whose friction model is `model`, if it has one."""
    friction = axis.friction
    cap_nm = friction.cap_share * axis.torque_limit_nm
    floor_nm, doubt_nm, peak_nm = 0.0, friction.drift_nm, cap_nm
    if model is not None:
        places = model.place_spread_nm
        # the shortfall at a place is below the curve, its error included: the larger of the two, not both
        doubt_nm += max(float(model.error_max_nm.max()), 0.0 if places is None else float(places.max()))
        floor_nm = max(0.0, float(model.friction_min_nm.min()) - doubt_nm)
        # no more than the cap is ever sent, however strong the friction is somewhere
        peak_nm = min(cap_nm, model.friction_max_nm + model.place_crest_nm)
    sliding_nm, place_nm = (
        (doubt_nm, doubt_nm) if model is None else _doubts_of_sliding(axis, model, doubt_nm)
    )
    length_rad, spread_rad, source = assumed_rad(axis.motion), 0.0, ASSUMED
    if friction.presliding_rad > 0:
        length_rad, source = friction.presliding_rad, "rig file"
    elif model is not None and model.presliding_rad is not None:
        length_rad, spread_rad = model.presliding_rad, model.presliding_spread_rad or 0.0
        source = AT_MOST if model.presliding_spread_rad == 0.0 else "model"
    # longer is the safe side: credit comes later than the friction does
    credited_rad = LENGTH_FACTOR * (length_rad + SPREADS * spread_rad)
    # who presses a springy wall spends more than a turn of such bristles costs: no less is lent than before
    lent_rad = max(credited_rad, LENGTH_FACTOR * assumed_rad(axis.motion) if source == AT_MOST else 0.0)
    dry_nm = _dry_nm(axis, model)
    return Guarantee(
        floor_nm=floor_nm,
        doubt_nm=doubt_nm,
        sliding_doubt_nm=sliding_nm,
        place_doubt_nm=place_nm,
        peak_nm=peak_nm,
        length_rad=length_rad,
        length_source=source,
        credited_rad=credited_rad,
        bank_j=bank_j(peak_nm, lent_rad, own_size("longest_rad", BANK_LONGEST_RAD, axis.motion)),
        intent_nm=friction.intent_nm or INTENT_SHARE * dry_nm,  # 0: the rig file names none
        gate_nm=friction.gate_nm or GATE_SHARE * dry_nm,
        gate_deadband_nm=friction.gate_deadband_nm
        or min(GATE_DEADBAND_SHARE * dry_nm, own_size("most_nm", GATE_DEADBAND_MOST_NM, axis.motion)),
        observer_deadband_nm=friction.observer.deadband_nm
        or min(OBSERVER_DEADBAND_SHARE * dry_nm, own_size("most_nm", OBSERVER_DEADBAND_MOST_NM, axis.motion)),
    )
