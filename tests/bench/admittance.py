"""Admittance displays in time: random rigs that `rtctl check` certifies, in hands and worlds of its box, by a
fine integration.

The joint is Newton's law by Runge and Kutta, the law its lines written anew: nothing of `admittance_loop` but
the numbers of a rig goes in. Run as `python -m tests.bench.admittance --rigs 200 --points 50`: 10,000 pairs
of a certified rig with a hand and a world. Prints how many diverge, and at what share of the stiffest hand
that passes a rigid joint begins to.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rtctl.control.proofs import admittance_margin
from rtctl.control.proofs.admittance_loop import (
    AdmittanceLoop,
    Box,
    Points,
    fine_worlds,
    points,
    spectral_radii,
)
from rtctl.control.proofs.drive_in_hand import BRISTLE_DAMPING_SHARE, RIGID, resonance
from tests.bench.row import Row, table

Array = NDArray[np.float64]

GROWN = 1e-4
"""Growth per tick that counts: less is what the estimate errs by."""

_WORLDS, _LOOKED_AT = 150, 8
"""Springs of the worlds, and how many points the integration is asked about."""

SHARES = (0.95, 0.97, 1.0, 1.03, 1.06, 1.1, 1.2, 1.5)


class _Joint:
    """Newton's law of motor, link and hand, for all points at once."""

    def __init__(self, loop: AdmittanceLoop, at: Points) -> None:
        self.loop, self.at, joint = loop, at, loop.joints[0]
        self.rigid = joint.stiffness_nm_rad == 0
        self.share, self.k_j, self.b_j = joint.link_share, joint.stiffness_nm_rad, joint.damping_nms_rad
        own = loop.viscous_nms_rad - (0.0 if self.rigid else loop.link_viscous_nms_rad)
        self.b_m = own + BRISTLE_DAMPING_SHARE * 2 * np.sqrt(at.bristle * loop.inertia_kgm2)
        self.b_l = loop.link_viscous_nms_rad
        self._maps: dict[float, tuple[Array, Array]] = {}

    def rates(self, y: Array, command: Array) -> tuple[Array, Array]:
        """dy/dt of (x, v, link's x, link's v, torque, what the sensor shows), and what it shows: the hand's
        torque, where it has no low-pass.
        """
        at, J = self.at, self.loop.inertia_kgm2
        x, v, X, V, torque, shown = y
        acting = torque if self.loop.lag_hz else command
        passive = acting - self.b_m * v - at.bristle * x
        if self.rigid:
            a = (passive - at.b_h * v - at.k_h * x) / (J + at.m_h)
            A, V, X = a, v, x
        else:
            twist = self.k_j * (x - X) + self.b_j * (v - V)
            a = (passive - twist) / ((1 - self.share) * J)
            A = (twist - self.b_l * V - at.b_h * V - at.k_h * X) / (self.share * J + at.m_h)
        lag = 2 * math.pi * self.loop.lag_hz * (command - torque)
        hand, cut = -(at.m_h * A + at.b_h * V + at.k_h * X), 2 * math.pi * self.loop.sensor_hz
        return np.array([v, a, V, A, lag, cut * (hand - shown)]), shown if cut else hand

    def advance(self, y: Array, command: Array, span: float, substeps: int) -> Array:
        """The state `span` seconds later, the torque's command held.

        The law of motion is linear, and so are its steps: where unit states and a unit command go in so long
        is integrated once, and all others are sums of these.
        """
        if span not in self._maps:
            none, one = np.zeros(self.at.size), np.ones(self.at.size)
            units = np.eye(6)[:, :, None] * one
            own = np.stack([self.integrated(unit, none, span, substeps) for unit in units], axis=1)
            self._maps[span] = own, self.integrated(np.zeros_like(y), one, span, substeps)
        own, pushed = self._maps[span]
        return np.asarray((own * y).sum(axis=1) + pushed * command)

    def integrated(self, y: Array, command: Array, span: float, substeps: int) -> Array:
        """The state `span` seconds later, by Runge and Kutta."""
        h = span / substeps
        for _ in range(substeps if span > 0 else 0):
            r1, _ = self.rates(y, command)
            r2, _ = self.rates(y + h / 2 * r1, command)
            r3, _ = self.rates(y + h / 2 * r2, command)
            r4, _ = self.rates(y + h * r3, command)
            y = y + h / 6 * (r1 + 2 * r2 + 2 * r3 + r4)
        return y


def _filtered(old: Array, new: Array, hz: float, period_s: float) -> Array:
    return new if hz == 0 else new + math.exp(-2 * math.pi * hz * period_s) * (old - new)


def growth_in_time(loop: AdmittanceLoop, at: Points, ticks: int = 1200, substeps: int = 4) -> Array:
    """Growth per tick of a random motion of every point, the first joint: its size late over its size
    before.
    """
    rng, n, T = np.random.default_rng(7), at.size, loop.period_s
    joint = _Joint(loop, at)
    y = np.zeros((6, n))
    y[0] = y[2] = rng.normal(size=n)
    sent = [np.zeros(n)] * 12  # newest last
    whole, rest = int(loop.delay), loop.delay - int(loop.delay)
    before, v_hat, v_r, x_r, sensed = y[0], np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    felt, sizes, forces = rng.normal(size=n), [], [np.zeros(n)] * (1 + loop.sensor_ticks)
    m, b_v, ahead = loop.mass_kgm2, loop.virtual_damping_nms_rad, np.zeros(n)
    for tick in range(ticks):
        x = y[0] if loop.encoder == "motor" or joint.rigid else y[2]
        if tick % loop.sample_ticks == 0:
            forces = [*forces[1:], joint.rates(y, sent[-1 - whole])[1]]
            sensed = _filtered(sensed, forces[0], loop.intake_lowpass_hz, T)
            felt = _filtered(felt, sensed, loop.force_lowpass_hz, T)
            span = loop.sample_ticks * T
            v_hat = _filtered(v_hat, (x - before) / span, loop.velocity_lowpass_hz, span)
            before = x
        slower = v_r
        v_r = (m * v_r + T * (felt - at.k_e * x_r)) / (m + T * (b_v + at.b_e) + T * T * at.k_e)
        x_r = x_r + T * v_r
        asked = loop.inertia_kgm2 * (v_r - slower) / T + loop.told_viscous_nms_rad * v_r - felt
        ahead = _filtered(ahead, asked, loop.feedforward_lowpass_hz, T)
        command = loop.velocity_gain_nms_rad * (v_r - v_hat) + loop.position_gain_nm_rad * (x_r - before)
        command = command + loop.feedforward * ahead
        y = joint.advance(y, sent[-1 - whole], rest * T, substeps)
        sent = [*sent[1:], command]
        y = joint.advance(y, sent[-1 - whole], (1 - rest) * T, substeps)
        sizes.append(np.abs(x) + np.abs(x_r) + 0.01 * np.abs(y[1]) + 0.01 * np.abs(v_r))
    early, late = (np.max(sizes[a : a + ticks // 6], axis=0) for a in (ticks // 3, 5 * ticks // 6))
    return np.asarray((late / early) ** (1 / (ticks // 2)))


def diverging(loop: AdmittanceLoop, at: Points, ticks: int = 1200) -> int:
    """Number of points whose motion grows. One that seems to is looked at for longer, twice: a heavy virtual
    mass with little damping drifts for seconds before it stands.
    """
    for longer in (1, 6, 40):
        grown = growth_in_time(loop, at, longer * ticks)
        at = at[np.flatnonzero(~(grown <= 1 + GROWN / longer))]
        if at.size == 0:
            break
    return at.size


def random_rig(rng: np.random.Generator, elastic: float = 0.3) -> AdmittanceLoop:
    """A rig somewhere between a light and a heavy joint, with lags as they occur."""
    J = float(10 ** rng.uniform(-3, -1))
    scale = J / 0.012
    joint = resonance(J, float(rng.uniform(30, 100))) if rng.random() < elastic else RIGID
    viscous = float(rng.uniform(1.0, 10.0)) * J
    return AdmittanceLoop(
        inertia_kgm2=J,
        viscous_nms_rad=viscous,
        told_viscous_nms_rad=viscous,
        feedforward=float(rng.choice([0.0, 1.0])),
        feedforward_lowpass_hz=20.0,
        period_s=float(rng.choice([5e-4, 1e-3])),
        mass_kgm2=float(rng.uniform(0.5, 2.0)) * J,
        virtual_damping_nms_rad=float(10 ** rng.uniform(-1.3, 0)) * scale,
        velocity_gain_nms_rad=float(rng.uniform(0.5, 3.0)) * scale,
        position_gain_nm_rad=float(rng.choice([0.0, 10.0])) * scale,
        force_lowpass_hz=float(rng.uniform(80, 300)),
        velocity_lowpass_hz=float(rng.uniform(80, 300)),
        delay=float(rng.uniform(0, 2)),
        lag_hz=float(rng.choice([0.0, 400.0])),
        sensor_hz=float(rng.choice([0.0, 10 ** rng.uniform(1.5, 3)])),
        sensor_ticks=int(rng.integers(0, 4)),
        link_viscous_nms_rad=0.4 * viscous,
        joints=(joint,),
        box=Box(float(rng.uniform(50, 600)) * scale, scale, 1.5 * J),
    )


def certified(rng: np.random.Generator, count: int, elastic: float = 0.3) -> Iterator[AdmittanceLoop]:
    """Random rigs that are proved, each with the least mass of a row of growing ones: near the edge."""
    while count > 0:
        loop = random_rig(rng, elastic)
        for _ in range(12):
            if admittance_margin.judge(loop).ok:
                break
            loop = replace(loop, mass_kgm2=1.3 * loop.mass_kgm2)
        if admittance_margin.judge(loop).ok and admittance_margin.proof(loop).proved:
            count -= 1
            yield loop


def random_points(rng: np.random.Generator, loop: AdmittanceLoop, count: int) -> Points:
    """Hands of the box and worlds, many at its edges."""
    box = loop.box

    def up_to(most: float) -> float:
        return float(most * rng.choice([0.0, 1.0, rng.random(), 10 ** rng.uniform(-3, 0)]))

    rows = [
        (
            up_to(box.stiffness_nm_rad),
            up_to(box.damping_nms_rad),
            up_to(box.inertia_kgm2),
            0.0,
            0,
            float(rng.choice([0.0, 10 ** rng.uniform(-1, 6)])),
            up_to(1.0),
        )
        for _ in range(count)
    ]
    return points(rows)


def share_at_which_one_grows(loop: AdmittanceLoop, ticks: int = 6000) -> float:
    """Least of `SHARES` of the stiffest hand that passes at which the motion grows in some world; infinite if
    at none.

    The matrices choose which hands and worlds are looked at, the integration says whether they grow.
    """
    most = admittance_margin.largest_hand(loop)
    for share in SHARES:
        one = replace(loop, box=replace(loop.box, stiffness_nm_rad=share * most))
        at = fine_worlds(one, only_stiffest=True, count=_WORLDS)
        at = at[np.argsort(-spectral_radii(one, at))[:_LOOKED_AT]]
        if growth_in_time(one, at, ticks).max() > 1 + GROWN * 1200 / ticks:
            return share
    return math.inf


def main() -> None:
    """Run rigs and print the rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rigs", type=int, default=200)
    parser.add_argument("--points", type=int, default=50)
    parser.add_argument("--edges", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng, unstable = np.random.default_rng(given.seed), 0
    for loop in certified(rng, given.rigs):
        unstable += diverging(loop, random_points(rng, loop, given.points))
    edges = [share_at_which_one_grows(loop) for loop in certified(rng, given.edges, elastic=0.0)]
    total = given.rigs * given.points
    rows = [
        Row(f"certified rigs that diverge, of {total}", unstable, "", "a fine integration", 0.0),
        Row("least share of the stiffest hand at which one grows", min(edges), "", "the same", 0.97, ">="),
        Row("largest", max(edges), "", "the same", 1.1),
    ]
    sys.stdout.write("\n".join([*table(rows), ""]))


if __name__ == "__main__":
    main()
