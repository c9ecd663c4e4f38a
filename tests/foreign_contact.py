"""Is a hand shaken in contact with a rendered world, or given more than it may be?
`python tests/foreign_contact.py --rigs 100`; `--foes`: who wants its energy; `--walls`: how they feel.

Rigs of `tests/foreign_rests.py`, joints and arms of `tests/foreign_arms.py`; behind the coupling a wall,
spring, damper or detents, a wall whose face a body moves, or a proxy that a renderer holds at its wall, of 30
to 1000 frames a second, with jitter and frames that are lost. Hands press and hold, tap, let go and grip
again, some by a soft fingertip that only pushes, some with a reflex or a tremor. What is *shaken* and *fed*
is said in `tests/foreign_moved.py`; *more than allowed* is who was given more since arming, at any time, than
docs/safety.md says; *unlike the wall* how far the torque of a hand that holds still in a wall is off the
configured stiffness times the way into it, in break-away torques.
"""

import math
from collections import Counter
from typing import NamedTuple

import click
import foreign_arms
import numpy as np
from foreign_arms import V, X
from foreign_foes import LEASE
from foreign_moved import counts, judged, name_of, policy_of, say
from foreign_rests import Luck, every_rig, parser_of
from foreign_rests import drawn as at_rest

from rtctl.control.vocabulary import Environment, Policy, State

POLICIES = ("hybrid", "hybrid", "observer", "stop_gated")
WORLDS = ("wall", "spring", "damper", "detents", "face", "renderer")
HABITS = ("grasps", "taps", "pushes", "grips again")
FOES = ("swing", "chirp", "ahead", "pump", "juggle", "jumps", "falls silent", "NaN")


class World(NamedTuple):
    """What is rendered, and where; frames a second, and how many are lost; when the hand lets go; what a foe
    does; what a renderer may put in, None by default."""

    kind: str
    stiffness: float = 0.0
    damping: float = 0.0
    place: float = 0.0
    frames_hz: float = 100.0
    lost: float = 0.0
    off_s: tuple = ()
    foe: str = ""
    rate: float = 0.0
    store_j: float | None = None
    power_w: float | None = None


class Case(NamedTuple):
    """As that of `foreign_rests`, in a world, and how the hand is on the handle."""

    loaded: object
    axis: np.ndarray
    kind: str
    fastest: float
    length_m: float
    world: World
    habit: str


def drawn(seed, folder, foes=False):
    """A random rig file with its joint, hand and world."""
    case = at_rest(seed, folder, POLICIES)
    if case.loaded is None:
        return Case(*case, None, "")
    luck, a, says = Luck(seed, 2), case.axis[0], case.loaded.config.axis[0]
    dry, k_c, habit = float(a["breakaway"]), says.coupling.stiffness_nm_rad, _habit(luck, case)
    press = luck.spread(0.3 * dry, max(0.7 * says.torque_limit_nm, 0.4 * dry))
    swing = float(a["amplitude"])
    face = max(swing - press / float(a["muscle"]), luck.within(0.1, 0.4) * swing)
    kind, off_s = luck.one(*WORLDS), (luck.within(4.0, 6.0),) if habit == "grips again" else ()
    world = World(
        kind, min(k_c * luck.spread(0.1, 30), 1e6), luck.one(0.0, luck.spread(0.3, 10)) * float(a["viscous"]),
        face, luck.spread(30, 1000), luck.one(0.0, 0.1), off_s,
    )  # fmt: skip
    if foes:
        moved = float(a["motor"] + a["link"] + a["handle"] + a["arm"])
        reach = luck.spread(0.3, 1.5) * says.torque_limit_nm / k_c
        if luck.one(0, 1):
            a["amplitude"] = 0.0
        world = world._replace(
            frames_hz=luck.one(1e9, 1e9, luck.spread(30, 1000)), foe=luck.one(*FOES), place=reach, lost=0.0,
            rate=math.sqrt((float(a["muscle"]) + k_c) / moved) * luck.spread(0.3, 1.5),
            store_j=luck.one(None, 0.05 * dry, 5e-3 * dry), power_w=luck.one(None, 0.2 * dry, 0.02 * dry),
        )  # fmt: skip
    return Case(*case, world, habit)


def _habit(luck, case):
    """How the hand is on the handle; writes what that asks of its numbers."""
    a, habit = case.axis, luck.one(*HABITS)
    if habit == "taps":
        a["manner"], a["omega"] = 0, 2 * math.pi * luck.within(1.0, 2.5)
        a["amplitude"] = min(float(a["amplitude"][0]), case.fastest * case.length_m / float(a["omega"][0]))
        a["to_s"] = a["from_s"] + 4.0 + luck.one(0.0, 0.25, 0.25) * 2 * math.pi / a["omega"]
    else:
        a["manner"] = luck.one(0, 0, 1, 2)
    if float(a["arm"][0]) > 0 and luck.one(0, 1):
        a["tip"] = 3 * a["breakaway"] / a["wrist"]
    if habit == "pushes" and float(a["arm"][0]) > 0:
        a["pushes"] = 1
    return habit


class Rig(foreign_arms.Rig):
    """In a world that is rendered beside the law; `most` is what the hand was given at most since arming, in
    shares of what docs/safety.md says."""

    def __init__(self, world, loaded, a, seed, policy=None, share=1.0):
        super().__init__(loaded, a, seed, policy, share)
        self.world, self.luck, self.due, self.frame = world, Luck(seed, 3), 0, 0
        self.held = {name: a[name].copy() for name in ("wrist", "wrist_damping", "muscle", "muscle_damping")}
        self.seen, self.shown, self.given_j, self.most, self.armed_s = 0.0, world.place, 0.0, 0.0, None
        p = self.law[2]
        for name in ("store_j", "power_w"):
            if getattr(world, name) is not None:
                p[f"renderer_{name}"] = getattr(world, name)
        self.k_c = float(p["coupling_stiffness_nm_rad"][0, 0])

    def run(self, seconds):
        """As that of every arm, frame by frame."""
        parts, left = [], round(seconds / self.period_s)
        while left > 0:
            tick = round(self.time_s / self.period_s)
            if tick >= self.due:
                self._frame()
                wait_s = min(self.luck.within(0.6, 1.4) / self.world.frames_hz, 0.01)
                self.due = tick + max(1, round(wait_s / self.period_s))
            n = min(left, self.due - tick)
            parts.append(super().run(n * self.period_s))
            self._account(parts[-1][:, 3])
            left -= n
        return np.concatenate(parts)

    def _account(self, given):
        if self.armed_s is None and self.active:
            self.armed_s = self.time_s - len(given) * self.period_s
        if self.armed_s is None:
            return
        p = self.law[2][0]
        since_s = self.time_s - self.armed_s - self.period_s * np.arange(len(given) - 1, -1, -1)
        allowed = p["renderer_store_j"] + p["renderer_power_w"] * since_s + 1.5 * p["energy_budget_j"]
        self.most = max(self.most, float(((self.given_j + np.cumsum(given)) / allowed).max()))
        self.given_j += float(given.sum())

    def _frame(self):
        """The hand's grip, and what is sent."""
        w, c, a = self.world, self.law[3], self.a
        for off_s in w.off_s:
            grip = min(max((self.time_s - off_s - 1.0) / 0.15, 0.0), 1.0) if self.time_s > off_s else 1.0
            for name in ("wrist", "wrist_damping") if a["arm"][0] > 0 else ("muscle", "muscle_damping"):
                a[name] = grip * self.held[name]
        if w.foe:
            if self.armed_s is not None:
                self._foe(w, c, float(self.y[X]), float(self.y[V]), self.time_s - self.armed_s)
            return
        if w.kind == "renderer" and self.armed_s is None:
            return
        kind = {"face": "wall", "renderer": "remote"}.get(w.kind, w.kind)
        self._world(kind, w.stiffness, 0.0 if kind == "spring" else self.shown)
        c["environment_pitch_rad"] = max(0.3 * w.place, 2e-3)
        fresh = self.time_s >= self.frame and self.luck.within(0, 1) >= w.lost
        if self.time_s >= self.frame:
            self.frame = self.time_s + self.luck.within(0.7, 1.3) / w.frames_hz
        if fresh and w.kind == "face":
            since_s = min(self.time_s, float(a["to_s"][0]))
            self.shown = w.place * (1 + 0.3 * math.sin(6 * since_s))
        elif fresh:  # where the joint was a frame ago
            self.shown = w.place if w.kind != "renderer" else min(self.seen, w.place)
            self.seen = float(self.law[0]["position_rad"][0, 0])
        if w.kind == "renderer":  # or the program says again what it said last
            self._target(self.shown, 0.0)

    def _world(self, kind, stiffness, place):
        c = self.law[3]
        c["environment_kind"], c["environment_side"] = int(Environment[kind.upper()]), 1
        c["environment_stiffness_nm_rad"], c["environment_center_rad"] = stiffness, place
        c["environment_damping_nms_rad"] = self.world.damping

    def _target(self, x, v):
        s, c = self.law[1], self.law[3]
        c["environment_kind"] = int(Environment.REMOTE)
        c["target_position_rad"], c["target_velocity_rad_s"] = x, v
        c["target_count"] += 1
        c["target_epoch"], c["target_lease"] = s["epoch"], LEASE

    def _foe(self, w, c, x, v, t):
        reach, ahead = w.place, 1.0 if v >= 0 else -1.0
        if w.foe == "falls silent" and t % 0.7 < 0.05:
            return
        if w.foe in ("swing", "falls silent", "chirp"):
            rate, led = (w.rate * (0.2 + 0.2 * (t % 10)), 1.0) if w.foe == "chirp" else (w.rate, 0.0)
            self._target(reach * math.sin(rate * t), led * reach * rate * math.cos(rate * t))
        elif w.foe == "ahead":
            self._target(x + reach * ahead, 0.3 * v)
        elif w.foe == "pump":
            self._world("spring", 1e6 if x * v < 0 else 0.0, reach)
        elif w.foe == "jumps" or (w.foe == "NaN" and t < 4):
            self._target(x + reach * self.luck.within(-1, 1), self.luck.one(0.0, 30.0 * v))
        elif w.foe == "NaN":
            self._target(math.nan, self.luck.one(0.0, math.nan))
        else:
            c["compensation"] = self.luck.one(0.0, 1.0)
            kind = self.luck.one("free", "spring", "wall", "damper", "detents", "remote")
            self._world(kind, self.k_c * self.luck.spread(0.01, 1e3), x + reach * ahead)
            if kind == "remote":
                self._target(x + reach * ahead, 0.0)


def contact(case, seed):
    """(as `foreign_moved` judges it, the share given of what is allowed); None where it was not armed."""
    rigs = []

    def make(*told):
        rigs.append(Rig(case.world, *told))
        return rigs[-1]

    moved = judged(case, seed, 1.0, make)
    return moved and (moved, max(rig.most for rig in rigs[:2]))


def unlike_the_wall(case, seed, policy=None):
    """How far the torque of a hand that holds still in a wall is off stiffness times way, break-away torques;
    NaN where it is outside, or presses with more than the motor gives."""
    a = case.axis.copy()
    a["manner"], a["to_s"], a["tremor"] = 0, a["from_s"] + 2.5 * math.pi / a["omega"], 0.0
    rig = Rig(case.world._replace(kind="wall", off_s=()), case.loaded, a, seed, policy)
    if not rig.arm():
        return None
    rig.run(float(a["to_s"][0]) - rig.time_s + 2.0)
    felt, most = float(rig.run(0.5)[:, 2].mean()), float(rig.law[2]["torque_limit_nm"][0, 0])
    deep = float(rig.law[0]["position_rad"][0, 0]) - case.world.place
    if deep <= 0 or felt > 0.8 * most or not rig.active:
        return math.nan
    return (felt - deep / (1 / rig.k_c + 1 / case.world.stiffness)) / float(a["breakaway"][0])


def robbed(case, seed):
    """(share of what is allowed that was given at most, J given, fault or state) after 12 s with a foe."""
    rig = Rig(case.world, case.loaded, case.axis, seed)
    if not rig.arm():
        return None
    rig.run(12.0)
    return rig.most, rig.given_j, name_of(rig.fault) if rig.fault >= 0 else State(rig.law[1]["state"][0]).name


def _contacts(asked):
    found = []
    for seed, case, (moved, most) in every_rig(asked, drawn, contact):
        found.append((case, moved, most))
        say(seed, case, moved, f" in {case.world.kind}, {case.habit}")
    for part in (policy_of, lambda case: case.world.kind, lambda case: case.habit, lambda case: "all"):
        for name in sorted({part(case) for case, *_ in found}):
            counts(name, [moved for case, moved, _ in found if part(case) == name])
    most = [most for *_, most in found]
    click.echo(f"more than allowed {sum(one > 1 for one in most)}, {max(most):.3f} of it at most")
    for words, of in (("with", 0), ("without", 1)):
        faults = Counter(name_of(moved[of].fault) for _, moved, _ in found)
        click.echo(f"faults {words} help: {dict(faults)}")


def _foes(asked):
    found = {}
    for seed, case, told in every_rig(asked, lambda *one: drawn(*one, True), robbed):
        found.setdefault(case.world.foe, []).append(told)
        if told[0] > 1:
            click.echo(f"seed {seed}: MORE THAN ALLOWED, {told[0]:.3f} times: {case.world}, {case.kind}")
    for foe, of in sorted(found.items()):
        most, given_j, ends = zip(*of, strict=True)
        click.echo(
            f"{foe}: {len(of)}, more than allowed {sum(one > 1 for one in most)}, {max(most):.3f} of it at "
            f"most, given {1e3 * max(given_j):.3g} mJ at most, {dict(Counter(ends))}"
        )


def _walls(asked):
    def both(case, seed):
        return [unlike_the_wall(case, seed, policy) for policy in (None, Policy.OFF)]

    found = np.array([one for _, _, one in every_rig(asked, drawn, both)], float)
    for name, of in zip(("with help", "without"), found.T, strict=True):
        off = np.abs(of[np.isfinite(of)])
        click.echo(
            f"{name}: {len(off)} walls held of {len(of)}, off by {np.median(off):.2f} of the break-away "
            f"torque in the median, {np.quantile(off, 0.95):.2f} (95 %), {off.max():.2f} at most"
        )


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--foes", action="store_true")
    parser.add_argument("--walls", action="store_true")
    asked = parser.parse_args()
    (_foes if asked.foes else _walls if asked.walls else _contacts)(asked)


if __name__ == "__main__":
    main()
