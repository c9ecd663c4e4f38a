"""Does the help with friction ever shake a hand that only holds still? `rtctl campaign --still`.

Every case follows from `(seed, index)` alone: a joint (LuGre, elasto-plastic or Maxwell-slip, sigma0 50 to 2000 N m/rad,
sigma1 .1 to 3 N m s/rad, one or two masses, at any place of its turn), a passive hand (0 to 500 N m/rad, 0 to 1 N m s/rad,
0 to .02 kg m^2), and a policy. The hand swings the joint for two periods and then holds still: in the middle, where its wish
happened to be, or it lets go. What it may feel is nothing: 2 s later the joint rests, and the hand is fed nothing. The
law is told the presliding length as `rtctl identify` would find it, and of two masses only the motor's damping.

Some joints ring by themselves: an elastic one, hardly damped, in the hand of a stiff spring and a mass. Whoever is not
quiet is therefore run again with the policy `off`; what is no more than `OWN_RING` of that is the joint's own, and is
counted apart.

The judge knows the truth only: velocity, and the hand's torque times the way of the mass it holds.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np

from hw import registry
from hw.mock.family import merged
from hw.mock.records import Hand
from rtctl.campaign.draws import log_uniform
from rtctl.control.vocabulary import State
from rtctl.errors import FaultError
from rtctl.friction.policies import STANDINGS
from rtctl.rig_file import config
from rtctl.rig_file.config import Config, LoadedConfig
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.demo import shipped_config

QUIET_RAD_S = 0.002
"""Largest RMS speed from `SETTLE_S` to `JUDGED_S` after the motion."""
FED_J = 1e-3
"""Most that the hand may be given from `SETTLE_S` to the end."""
SETTLE_S, JUDGED_S = 2.0, 5.0
OWN_RING = 1.25
PERIOD_S = 2.0
PERIODS = 2
PART = 20
"""Cases that a process runs before it reports."""

POLICIES = tuple(name for name, standing in STANDINGS.items() if standing.quiet and name != "off")
"""What is tried where no policy is named: those that help and that `rtctl check` lets a hand meet."""

_KINDS = ("lugre", "elasto_plastic", "gms")


@dataclass(frozen=True)
class Case:
    """One joint, one hand, one policy, as it was drawn. Units as in a rig file."""

    index: int
    policy: str
    model: str
    bristle_stiffness_nm_rad: float
    bristle_damping_nms_rad: float
    joint_hz: float
    """Resonance of two equal masses; 0: one mass."""
    hand_stiffness_nm_rad: float
    hand_damping_nms_rad: float
    hand_inertia_kgm2: float
    amplitude_rad: float
    place_rad: float
    ends: str
    """"middle", "anywhere" (the wish stops where it is), or "off" (the hand lets go)."""
    stop_s: float
    """When, after the two periods."""


@dataclass(frozen=True)
class Found:
    """What became of a case."""

    case: Case
    speed_rad_s: float
    fed_j: float
    fault: int
    """Bit number of the fault that stopped the rig, -1 for none."""

    @property
    def quiet(self) -> bool:
        """True when the hand felt nothing; a rig that had to be stopped was not quiet. NaN is not."""
        return self.speed_rad_s <= QUIET_RAD_S and self.fed_j <= FED_J and self.fault < 0


def drawn(seed: int, index: int, policies: tuple[str, ...] = POLICIES) -> Case:
    """Case `index` of campaign `seed`."""
    draw = np.random.default_rng((seed, index))
    ends = str(draw.choice(["middle", "middle", "anywhere", "off"]))
    # a wish that stops in the middle of its motion stops where it passes there: a hand does not jump
    stop_s = float(draw.choice([0.0, PERIOD_S / 2]) if ends == "middle" else draw.uniform(0.0, PERIOD_S))
    return Case(
        index=index,
        policy=policies[index % len(policies)],
        model=str(draw.choice(_KINDS)),
        bristle_stiffness_nm_rad=log_uniform(draw, 50.0, 2000.0),
        bristle_damping_nms_rad=log_uniform(draw, 0.1, 3.0),
        joint_hz=float(draw.choice([0.0, 0.0, log_uniform(draw, 30.0, 120.0)])),
        hand_stiffness_nm_rad=float(
            draw.choice([0.0, log_uniform(draw, 0.5, 500.0), log_uniform(draw, 0.5, 500.0), 500.0])
        ),
        hand_damping_nms_rad=float(
            draw.choice([0.0, log_uniform(draw, 0.01, 1.0), log_uniform(draw, 0.01, 1.0), 1.0])
        ),
        hand_inertia_kgm2=float(draw.choice([0.0, draw.uniform(0.0, 0.02), 0.02])),
        amplitude_rad=log_uniform(draw, 0.03, 0.4),
        place_rad=draw.uniform(-math.pi, math.pi),
        ends=ends,
        stop_s=stop_s,
    )


@cache
def _shipped() -> LoadedConfig:
    return config.load(shipped_config("mock.toml"))


def _joint(case: Case, inertia_kgm2: float) -> dict[str, Any]:
    """The case's changes of [[device.options.axis]]."""
    friction = {
        "model": case.model,
        "bristle_stiffness_nm_rad": case.bristle_stiffness_nm_rad,
        "bristle_damping_nms_rad": case.bristle_damping_nms_rad,
    }
    axis: dict[str, Any] = {"friction": friction, "start_position_rad": case.place_rad}
    if case.joint_hz > 0:
        stiffness = inertia_kgm2 / 4 * (2 * math.pi * case.joint_hz) ** 2
        damping = 0.02 * 2 * math.sqrt(stiffness * inertia_kgm2 / 4)
        axis["elastic"] = {
            "stiffness_nm_rad": stiffness,
            "damping_nms_rad": damping,
            "link_viscous_share": 0.2,
        }
    return axis


def _hand(case: Case) -> dict[str, Any]:
    """The case's changes of [[device.options.hand]]."""
    return {
        "kind": "sine",
        "stiffness_nm_rad": case.hand_stiffness_nm_rad,
        "damping_nms_rad": case.hand_damping_nms_rad,
        "inertia_kgm2": case.hand_inertia_kgm2,
        "amplitude_rad": case.amplitude_rad,
        "frequency_hz": 1 / PERIOD_S,
        "center_rad": case.place_rad,
    }


def rig(case: Case) -> Simulation:
    """The simulated rig of a case, nothing run yet. The presliding length is told as break-away over sigma0."""
    shipped = _shipped()
    table = shipped.config.model_dump(mode="json", by_alias=True)
    axis = table["axis"][0]
    options = dict(shipped.options)
    own = options["axis"][0]
    breakaway_nm = own["friction"]["breakaway_nm"]
    told: dict[str, Any] = {
        "friction": {"policy": case.policy, "presliding_rad": breakaway_nm / case.bristle_stiffness_nm_rad}
    }
    if case.joint_hz > 0:
        told |= {"viscous_nms_rad": 0.8 * axis["viscous_nms_rad"], "coupling": {"stiffness_nm_rad": 45.0}}
    table["axis"] = [merged(axis, told)]
    options["axis"] = [merged(own, _joint(case, axis["inertia_kgm2"]))]
    options["hand"] = [merged(options["hand"][0], _hand(case))]
    options["seed"] = case.index + 1
    valid = registry.options_model("mock").model_validate(options, context={"n_axes": 1})
    update = {"config": Config.model_validate(table), "options": valid.model_dump(mode="json")}
    return Simulation(shipped.model_copy(update=update))


def _stop_moving(simulation: Simulation, case: Case) -> None:
    plant = simulation.plant_params[0]
    if case.ends == "off":
        plant["hand_kind"][0] = int(Hand.NONE)
        return
    plant["hand_kind"][0] = int(Hand.REST)
    if case.ends == "anywhere":
        plant["hand_center_rad"][0] = simulation.plant_state[0]["hand_position_rad"][0]


def _link_rad(simulation: Simulation) -> np.ndarray:
    """Angle of the mass that the hand holds, of the last run."""
    truth = simulation.truth
    return np.asarray(truth["position_rad"][:, 0] - truth["joint_twist_rad"][:, 0])


def run_case(case: Case, hold_s: float = JUDGED_S) -> Found:
    """Run a case: arm, two periods and a part, then hold still for `hold_s`, at least `JUDGED_S`."""
    simulation = rig(case)
    try:
        simulation.arm()
    except FaultError:
        return Found(case, math.nan, math.nan, int(simulation.state["fault_first"][0]))
    moved_s = simulation.time_s - float(simulation.plant_params["hand_start_s"][0, 0])
    ends_s = PERIOD_S * (PERIODS + math.ceil(max(moved_s, 0.0) / PERIOD_S)) + case.stop_s
    simulation.run(ends_s - moved_s)
    _stop_moving(simulation, case)
    settle = simulation.run(SETTLE_S)
    start_rad = float(_link_rad(simulation)[-1])
    trace = simulation.run(max(hold_s, JUDGED_S) - SETTLE_S)
    judged = round((JUDGED_S - SETTLE_S) / simulation.plan.period_s)
    speed = simulation.truth["velocity_rad_s"][:judged, 0]
    steps_rad = np.diff(_link_rad(simulation), prepend=start_rad)
    given_j = np.cumsum(-simulation.truth["hand_torque_nm"][:, 0] * steps_rad)
    stopped = not (np.all(settle["state"] == State.ACTIVE) and np.all(trace["state"] == State.ACTIVE))
    fault = max(int(trace["fault_first"][-1]), 0) if stopped else -1
    return Found(case, float(np.sqrt(np.mean(np.square(speed)))), float(np.max(given_j, initial=0.0)), fault)


def rings_by_itself(found: Found, hold_s: float) -> bool:
    """True when the same joint in the same hand moves as much without any help, and the hand was given nothing."""
    if found.fault >= 0 or not found.fed_j <= FED_J:
        return False
    alone = run_case(replace(found.case, policy="off"), hold_s)
    return found.speed_rad_s <= OWN_RING * alone.speed_rad_s


@dataclass
class Findings:
    """Sums over the cases that were run. Speed and energy are those of the cases that do not ring by themselves."""

    cases: int = 0
    own: int = 0
    """Cases that ring as much without help."""
    worst_rad_s: float = 0.0
    most_fed_j: float = 0.0
    loud: list[Found] = field(default_factory=list)

    def add(self, found: list[Found], hold_s: float = JUDGED_S) -> None:
        """Add cases that were run with this `hold_s`."""
        self.cases += len(found)
        judged = [one for one in found if one.quiet or not rings_by_itself(one, hold_s)]
        self.own += len(found) - len(judged)
        self.worst_rad_s = max([self.worst_rad_s, *(one.speed_rad_s for one in judged)])
        self.most_fed_j = max([self.most_fed_j, *(one.fed_j for one in judged)])
        self.loud += [one for one in judged if not one.quiet]

    def as_dict(self) -> dict[str, object]:
        """Plain values for JSON; what is not a number is None."""
        return {
            "cases": self.cases,
            "ring_by_themselves": self.own,
            "worst_rad_s": _finite(self.worst_rad_s),
            "most_fed_j": _finite(self.most_fed_j),
            "not_quiet": [
                {**vars(one.case), "speed_rad_s": _finite(one.speed_rad_s), "fed_j": _finite(one.fed_j)}
                | {"fault": one.fault}
                for one in self.loud
            ],
        }

    def text(self, seed: int) -> str:
        """For people."""
        lines = [
            f"{self.cases:,} hands that hold still: {len(self.loud)} feel something, {self.own} on a joint "
            f"that rings as much without help; fastest "
            f"{1e3 * self.worst_rad_s:.3g} mrad/s RMS, most fed {1e3 * self.most_fed_j:.3g} mJ"
        ]
        for one in sorted(self.loud, key=lambda one: -one.speed_rad_s)[:20]:
            fault = f", fault {one.fault}" if one.fault >= 0 else ""
            lines.append(
                f"case {one.case.index}: {1e3 * one.speed_rad_s:.3g} mrad/s, fed {1e3 * one.fed_j:.3g} mJ{fault}: {one.case}"
                f"\n    rtctl campaign --still --seed {seed} --rig {one.case.index}"
            )
        return "\n".join(lines)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


@dataclass(frozen=True)
class Order:
    """What to run."""

    seed: int = 1
    cases: int = 1000
    hold_s: float = JUDGED_S
    policies: tuple[str, ...] = POLICIES


def run_part(order: Order, indices: range) -> list[Found]:
    """Run these cases in this process."""
    return [run_case(drawn(order.seed, index, order.policies), order.hold_s) for index in indices]


def _parts(cases: int) -> Iterator[range]:
    for first in range(0, cases, PART):
        yield range(first, min(first + PART, cases))


def run(order: Order, jobs: int = 0, progress: Callable[[int], None] = lambda _cases: None) -> Findings:
    """Run them all on `jobs` processes (0: one per core); `progress` is told how many were done since."""
    findings = Findings()
    with ProcessPoolExecutor(jobs or os.cpu_count() or 1) as pool:
        parts = list(_parts(order.cases))
        for found in pool.map(run_part, [order] * len(parts), parts):
            findings.add(found, order.hold_s)
            progress(len(found))
    return findings
