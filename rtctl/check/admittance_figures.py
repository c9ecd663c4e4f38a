"""Every figure of an axis that is displayed as an admittance: its loop as the certificate takes it, and what
that finds."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

from rtctl.check.drive_of_axis import drive_of
from rtctl.control.proofs.less_late import quicker_sensors

if TYPE_CHECKING:
    from hw.interface import Joint
    from rtctl.check.axis_report import AxisFigures
    from rtctl.control.proofs.admittance_counts import Hunting
    from rtctl.control.proofs.admittance_help import Helped
    from rtctl.control.proofs.admittance_loop import AdmittanceLoop
    from rtctl.control.proofs.admittance_margin import Finding
    from rtctl.control.proofs.admittance_proof import Proof
    from rtctl.control.proofs.admittance_sticking import Sticking
    from rtctl.rig_file.axis_tables import AxisTable

BRISTLES_TO, SHORTER_TO = 4.0, 16.0
"""A presliding length that was measured is at most four times too long, one that was assumed or is a bound
sixteen times. On sixteen times stiffer ones velocity gains fail, from 130 Hz on (decision 0058)."""

FADING = (0.1, 0.3, 0.6, 0.85)
"""Shares of the torque at which a display that fades is tried."""


@dataclass(frozen=True)
class AdmittanceFigures:
    """What is found of one axis. Units are in the names; the box of hands is the rig file's."""

    radius: float
    """Largest |eigenvalue| of one period over the grid, a joint that slides, whatever lies between law and
    joint up to the declared, for every mass that may be asked for and every share of the torque that is
    tried."""
    points: int
    worst: str
    """Hand, joint and world of that point."""
    stable: bool
    proved: bool
    """Between the points, too, at the declared delay and lag."""
    cells: int
    not_proved_at: str
    stuck_radius: float | None
    """Largest |eigenvalue| for a joint that sticks on its bristles; None where there is no dry friction."""
    stuck_worst: str
    """Hand, joint and world there; empty where nothing grows."""
    stuck_speed_rad_s: float
    """Speed, RMS, with which what grows there shakes the joint."""
    rest_damping_min_nms_rad: float
    """Least `rest_damping_nms_rad` with which nothing grows there; 0: none does, or nothing grows as it
    is."""
    rubbing_radius: float
    """Largest |eigenvalue| with dry friction taken for damping of every size."""
    rubbing_damping_nms_rad: float
    """The damping at which that is."""
    rubbing_worst: str
    """Hand, joint and world there; empty where nothing grows."""
    helped: Helped
    """The swing that help with dry friction feeds most; the next: share of the friction up to which help
    leaves nothing growing."""
    help_share_max: float
    damping_kept: float
    """Least share of its ideal damping that a vibration keeps."""
    hand_stiffness_max_nm_rad: float
    """Up to which every hand passes in every linear world; the next one: in free motion."""
    hand_stiffness_max_free_nm_rad: float
    mass_min_kgm2: float
    """Least that passes at these gains; 0: none does."""
    damping_min_nms_rad: float
    """Least virtual damping, no less than the rig file's, that passes with its mass; 0: none does."""
    mass_min_continuous_kgm2: float
    """From which on it would be passive without any lag, in any hand."""
    sensor_min_hz: float
    """Own low-pass of the force sensor down to which the certificate holds; infinite: down to none that is
    tried."""


def loop_of(figures: AxisFigures, table: AxisTable, joint: Joint, period_s: float) -> AdmittanceLoop:
    """The loop of an axis as `admittance_loop` wants it."""
    # here, since the names of a report must not load the compiler
    from rtctl.control.proofs.admittance_loop import AdmittanceLoop, Box
    from rtctl.control.virtual_mass import MASS_REST_HZ

    a = table.admittance
    drive = drive_of(table, joint, period_s, figures.between, figures.force_way)
    drive = replace(
        drive,
        viscous_nms_rad=figures.total_damping_nms_rad,
        force_lowpass_hz=a.force_lowpass_hz,
        bristle_nm_rad=figures.guarantee.bristle_nm_rad,
    )
    return AdmittanceLoop(
        **vars(drive),
        mass_kgm2=a.mass_kgm2,
        virtual_damping_nms_rad=a.damping_nms_rad,
        velocity_gain_nms_rad=a.velocity_gain_nms_rad,
        position_gain_nm_rad=a.position_gain_nm_rad,
        mass_max_kgm2=a.mass_max_kgm2,
        # two low-passes one behind the other: that of the intake, and that of the mass
        intake_lowpass_hz=table.force.lowpass_hz,
        velocity_lowpass_hz=a.velocity_lowpass_hz,
        feedforward=a.sent_ahead(table.inertia_kgm2),
        feedforward_lowpass_hz=a.feedforward_lowpass_hz,
        help_share=_help_share(figures, a.compensation_share),
        help_turns_rad=figures.friction.presliding_rad if figures.friction else 0.0,
        told_viscous_nms_rad=table.viscous_nms_rad,
        presliding_rad=figures.guarantee.length_rad,
        bristles_to=SHORTER_TO if figures.guarantee.may_be_shorter else BRISTLES_TO,
        rest_damping_nms_rad=a.rest_damping_nms_rad,
        rest_hz=MASS_REST_HZ,
        box=Box(a.hand_stiffness_nm_rad, a.hand_damping_nms_rad, a.hand_inertia_kgm2),
    )


def _help_share(figures: AxisFigures, compensation_share: float) -> float:
    """Share of the dry friction that is helped with at most while a mass is shown."""
    if figures.friction is None or not figures.compensates:
        return 0.0
    return compensation_share * figures.friction.helped_share


@dataclass(frozen=True)
class Judged:
    """What a loop is refused by, without the search for what would pass: no proof where a point grows, no
    sticking without dry friction."""

    found: Finding
    proof: Proof | None
    stuck: Sticking | None
    rubbing: Finding
    rubbing_damping_nms_rad: float
    helped: Helped

    @property
    def stable(self) -> bool:
        """A joint that slides."""
        return self.found.ok and not (self.proof and self.proof.unstable)

    @property
    def ok(self) -> bool:
        """Nothing grows, sliding, sticking, rubbing or helped."""
        return self.stable and self.rubbing.ok and self.helped.ok and not (self.stuck and self.stuck.at)


@lru_cache(maxsize=64)
def judged(loop: AdmittanceLoop) -> Judged:
    """Half of what is found of a loop."""
    from rtctl.control.proofs import admittance_help
    from rtctl.control.proofs import admittance_margin as margin

    found = margin.judge(loop)
    # of the declared loop the whole grid, of all that it may be beside that the hands that decide
    others = (*faster(loop), *quicker_sensors(loop), *fading(loop), *heavier(loop)) if found.ok else ()
    found = next((one for one in map(margin.judge_stiffest, others) if not one.ok), found)
    proof = margin.proof(loop) if found.ok else None  # ten thousand cells: not where a point grows already
    masses = (loop, *heavier(loop))
    stuck = _sticking(masses) if loop.bristle_nm_rad > 0 else None
    rubbing = max(map(margin.judge_rubbing, masses), key=lambda one: _growth(one[0]))
    helped = max(map(admittance_help.judge_help, masses), key=lambda one: one.growth_1_s)
    return Judged(found, proof, stuck, *rubbing, helped)


@lru_cache(maxsize=64)
def figures_of(loop: AdmittanceLoop) -> AdmittanceFigures:
    """Everything that is found of a loop. Some two seconds; the same loop is not asked twice."""
    from rtctl.control.proofs import admittance_help
    from rtctl.control.proofs import admittance_margin as margin

    one, masses = judged(loop), (loop, *heavier(loop))
    found, proof, stuck, rubbing = one.found, one.proof, one.stuck, one.rubbing
    return AdmittanceFigures(
        radius=found.radius,
        points=found.points,
        worst=found.at if proof is None or not proof.unstable else proof.at,
        stable=one.stable,
        proved=proof is not None and proof.proved,
        cells=proof.cells if proof else 0,
        not_proved_at=proof.at if proof else "",
        stuck_radius=stuck.finding.radius if stuck else None,
        stuck_worst=stuck.at if stuck else "",
        stuck_speed_rad_s=stuck.speed_rad_s if stuck else 0.0,
        rest_damping_min_nms_rad=_rest_damping(masses) if stuck and stuck.at else 0.0,
        rubbing_radius=rubbing.radius,
        rubbing_damping_nms_rad=one.rubbing_damping_nms_rad,
        rubbing_worst="" if rubbing.ok else rubbing.at,
        helped=one.helped,
        help_share_max=loop.help_share if one.helped.ok else min(map(admittance_help.largest_help, masses)),
        damping_kept=found.kept,
        hand_stiffness_max_nm_rad=margin.largest_hand(loop),
        hand_stiffness_max_free_nm_rad=margin.largest_hand(loop, world=False),
        mass_min_kgm2=margin.smallest_mass(loop),
        damping_min_nms_rad=loop.virtual_damping_nms_rad if one.stable else margin.least_damping(loop),
        mass_min_continuous_kgm2=margin.mass_min_continuous(
            loop.inertia_kgm2, loop.viscous_nms_rad, loop.velocity_gain_nms_rad
        ),
        sensor_min_hz=margin.slowest_sensor(loop) if one.stable else math.inf,
    )


@lru_cache(maxsize=64)
def hunting_of(loop: AdmittanceLoop, held: bool) -> Hunting:
    """The fastest hunting about encoder counts of all masses; `held`: the law holds a flicker."""
    from rtctl.control.proofs.admittance_counts import hunting

    return max((hunting(one, held=held) for one in (loop, *heavier(loop))), key=lambda one: one.counts_1_s)


@lru_cache(maxsize=64)
def creeping_of(loop: AdmittanceLoop) -> Hunting:
    """The fastest ringing of a joint that creeps from count to count, of every mass that may be asked for."""
    from rtctl.control.proofs.admittance_counts import creeping

    return max((creeping(one) for one in (loop, *heavier(loop))), key=lambda one: one.counts_1_s)


def calming_hunt(loop: AdmittanceLoop, most_counts_1_s: float) -> float:
    """Damping at rest with which no mass hunts faster where a flicker is held, N m s/rad; 0: none that is
    tried."""
    from rtctl.control.proofs.admittance_counts import calming_rest_damping

    found = [calming_rest_damping(one, most_counts_1_s) for one in (loop, *heavier(loop))]
    return max(found) if all(found) else 0.0


def _sticking(loops: tuple[AdmittanceLoop, ...]) -> Sticking:
    """The one of these whose joint is shaken the fastest while it sticks."""
    from rtctl.control.proofs.admittance_sticking import sticking

    return max(map(sticking, loops), key=lambda one: (one.speed_rad_s, _growth(one.finding)))


def _rest_damping(loops: tuple[AdmittanceLoop, ...]) -> float:
    """Least damping at rest that calms all of these, N m s/rad; 0: none does."""
    from rtctl.control.proofs.admittance_sticking import calming_rest_damping

    found = [calming_rest_damping(one) for one in loops]
    return max(found) if all(found) else 0.0


def _growth(found: Finding) -> float:
    """What orders findings, the worst last; one that is no number is the worst."""
    return math.inf if math.isnan(found.radius) else found.radius


def faster(loop: AdmittanceLoop) -> list[AdmittanceLoop]:
    """The loop with every whole delay below the declared, with and without the current loop's lag, and with
    samples that are fresh in every tick."""
    delays = [*map(float, range(math.ceil(loop.delay))), loop.delay]  # a little less delay may be worse (2.4)
    lags = [0.0, loop.lag_hz] if loop.lag_hz > 0 else [0.0]
    ages = sorted({1, loop.sample_ticks})
    every = [
        replace(loop, delay=delay, lag_hz=lag, sample_ticks=age)
        for delay in delays
        for lag in lags
        for age in ages
    ]
    return [one for one in every if one != loop]


def fading(loop: AdmittanceLoop) -> list[AdmittanceLoop]:
    """The loop at shares of its torque: a soft start, or a display that is changed, goes through all of them,
    with more damping (`virtual_mass`)."""
    return [
        replace(
            loop,
            virtual_damping_nms_rad=loop.virtual_damping_nms_rad + (1 - share) * loop.velocity_gain_nms_rad,
            velocity_gain_nms_rad=share * loop.velocity_gain_nms_rad,
            position_gain_nm_rad=share * loop.position_gain_nm_rad,
            feedforward=share * loop.feedforward,
        )
        for share in FADING
    ]


def heavier(loop: AdmittanceLoop) -> list[AdmittanceLoop]:
    """The loop with heavier masses that a client may ask for."""
    if loop.mass_max_kgm2 <= loop.mass_kgm2:
        return []
    ratio = loop.mass_max_kgm2 / loop.mass_kgm2  # the middle of a range of ratios, and its end
    return [replace(loop, mass_kgm2=loop.mass_kgm2 * ratio**share, mass_max_kgm2=0.0) for share in (0.5, 1.0)]
