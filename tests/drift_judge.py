"""The watch over friction on changing joints of another make (`tests/foreign_drift.py`): what it tells.

`python -m tests.drift_judge [--seed N] [PLANT ...]` prints a line for each joint, motion and change. Nothing
changes for the first 100 s. Dry friction that changes by a tenth must be told within 60 s of motion with its
factor within 2 %; whatever else changes must not be told as friction.
"""

import itertools
import math
import tempfile
from functools import cache
from pathlib import Path
from typing import NamedTuple

import click
import numpy as np

from rtctl.control.vocabulary import Fault
from rtctl.friction.drift_watch import RigWatch
from tests.foreign_drift import Joint, Rig, learned, on_rail
from tests.foreign_files import certified, rig_file

BEFORE_S, STEP_S, MOTION_S, MOVING = 100.0, 2.0, 60.0, 0.03
DIRECT = Joint()
GEARED = Joint(
    motor=0.012, viscous=0.08, coulomb=0.22, breakaway=0.36, stribeck=0.05, power=1.0, bristle=800.0,
    exponent=0.8, backward=0.97,
)  # fmt: skip
ELASTIC = Joint(
    motor=0.007, link=0.006, gear=450.0, gear_damping=0.05, viscous=0.05, bristle=500.0, exponent=1.0
)
LOOSE = ELASTIC._replace(play=2.5e-3, gear=700.0, gear_damping=0.3)
PLANTS = {
    "direct": DIRECT,
    "geared": GEARED,
    "elastic": ELASTIC,
    "play": LOOSE,
    "carriage": on_rail(DIRECT, 0.1),
    "carriage, elastic": on_rail(LOOSE, 0.1),
}


def strokes(seed, slow, fast, reach, seconds=4000.0):
    """Times and places of strokes to and fro, each of a speed and a length of its own."""
    draw, at, knots = np.random.default_rng(seed), 0.0, [(0.0, 0.0), (2.0, 0.0)]
    while knots[-1][0] < seconds:
        goal = -math.copysign(draw.uniform(0.4, 1.0) * reach, at if at else 1.0)
        speed = float(np.exp(draw.uniform(math.log(slow), math.log(fast))))
        knots.append((knots[-1][0] + abs(goal - at) / speed, goal))
        knots.append((knots[-1][0] + draw.choice([0.02, 0.3]), goal))
        at = goal
    return np.array(knots).T


@cache
def knots(seed):
    """Knots of the motions that go by strokes."""
    return {
        "use": strokes(seed, 0.06, 1.2, 0.4),
        "slow use": strokes(seed + 1, 0.05, 0.15, 0.15),
        "quick use": strokes(seed + 2, 0.6, 1.4, 0.5),
    }


KNOTS = knots(1)
MOTIONS = (*KNOTS, "sine", "small")


def wish(motion, t, size):
    """Where the hand wants to be, and how fast, at the times t."""
    if motion in KNOTS:
        place = [np.interp(t + h, *KNOTS[motion]) for h in (-0.02, 0.02)]
        return {"wish": size * np.interp(t, *KNOTS[motion]), "wish_v": size * (place[1] - place[0]) / 0.04}
    parts = ((0.3, 0.5),) if motion == "sine" else ((0.04, 1.3), (0.02, 2.1), (0.05, 0.17))
    grow = np.clip(t - 2.0, 0.0, 1.0)
    x = sum(a * np.sin(2 * np.pi * f * t) for a, f in parts) * grow
    v = sum(a * 2 * np.pi * f * np.cos(2 * np.pi * f * t) for a, f in parts) * grow
    return {"wish": size * x, "wish_v": size * v}


class Change(NamedTuple):
    """What changes, by the seconds since it began; how long it is followed; whether the rig is to stop."""

    channels: object
    seconds: float = 0.0
    stops: bool = False
    restart: bool = False


def step(**to):
    return Change(lambda t: {name: np.where(t < 0, 1.0, value) for name, value in to.items()})


def pushed(**to):
    """Torques and shares that were 0 before."""
    return Change(lambda t: {name: np.where(t < 0, 0.0, value) for name, value in to.items()}, 90.0)


def swings(amplitude, period):
    """A force sensor's zero that goes to and fro."""
    return Change(lambda t: {"felt": amplitude * np.sin(2 * np.pi * np.clip(t, 0, None) / period)}, 300.0)


def bursts(t, value, on=3.0, every=11.0):
    return np.where((t > 0) & (t % every < on), value * np.where((t // every) % 3 == 1, -1.0, 1.0), 0.0)


def warms(dry, viscous, seconds=1200.0):
    def at(t):
        share = 1.0 - np.exp(-3.0 * np.clip(t, 0.0, None) / seconds)
        return {"forward": 1 + dry * share, "backward": 1 + dry * share, "viscous": 1 + viscous * share}

    return Change(at, seconds)


def changes(f):
    """By name; `f` is the joint's Coulomb friction, of which torques are shares."""
    return {
        "nothing": Change(lambda t: {}, 300.0),
        "a tenth less": step(forward=0.9, backward=0.9),
        "a tenth more": step(forward=1.1, backward=1.1),
        "a tenth more at a restart": step(forward=1.1, backward=1.1)._replace(restart=True),
        "forward a fifth less": step(forward=0.8),
        "backward a fifth more": step(backward=1.2),
        "forward a tenth more": step(forward=1.1),
        "dry a tenth more, viscous .6": step(forward=1.1, backward=1.1, viscous=0.6),
        "viscous .6": step(viscous=0.6)._replace(seconds=120.0),
        "viscous 1.5": step(viscous=1.5)._replace(seconds=120.0),
        "warms: dry .85, viscous .6 in 20 min": warms(-0.15, -0.4),
        "worn at one place, .7": step(worn=0.7),
        "a third less": step(forward=0.67, backward=0.67)._replace(stops=True),
        "torque .4 F": pushed(torque=0.4 * f),
        "spring of 1 F/rad": pushed(spring=1.0 * f),
        "spring of 4 F/rad": pushed(spring=4.0 * f),
        "handle out of balance, .5 F": pushed(weight=0.5 * f),
        "sensor's bias .2 F": pushed(felt=0.2 * f),
        "sensor's bias drifts, .3 F in 10 min": Change(
            lambda t: {"felt": 0.3 * f * np.clip(t, 0, 600) / 600}, 600.0
        ),
        "sensor's bias swings, .2 F in 90 s": swings(0.2 * f, 90.0),
        "sensor's bias swings, .2 F in 45 s": swings(0.2 * f, 45.0),
        "current's zero .1 F": pushed(current=0.1 * f),
        "pushes on the mounting, .5 F": Change(lambda t: {"torque": bursts(t, 0.5 * f)}, 200.0),
        "a third of the hand past the sensor, at times": Change(
            lambda t: {"past": np.abs(bursts(t, 0.33))}, 200.0
        ),
    }


def payloads(inertia):
    """Loads as heavy as the joint itself, on the handle and past the sensor."""
    return {
        "payload on the handle": pushed(payload=inertia),
        "payload past the sensor": Change(
            lambda t: {"payload": np.where(t < 0, 0.0, 0.5 * inertia), "seen": np.where(t < 0, 1.0, 0.0)},
            90.0,
        ),
    }


def rig_of(joint, folder):
    """A rig file that `rtctl check` lets pass, with a model of the joint's curve."""
    linear = joint.size != 1.0
    limit = 6.0 * joint.breakaway
    says = {
        "inertia_kgm2": joint.motor + joint.link, "viscous_nms_rad": 0.9 * joint.viscous,
        "torque_limit_nm": limit, "torque_rate_nm_s": 100 * limit, "velocity_limit_rad_s": 6.0 * joint.size,
        "current_limit_a": 5 * limit / (15.0 if linear else 0.77),
        "force": {"limit_n": 1e4, "resolution_n": 0.005},
        "coupling": {"delay_ticks": 0.0, "stiffness_nm_rad": 5.0 / joint.size**2,
            "damping_nms_rad": 0.1 * joint.viscous}, "friction": {"gain": 0.9},
    }  # fmt: skip
    base, rig, motion = ("mock-linear.toml", "slide", "linear") if linear else ("mock.toml", "mock", "rotary")
    if linear:
        says |= {"encoder_counts_per_rev": 50000.0, "position_min_rad": -1.0, "position_max_rad": 1.0}
    else:
        says["friction"] |= {"intent_nm": 0.0, "gate_nm": 0.0}
    loaded = rig_file(base, [says], folder, models=[learned(joint, rig, motion)])
    assert certified(loaded), "the judge's rig is refused"
    return loaded


def restarted(rig_watch, make):
    """Another watch that goes on from what this one keeps."""
    from rtctl.friction import drift_state as state

    with tempfile.TemporaryDirectory() as folder:
        state.write(Path(folder), "d", {"joint": state.packed(rig_watch.axes[0])})
        other = make()
        assert state.restore(other.axes[0], state.read(Path(folder), "d")["joint"])
    return other


def watched(loaded, joint, motion, change, seed=1):
    """Rows, one every 2 s: time since the change, motion, truth, factor, error, warned, stopped; words."""
    rig = Rig(loaded, joint, seed)

    def make():
        return RigWatch(rig.plan.params, rig.plan.model, [loaded.config.axis[0].friction.drift])

    def script(t):
        return {**wish(motion, t, joint.size), **change.channels(t - BEFORE_S)}

    watch, moved, rows, words = make(), 0.0, [], ""
    watch.follow(rig.arm(script))
    until = BEFORE_S + max(change.seconds, 5 * MOTION_S)
    restart = change.restart
    while rig.time_s < until:
        if restart and rig.time_s >= BEFORE_S:
            watch, restart = restarted(watch, make), False
        ticks = rig.run(STEP_S, script)
        watch.follow(ticks)
        t = rig.time_s - BEFORE_S
        (axis,) = watch.axes
        moves = np.abs(ticks["velocity_rad_s"][:, 0]) > MOVING * joint.size
        moved += STEP_S * float(moves.mean()) * (t > 0)
        now = script(np.array([rig.time_s]))
        parts = [float(np.ravel(now.get(name, 1.0))[0]) for name in ("forward", "backward", "worn")]
        x = ticks["position_rad"][::10, 0]
        worn = 1 + (parts[2] - 1) * np.mean(np.exp(-0.5 * ((x - joint.worn_at) / joint.worn_width) ** 2))
        truth = (parts[0] + joint.backward * parts[1]) / (1 + joint.backward) * worn
        found = axis.found
        factor = (found.factor, found.factor_error) if found else (np.nan, np.nan)
        rows.append((t, moved, truth, *factor, bool(axis.warning), bool(axis.stopped)))
        words = axis.warning or words
        if ticks["faults"].any():
            words = f"FAULT {Fault(int(np.bitwise_or.reduce(ticks['faults'])))!r}"
            break
        if not change.seconds and moved >= MOTION_S:
            break
    return np.array(rows, float), words


def verdict(rows, words, change):
    """In one word how it was told: rightly, late, missed, wrongly; and what else there is to say."""
    t, moved, truth, factor, error, warned, stopped = rows.T
    end, said = truth[-5:].mean(), []
    changed = np.abs(truth - 1) >= 0.0995
    if words.startswith("FAULT"):
        return "fault", words
    if np.any(warned[t <= 0]):
        said.append("false before")
    if np.any(stopped) and not change.stops:
        said.append("STOPPED")
    if change.stops and not np.any(stopped):
        said.append("not stopped")
    still = np.abs(truth[:-1] - end) < 1e-3 if not change.seconds else np.abs(np.diff(truth)) < 5e-4
    off = np.abs(factor[-1] - end) if still[-1] else np.nan
    if off > 0.02:
        said.append(f"off by {off:.3f}")
    after = moved - moved[np.argmax(changed)] if changed.any() else np.full(len(moved), np.nan)
    if changed.any():
        lag = after[warned.astype(bool) & changed]
        kind = "missed" if not len(lag) else "told" if lag[0] <= MOTION_S else "late"
        said.append(f"{lag[0]:.0f} s" if len(lag) else "")
    else:
        small = np.abs(end - 1) < 0.065
        kind = "wrong" if warned.any() and small else "told" if warned.any() else "quiet"
    wide = np.nanmean(3 * error[-10:])
    return (
        kind,
        f"{factor[-1]:.3f} +- {wide:.3f} for {end:.3f} ({np.nanmin(factor):.3f} to {np.nanmax(factor):.3f}) "
        + ", ".join(one for one in said if one),
    )


def judged(names, motions=MOTIONS, only=None, seed=1):
    """Rows of plant, motion, change, verdict, words; `seed` is that of strokes and noise."""
    KNOTS.update(knots(seed))
    for name in names:
        joint = PLANTS[name]
        with tempfile.TemporaryDirectory() as folder:
            loaded = rig_of(joint, folder)
            every = {**changes(joint.coulomb), **payloads(joint.motor + joint.link)}
            for motion, what in itertools.product(motions, every):
                if only in (None, what):
                    said = verdict(*watched(loaded, joint, motion, every[what], seed), every[what])
                    yield (name, motion, what, *said)


@click.command()
@click.option("--seed", default=1, help="of strokes and noise")
@click.argument("names", nargs=-1)
def main(names, seed):
    """Print every row and the sums."""
    sums = {}
    for row in judged(names or PLANTS, seed=seed):
        click.echo(f"{row[0]:18} {row[1]:10} {row[2]:46} {row[3]:7} {row[4]}")
        sums[row[3]] = sums.get(row[3], 0) + 1
    click.echo(sums)


if __name__ == "__main__":
    main()
