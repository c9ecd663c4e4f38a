"""Tests for a wrong unit or a slipped decimal point: figures that real rigs have within a band.

The bands are wide: a figure outside the inner one is told, one outside the outer one is refused. What they
rest on stands in docs/check.md."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rtctl.check.verdict import Outcome, Subject, Verdict
from rtctl.rig_file.axis_tables import AxisTable


@dataclass(frozen=True)
class Band:
    """Where real rigs are, inner band, and where none is, beyond the outer one; both ends belong to it."""

    least: float
    low: float
    high: float
    most: float

    def outcome(self, value: float) -> Outcome:
        """PASS within the inner band, WARN within the outer one, FAIL beyond, and for what is no number."""
        if self.low <= value <= self.high:
            return Outcome.PASS
        # comparisons: NaN is beyond
        return Outcome.WARN if self.least <= value <= self.most else Outcome.FAIL

    def use(self, value: float) -> float:
        """1 at the ends of the inner band, more beyond, the further the more."""
        if not value > 0:  # 0, less or NaN: no ratio, beyond any band
            return math.inf
        if self.least == 0:
            return value / self.high
        middle = math.sqrt(self.low * self.high)  # bands are of ratios
        return abs(math.log(value / middle)) / math.log(self.high / middle)

    def __str__(self) -> str:
        return f"{self.low:g} to {self.high:g}" if self.least > 0 else f"up to {self.high:g}"


ACCELERATION = Band(0.3, 3.0, 1e5, 1e6)
"""rad/s^2 at the torque limit."""
ACCELERATION_LINEAR = Band(0.03, 0.3, 1e3, 1e4)
"""m/s^2 at the force limit: from a heavy gantry to a voice coil with nothing on it; grams for kilograms are a
thousand times as much."""
CURRENT_SHARE = Band(5e-4, 1e-2, 1.0, 1.0)
"""Current at the torque limit, share of the range of its sensor."""
TICKS_TO_FULL = Band(1e-3, 0.5, 2e3, 2e4)
"""Periods that the gate needs from zero to the torque limit."""
COUNT_SHARE = Band(0.0, 0.0, 0.06, 0.2)
"""Torque of one encoder count, share of the torque limit."""
TIME_CONSTANT_S = Band(1e-3, 0.03, 1e2, 1e4)
"""J/b, s."""
VISCOUS_SHARE = Band(0.0, 0.0, 0.5, 3.0)
"""Viscous torque at the velocity limit over the torque limit."""
HANDLE_FORCE_N = Band(1e-2, 0.2, 2e3, 1e4)
"""N at the handle at the torque limit: from a finger's device while it is commissioned to a whole arm's."""
DRY_SHARE = Band(0.0, 0.0, 0.5, 1.0)
"""Guaranteed dry friction over the torque limit: beyond it the motor could not move its own joint."""

TRAVEL_COUNTS = Band(20.0, 500.0, 1e10, 1e13)
"""Counts of the encoder over a turn or the travel: from Hall sensors of a motor (told) to 26 bits behind a
gear."""
TIME_TO_SPEED_S = Band(5e-5, 1.5e-3, 20.0, 1e3)
"""s to the velocity limit at the torque limit."""


def judged(
    s: Subject, name: str, value: float, unit: str, band: Band, meaning: str, remedy: str
) -> list[Verdict]:
    """One row; `remedy` begins with the key to look at."""
    outcome = band.outcome(value)  # one place for all rows: what is told and what refuses
    text = f"{value:.3g} {unit}".rstrip()
    key, _, hint = remedy.partition(": ")  # the key stands first in a refusal, the hint last
    refusal = (
        f"{s.where}.{key}: axis {s.axis.name}: {name} comes to {text}; real rigs have {band} {unit}".rstrip()
        + f", none is beyond {band.least:g} to {band.most:g}: {hint}"
    )
    told = outcome in (Outcome.WARN, Outcome.FAIL)  # a row that passes needs no remedy
    return [
        s.row(
            name,
            text,
            f"{band} {unit}".rstrip(),
            outcome,
            f"{meaning}: {key}: {hint}" if told else meaning,
            band.use(value),
            refusal if told else "",
        )
    ]


def acceleration(s: Subject) -> list[Verdict]:
    """What the torque limit does to the joint."""
    slides = s.table.motion == "linear"
    where = (
        "carriage, what turns with it by (2 pi / lead_m)^2 of its moment of inertia"
        if slides
        else "link (1 kg m^2 is 1e4 kg cm^2, 1e7 g cm^2)"
    )
    return judged(
        s,
        "acceleration at the torque limit",
        s.table.torque_limit_nm / s.table.inertia_kgm2,  # without friction: of the unit alone
        "rad/s^2",
        ACCELERATION_LINEAR if slides else ACCELERATION,
        "torque_limit_nm over inertia_kgm2",
        f"inertia_kgm2: {s.table.inertia_kgm2:g} is meant in kg m^2 at the {where}, the limit in N m",
    )


def current(s: Subject) -> list[Verdict]:
    """What the torque limit asks of the amplifier."""
    table, amperes = s.table, amperes_of(s)  # at the motor, before gear and losses
    return judged(
        s,
        "current at the torque limit",
        amperes / table.current_limit_a,  # 1 at most: beyond it no sample would be in range
        "",
        CURRENT_SHARE,
        f"{amperes:.3g} A, as a share of current_limit_a",
        f"torque_constant_nm_a: {table.torque_constant_nm_a:g} is meant in N m/A at the motor (13.4 mN m/A "
        "is 0.0134); see gear_ratio, "
        f"{'lead_m (a lead of 5 mm is 0.005), ' if table.motion == 'linear' else ''}torque_limit_nm and "
        "current_limit_a, too",
    )


def amperes_of(s: Subject) -> float:
    """Current of the motor at the torque limit, A."""
    table = s.table
    return table.torque_limit_nm / (table.motor_ratio * table.gear_efficiency * table.torque_constant_nm_a)


def ticks_to_full_torque(s: Subject) -> list[Verdict]:
    """How long the gate takes to the limit."""
    return judged(
        s,
        "ticks to full torque",
        s.table.torque_limit_nm / (s.table.torque_rate_nm_s * s.period_s),
        "ticks",
        TICKS_TO_FULL,
        "torque_limit_nm over torque_rate_nm_s and the period",
        "torque_rate_nm_s: it is meant in N m/s",
    )


def torque_of_a_count(s: Subject) -> list[Verdict]:
    """One step of the encoder through coupling and feed-forward."""
    axis, table = s.axis, s.table
    step = axis.stiffness_nm_rad * axis.count_rad + axis.damping_nms_rad * axis.count_rad / s.period_s
    step += _feedforward_of_a_count(s)  # both answer the same count, in the same sense
    if step == 0:  # neither coupling nor help: a count sends nothing
        return []
    return judged(
        s,
        "torque of one encoder count",
        step / table.torque_limit_nm,
        "",
        COUNT_SHARE,
        f"{step:.3g} N m through coupling and feed-forward, as a share of torque_limit_nm",
        f"encoder_counts_per_rev: {table.encoder_counts_per_rev:g} are meant per {_turn_of(table)}: lines x "
        "4 x gear_ratio, for an encoder at the motor",
    )


def _turn_of(table: AxisTable) -> str:
    """What the encoder's counts are of."""
    if table.motion != "linear":
        return "turn of the link"
    return "turn of the screw" if table.lead_m else "metre"


def _feedforward_of_a_count(s: Subject) -> float:
    """Most that one count changes the feed-forward by, N m: the width of the policy against the speed of a
    count."""
    found, table, friction = s.axis.friction, s.table, s.table.friction
    if found is None or found.feedforward_max_nm == 0:
        return 0.0
    if friction.policy in ("stop", "stop_gated"):
        return found.feedforward_max_nm * min(1.0, s.axis.count_rad / found.presliding_rad)
    window = table.velocity.window if table.velocity.method == "foaw" else 1  # ticks of one slope
    width = friction.tanh_rad_s if friction.policy == "tanh" else friction.blend_rad_s  # of the direction
    return found.feedforward_max_nm * min(1.0, s.axis.count_rad / (window * s.period_s) / width)


def time_constant(s: Subject) -> list[Verdict]:
    """How long the joint runs on by itself."""
    b = s.table.viscous_nms_rad
    # 0 is allowed, and no unit can be wrong about it
    if b == 0:
        return []
    return judged(
        s,
        "mechanical time constant",
        s.table.inertia_kgm2 / b,
        "s",
        TIME_CONSTANT_S,
        "inertia_kgm2 over viscous_nms_rad",
        f"viscous_nms_rad: {b:g} is meant in N m s/rad at the link, guaranteed (friction without its dry "
        "part), inertia_kgm2 in kg m^2",
    )


def viscous_torque(s: Subject) -> list[Verdict]:
    """What the guaranteed damping alone would take at full speed."""
    b = s.table.viscous_nms_rad
    if b == 0:
        return []
    return judged(
        s,
        "viscous torque at the velocity limit",
        b * s.table.velocity_limit_rad_s / s.table.torque_limit_nm,
        "",
        VISCOUS_SHARE,
        "viscous_nms_rad times velocity_limit_rad_s, as a share of torque_limit_nm",
        f"viscous_nms_rad: {b:g} is meant in N m s/rad at the link; velocity_limit_rad_s in rad/s",
    )


def force_at_the_handle(s: Subject) -> list[Verdict]:
    """What the torque limit is in the hand, by the lever that turns the force sensor's newtons into
    torque."""
    lever = math.hypot(*s.table.lever_m)  # direction x arm: its length is the arm across
    if lever == 0:  # only a torque about `axis_direction` counts
        return []
    slides = s.table.motion == "linear"
    return judged(
        s,
        "force at the handle at the torque limit",
        s.table.torque_limit_nm / lever,
        "N",
        HANDLE_FORCE_N,
        f"torque_limit_nm over the length of lever_m, {lever:.3g}",
        f"lever_m: {list(s.table.lever_m)} is meant "
        + (
            "as shares of the force, without a unit"
            if slides
            else "in m, from the joint to the handle (60 mm is 0.06)"
        ),
    )


def dry_friction(s: Subject) -> list[Verdict]:
    """The dry friction that the rig file vouches for: proofs count on it, so too much of it proves what is
    not so."""
    f = s.table.dry_friction_nm
    if f == 0:  # nothing is vouched for
        return []
    return judged(
        s,
        "guaranteed dry friction over the torque limit",
        f / s.table.torque_limit_nm,
        "",
        DRY_SHARE,
        "dry_friction_nm, as a share of torque_limit_nm",
        f"dry_friction_nm: {f:g} is meant in N m at the link, the least that the joint ever has",
    )


def counts_of_the_travel(s: Subject) -> list[Verdict]:
    """How finely the encoder divides what the joint moves over: also where no coupling turns a count into
    torque."""
    table = s.table
    # of a joint with a huge travel a turn: counts are of what a hand moves over
    travel = min(
        table.position_max_rad - table.position_min_rad, 1.0 if table.motion == "linear" else 2 * math.pi
    )
    return judged(
        s,
        "encoder counts over the travel",
        travel / s.axis.count_rad,  # of what it moves over, whole turns aside
        "",
        TRAVEL_COUNTS,
        "a metre, or less travel" if table.motion == "linear" else "a turn, or less travel",
        f"encoder_counts_per_rev: {table.encoder_counts_per_rev:g} are meant per {_turn_of(table)}; see "
        "position_min_rad and position_max_rad, too",
    )


def time_to_speed(s: Subject) -> list[Verdict]:
    """How soon the torque limit brings the joint to its velocity limit: sooner than a few ticks, and any
    touch is a fault."""
    table = s.table
    return judged(
        s,
        "time to the velocity limit",
        table.velocity_limit_rad_s * table.inertia_kgm2 / table.torque_limit_nm,
        "s",
        TIME_TO_SPEED_S,
        "velocity_limit_rad_s times inertia_kgm2 over torque_limit_nm",
        f"velocity_limit_rad_s: {table.velocity_limit_rad_s:g} is meant in rad/s at the link; see "
        "inertia_kgm2 and torque_limit_nm, too",
    )
