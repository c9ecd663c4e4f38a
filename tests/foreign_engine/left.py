"""What is left of the hand's torque on joints of other makes, why, and what could be reached.
`python tests/foreign_engine/left.py` (decisions 0159, 0181).

Every tick the hand's torque is the joint's inertia, its viscous part, and what help leaves of the dry
friction; that is followed through the law: what it does not mean to give, what turns late or stands, and what
each stage takes back. Each part is projected on the hand's torque, over the RMS without help: the parts add
up to what is left. Beside it stand two oracles without a law, joints with .05 (the most that the shipped gain
may give back) and .001 of their dry friction: what help that knows the friction at once leaves in this hand.
"""

import argparse
import sys
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import click
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from foreign_files import model, rig_file

from foreign_engine import plants, rig
from foreign_engine.engines import ROWS
from rtctl.control.feeding import BANK_RAD
from rtctl.control.vocabulary import Policy
from rtctl.friction import artefact

GEARED = plants.Joint(0.008, 0.04, 0.2, 0.004, 168.4, 0.01, 0.01, 0.05)
"""40 Hz."""
JOINTS = {"rigid": plants.Joint(), "geared": GEARED, "strong": plants.Joint(0.02, 0.1, 0.6)}
HANDS = {"arm": plants.Hand("arm", 0.01, 5.0, 0.1), "muscles": plants.Hand("muscles", 0.012, 10.0, 0.2)}
FROM_S, SETTLED_S = 3.0, 5.0
LENGTH_RAD = 3.125e-4
"""What `identify` knows of them: no presliding longer than that (decision 0156)."""
TURNED = 0.97
"""Friction below this share of the dry one holds; the joint has not let go yet."""
TURN_S = 0.2
ORACLES = (0.05, 0.001)


def sine(time_s):
    return 0.3 * np.sin(2 * np.pi * 0.5 * np.maximum(time_s - FROM_S, 0.0))


def triangle(amplitude, hz, time_s):
    return amplitude * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * hz * np.maximum(time_s - FROM_S, 0.0)))


MOTIONS = {
    "fast sine": (sine, 8.0),
    "triangle of .3 rad/s": (partial(triangle, 0.3, 0.25), 8.0),
    "slow triangle": (partial(triangle, 0.15, 1 / 6), 12.0),
}
"""The hand's wish and how long it is judged, s."""
STATE = ("friction_brake", "stroke_left", "paid_left", "trembled_s", "fed_j")
TICK = (
    "friction_gate", "assistance_share", "feedforward_torque_nm", "observer_torque_nm", "torque_applied_nm",
    "friction_observed_nm", "velocity_rad_s",
)  # fmt: skip


def loaded_for(joint, policy, folder, learned=None):
    """The shipped file told what this joint is, with this model, or the joint's own friction as one."""
    dry, viscous = joint.dry + joint.link_dry, joint.viscous + joint.link_viscous
    flat = {"stribeck": 0.05, "viscous": viscous, "bristle": 1.0, "backward": 1.0}
    flat |= {"coulomb": dry, "breakaway": dry}
    own = replace(model(flat), presliding_rad=LENGTH_RAD, presliding_spread_rad=0.0, presliding_ramps=8)
    says = {
        "inertia_kgm2": joint.motor + joint.link, "viscous_nms_rad": viscous, "torque_limit_nm": 8 * dry,
        "friction": {"policy": policy, "intent_nm": 0.0, "gate_nm": 0.0},
    }  # fmt: skip
    return rig_file("mock.toml", [says], folder, models=[learned or own])


def ran(loaded, joint, hand, motion, device, policy=None):
    """(rig, what it tells of each tick, tick and state of the law in each)."""
    one = rig.Rig(loaded, joint, hand, plants.World(), device, 21, policy)
    one.wish, seconds = MOTIONS[motion]
    if not one.arm():
        raise click.ClickException("not armed in time")
    one.run(SETTLED_S - one.time_s)
    n = round(seconds / one.period_s)
    out, told = np.zeros((n, len(rig.Rig.SEEN))), np.zeros(n, [(name, "<f8") for name in (*TICK, *STATE)])
    for k in range(n):
        out[k] = one.run(one.period_s)[0]
        told[k] = tuple(one.law[at][name].flat[0] for at, of in ((0, TICK), (1, STATE)) for name in of)
    return one, out, told


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def balance(one, out, told):
    """(inertia, viscous part, dry friction) of both masses over each period, N m."""
    j, parts = one.joint, np.zeros((2, len(out)))
    for column, inertia, viscous in ((0, j.motor, j.viscous), (1, j.link, j.link_viscous)):
        v = np.concatenate([out[:1, column], out[:, column]])
        parts += inertia * np.diff(v) / one.period_s, viscous * 0.5 * (v[1:] + v[:-1])
    return *parts, out[:, 2] + told["torque_applied_nm"] - parts.sum(axis=0)


def stages(whole, shares):
    """What each share takes of `whole`, one after the other; and what is left."""
    taken = {}
    for name, share in shares.items():
        taken[name], whole = whole * (1.0 - share), whole * share
    return taken, whole


def taken_back(told):
    """Shares that the law leaves of all help."""
    calm = np.clip((0.5 - told["trembled_s"]) / 0.2, 0.0, 1.0)
    return {
        "account": told["assistance_share"],
        "taken back": (1 - told["friction_brake"]) * (1 - told["stroke_left"]) * calm * told["paid_left"],
    }


def by_curve(one, out, told, dry):
    """Where the help of a feed-forward with an observer on top falls short of the dry friction."""
    p, back = one.law[2], taken_back(told)
    left = np.maximum(back["account"] * back["taken back"], 1e-9)
    given = told["feedforward_torque_nm"] / left / np.maximum(told["friction_gate"], 1e-9)
    n, most = len(out), one.joint.dry + one.joint.link_dry
    turns = np.flatnonzero(np.diff(np.sign(out[:, 1])) != 0)
    since = np.abs(np.arange(n) - turns[np.maximum(np.searchsorted(turns, np.arange(n)) - 1, 0)])
    turning = (since * one.period_s < TURN_S) | (np.abs(dry) < TURNED * most)
    gain = float(p["friction_gain"].flat[0])
    short = gain * dry - given
    taken, _ = stages(given, {"gate": told["friction_gate"], **back})
    return {
        "meant": (1 - gain) * dry, "turns": short * turning, "curve": short * ~turning, **taken,
        "observer": -told["observer_torque_nm"],
    }  # fmt: skip


def by_observer(one, _out, told, dry):
    """Where that of an observer alone does."""
    p, seen = one.law[2], told["friction_observed_nm"]
    gain, dead = float(p["observer_gain"].flat[0]), float(p["observer_deadband_nm"].flat[0])
    bank = float(p["paying_nm"].flat[0]) * BANK_RAD
    aimed = (1 - 0.03 * np.exp(-((told["velocity_rad_s"] / 0.03) ** 2))) * seen
    wanted = gain * np.sign(aimed) * np.maximum(np.abs(aimed) - dead, 0.0)
    unfed = np.clip(1 + told["fed_j"] / bank, 0.0, 1.0)
    taken, _ = stages(wanted, {**taken_back(told), "fed": unfed})
    return {"lag": dry - seen, "meant": seen - wanted, **taken}


def row(name, hand, motion, policy, device, folder, learned=None):
    """One line: what is left, with which oracles, and of what."""
    joint = JOINTS[name]
    loaded = loaded_for(joint, policy, folder, learned)
    go = partial(ran, loaded, hand=HANDS[hand], motion=motion, device=device)
    off = rms(go(joint, policy=Policy.OFF)[1][:, 2])
    one, out, told = go(joint)
    inertia, viscous, dry = balance(one, out, told)
    made = by_observer if policy == "observer" else by_curve
    parts = {"inertia": inertia, "viscous": viscous, **made(one, out, told, dry)}
    torque = out[:, 2]
    parts["else"] = torque - np.sum(list(parts.values()), axis=0)
    oracles = []
    for share in ORACLES:
        rubs = joint._replace(dry=share * joint.dry, link_dry=share * joint.link_dry)
        oracles.append(rms(go(rubs, policy=Policy.OFF)[1][:, 2]) / off)
    of = ", ".join(f"{key} {np.mean(part * torque) / rms(torque) / off:.3f}" for key, part in parts.items())
    return f"| {name} | {hand} | {motion} | {rms(torque) / off:.3f} | " + " / ".join(
        f"{one:.3f}" for one in oracles
    ) + f" | {of} |"  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--policy", nargs="+", default=["hybrid", "observer"])
    parser.add_argument("--joint", nargs="+", choices=JOINTS, default=list(JOINTS))
    parser.add_argument("--hand", nargs="+", choices=HANDS, default=list(HANDS))
    parser.add_argument("--motion", nargs="+", choices=MOTIONS, default=list(MOTIONS))
    parser.add_argument("--step", type=float, default=1e-4, help="of the engine, s")
    parser.add_argument("--engine", choices=ROWS, default="mujoco")
    parser.add_argument("--models", type=Path, help="folder of what `identified.py` learned of each joint")
    asked = parser.parse_args()
    device = plants.Device(force_noise=0.005, step_s=asked.step, engine=asked.engine)
    with tempfile.TemporaryDirectory() as folder:
        for policy in asked.policy:
            click.echo(f"{policy}\n| joint | hand | motion | left | oracles | of what |")
            for name in asked.joint:
                learned = artefact.load(asked.models / f"{name}.json") if asked.models else None
                for hand in asked.hand:
                    for motion in asked.motion:
                        click.echo(row(name, hand, motion, policy, device, folder, learned))


if __name__ == "__main__":
    main()
