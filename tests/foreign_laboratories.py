"""Does a hand that holds still feel the help on rigs as laboratories have them, and if so, why?
`python tests/foreign_laboratories.py --rigs 40`.

Five joints (a Maxon motor on a capstan, a Faulhaber on a planetary gear, a harmonic drive, a knee, a gimbal
motor), written from what such parts are like; each certified file, with numbers of its own, meets eight
hands of the box of issue 14, half of them hardly damped, on the joints of `tests/foreign_swings.py`. A hand
strokes, then holds in the middle or anywhere, lets go, or lets go later and grips again. Judged are the
speeds of motor and link from 2 to 5 s after that, and the energy that the hand was given from 2 s on.

Every hand above `QUIET` is run again, and is named by the first of these that is as loud, within `OWN`:
*own*: without help, the joint swung no farther, its motion ending now or a little later;
*own from the stop*, *own from .5 s*: help is taken away then, so that hand and joint begin alike;
*swings out*: help is taken away at the stop, and all dry friction but what the file asks help to leave: only
more friction would end it sooner;
*kept up*: none, so the help is at fault. `--policy dither` shows that the judge hears that."""

import math
import tempfile
from typing import NamedTuple

import click
import foreign_luck
import numpy as np
from foreign_files import fitted, model
from foreign_rests import parser_of
from foreign_shaken import rubbing
from foreign_strokes import SWINGS_HZ, Drawn, row
from foreign_swings import HAND_V, HAND_X, LINK_X, Rig, X

from rtctl.control.vocabulary import Fault, Policy

QUIET, OWN = 2e-3, 1.25
HANDS = 8
FARTHER = (1.0, 1.2, 1.5, 2.0, 3.0)
LATER_S = (0.0, 0.025, 0.05, 0.075)

LABORATORIES = {
    # dry and break-away N m, kg m^2, N m s/rad, bristles' length rad, gear Hz (0: none), its damping, link's
    # share, counts a turn, torque limit N m, Hz, samples every so many ticks, delay ticks, current loop Hz
    "capstan": (0.06, 1.15, 0.003, 0.006, 1.0e-3, 80.0, 0.03, 0.4, 200_000, 3.0, 2000.0, 1, 1.0, 1500.0),
    "planetary": (0.40, 1.30, 0.020, 0.080, 3.0e-3, 28.0, 0.03, 0.5, 176_000, 8.0, 1000.0, 1, 1.0, 400.0),
    "harmonic": (3.00, 1.40, 0.300, 1.500, 1.5e-3, 20.0, 0.02, 0.4, 400_000, 40.0, 1000.0, 1, 1.0, 500.0),
    "knee": (1.50, 1.25, 0.150, 0.500, 4.0e-3, 14.0, 0.03, 0.6, 300_000, 60.0, 1000.0, 2, 1.5, 250.0),
    "gimbal": (0.01, 1.20, 2e-4, 0.001, 2.0e-3, 0.0, 0.0, 0.0, 65_536, 0.4, 2000.0, 1, 0.6, 0.0),
}


class Luck(foreign_luck.Luck):
    """Numbers of one case of this judge."""

    FIRST = 166


class Hand(NamedTuple):
    """A case with one of its hands, and how its motion ends."""

    case: Drawn
    ends: str
    seed: int


def _joint(luck, name):
    """The laboratory's joint, every number its own by a quarter."""
    told = [value * luck.within(0.8, 1.25) for value in LABORATORIES[name][:7]]
    dry, ratio, inertia, viscous, length, hz, damping = told
    peak = dry * max(1.05, min(ratio, 1.6))
    kind = luck.one(0, 0, 1, 2)
    joint = {
        "coulomb": dry, "breakaway": peak, "stribeck": luck.spread(0.04, 0.2), "viscous": viscous,
        "kind": kind, "elements": 10, "exponent": luck.one(0.7, 1.0, 2.0), "link_dry": 0.0,
        "bristle": peak / (3e-4 if kind == 2 else length), "motor": inertia, "link": 0.0, "gear": 0.0,
        "gear_damping": 0.0, "link_viscous": 0.0,
    }  # fmt: skip
    joint["bristle_damping"] = luck.one(0.0, 0.1) * math.sqrt(joint["bristle"] * inertia)
    if hz > 0:
        link = LABORATORIES[name][7] * inertia
        reduced = link * (inertia - link) / inertia
        gear = reduced * (2 * math.pi * hz) ** 2
        joint |= {"motor": inertia - link, "link": link, "gear": gear, "link_viscous": 0.1 * viscous}
        joint["gear_damping"] = 2 * damping * math.sqrt(gear * reduced)
    return joint


def rig(seed, folder):
    """(name, certified file or None, numbers of joint and device) of a laboratory's rig."""
    luck = Luck(seed)
    name = list(LABORATORIES)[seed % len(LABORATORIES)]
    counts, most, rate_hz, every, late, lag_hz = LABORATORIES[name][8:]
    joint = _joint(luck, name)
    lever_m = 0.25 if name == "knee" else 0.1
    numbers = joint | {
        "late_ticks": late * luck.one(1.0, 0.7), "sample_ticks": every, "current_noise": 0.002,
        "lag_s": 1 / (2 * math.pi * lag_hz) if lag_hz else 0.0, "force_step": most / lever_m * 2e-5,
        "force_noise": most / lever_m * luck.one(0.0, 1e-5, 1e-4),
    }  # fmt: skip
    says = {
        "inertia_kgm2": joint["motor"] + joint["link"], "viscous_nms_rad": joint["viscous"],
        "torque_limit_nm": most, "torque_rate_nm_s": 100 * most, "torque_constant_nm_a": most / 5.0,
        "gear_ratio": 1.0, "gear_efficiency": 1.0, "velocity_limit_rad_s": 8.0, "current_limit_a": 10.0,
        "drive": {"current_loop_hz": lag_hz}, "encoder_counts_per_rev": counts,
        "lever_m": [0.0, lever_m, 0.0],
        "coupling": {
            "delay_ticks": 0.0, "damping_nms_rad": 0.3 * joint["viscous"], "stiffness_nm_rad": 1e-3
        },
        "force": {
            "limit_n": min(100 * most / lever_m, 9e3), "resolution_n": max(numbers["force_step"], 1e-6)
        },
        "friction": {
            "gain": 0.95, "intent_nm": 0.2 * joint["coulomb"], "gate_nm": 0.1 * joint["coulomb"],
            "presliding_rad": joint["breakaway"] / joint["bristle"], "blend_rad_s": 0.08,
            "policy": "observer" if luck.draw.random() < 0.5 else "hybrid",
        },
        "environment": {"kind": "free", "stiffness_nm_rad": 1.0, "center_rad": 0.0},
    }  # fmt: skip
    if joint["link"] > 0:
        says["drive"]["resonance_hz"] = math.sqrt(
            joint["gear"] * (1 / joint["motor"] + 1 / joint["link"])
        ) / (2 * math.pi)  # fmt: skip
    loaded = fitted(
        "mock.toml", [says], folder, luck.one(0.5, 0.9), models=[model(joint | {"backward": 1.0})],
        device={"timing": {"sample_every_ticks": every, "transport_delay_ticks": late}}, rate_hz=rate_hz,
    )  # fmt: skip
    return name, loaded, numbers


def _hand(luck, numbers):
    """A hand of the issue's box (0 to 500 N m/rad, 1 N m s/rad, .02 kg m^2 at .012 kg m^2), in proportion to
    the joint; half of them hardly damp. And its kind, and its largest speed, rad/s."""
    size = (numbers["motor"] + numbers["link"]) / 0.012
    kind = luck.one("held", "mass", "grip")
    spring = luck.spread(0.5, 500.0) * size
    damper = luck.one(0.0, luck.spread(1e-3, 1e-2), luck.spread(1e-2, 1.0), luck.spread(1e-2, 1.0)) * size
    mass = 0.0 if kind == "held" else luck.one(0.02, luck.within(0.0, 0.02)) * size
    fastest = luck.one(*SWINGS_HZ)
    omega = 2 * math.pi * SWINGS_HZ[fastest]
    amplitude = fastest / omega + numbers["breakaway"] / spring * luck.one(0.0, 1.0)
    made = {
        "spring": spring, "damper": damper, "mass": mass, "omega": omega, "triangle": luck.one(0, 0, 1),
        "grip": luck.within(80, 600) * size if kind == "grip" else 0.0, "amplitude": min(amplitude, 0.8),
        "from_s": 3.0, "to_s": 3.0 + 2 * 2 * math.pi / omega,
    }  # fmt: skip
    return made, kind, fastest


def hands(seed, loaded, numbers):
    """The rig in each of its hands."""
    for at in range(HANDS):
        luck = Luck(seed, at)
        held, kind, fastest = _hand(luck, numbers)
        ends = luck.one("middle", "anywhere", "off", "regrip")
        held["to_s"] += luck.within(0.0, 2 * math.pi) / held["omega"] if ends != "middle" else 0.0
        yield Hand(Drawn(loaded, row(numbers | held, 1.0), kind, fastest, 1.0), ends, seed * HANDS + at)


class Left(NamedTuple):
    """Of 2 to 5 s after the motion: RMS speed of who is faster, of the motor, and in the last second, rad/s;
    energy of the help; energy given to the hand until 8 s, J; what the joint swung in motion, rad."""

    speed: float
    motor: float
    late: float
    helped_j: float
    fed_j: float
    swing: float
    fault: int


def _let_go(one, a, on):
    """Take spring, damper, grip and the mass that hangs on it from the joint, or give them back."""
    for name in ("spring", "damper", "grip", *(("mass",) if one.case.axis["grip"][0] > 0 else ())):
        a[name] = one.case.axis[name] if on else 0.0


def left(one, policy=None, farther=1.0, later_s=0.0, away_s=math.inf, share=1.0):
    """What is left of the motion; `away_s` after it the help is taken away, and dry friction down to
    `share`. None: not armed."""
    a = one.case.axis.copy()
    a["amplitude"] *= farther
    a["to_s"] += later_s
    rig = Rig(one.case.loaded, a, one.seed, policy)
    if not rig.arm():
        return None
    moved = rig.run(float(a["to_s"][0]) - rig.time_s)
    period_s = rig.period_s
    swing = float(np.ptp(np.cumsum(moved[:, 1]) * period_s))
    if one.ends == "regrip":
        rig.run(1.0)
    if one.ends in ("off", "regrip"):
        _let_go(one, rig.a, on=False)
    if one.ends == "regrip":
        rig.run(0.5)
        outer = X if float(a["link"][0]) == 0 else LINK_X
        rig.y[HAND_X], rig.y[HAND_V] = rig.y[outer], 0.0
        _let_go(one, rig.a, on=True)
    out = rig.run(min(away_s, 8.0))
    rig.law[3]["compensation"] = 0.0
    if share < 1.0:
        rig.a, rig.z = rubbing(rig.a, share), share * rig.z
    out = np.concatenate([out, rig.run(8.0 - min(away_s, 8.0))])
    second = round(1 / period_s)
    held = out[2 * second : 5 * second]
    rms = np.sqrt(np.mean(np.square(held[:, :2]), axis=0))
    late = np.sqrt(np.mean(np.square(held[-second:, :2]), axis=0).max())
    fed = np.cumsum(-out[2 * second :, 2] * out[2 * second :, 1]) * period_s
    helped_j = np.sum((held[:, 3] + held[:, 4]) * held[:, 0]) * period_s
    fault = -1 if rig.active else rig.fault
    return Left(*map(float, (rms.max(), rms[0], late, helped_j, fed.max(), swing)), fault)


def own(one, helped):
    """The loudest of it without any help, the joint swung no farther and its motion ending later."""
    loudest = 0.0
    for farther in FARTHER:
        for later_s in LATER_S:
            alone = left(one, Policy.OFF, farther=farther, later_s=later_s)
            if farther > 1.0 and not alone.swing <= helped.swing:
                return loudest
            loudest = max(loudest, alone.speed)
            if helped.speed <= OWN * loudest:
                return loudest
    return loudest


def _meant(one):
    """Share of the dry friction that the rig file asks help to leave."""
    asked = one.case.loaded.config.axis[0].friction
    observer = 1.0 - asked.observer.gain
    return observer if asked.policy == "observer" else (1.0 - asked.gain) * observer


def cause(one, helped, policy):
    """(whose it is, the speeds that say so) of a hand above `QUIET`."""
    if helped.fault >= 0:
        plain = left(one, Policy.OFF)
        return f"{Fault(1 << helped.fault).name}, without help {plain.fault}", {}
    told = {
        "own": own(one, helped),
        "own from the stop": left(one, policy, away_s=0.0).speed,
        "own from .5 s": left(one, policy, away_s=0.5).speed,
        "swings out": left(one, policy, away_s=0.0, share=_meant(one)).speed,
    }
    return next((word for word, speed in told.items() if helped.speed <= OWN * speed), "kept up"), told


def _say(one, seed, name, helped, word, told):
    a, policy = one.case.axis, one.case.loaded.config.axis[0].friction.policy
    held = ", ".join(f"{of} {float(a[of][0]):.3g}" for of in ("spring", "damper", "mass", "grip"))
    speeds = ", ".join(f"{of} {1e3 * value:.2f}" for of, value in told.items())
    click.echo(
        f"seed {seed} hand {one.seed % HANDS}: {word}: {name}, {policy}, {one.ends}, {held}: "
        f"{1e3 * helped.speed:.2f} mrad/s (motor {1e3 * helped.motor:.2f}, last second "
        f"{1e3 * helped.late:.2f}), help {1e6 * helped.helped_j:.3g} uJ, fed {1e6 * helped.fed_j:.3g} uJ; "
        f"{speeds}"
    )


def main():
    parser, found = parser_of(__doc__), []
    parser.add_argument("--policy", choices=[one.name.lower() for one in Policy], help="not the file's own")
    asked = parser.parse_args()
    policy = None if asked.policy is None else Policy[asked.policy.upper()]
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(asked.first, asked.first + asked.rigs):
            name, loaded, numbers = rig(seed, folder)
            if loaded is None:
                click.echo(f"seed {seed}: {name} refused")
                continue
            for one in hands(seed, loaded, numbers):
                helped, word = left(one, policy), ""
                if helped is None:
                    click.echo(f"seed {seed}: {name} not armed in time")
                    continue
                if helped.fault >= 0 or not helped.speed <= QUIET:
                    word, told = cause(one, helped, policy)
                    _say(one, seed, name, helped, word, told)
                found.append((word, left(one, Policy.OFF).speed > QUIET, helped.fed_j))
    words, plain = [one[0] for one in found if one[0]], sum(one[1] for one in found)
    told = ", ".join(f"{word} {words.count(word)}" for word in sorted(set(words)))
    both = sum(one[1] for one in found if one[0])
    click.echo(
        f"{len(found)} hands, above {len(words)} ({told}), without help {plain}, both {both}, fed at most "
        f"{1e6 * max(one[2] for one in found):.3g} uJ"
    )


if __name__ == "__main__":
    main()
