"""The watch over friction under what nobody modelled: cables, warm oil, iron that saturates, a hand that
holds, works at one place, only slowly or only briskly.

`python -m tests.drift_unseen [--seed N] [PLANT ...]` prints rows as `tests.drift_judge` does.
"""

import itertools
import tempfile

import click
import numpy as np

from tests import drift_judge as judge
from tests.drift_judge import Change, pushed, rig_of, step, strokes, verdict, watched

MOTIONS = ("slow use", "quick use", "holds", "one place")


def with_holds(seed):
    """Strokes with holds of 4 to 20 s after every third."""
    draw, (t, x) = np.random.default_rng(seed), strokes(seed, 0.1, 0.8, 0.4)
    wait = np.zeros(len(t))
    wait[7::6] = draw.uniform(4.0, 20.0, len(wait[7::6]))
    return np.array([t + np.cumsum(wait), x])


def at_one_place(seed):
    """Short strokes about .5 rad, reached once."""
    t, x = strokes(seed, 0.08, 0.4, 0.08)
    return np.array([t, np.where(t > 2.0, 0.5 + x, 0.0)])


def knots(seed):
    """Knots of every motion."""
    own = {"holds": with_holds(seed + 3), "one place": at_one_place(seed + 4)}
    return {**judge.knots(seed), **own}


def thins(to, seconds=1200.0):
    """Oil that warms: its viscous part falls, its dry one stays."""
    return Change(lambda t: {"viscous": 1.0 + (to - 1.0) * np.clip(t, 0.0, seconds) / seconds}, seconds)


def fades(value, seconds):
    """A force sensor's zero that drifts as it warms."""
    return Change(lambda t: {"felt": value * -np.expm1(-np.clip(t, 0.0, None) / 200.0)}, seconds)


def changes(joint):
    """By name."""
    f = joint.coulomb
    return {
        "a tenth less": step(forward=0.9, backward=0.9),
        "a tenth more": step(forward=1.1, backward=1.1),
        "a cable, .05 F": pushed(cable=0.05 * f),
        "a cable, .15 F": pushed(cable=0.15 * f)._replace(seconds=200.0),
        "oil warms, viscous .6 in 20 min": thins(0.6),
        "motor saturates near 2 F": Change(lambda t: {"most": np.where(t < 0, 1e9, 2.0 * f)}, 90.0),
        "sensor's zero fades by .3 F": fades(0.3 * f, 600.0),
        "hand's mass past the sensor, .3 of the joint": Change(
            lambda t: {
                "payload": np.where(t < 0, 0.0, 0.3 * (joint.motor + joint.link)),
                "seen": np.where(t < 0, 1.0, 0.0),
            },
            90.0,
        ),
    }


def judged(names, motions=MOTIONS, only=None, seed=1):
    """Rows of plant, motion, change, verdict, words."""
    judge.KNOTS.update(knots(seed))
    for name in names:
        joint = judge.PLANTS[name]
        with tempfile.TemporaryDirectory() as folder:
            loaded = rig_of(joint, folder)
            every = changes(joint)
            for motion, what in itertools.product(motions, every):
                if only in (None, what):
                    change = every[what]
                    yield (
                        name,
                        motion,
                        what,
                        *verdict(*watched(loaded, joint, motion, change, seed), change),
                    )


@click.command()
@click.option("--seed", default=1, help="of strokes and noise")
@click.option("--only", help="a change")
@click.argument("names", nargs=-1)
def main(names, seed, only):
    """Print every row and the sums."""
    sums = {}
    for row in judged(names or ("direct", "elastic"), only=only, seed=seed):
        click.echo(f"{row[0]:18} {row[1]:10} {row[2]:46} {row[3]:7} {row[4]}")
        sums[row[3]] = sums.get(row[3], 0) + 1
    click.echo(sums)


if __name__ == "__main__":
    main()
