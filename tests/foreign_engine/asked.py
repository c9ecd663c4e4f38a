"""Is a hand shaken or fed on joints of other makes? `python tests/foreign_engine/asked.py --rigs 100`.

Random rigs, certified (exit code 0), in hands and worlds of `foreign_engine/plants.py`, moved by an engine of
`foreign_engine/engines.py` (decisions 0153, 0181): a seed is the same joint for each, in an arm for those
without contacts. `--losses .02`: of so little damping. *Grows* is who moves above 2 mrad/s from 9 to 12 s
after the motion, 1.25 times what it did from 2 to 5. Half of them meet a world, the engine's (a wall, a ball)
or the law's own; a third let go of the handle and grip it again. *Shaken*, *beyond both*, *fed* (by more than
the joint's masses lose) and *false* are those of `tests/foreign_moved.py`; *loud* is who has more than 2
mrad/s RMS from 2 to 5 s after the motion, 1.25 times what it has without help and with little friction,
*kept up* so much more than where help ends with the motion;
*kept fed* who is given more than 1 mJ from then to the end of the minute; *account* how far the law's
`energy_hand_j` is off the engine's, in shares of what went either way.
"""

# longer than 300 lines: whom it draws, what it asks and what it says are one judge
import math
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import click
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from foreign_arms import AXIS, wish
from foreign_files import fitted, model
from foreign_luck import Luck as _Luck
from foreign_moved import MANNERS, counts, judged, name_of, policy_of, say
from foreign_rests import FED_J, LITTLE, OWN, QUIET, every_rig, parser_of, rubbing

from foreign_engine import plants, rig
from foreign_engine.engines import ROWS
from foreign_engine.sound import DivergedError
from rtctl.control.jit import compiled, records
from rtctl.control.vocabulary import Policy

WORLDS = ("", "", "", "wall", "ball", "law wall", "law spring", "law detents", "law damper")
KINDS = ("arm", "muscles", "palm", "fingers", "leans")


class Luck(_Luck):
    FIRST = 153


class Case(NamedTuple):
    """As in `foreign_rests`; `parts` are joint, hand, world and device of the engine."""

    loaded: object
    axis: np.ndarray
    kind: str
    fastest: float
    length_m: float
    parts: tuple
    world: str
    stiffness: float
    off_s: float


def drawn(seed, folder):  # longer than 50 lines: tables of numbers, drawn in one order
    """A random rig file, certified or None, with its joint, hand and world."""
    luck = Luck(seed)
    dry = luck.spread(0.02, 1.0)
    inertia, viscous = dry / luck.spread(8, 60), dry / luck.spread(3, 25)
    made, hz = plants.Joint(inertia, viscous, dry), 0.0
    if luck.draw.random() < 0.6:
        share, hz, rubs = luck.within(0.2, 0.8), luck.spread(10, 150), luck.one(0.0, luck.within(0.05, 0.5))
        link, motor = share * inertia, (1 - share) * inertia
        gear = link * motor / inertia * (2 * math.pi * hz) ** 2
        damping = 2 * luck.within(0.005, 0.05) * math.sqrt(gear * link * motor / inertia)
        made = plants.Joint(
            motor, 0.8 * viscous, (1 - rubs) * dry, link, gear, damping, 0.2 * viscous, rubs * dry
        )
    rate_hz, every = luck.one(500.0, 1000.0, 1000.0, 2000.0), luck.one(1, 1, 2)
    late, lag_hz = luck.one(0.0, 1.0, luck.within(0, 1.5)), luck.one(0.0, luck.spread(100, 2000))
    most = dry * luck.within(4, 12)
    lag_s = 1 / (2 * math.pi * lag_hz) if lag_hz else 0.0
    device = plants.Device(late, lag_s, every, most * luck.one(0.0, 1e-4, 1e-3))
    kind, size = luck.one(*KINDS), dry / 0.25 * luck.spread(0.4, 3)
    spring, mass = luck.spread(2, 60) * size, luck.within(0.5, 6) * inertia
    hand = plants.Hand(
        kind, mass, spring, 2 * luck.within(0.05, 0.7) * math.sqrt(spring * mass),
        luck.spread(60, 500) * size,
        luck.within(0.02, 0.3) * math.sqrt(80 * size * mass), luck.one(0.0, luck.within(0.1, 0.6)),
        luck.within(0.03, 0.06), luck.within(0.1, 0.9) * dry if kind == "leans" else 0.0,
        luck.spread(0.01, 0.05),
    )  # fmt: skip
    fastest, omega = luck.one((0.05, 0.1), (0.15, 0.25), (0.4, 0.4), (0.9, 0.5), (1.6, 0.8))
    omega *= 2 * math.pi
    a = np.zeros(1, AXIS)
    for name, value in {
        "motor": made.motor, "link": made.link, "gear": made.gear, "viscous": viscous, "coulomb": dry,
        "breakaway": dry, "omega": omega,
        "amplitude": min(fastest / omega + luck.one(0.0, dry / spring), 0.6),
        "manner": luck.one(0, 1, 2), "from_s": 3.0,
        "to_s": 3.0 + 2 * math.pi * (2 + luck.one(0.0, 0.25, 0.6)) / omega,
    }.items():  # fmt: skip
        a[name] = value
    if a["manner"] == 2:
        a["amplitude"] *= 0.5
    world, at = luck.one(*WORLDS), float(a["amplitude"][0]) * luck.within(0.2, 0.8)
    parts = (
        made, hand, plants.World("" if " " in world else world, at, luck.spread(0.002, 0.02)), device,
    )  # fmt: skip
    drive = {"current_loop_hz": lag_hz, **({"resonance_hz": hz} if hz and luck.one(0, 1) else {})}
    says = {
        "inertia_kgm2": inertia, "viscous_nms_rad": viscous, "gear_ratio": 1.0, "gear_efficiency": 1.0,
        "torque_limit_nm": most, "torque_rate_nm_s": 100 * most, "torque_constant_nm_a": most / 5.0,
        "velocity_limit_rad_s": 8.0, "current_limit_a": 10.0, "drive": drive,
        "lever_m": [0.0, plants.LEVER_M, 0.0],
        "coupling": {
            "delay_ticks": 0.0, "damping_nms_rad": viscous * luck.within(0.0, 0.6),
            "stiffness_nm_rad": 1e-3 * most,
        },
        "force": {"limit_n": min(max(1000 * most, 1), 9e3), "resolution_n": 1e-4},
        "encoder_counts_per_rev": luck.spread(4e4, 1e6),
        "friction": {"gain": luck.one(0.8, 0.95), "intent_nm": 0.2 * dry, "gate_nm": 0.1 * dry,
            "policy": luck.one("hybrid", "hybrid", "hybrid", "observer")},
        "environment": {"kind": "free", "stiffness_nm_rad": 1.0, "center_rad": 0.0},
    }  # fmt: skip
    flat = {"stribeck": 0.05, "viscous": viscous, "bristle": 1.0, "coulomb": dry, "breakaway": dry}
    # identified on such a joint no presliding length is found: it has no bristles
    unbent = {"presliding_rad": None, "presliding_spread_rad": None, "presliding_ramps": 0}
    learned = replace(model(flat | {"backward": 1.0}, factor=luck.one(1.0, 1.0, 0.94, 1.05)), **unbent)
    loaded = fitted(
        "mock.toml", [says], folder, luck.one(0.3, 0.9, 0.99), models=[learned],
        device={"timing": {"sample_every_ticks": every, "transport_delay_ticks": late}}, rate_hz=rate_hz,
    )  # fmt: skip
    stiffness = 0.0
    if loaded is not None:
        stiffness = loaded.config.axis[0].coupling.stiffness_nm_rad * luck.spread(0.2, 30)
    off_s = luck.one(0.0, 0.0, luck.within(3.5, 5.0))
    kind = "nerves" if hand.reflex else kind
    return Case(loaded, a, kind, fastest, 1.0, parts, world, stiffness, off_s)


def in_an_arm(seed, folder, losses, declared, **engine):
    """The same joint for an engine without contacts, in an arm: with a share of its `losses` only (no nerves
    then, and it holds on), with all friction at the motor if it is where the file says (`declared`)."""
    case = drawn(seed, folder)
    joint, hand, world, device = case.parts
    hand = hand._replace(
        kind="arm", leans=0.0, damper=losses * hand.damper, grip_damping=losses * hand.grip_damping
    )
    if losses < 1:
        hand, case = hand._replace(reflex=0.0), case._replace(off_s=0.0)
    if declared:
        dry, viscous = joint.dry + joint.link_dry, joint.viscous + joint.link_viscous
        joint = joint._replace(dry=dry, viscous=viscous, link_dry=0.0, link_viscous=0.0)
    world = world._replace(kind="wall" if world.kind == "wall" else "")
    parts = joint, hand, world, device._replace(**engine)
    kind, met = "nerves" if hand.reflex else "arm", "" if case.world == "ball" else case.world
    return case._replace(parts=parts, kind=kind, world=met)


@compiled
def _wishes(a, times, out):
    for i in range(len(times)):
        out[i], _ = wish(a, times[i])


class Rig(rig.Rig):
    """As `foreign_moved` makes one: `a` has the wish, and the friction that is left of the joint's."""

    def __init__(self, case, loaded, a, seed, policy=None, share=1.0):
        made, hand, world, device = case.parts
        left = float(a["coulomb"][0] / case.axis["coulomb"][0])
        made = made._replace(dry=left * made.dry, link_dry=left * made.link_dry)
        super().__init__(loaded, made, hand, world, device, seed, policy)
        self.case, self.a, self.true_j, self.went_j, self.said_j = case, a, 0.0, 1e-9, 0.0
        if case.world.startswith("law "):
            kind = case.world.split()[1]
            self.world(kind, case.stiffness, 0.0 if kind == "spring" else world.at, 3.0 * made.viscous)

        self.wish = self._wish

    def _wish(self, times):
        out = np.zeros(len(times))
        _wishes(records(self.a)[0], times, out)
        return out

    def run(self, seconds, trace=None):
        off_s, parts, left = self.case.off_s, [], seconds
        self.leans = self.hand.leans * float(np.clip(self.time_s - 2.0, 0, 1)) if self.hand.leans else 0.0
        for edge, held in ((off_s, 0.0), (off_s + 1.0, 1.0)):
            if off_s and self.time_s < edge <= self.time_s + left:
                parts.append(super().run(max(edge - self.time_s, self.period_s), trace))
                left -= len(parts[-1]) * self.period_s
                self.hold(held)
        if left > 0.5 * self.period_s:
            parts.append(super().run(left, trace))
        out = np.concatenate(parts)
        if self.active:
            said = float(self.law[0]["energy_hand_j"][0, 0])
            self.true_j, self.went_j = self.true_j - out[:, 3].sum(), self.went_j + np.abs(out[:, 3]).sum()
            self.said_j += said - getattr(self, "_before", said)
            if not hasattr(self, "_before"):
                self.true_j, self.went_j = 0.0, 1e-9
            self._before = said
        return out


class Rest(NamedTuple):
    """rad/s RMS from 2 to 5 s after the motion, J given from then on, at most; share of the account."""

    speed: float
    fed_j: float
    account: float
    fault: int
    seconds: float
    grows: bool


def rest(case, a, seed, policy=None, then=None):
    """Armed, moved, held with help by the policy `then`; None if it was not armed in time."""
    one = Rig(case, case.loaded, a, seed, policy)
    if not one.arm():
        return None
    one.run(float(a["to_s"][0]) - one.time_s)
    if then is not None:
        one.follow(then)
    second = round(1 / one.period_s)
    out = one.run(12.0)
    while len(out) < 60 * second and out[2 * second :, 3].sum() > 1e-3 * FED_J:
        out = np.concatenate([out, one.run(12.0)])
    speed, later = (
        np.sqrt(np.square(out[since * second :, :2][: 3 * second]).mean(axis=0).max()) for since in (2, 9)
    )
    account = abs(one.said_j - one.true_j) / max(one.went_j, 1e-3)
    fed_j, fault = float(np.cumsum(out[2 * second :, 3]).max()), -1 if one.active else one.fault
    return Rest(float(speed), fed_j, account, fault, one.time_s, bool(later > max(QUIET, OWN * speed)))


def asked_of(motion, case, seed):
    """(as `foreign_moved` judges it, rest with help, without, whether it is loud, kept fed, kept up)."""
    moved = judged(case, seed, 1.0, partial(Rig, case)) if motion else None
    helped = rest(case, case.axis, seed)
    if helped is None:
        return None
    if helped.speed <= QUIET and helped.fed_j <= FED_J and helped.fault < 0 and not helped.grows:
        return moved, helped, helped, False, False, False
    plain = rest(case, case.axis, seed, Policy.OFF)
    loud = not helped.speed <= max(QUIET, OWN * plain.speed)
    fed = not helped.fed_j <= max(FED_J, OWN * plain.fed_j)
    if loud or fed:
        others = [rest(case, rubbing(case.axis, share), seed, Policy.OFF) for share in LITTLE]
        loud = loud and not helped.speed <= OWN * max(one.speed for one in others)
        fed = fed and not helped.fed_j <= OWN * max(one.fed_j for one in others)
    ended = rest(case, case.axis, seed, then=Policy.OFF) if loud else helped
    return moved, helped, plain, loud, fed, loud and not helped.speed <= OWN * ended.speed


def asked_or_refused(motion, case, seed):
    """The same, or why the engine's own run is none to judge by."""
    try:
        return asked_of(motion, case, seed)
    except DivergedError as why:
        return why


def told(helped, plain):
    return (
        f"{1e3 * helped.speed:.3g} mrad/s ({1e3 * plain.speed:.3g} without help), given "
        f"{1e3 * helped.fed_j:.3g} mJ ({1e3 * plain.fed_j:.3g}), fault {name_of(helped.fault)} "
        f"({name_of(plain.fault)})"
    )


def resting(name, of):
    _, _, rests, plain, loud, fed, kept = zip(*of, strict=True)
    click.echo(
        f"{name}: {len(of)} at rest: above {1e3 * QUIET:g} mrad/s {sum(one.speed > QUIET for one in rests)} "
        f"(of them {sum(one.speed > QUIET for one in plain)} without help), loud {sum(loud)} ("
        f"kept up {sum(kept)}), grows "
        f"{sum(one.grows for one in rests)} ({sum(one.grows for one in plain)} without help), kept fed "
        f"{sum(fed)}, {1e3 * max(one.fed_j for one in rests):.3g} mJ at most; account off by "
        f"{np.median([one.account for one in rests]):.2g}, {max(one.account for one in rests):.2g} at most; "
        f"faults {sum(one.fault >= 0 for one in rests)} of {sum(one.seconds for one in rests) / 3600:.2f} h"
    )


def main():
    parser, found = parser_of(__doc__), []
    parser.add_argument("--motion", action="store_true", help="ask who is shaken in motion, too")
    parser.add_argument("--minutes", type=float, default=1e3, help="of the clock, at most")
    parser.add_argument("--engine", choices=ROWS, default="mujoco")
    parser.add_argument("--step", type=float, default=1e-4, help="of an engine that Python calls, s")
    parser.add_argument("--losses", type=float, default=1.0, help="share that the hand has of its own")
    parser.add_argument("--declared", action="store_true", help="friction is where the file says")
    asked, draw = parser.parse_args(), drawn
    if asked.engine != "mujoco":
        draw = partial(
            in_an_arm, losses=asked.losses, declared=asked.declared, engine=asked.engine, step_s=asked.step
        )
    end_s, ask = time.monotonic() + 60 * asked.minutes, partial(asked_or_refused, asked.motion)
    for seed, case, verdict in every_rig(asked, draw, ask):
        if isinstance(verdict, DivergedError):
            click.echo(f"seed {seed}: not judged: {verdict}")
            continue
        moved, helped, plain, loud, fed, kept = verdict
        found.append((case, *verdict))
        if moved:
            again = ", grips again" if case.off_s else ""
            say(seed, case, moved, f" in {case.world or 'free motion'}{again}")
        if loud or fed or helped.grows or (helped.fault >= 0) != (plain.fault >= 0):
            click.echo(
                f"seed {seed}: rest: {case.kind}, {policy_of(case)}, {case.world}: {told(helped, plain)}"
                f"{', kept up by the help' * kept}"
            )
        if time.monotonic() > end_s:
            break
    for part in (
        lambda case: case.kind, policy_of, lambda case: case.world or "free motion",
        lambda case: "grips again" if case.off_s else "keeps hold",
        lambda case: MANNERS[int(case.axis["manner"][0])],
        lambda case: "all",
    ):  # fmt: skip
        for name in sorted({part(case) for case, *_ in found}):
            of = [one for one in found if part(one[0]) == name]
            if asked.motion:
                counts(name, [one[1] for one in of])
            resting(name, of)


if __name__ == "__main__":
    main()
