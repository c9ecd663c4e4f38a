"""Is an arm ever shaken that has come to rest on a certified rig? `python tests/foreign_rests.py --rigs 100`.

Random rigs, certified, on the joints and arms of `tests/foreign_arms.py`. Judged is the speed of motor and
link from 2 to 5 s after the motion, the energy that a passive arm is given from 2 s on (to the end of the
minute, where there is any), and every fault, since nothing that is done here should be one. *Loud* is who has
more than `QUIET` and `OWN` times what it has without help; *beyond both* who has it beyond the joint with a
twentieth and with a third of the dry friction, too: an arm that swings out or trembles by itself is stopped
by friction alone, and that is what help takes.
"""

import argparse
import math
import tempfile
from typing import NamedTuple

import click
import numpy as np
from foreign_arms import AXIS, Rig
from foreign_files import fitted, model
from foreign_luck import Luck as _Luck

from rtctl.control.vocabulary import Fault, Policy

QUIET, OWN, FED_J = 2e-3, 1.25, 1e-3
"""rad/s of a joint with its handle .1 m away; J, of friction of .25 N m, and in proportion above."""
LITTLE = (0.05, 0.35)
LENGTH_M = 0.1
_OF_LENGTH = {
    "motor": -2, "link": -2, "gear": -2, "gear_damping": -2, "play": 1, "viscous": -2, "link_viscous": -2,
    "coulomb": -1, "breakaway": -1, "stribeck": 1, "bristle": -2, "bristle_damping": -2, "handle": -2,
    "wrist": -2, "wrist_damping": -2, "arm": -2, "muscle": -2, "muscle_damping": -2, "reflex": -2,
    "reflex_damping": -2, "tremor": -1, "amplitude": 1,
}  # fmt: skip


class Luck(_Luck):
    """Numbers of one case of this judge."""

    FIRST = 50321


class Drawn(NamedTuple):
    """A certified rig in an arm; `loaded` None where `rtctl check` refuses it."""

    loaded: object
    axis: np.ndarray
    kind: str
    fastest: float
    length_m: float


def _joint(luck):
    """A joint's numbers: rotary, the share of its gear's inertia behind it, its resonance."""
    dry = luck.spread(0.003, 4.0)
    inertia, peak = dry / luck.spread(6, 80), dry * luck.within(1.02, 1.7)
    bristle = peak / luck.spread(1.5e-4, 8e-3)
    made = {
        "motor": inertia, "link": 0.0, "coulomb": dry, "breakaway": peak, "stribeck": luck.spread(0.02, 0.4),
        "viscous": dry / luck.spread(2, 25), "bristle": bristle, "kind": luck.one(0, 1, 2),
        "bristle_damping": luck.one(0.0, luck.within(0.05, 0.4)) * math.sqrt(bristle * inertia),
        "memory_s": luck.one(0.0, luck.spread(5e-4, 8e-3)),
    }  # fmt: skip
    hz = 0.0
    if luck.draw.random() < 0.65:
        share, hz = luck.within(0.15, 0.85), luck.spread(8, 300)
        link, motor = share * inertia, (1 - share) * inertia
        gear = link * motor / inertia * (2 * math.pi * hz) ** 2
        damping = 2 * luck.within(0.005, 0.05) * math.sqrt(gear * link * motor / inertia)
        made |= {"motor": motor, "link": link, "gear": gear, "gear_damping": damping}
        made["link_viscous"] = luck.one(0.0, 0.2) * made["viscous"]
        made["play"] = luck.one(0.0, 0.0, 0.0, luck.spread(1e-4, 2e-3))
    return made, hz


def _arm(luck, dry, inertia):
    """Handle, wrist, arm and nerves, sized by what has to be moved; and what it is called."""
    size = min(max(dry / 0.25, 1e-3) * luck.spread(0.3, 3), 20.0)
    kind = luck.one("fingers", "arm", "arm", "soft", "nerves", "tremor")
    spring, mass = luck.spread(2, 300) * size, luck.within(0.3, 8) * inertia
    if kind == "soft":
        spring = luck.spread(0.5, 30) * size
    damping = 2 * luck.within(0.05, 0.7) * math.sqrt(spring * mass)
    made = {
        "muscle": spring, "muscle_damping": damping, "handle": luck.one(0.0, luck.within(0.1, 2) * inertia),
        "arm": 0.0 if kind == "fingers" else mass, "wrist": luck.within(80, 600) * size,
        "wrist_damping": luck.one(0.0, luck.within(0.02, 0.3)) * math.sqrt(80 * size * mass),
        "twitch_s": 0.02, "reflex_s": 0.04, "tremor_omega": 60.0,
    }  # fmt: skip
    if kind == "soft":
        made["muscle_damping"] = damping * luck.one(0.0, luck.within(0, 0.3))
    if kind == "fingers":
        made["muscle_damping"] = luck.spread(0.003, 1.0) * size
    if kind in ("nerves", "tremor"):
        made |= {"reflex": luck.within(0.1, 0.8) * spring, "reflex_s": luck.within(0.03, 0.06)}
        made["reflex_damping"] = luck.one(0.0, luck.within(0, 0.5)) * damping
    if kind == "tremor":
        made |= {"tremor": luck.spread(0.01, 0.2) * dry, "tremor_omega": 2 * math.pi * luck.within(8, 12)}
    fastest, hz = luck.one((0.05, 0.1), (0.15, 0.25), (0.4, 0.4), (0.9, 0.5), (1.6, 0.8))
    made |= {"omega": 2 * math.pi * hz, "from_s": 3.0, "to_s": 3.0 + (2 + luck.one(0.0, 0.25, 0.6)) / hz}
    return made | {"amplitude": fastest / (2 * math.pi * hz) + luck.one(0.0, dry / spring)}, kind, fastest


def drawn(seed, folder, policies=("hybrid", "hybrid", "hybrid", "observer"), stribecks=40.0):
    """A random rig file, its policy one of these, with its joint and arm; its model is of speeds up to so
    many of the joint's Stribeck speeds."""
    luck = Luck(seed)
    linear = luck.draw.random() < 0.25
    joint, gear_hz = _joint(luck)
    inertia = joint["motor"] + joint["link"]
    holder, kind, fastest = _arm(luck, joint["coulomb"], inertia)
    length_m = LENGTH_M if linear else 1.0
    rate_hz = luck.one(250.0, 500.0, 1000.0, 1000.0, 2000.0, 4000.0)
    every = 1 if rate_hz < 1000 else luck.one(1, 1, 2, 3)
    late, lag_hz = luck.one(0.0, 1.0, luck.within(0, 2)), luck.one(0.0, luck.spread(80, 3000))
    most = joint["breakaway"] * luck.within(4, 15) / length_m
    lever_m = 1.0 if linear else LENGTH_M
    device = {
        "late_ticks": late * luck.one(1.0, luck.within(0, 1)), "sample_ticks": luck.one(every, every, 1),
        "lag_s": 1 / (2 * math.pi * lag_hz * luck.within(1, 2)) if lag_hz else 0.0, "current_noise": 0.002,
        "force_step": most / lever_m * 2e-5, "force_noise": most / lever_m * luck.one(0.0, 1e-5, 1e-4),
    }  # fmt: skip
    a = np.zeros(1, AXIS)
    for name, value in (joint | holder).items():
        a[name] = value * length_m ** _OF_LENGTH.get(name, 0)
    for name, value in device.items():
        a[name] = value
    says, models = _file(
        luck, policies, a, inertia / length_m**2, gear_hz, linear, most, lever_m, length_m, lag_hz, stribecks
    )
    loaded = fitted(
        "mock-linear.toml" if linear else "mock.toml", [says], folder, luck.one(0.3, 0.9, 0.99),
        models=models,
        device={"timing": {"sample_every_ticks": every, "transport_delay_ticks": late}}, rate_hz=rate_hz,
    )  # fmt: skip
    return Drawn(loaded, a, kind, fastest, length_m)


def _file(luck, policies, a, inertia, gear_hz, linear, most, lever_m, length_m, lag_hz, stribecks):
    """What the rig file says of it, and its model of friction."""
    one = {name: float(a[name][0]) for name in AXIS.names}
    drive = {"current_loop_hz": lag_hz}
    if gear_hz and luck.draw.random() < 0.4:
        drive["resonance_hz"] = gear_hz
    says = {
        "inertia_kgm2": inertia, "viscous_nms_rad": one["viscous"], "torque_limit_nm": most,
        "torque_rate_nm_s": 100 * most, "gear_ratio": 1.0, "gear_efficiency": 1.0,
        "torque_constant_nm_a": most / 5.0 / (2 * math.pi / 0.005 if linear else 1.0),
        "velocity_limit_rad_s": 8.0 * length_m, "current_limit_a": 10.0, "drive": drive,
        "coupling": {
            "delay_ticks": 0.0, "damping_nms_rad": one["viscous"] * luck.within(0.0, 0.6),
            "stiffness_nm_rad": 1e-3 * most,
        },
        "force": {
            "limit_n": min(max(100 * most / lever_m, 1), 9e3), "resolution_n": max(one["force_step"], 1e-6)
        },
        "encoder_counts_per_rev": luck.one(2e4, 1e5) if linear else luck.one(1e5, 1e6),
        "friction": {
            "gain": luck.one(0.8, 0.95, 0.95), "intent_nm": 0.2 * one["coulomb"],
            "gate_nm": 0.1 * one["coulomb"], "presliding_rad": one["breakaway"] / one["bristle"],
            "blend_rad_s": 0.08 * length_m, "policy": luck.one(*policies),
        },
        "environment": {"kind": "free", "stiffness_nm_rad": 1.0, "center_rad": 0.0},
    }  # fmt: skip
    if not linear:
        says["lever_m"] = [0.0, lever_m, 0.0]
    own = {name: one[name] for name in ("stribeck", "viscous", "bristle", "coulomb", "breakaway")}
    rig, motion = ("slide", "linear") if linear else ("mock", "rotary")
    factor = luck.one(1.0, 1.0, 0.92, 1.06)
    return says, [model(own | {"backward": 1.0}, rig, motion, factor, stribecks)]


def rubbing(a, share):
    """The same joint with so much of its dry friction, bristles as long as they were."""
    made = a.copy()
    for name in ("coulomb", "breakaway", "bristle"):
        made[name] *= share
    made["bristle_damping"] *= math.sqrt(share)
    return made


class Rest(NamedTuple):
    """What is left 2 to 5 s after the motion, rad/s and N m, when a speed was last loud, s after the motion,
    what the arm was given from 2 s on, J, and the fault that ended it."""

    speed: float
    ends_s: float
    fed_j: float
    fault: int


def rest(case, a, seed, policy=None):
    """Armed, moved, held; None if it was not armed in time."""
    rig = Rig(case.loaded, a, seed, policy)
    if not rig.arm():
        return None
    rig.run(float(a["to_s"][0]) - rig.time_s)
    second = round(1 / rig.period_s)
    out = rig.run(12.0)
    while len(out) < 60 * second and out[2 * second :, 3].sum() > 1e-3 * FED_J:
        out = np.concatenate([out, rig.run(12.0)])
    speed = np.abs(out[:, :2]).max(axis=1) / case.length_m
    loud = np.flatnonzero(speed > QUIET)
    part = np.square(out[2 * second : 5 * second, :2] / case.length_m)
    given = np.cumsum(out[2 * second :, 3])
    return Rest(
        float(np.sqrt(part.mean(axis=0).max())),
        float((loud[-1] + 1) * rig.period_s) if len(loud) else 0.0,
        float(given.max()),
        -1 if rig.active else rig.fault,
    )


def judged(case, seed):
    """(with help, without, loud, beyond both, fed): None where it was not armed in time."""
    helped = rest(case, case.axis, seed)
    if helped is None:
        return None
    plain = rest(case, case.axis, seed, Policy.OFF)
    loud = both = not helped.speed <= max(QUIET, OWN * plain.speed)
    if loud:
        others = [rest(case, rubbing(case.axis, share), seed, Policy.OFF) for share in LITTLE]
        both = not helped.speed <= OWN * max(one.speed for one in others if one is not None)
    passive = case.kind not in ("nerves", "tremor")
    most = FED_J * max(float(case.axis["coulomb"][0]) * case.length_m / 0.25, 1.0)
    fed = passive and helped.fed_j > max(most, OWN * plain.fed_j)
    return helped, plain, loud, both, fed


def _name(fault):
    return Fault(1 << fault).name if fault >= 0 else "none"


def _say(seed, case, verdict):
    helped, plain, loud, both, fed = verdict
    words = [name for name, so in (("loud", loud), ("beyond both", both), ("fed", fed)) if so]
    if helped.fault >= 0 or plain.fault >= 0:
        words.append(f"fault {_name(helped.fault)} ({_name(plain.fault)} without help)")
    if not words:
        return
    click.echo(
        f"seed {seed}: {', '.join(words)}: {case.kind}, {case.loaded.config.axis[0].friction.policy}: "
        f"{1e3 * helped.speed:.2f} mrad/s ({1e3 * plain.speed:.2f} without help), quiet after "
        f"{helped.ends_s:.1f} s ({plain.ends_s:.1f}), fed "
        f"{1e3 * helped.fed_j:.3g} mJ ({1e3 * plain.fed_j:.3g})"
    )


def every_rig(asked, drawn, judged):
    """Seed, case and verdict of each certified rig that armed; `asked`: the first seed, and how many."""
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(asked.first, asked.first + asked.rigs):
            case = drawn(seed, folder)
            if case.loaded is None:
                continue
            verdict = judged(case, seed)
            if verdict is None:
                click.echo(f"seed {seed}: not armed in time")
            else:
                yield seed, case, verdict


def parser_of(about):
    """Of a script that judges rigs."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--rigs", type=int, default=100)
    return parser


def main():
    asked, found = parser_of(__doc__).parse_args(), []
    for seed, case, verdict in every_rig(asked, drawn, judged):
        found.append((case.kind, *verdict))
        _say(seed, case, verdict)
    for kind in sorted({one[0] for one in found}):
        of = [one for one in found if one[0] == kind]
        loud, both, fed = (sum(one[i] for one in of) for i in (3, 4, 5))
        click.echo(
            f"{kind}: {len(of)} certified, loud {loud}, beyond both {both}, fed {fed}, faults "
            f"{sum(one[1].fault >= 0 for one in of)} ({sum(one[2].fault >= 0 for one in of)} without help)"
        )


if __name__ == "__main__":
    main()
