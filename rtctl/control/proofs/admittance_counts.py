"""How fast does an admittance hunt about the counts of its encoder, at most?

Pure functions of numbers, on `admittance_loop`. Of a swing of A counts the readings swing by N times as much,
by the describing function of steps

    N(A) = 2/(pi A) sum_i sqrt(1 - (t_i/A)^2)

(t_i: the edges between two counts that are within A of the swing's middle)

from nothing within a count to 2/(pi A) across one edge. Where the loop grows with N of the joint's motion
seen it may swing on at that A, and A w/sqrt(2) counts a second is how fast it shakes the hand
(docs/theory.md 2.17). Where the law holds a flicker (`control.flicker`) no swing within it lasts: it is blind
then, the force moves the mass slowly, and that must rest by itself."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from rtctl.control.flicker import WIDE, blind_damping_nms_rad, blind_hz
from rtctl.control.proofs.admittance_loop import (
    AdmittanceLoop,
    Points,
    Swing,
    eigenvalues_of,
    fine_worlds,
    matrices,
)
from rtctl.control.proofs.admittance_margin import edge
from rtctl.control.proofs.admittance_sticking import SOFTER, judge_stuck

LESS = (
    (0.0, 0.5),
    (0.3, 0.53),
    (0.6, 0.56),
    (0.67, 1.0),
    (0.8, 1.06),
    (0.82, 1.52),
    (0.88, 2.05),
    (0.914, 2.55),
)
"""Shares of a swing that the readings show at least, and up to how many counts of amplitude they may show so
little: about the worst place."""

MORE = (
    *((1.04, 2.45), (1.06, 1.9), (1.11, 1.35), (1.25, 0.8)),
    *((share, 2 / (math.pi * share)) for share in np.geomspace(1.3, 40.0, 12).tolist()),
)
"""And so much; from 1.3 on across a single edge."""

HELD_COUNTS = 0.5 * (WIDE + 2.0)
"""Largest amplitude of what grows while a flicker is held: then that ends."""

FLICKER_COUNTS = 0.5 * WIDE
"""A swing up to this is a flicker."""

_LATE_TICKS = 0.5
"""A swing of few samples may lie so that each comes late after its edge, by half a sample more than on the
average."""

_WORLDS = 7
"""Springs of worlds: one a decade."""
_SLOWEST_RAD_S = 2 * math.pi
"""Growth that turns more slowly than once a second counts as none (docs/theory.md 2.17)."""
_DAMPINGS = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Damping at rest that is tried, in velocity gains."""

_CREPT_COUNTS = 1.5 / math.pi
"""What the readings of a joint that creeps err by as each edge is crossed: 1/pi is the first harmonic of a
sawtooth of half a count to either side, 2/pi the most that any error of half a count has. A ring that turns
back over an edge is between them, by up to 1.5 of the first wherever one was followed."""
_EDGES_HZ = (5.0, 200.0)
_EDGES = 24
"""Edges a second that are tried, and how many of such speeds."""


@dataclass(frozen=True)
class Hunting:
    """The fastest hunting."""

    counts_1_s: float
    """Speed, RMS, in counts a second; 0: none."""
    at: str = ""
    """The hand, joint and world of that."""


def hunting(loop: AdmittanceLoop, *, held: bool) -> Hunting:
    """The fastest over hands without damping, worlds and the joint's bristles; `held`: the law holds a
    flicker."""
    shares = (*SOFTER, *(4.0**n for n in range(round(math.log(loop.bristles_to, 4)) + 1)))
    stuck = [share * loop.bristle_nm_rad for share in shares] if loop.bristle_nm_rad > 0 else [0.0]
    # a relay of few samples may see each edge late
    late = replace(loop, delay=loop.delay + _LATE_TICKS * loop.sample_ticks)
    tried = [(loop, bristle, *one) for bristle in stuck for one in LESS]
    tried += [(late if counts < LESS[0][1] else loop, stuck[-1], seen, counts) for seen, counts in MORE]
    if held:
        # within a flicker the reading is held: no swing lasts
        tried = [one for one in tried if one[-1] > FLICKER_COUNTS]
        tried += [(_blind(loop), bristle, 0.0, HELD_COUNTS) for bristle in stuck]
    return max((_fastest(*one) for one in tried), key=lambda one: one.counts_1_s)


def creeping(loop: AdmittanceLoop) -> Hunting:
    """How fast a joint rings at most that creeps from count to count: by itself where no flicker is held, or
    by the edges that it crosses (docs/theory.md 2.17)."""
    return max(hunting(loop, held=False), _crept(loop), key=lambda one: one.counts_1_s)


def _crept(loop: AdmittanceLoop) -> Hunting:
    """What the loop that sees its joint makes of the error of its readings, on the stiffest bristles: those
    answer fastest."""
    at, blind, sight = _seeing(loop, loop.bristles_to * loop.bristle_nm_rad)
    sample_s = loop.sample_ticks * loop.period_s
    # beyond .4 of the rate of fresh samples a sawtooth has fewer than three of them, and is none
    slowest, quickest = 2 * math.pi * _EDGES_HZ[0], 2 * math.pi * min(_EDGES_HZ[1], 0.4 / sample_s)
    even = np.broadcast_to(np.geomspace(slowest, quickest, _EDGES), (at.size, _EDGES)).T
    # a ring is narrower than the even steps: asked where its root lies, too, or the worst point is missed
    own = np.abs(np.angle(eigenvalues_of(loop, blind + sight))).T / loop.period_s
    turns = np.concatenate([even, np.clip(np.nan_to_num(own, posinf=quickest), slowest, quickest)])
    speeds = _answered(loop, blind, sight, turns)
    quickest_at, worst = np.unravel_index(np.argmax(speeds), speeds.shape)
    one, step = slice(worst, worst + 1), even[1, 0] / even[0, 0]
    near = turns[quickest_at, worst] * np.geomspace(1 / step, step, 4 * _EDGES + 1)[:, None]
    speed = float(_answered(loop, blind[one], sight[one], near).max())
    return Hunting(_CREPT_COUNTS * speed / math.sqrt(2.0), at.words(loop, int(worst)))


def _answered(loop: AdmittanceLoop, blind: np.ndarray, sight: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Speed of the joint for a reading that errs by 1, of each point at each of its turns, rad/s: shape
    (turns, points), as `turns` has it."""
    # the loop is one of a whole frame: z goes on by the time between fresh samples, not by a tick
    z = np.exp(1j * turns * loop.sample_ticks * loop.period_s)[:, :, None, None]
    error = np.broadcast_to(sight[:, :, :1].astype(complex), (len(turns), *sight.shape[:2], 1))
    answer = np.linalg.solve(z * np.eye(sight.shape[1]) - blind - sight, error)[:, :, 0, 0]
    return np.nan_to_num(np.abs(answer) * turns, nan=math.inf)  # no number is the worst number


def calming_rest_damping(loop: AdmittanceLoop, most_counts_1_s: float) -> float:
    """Damping of the mass on a joint that sticks with which it hunts no faster where a flicker is held, N m
    s/rad; 0: none of those tried."""
    for damping in (share * loop.velocity_gain_nms_rad for share in _DAMPINGS):
        one = replace(loop, rest_damping_nms_rad=damping)
        if damping > loop.rest_damping_nms_rad and hunting(one, held=True).counts_1_s <= most_counts_1_s:
            # more damping at rest may ring where the joint sticks
            return damping if judge_stuck(one).ok else 0.0
    return 0.0


def _blind(loop: AdmittanceLoop) -> AdmittanceLoop:
    """The loop while it does not see the joint (`virtual_mass`)."""
    damping = blind_damping_nms_rad(loop.rest_damping_nms_rad, loop.velocity_gain_nms_rad)
    return replace(loop, force_lowpass_hz=blind_hz(loop.force_lowpass_hz), rest_damping_nms_rad=damping)


def _fastest(loop: AdmittanceLoop, bristle_nm_rad: float, seen: float, counts: float) -> Hunting:
    """The fastest of what grows where so much of the joint's motion is seen, in a swing of so many counts."""
    turns_1_s, at = _quickest(loop, bristle_nm_rad, seen)
    return Hunting(counts * turns_1_s / math.sqrt(2.0), at)


@lru_cache(maxsize=1024)
def _quickest(loop: AdmittanceLoop, bristle_nm_rad: float, seen: float) -> tuple[float, str]:
    """The quickest of what grows, rad/s, and the hand, joint and world of that; 0: nothing does. A hunt that
    creeps asks the same again."""
    at, blind, sight = _seeing(loop, bristle_nm_rad)
    z = eigenvalues_of(loop, blind + seen * sight)
    turns = np.abs(np.angle(z)) / loop.period_s
    grows = ~(np.abs(z) <= edge(loop)) & ~(turns <= _SLOWEST_RAD_S)  # so written that NaN grows
    speeds = np.where(grows, np.nan_to_num(turns, nan=math.inf), 0.0).max(axis=1)
    # the quickest to turn, not to grow: at a given amplitude speed goes with the frequency alone
    worst = int(np.argmax(speeds))
    return float(speeds[worst]), at.words(loop, worst) if speeds[worst] > 0 else ""


@lru_cache(maxsize=1)
def _seeing(loop: AdmittanceLoop, bristle_nm_rad: float) -> tuple[Points, np.ndarray, np.ndarray]:
    """Points, their closed loops where nothing of the joint's motion is seen, and what is added to them where
    all is: they are linear in it."""
    at = fine_worlds(loop, only_stiffest=False, count=_WORLDS)
    at, none = replace(at, bristle=np.full(at.size, bristle_nm_rad)), np.zeros(at.size)
    blind, sees = (matrices(loop, at, Swing(none, none, none, np.full(at.size, seen))) for seen in (0.0, 1.0))
    return at, blind, sees - blind
