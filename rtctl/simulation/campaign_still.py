"""Does the help with friction ever shake a hand that only holds still? `rtctl campaign --still`.

Every case follows from `(seed, index)` alone: a joint (LuGre, elasto-plastic or Maxwell-slip, sigma0 50 to
2000 N m/rad, sigma1 .1 to 3 N m s/rad, one or two masses, at any place of its turn), a passive hand (0 to 500
N m/rad, 0 to 1 N m s/rad, 0 to .02 kg m^2), and a policy. The hand swings the joint for two periods and then
holds still: in the middle, where its wish happened to be, or it lets go. What it may feel is nothing: 2 s
later the joint rests, and the hand is fed nothing. The law is told the presliding length as `rtctl identify`
would find it, and of two masses only the motor's damping.

Some joints ring by themselves: an elastic one, hardly damped, in the hand of a mass. Whoever is not quiet is
therefore run again with the policy `off`; what is no more than `OWN_RING` of that, and dies away as it does,
is the joint's own, and is counted apart. Without help the same wish may move the joint less, or leave it
stuck with the hand's spring bent, where hardly anything rings. So the hand is tried with larger wishes
(`FARTHER`), too, as long as the joint goes no farther than it went with help. And a hand that rings in motion
already is met in some phase of it when it stops, with help in another than without: from that alone the ring
that is left differs twofold and more. So without help it stops a little later, too (`LATER_S`).

The judge knows the truth only: velocity, and the hand's torque times the way of the mass it holds."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from hw.simulators.mock_records import Hand
from rtctl.control.vocabulary import State
from rtctl.errors import FaultError
from rtctl.simulation import campaign_workers
from rtctl.simulation.campaign_still_cases import PERIOD_S, PERIODS, POLICIES, Case, drawn, rig
from rtctl.simulation.closed_loop import Simulation

QUIET_RAD_S = 0.002
"""Largest RMS speed from `SETTLE_S` to `JUDGED_S` after the motion."""
FED_J = 1e-3
"""Most that the hand may be given from `SETTLE_S` to the end."""
SETTLE_S, JUDGED_S = 2.0, 5.0
OWN_RING = 1.25
FARTHER = (1.0, 1.2, 1.5, 2.0, 3.0)
"""Amplitudes of the hand that a joint's own ring is looked for with."""
LATER_S = tuple(round(0.0125 * n, 4) for n in range(8))
"""By which its motion ends later: four phases of a ring of 20 Hz, eight of 10 Hz."""
LATE_S = 1.0
"""Last part of what is judged, in which a ring has died away."""
PART = 20
"""Cases that a process runs before it reports."""


@dataclass(frozen=True)
class Found:
    """What became of a case."""

    case: Case
    speed_rad_s: float
    fed_j: float
    fault: int
    """Bit number of the fault that stopped the rig, -1 for none."""
    late_rad_s: float = math.nan
    """RMS speed of the last `LATE_S` that are judged."""
    swing_rad: float = 0.0
    """What the joint went to and fro in the last period of the motion."""

    @property
    def quiet(self) -> bool:
        """True when the hand felt nothing; a rig that had to be stopped was not quiet. NaN is not."""
        return self.speed_rad_s <= QUIET_RAD_S and self.fed_j <= FED_J and self.fault < 0


def _stop_moving(simulation: Simulation, case: Case) -> None:
    plant = simulation.plant_params[0]
    if case.ends == "off":
        plant["hand_kind"][0] = int(Hand.NONE)
        return
    # the same spring and damper, whose wish stands from here on: nothing jumps
    plant["hand_kind"][0] = int(Hand.REST)
    if case.ends == "anywhere":
        plant["hand_center_rad"][0] = simulation.plant_state[0]["hand_position_rad"][0]


def _held_rad(simulation: Simulation) -> np.ndarray:
    """Angle of the mass that the hand holds, of the last run: of an elastic joint the link's."""
    return np.asarray(simulation.truth["position_rad"][:, 0])


def _rms(speed_rad_s: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(speed_rad_s))))


def run_case(case: Case, hold_s: float = JUDGED_S) -> Found:
    """Run a case: arm, two periods and a part, then hold still for `hold_s`, at least `JUDGED_S`."""
    # a rig of its own: bristles and observer as they were made
    simulation = rig(case)
    try:
        simulation.arm()
    except FaultError:
        # a rig that cannot be armed is no quiet one, and is told
        return Found(case, math.nan, math.nan, int(simulation.state["fault_first"][0]))
    moved_s = simulation.time_s - float(simulation.plant_params["hand_start_s"][0, 0])
    # arming took some of the motion
    ends_s = PERIOD_S * (PERIODS + math.ceil(max(moved_s, 0.0) / PERIOD_S)) + case.stop_s
    simulation.run(ends_s - moved_s)
    period_s = simulation.plan.period_s
    swing_rad = float(np.ptp(_held_rad(simulation)[-round(PERIOD_S / period_s) :]))
    _stop_moving(simulation, case)
    settle = simulation.run(SETTLE_S)
    # from the last tick before: the first step of what is judged counts, too
    start_rad = float(_held_rad(simulation)[-1])
    trace = simulation.run(max(hold_s, JUDGED_S) - SETTLE_S)
    # the speed of these seconds alone; energy goes on to the end, since it adds up
    judged = round((JUDGED_S - SETTLE_S) / period_s)
    speed = simulation.truth["velocity_rad_s"][:judged, 0]
    steps_rad = np.diff(_held_rad(simulation), prepend=start_rad)
    # by the torque at the end of each tick: of a spring that counts a little too much as given, never too
    # little
    given_j = np.cumsum(-simulation.truth["hand_torque_nm"][:, 0] * steps_rad)
    stopped = not (np.all(settle["state"] == State.ACTIVE) and np.all(trace["state"] == State.ACTIVE))
    # a rig that was stopped, by its STOP too, is none that was quiet: bit 0 where no fault is named
    fault = max(int(trace["fault_first"][-1]), 0) if stopped else -1
    late_rad_s = _rms(speed[-round(LATE_S / period_s) :])
    return Found(case, _rms(speed), float(np.max(given_j, initial=0.0)), fault, late_rad_s, swing_rad)


def rings_by_itself(found: Found, hold_s: float) -> bool:
    """True when the hand was given nothing, and the same joint in it rings as much and as long without any
    help.

    After some motion in which the joint went no farther than in this case, whenever it ends."""
    # what stopped the rig, or fed the hand, is no joint's own ring
    if found.fault >= 0 or not found.fed_j <= FED_J:
        return False
    # the case's own wish first: each further one is a run of its own
    for farther in FARTHER:
        wish = replace(found.case, policy="off", amplitude_rad=farther * found.case.amplitude_rad)
        for later_s in LATER_S:
            alone = run_case(_ending_later(wish, later_s), hold_s)
            # a larger motion than with help excuses nothing
            if farther > 1.0 and not alone.swing_rad <= found.swing_rad:
                return False
            # the end of it, too: one that goes on where the other dies away is kept up by somebody
            as_long = found.late_rad_s <= max(OWN_RING * alone.late_rad_s, QUIET_RAD_S)
            if found.speed_rad_s <= OWN_RING * alone.speed_rad_s and as_long:
                return True
    return False


def _ending_later(case: Case, later_s: float) -> Case:
    """The same motion, which ends so much later: where the wish then is, as no hand jumps."""
    if later_s == 0.0:
        return case
    # later it is not in the middle any more
    ends = "anywhere" if case.ends == "middle" else case.ends
    return replace(case, stop_s=case.stop_s + later_s, ends=ends)


@dataclass(frozen=True)
class Order:
    """What to run."""

    seed: int = 1
    cases: int = 1000
    hold_s: float = JUDGED_S
    policies: tuple[str, ...] = POLICIES
    hands: int = 1
    """Cases that share a gear and a force sensor (`drawn`)."""

    def reproduce(self, index: int) -> str:
        """The command that runs case `index` alone."""
        # policies take turns by the index, so that the same index with others is another case
        named = "" if self.policies == POLICIES else "".join(f" --policy {name}" for name in self.policies)
        held = "" if self.hold_s == JUDGED_S else f" --hold-s {self.hold_s:.12g}"
        return f"rtctl campaign --still --seed {self.seed} --rig {index}{named}{held}"


@dataclass
class Findings:
    """Sums over the cases that were run. Speed and energy are those of the cases that do not ring by
    themselves."""

    cases: int = 0
    own: int = 0
    """Cases that ring as much without help."""
    worst_rad_s: float = 0.0
    most_fed_j: float = 0.0
    loud: list[Found] = field(default_factory=list)

    def add(self, found: list[Found], hold_s: float = JUDGED_S) -> None:
        """Add cases that were run with this `hold_s`."""
        self.cases += len(found)
        # the second question costs up to forty runs: only of those that are not quiet
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

    def text(self, order: Order) -> str:
        """For people; of what was run with this order."""
        lines = [
            f"{self.cases:,} hands that hold still: {len(self.loud)} feel something, {self.own} on a joint "
            f"that rings as much without help; fastest "
            f"{1e3 * self.worst_rad_s:.3g} mrad/s RMS, most fed {1e3 * self.most_fed_j:.3g} mJ"
        ]
        for one in sorted(self.loud, key=_loudest_first)[:20]:
            fault = f", fault {one.fault}" if one.fault >= 0 else ""
            lines.append(
                f"case {one.case.index}: {1e3 * one.speed_rad_s:.3g} mrad/s, fed {1e3 * one.fed_j:.3g} "
                f"mJ{fault}: {one.case}"
                f"\n    {order.reproduce(one.case.index)}"
            )
        return "\n".join(lines)


def _loudest_first(one: Found) -> float:
    # a speed that is no number orders nothing: it comes first, as a rig that did not even arm
    return -math.inf if math.isnan(one.speed_rad_s) else -one.speed_rad_s


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def run_part(order: Order, indices: range) -> list[Found]:
    """Run these cases in this process."""
    cases = (drawn(order.seed, index, order.policies, order.hands) for index in indices)
    return [run_case(case, order.hold_s) for case in cases]


def _parts(cases: int) -> Iterator[range]:
    for first in range(0, cases, PART):
        yield range(first, min(first + PART, cases))


def run(order: Order, jobs: int = 0, progress: Callable[[int], None] = lambda _cases: None) -> Findings:
    """Run them all on `jobs` processes (0: one per core); `progress` is told how many were done since."""
    findings = Findings()
    parts = list(_parts(order.cases))
    for found in campaign_workers.results(run_part, [order] * len(parts), parts, jobs=jobs):
        findings.add(found, order.hold_s)
        progress(len(found))
    return findings
