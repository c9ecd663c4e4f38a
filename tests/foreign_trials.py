"""Certified rigs on the joints of `tests/foreign_braked.py`, drawn at random, what is asked of one,
and when it rings, for `tests/foreign_brakes.py`."""

import math
from typing import NamedTuple

import foreign_braked
import numpy as np
from foreign_braked import GAVE, HAND_SPEED, OUT_X, PLACE, SENT, SPEED, STATE, Rig, X
from foreign_files import CONFIGS, fitted, model
from foreign_luck import Luck as _Luck

from rtctl.control.vocabulary import Environment, Fault, ProgramFlag, State
from rtctl.identify.motion import Motion
from rtctl.identify.settings import Settings, rig_of, without_feedforward
from rtctl.rig_file.config import load

LEASE, END_RAD = 7, 3.0
QUIET, FED_J = 3e-3, 1e-5
CHATTER = 0.015
"""RMS change of a servo's torque from tick to tick, share of the torque limit, that is ringing (0171)."""
FRICTIONS = ("dry", "load", "ripple", "bristles")


class Luck(_Luck):
    """Numbers of one case of this judge."""

    FIRST = 177


class Drawn(NamedTuple):
    """A certified rig file (None: refused) and its joint; how late it is; what its friction is."""

    loaded: object
    axis: np.ndarray
    kind: str
    friction: str


def drawn(seed, folder):
    """A random rig: rigid, or elastic as its device declares it."""
    luck = Luck(seed)
    inertia, dry, b = luck.spread(0.002, 0.04), luck.spread(0.003, 0.3), luck.spread(0.01, 0.15)
    friction = luck.one(*FRICTIONS)
    a = np.zeros(1, foreign_braked.AXIS)
    a["motor"], a["viscous"], a["dry"], a["peak"] = inertia, b, dry, dry * luck.within(1.0, 1.5)
    a["stribeck"] = luck.spread(0.03, 0.3)
    a["bristle"] = a["peak"] / luck.spread(5e-4, 5e-3) if friction == "bristles" else 0.0
    a["bristle_damping"] = 0.1 * np.sqrt(a["bristle"] * inertia)
    a["by_load"] = luck.within(0.05, 0.3) if friction == "load" else 0.0
    if friction == "ripple":
        a["wave"], a["waves"], a["cogging"] = luck.within(0.05, 0.4), luck.one(20, 80, 160), 0.3 * dry
    elastic, hz, share = luck.one(True, True, False), luck.spread(20, 150), luck.within(0.2, 0.85)
    damped, behind = luck.spread(0.005, 0.05), luck.one(0.0, luck.within(0.1, 0.5))
    rate_hz = luck.one(500.0, 1000.0, 1000.0, 2000.0)
    every = 1 if rate_hz < 1000 else luck.one(1, 1, 2, 3)
    late = luck.one(0.0, luck.within(0, 2), luck.within(2, 6), 6.0)
    lag_hz = luck.one(0.0, luck.spread(100, 1500))
    a["late_ticks"], a["lag_s"] = late, 1 / (2 * math.pi * lag_hz) if lag_hz else 0.0
    a["sample_ticks"], a["lost"] = every, luck.one(0.0, 0.03) if every == 1 else 0.0
    if elastic:
        a["link"], a["motor"] = share * inertia, (1 - share) * inertia
        reduced = share * (1 - share) * inertia
        a["gear"] = reduced * (2 * math.pi * hz) ** 2
        a["gear_damping"] = 2 * damped * math.sqrt(float(a["gear"][0]) * reduced)
        a["link_viscous"], a["viscous"] = behind * b, (1 - behind) * b
    base = "mock-elastic.toml" if elastic else "mock.toml"
    device = {"timing": {"sample_every_ticks": every, "transport_delay_ticks": late}}
    if elastic:
        of_mock = load(CONFIGS / base).options["axis"][0]
        device["axis"] = [of_mock | {"elastic": of_mock["elastic"] | _told(a, share, behind)}]
    says = _says(luck, a, inertia, b, lag_hz)
    made = fitted(
        base, [says], folder, luck.one(0.3, 0.9), rate_hz=rate_hz, models=[model(_curve(a))], device=device
    )
    return Drawn(made, a, ("elastic" if elastic else "rigid") + (" late" if late >= 2 else ""), friction)


def _curve(a):
    """What the model is learned of."""
    one = {name: float(a[name][0]) for name in ("stribeck", "viscous")}
    level, peak = float(a["dry"][0]), float(a["peak"][0])
    return one | {
        "coulomb": level,
        "breakaway": peak,
        "bristle": float(a["bristle"][0]) or peak / 1e-4,
        "backward": 1.0,
    }


def _told(a, share, behind):
    """The elastic joint as its device declares it."""
    return {
        "stiffness_nm_rad": float(a["gear"][0]), "damping_nms_rad": float(a["gear_damping"][0]),
        "link_inertia_share": share, "link_viscous_share": behind,
    }  # fmt: skip


def _says(luck, a, inertia, b, lag_hz):
    """What the rig file says of it."""
    peak, most = float(a["peak"][0]), inertia * luck.spread(80, 400)
    most = max(most, 6 * peak)
    bend = peak / float(a["bristle"][0]) if a["bristle"][0] > 0 else 1e-4
    return {
        "inertia_kgm2": inertia, "viscous_nms_rad": b, "torque_limit_nm": most,
        "torque_rate_nm_s": 100 * most,
        "gear_ratio": 1.0, "gear_efficiency": 1.0, "torque_constant_nm_a": most / 5.0,
        "current_limit_a": 10.0, "velocity_limit_rad_s": 8.0, "drive": {"current_loop_hz": lag_hz},
        "position_min_rad": -END_RAD, "position_max_rad": END_RAD, "lever_m": [0.0, 0.1, 0.0],
        "coupling": {"delay_ticks": 0.0, "damping_nms_rad": 0.3 * b, "stiffness_nm_rad": 1.0},
        "force": {"limit_n": min(max(1e3 * most, 10), 9e3), "resolution_n": 1e-3},
        "encoder_counts_per_rev": luck.spread(1e5, 1e6),
        "friction": {
            "gain": 0.9, "intent_nm": 0.2 * peak, "gate_nm": 0.1 * peak, "presliding_rad": bend,
            "policy": luck.one("off", "hybrid", "stop_gated"),
        },
        "environment": {"kind": "free", "stiffness_nm_rad": 1.0, "center_rad": 0.0},
    }  # fmt: skip


class Hand(NamedTuple):
    """N m/rad, N m s/rad, kg m^2."""

    spring: float
    damper: float
    mass: float


def hand_of(luck):
    """A passive one, more often than not without any damping."""
    damper = luck.one(0.0, 0.0, luck.spread(1e-3, 1.0))
    return Hand(luck.one(luck.spread(1, 500), 500.0), damper, luck.one(0.0, luck.spread(1e-4, 0.02)))


class Trial:
    """One rig, armed, and the programs of an identification for it."""

    def __init__(self, case, seed, bare=True, first=None, at_rad=0.0):
        self.luck = Luck(seed, 1)
        self.loaded = without_feedforward(case.loaded) if bare else case.loaded
        self.rig = Rig(self.loaded, case.axis, seed)
        self.rig.q[[X, OUT_X]] = at_rad
        if first is not None:
            self.rig.grip(*first)
        self.armed = self.rig.arm_until(5.0)
        self.out = [self.rig.run(0.8)] if self.armed else []
        settings = Settings(margin_rad=0.1)
        self.motion = Motion(rig_of(self.loaded, settings), settings)
        self.motion.last = self.rig.law[0][0]
        self.motion.choose_travel()

    @property
    def flags(self):
        return ProgramFlag(int(self.rig.law[0]["program_flags"][0, 0]))

    def run(self, seconds):
        self.out.append(self.rig.run(seconds))
        return self.out[-1]

    def ask(self, kind, limit_s=3600.0, **values):
        command = self.rig.law[3]
        for name, value in self.motion.order(kind, limit_s, **values).items():
            command[name] = value
        command["seq"] += 1

    def target(self, place_rad):
        command, state = self.rig.law[3], self.rig.law[1]
        command["environment_kind"], command["target_position_rad"] = int(Environment.REMOTE), place_rad
        command["target_count"] += 1
        command["target_epoch"], command["target_lease"] = state["epoch"], LEASE

    def followed(self, seconds, place_rad):
        for _ in range(round(seconds / 0.01)):
            self.target(place_rad)
            self.run(0.01)


class Seen(NamedTuple):
    """What was seen of one run, in words, and its loudest figures: rad/s left, rad/s with a dead motor, J."""

    words: tuple
    left: float = 0.0
    dead: float = 0.0
    fed: float = 0.0


def _loud(out):
    """Speed of whichever side is faster, RMS of each tenth of a run."""
    speed = np.abs(out[:, [SPEED, HAND_SPEED]]).max(axis=1)
    return np.array([math.sqrt(np.mean(part**2)) for part in np.array_split(speed, 10)])


def beside_dead(rig, seconds=3.0):
    """The rest of a run, and the same with a dead motor from here on; what is wrong about it."""
    dead = rig.without_torque()
    live, gone = rig.run(seconds), dead.run(seconds)
    loud, quiet = _loud(live), _loud(gone)
    fed, words = float(live[len(live) // 2 :, GAVE].sum()), []
    grown = loud[5:].max() > max(4 * QUIET, 1.25 * loud[1:5].max(), 1.25 * quiet[5:].max())
    # a link that swings out behind a motor that stands dies as it would anyway
    dies = loud[-1] * quiet[5] <= 1.1 * loud[5] * quiet[-1] and quiet[-1] > 0.1 * loud[-1]
    if not (loud[-2:].max() <= max(QUIET, 1.25 * quiet[-2:].max()) or dies) or grown:
        words.append("rings")
    if fed > FED_J:
        words.append("fed")
    return live, Seen(tuple(words), float(loud[-2:].max()), float(quiet[-2:].max()), fed)


def kicks(rig, out):
    """True where the torque changes by more than its rate while it is not cut, as above the velocity limit,
    too."""
    steps = np.abs(np.diff(out[:, SENT], prepend=out[0, SENT]))
    cut = np.isin(out[:, STATE], [State.FAULT, State.ESTOP, State.LOCKOUT])
    cut |= (out[:, SENT] == 0) & (np.abs(out[:, SPEED]) > 0.9 * rig.law[2]["velocity_limit_rad_s"][0, 0])
    return bool(np.any((steps > rig.law[2]["torque_rate_nm"][0, 0] * (1 + 1e-9)) & ~cut))


def ended(trial, rest, wanted=(State.ACTIVE,)):
    """Seen, with what the whole run shows: kicks, the travel's end, a fault."""
    out, words = np.concatenate(trial.out), list(rest.words)
    if kicks(trial.rig, out):
        words.append("kicks")
    if np.abs(out[:, PLACE]).max() > END_RAD:
        words.append("out")
    if trial.rig.law[1]["state"][0] not in wanted:
        words.append(f"ends {fault_of(trial.rig)}")
    return rest._replace(words=tuple(words))


def pull(luck, case, hand):
    """How far a hand pulls at once, rad: it throws the joint by no more than 2 rad/s."""
    moved = float(case.axis["motor"][0] + case.axis["link"][0]) + hand.mass
    reach = min(0.2, 2.0 * math.sqrt(moved / hand.spring))
    return luck.within(-reach, reach)


def fault_of(rig):
    """Name of the first fault, or of the state."""
    return Fault(1 << rig.fault).name if rig.fault >= 0 else State(rig.law[1]["state"][0]).name


def chatter(trial, out):
    """By how much the torque changes from tick to tick: by a count of the encoder it may."""
    command, p = trial.rig.law[3][0], trial.rig.law[2][0]
    grain = command["program_damping_nms_rad"][0] * command["program_alpha"][0] * p["count_rad"][0]
    grain /= trial.rig.period_s * p["torque_limit_nm"][0]
    change = float(np.std(np.diff(out[:, SENT]))) / float(trial.rig.law[2]["torque_limit_nm"][0, 0])
    return Seen(("rings",) if change > max(CHATTER, grain) else (), change)
