"""Is an admittance display that `rtctl check` certifies stable in the hands it is certified for?
`rtctl campaign --admittance`.

Every rig follows from `(seed, index)` alone: a plant of the mock's family, with all of its friction and the
help with it of the rig file's learned model and observer, or with a hundredth and more of its friction and no
help; random mass, damping, gains, a force sensor with a low-pass and delay of its own or none, and a random
box of hands. A rig that the certificate refuses, or does not prove, is drawn again, and counted. Each rig is
held by `PAIRS` hands of its box, at its corners and inside, most of them with hardly any damping, in random
worlds. The law runs as it is but for watch and account, which would calm what the certificate let through.

The judge knows the truth only: the hand swings the joint for a moment, then holds still. What is stable comes
to rest. What still moves at the end, no slower than before, shakes. A rig that rings where the joint sticks
on its bristles is refused; it is run with the damping at rest that the refusal names. Hands in worlds that
are not linear, of which the certificate says that they are not proved, are counted apart."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hw.simulators.mock_records import Hand
from rtctl.control.vocabulary import State
from rtctl.errors import FaultError
from rtctl.simulation import campaign_workers
from rtctl.simulation.campaign_certified_pairs import PAIRS, TRIES, Pair, Rig, drawn, pair
from rtctl.simulation.closed_loop import Simulation

QUIET_RAD_S = 0.002
SWING_S, REST_S = 0.6, 5.0
WINDOW_S = 1.5
DOUBT_S = 20.0
"""Time given to what still moves after `REST_S`."""
# what falls to 1/e in less than 1.5 / -ln .98 = 74 s dies away; after `DOUBT_S` more in less than 990 s
GROWS = 0.98
"""Peak of the last window over that of the window before, from which on it does not come to rest."""
_FRICTIONS = ("coulomb_nm", "breakaway_nm", "bristle_max_nm", "bristle_stiffness_nm_rad")


@dataclass(frozen=True)
class Found:
    """What became of a pair."""

    rig: int
    plant: str
    compensation: float
    pair: Pair
    speed_rad_s: float
    """RMS of the last window."""
    peak_rad_s: float
    """Largest of the last window."""
    before_rad_s: float
    """Largest of the window before."""
    way_rad: float
    """Peak to peak in the last window."""
    fault: int

    @property
    def proved(self) -> bool:
        """Worlds that are not linear `rtctl check` calls not proved, of every admittance."""
        return self.pair.world.about.linear

    @property
    def rests(self) -> bool:
        """The joint came to rest, or is on its way. NaN is not."""
        # by the peak: a steady ring from 1/3 Hz on has it in every window. Its RMS goes by the phase, up to
        # 8 % at .9 Hz, and two in five passed for dying. So written that NaN shakes
        quiet = self.speed_rad_s <= QUIET_RAD_S or self.peak_rad_s <= GROWS * self.before_rad_s
        return quiet and self.fault < 0


def _simulation(rig: Rig, held: Pair, seed: int) -> Simulation:
    """The rig in its world, nobody at it, without watch and account."""
    made = Simulation(rig.loaded)
    plant, p, command = made.plant_params, made.params, made.command
    for name in _FRICTIONS:
        plant[name] *= rig.friction
    for name in ("force_noise_n", "force_resolution_n", "current_noise_a"):
        plant[name] = 0.0
    plant["count_rad"] = p["count_rad"] = 1e-7  # steps of encoder and force are rows of their own
    plant["force_range_n"] = p["force_limit_n"] = 1e4  # a swing is to be seen, not clipped
    # both would calm what the certificate let through
    p["watch_floor_nm"], p["energy_budget_j"] = math.inf, 1e6
    plant["hand_kind"] = int(Hand.NONE)
    command["environment_kind"], command["environment_side"] = int(held.world), 1
    command["environment_stiffness_nm_rad"] = held.world_stiffness_nm_rad
    command["environment_damping_nms_rad"] = held.world_damping_nms_rad
    # of the rig and not of the hand: all hands of a rig meet one place; by the first number of the rig's own
    # stream, so that it goes with the plant
    command["environment_center_rad"] = 0.01 * np.random.default_rng((seed, rig.index)).standard_normal()
    # detents as wide as the largest swing of a hand (`_take_hold`)
    command["environment_pitch_rad"] = 0.1
    return made


def _take_hold(made: Simulation, held: Pair) -> None:
    """A hand that swings a little about where the joint is: by a fifth of the torque limit at most."""
    plant = made.plant_params
    torque = 0.2 * float(made.params["torque_limit_nm"][0, 0])
    plant["hand_kind"] = int(Hand.SINES)
    plant["hand_stiffness_nm_rad"], plant["hand_damping_nms_rad"] = (
        held.stiffness_nm_rad,
        held.damping_nms_rad,
    )
    plant["hand_inertia_kgm2"], plant["hand_center_rad"] = (
        held.inertia_kgm2,
        made.plant_state["position_rad"][0],
    )
    plant["hand_sine_rad"] = 0.0
    # a soft hand would swing round and round
    plant["hand_sine_rad"][0, 0, 0] = min(torque / held.stiffness_nm_rad, 0.1)
    plant["hand_sine_rad_s"][0, 0, 0] = 2 * math.pi * 3.0


def run_pair(rig: Rig, held: Pair, seed: int) -> Found:
    """Arm, take hold and swing, hold still; judge what is left."""
    made = _simulation(rig, held, seed)
    try:
        made.arm(compensation=rig.compensation)
    except FaultError:
        fault = int(made.state["fault_first"][0])
        return Found(
            rig.index, rig.plant, rig.compensation, held, math.nan, math.nan, math.nan, math.nan, fault
        )
    _take_hold(made, held)
    made.run(SWING_S)
    made.plant_params["hand_kind"] = int(Hand.REST)
    found = _judged(rig, held, made, REST_S)
    if found.rests or found.fault >= 0:
        return found
    later = _judged(rig, held, made, DOUBT_S)  # what dies slowly is given time
    return replace(later, before_rad_s=found.peak_rad_s)


def _judged(rig: Rig, held: Pair, made: Simulation, span_s: float) -> Found:
    """How it moves at the end of so many seconds, and a window before."""
    trace = made.run(span_s)
    window = round(WINDOW_S / made.plan.period_s)
    speed, place = made.truth["velocity_rad_s"][:, 0], made.truth["position_rad"][:, 0]
    fault = -1 if np.all(trace["state"] == State.ACTIVE) else max(int(trace["fault_first"][-1]), 0)
    rms = float(np.sqrt(np.mean(np.square(speed[-window:]))))
    peak, before = (float(np.abs(one).max()) for one in (speed[-window:], speed[-2 * window : -window]))
    way = float(np.ptp(place[-window:]))
    return Found(rig.index, rig.plant, rig.compensation, held, rms, peak, before, way, fault)


@dataclass
class Findings:
    """Sums over what was run."""

    rigs: int = 0
    pairs: int = 0
    refused: int = 0
    """Drawn before, and refused or not proved."""
    left_out: int = 0
    calmed: int = 0
    """Rigs that were given the damping at rest that their refusal names."""
    shaking: list[Found] = field(default_factory=list)
    told: list[Found] = field(default_factory=list)
    """What moves in worlds that are not linear."""

    def add(self, rig: Rig | None, found: list[Found]) -> None:
        """Add what one rig did in its hands."""
        self.left_out += rig is None
        self.rigs += rig is not None
        self.calmed += rig is not None and rig.calmed
        # without a rig all of its tries were refused
        self.refused += rig.refused if rig else TRIES
        self.pairs += len(found)
        self.told += [one for one in found if not one.rests and not one.proved]
        self.shaking += [one for one in found if not one.rests and one.proved]

    def as_dict(self) -> dict[str, Any]:
        """Values for JSON."""
        return {
            "rigs": self.rigs,
            "pairs": self.pairs,
            "refused": self.refused,
            "not_drawn": self.left_out,
            "rigs_with_damping_at_rest": self.calmed,
            "shaking": [_plain(one) for one in self.shaking],
            "shaking_in_worlds_not_linear": [_plain(one) for one in self.told],
        }

    def text(self, seed: int) -> str:
        """For people."""
        lines = [
            f"{self.pairs:,} hands in worlds, on {self.rigs:,} certified rigs ({self.refused:,} refused on "
            f"the way, {self.calmed:,} with the damping at rest that their refusal names): "
            f"{len(self.shaking)} shake; in walls and detents, which are not proved, {len(self.told)}"
        ]
        lines += [
            f"rig {one.rig} ({one.plant}{', compensated' if one.compensation else ''}): "
            f"{1e3 * one.speed_rad_s:.3g} mrad/s, {1e3 * one.peak_rad_s:.3g} at most after "
            f"{1e3 * one.before_rad_s:.3g}, "
            f"{1e3 * one.way_rad:.3g} mrad{f', fault {one.fault}' if one.fault >= 0 else ''}: {one.pair}\n"
            f"    rtctl campaign --admittance --seed {seed} --rig {one.rig}"
            for one in (*self.shaking[:20], *self.told[:20])
        ]
        return "\n".join(lines)


def _plain(found: Found) -> dict[str, Any]:
    return {**vars(found), "pair": {**vars(found.pair), "world": found.pair.world.word}}


def run_rig(seed: int, index: int) -> tuple[Rig | None, list[Found]]:
    """One rig in its hands, in this process; the rig without what belongs to this process."""
    rig = drawn(seed, index)
    if rig is None:
        return None, []
    return rig, [run_pair(rig, pair(rig, seed, number), seed) for number in range(PAIRS)]


def run(
    rigs: int,
    seed: int = 1,
    jobs: int = 0,
    progress: Callable[[int], None] = lambda _rigs: None,
    first: int = 0,
) -> Findings:
    """Run so many rigs from number `first` on, on `jobs` processes (0: one per core); `progress` is told how
    many were done since."""
    findings = Findings()
    for rig, found in campaign_workers.results(run_rig, [seed] * rigs, range(first, first + rigs), jobs=jobs):
        findings.add(rig, found)
        progress(1)
    return findings
