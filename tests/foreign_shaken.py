"""Does the help of a certified rig shake the hand that moves it? `python tests/foreign_shaken.py --rigs 200`.

Random rigs, certified, on joints of another make (`tests/foreign_swings.py`) in random hands, with help and
without. Judged is what is left of the speeds of motor and link beside their mean over .06 s to both sides,
taken twice, RMS, of the whole motion and of the strokes between its turns; and the speed from 2 to 5 s after
it. *Shaken* is who has `MORE` than without help; *beyond both* who has it beyond a joint with a twentieth of
the dry friction, too, which is what the help promises at best; *beyond every friction* who has it beyond
joints with all that lies between. *The hand pays* where it, and not the joint, gives what the vibration has.
"""

import argparse
import math
import tempfile

import click
import numpy as np
from foreign_strokes import drawn, hands_of, in_box
from foreign_swings import Rig

from rtctl.control.vocabulary import Policy

MORE = {"whole": 20.0, "strokes": 20.0, "still": 2.0}
"""mrad/s; of a carriage with its handle .1 m from the joint it would be."""
BETWEEN = (0.1, 0.2, 0.35, 0.5, 0.7, 0.85)
LITTLE = 0.05


def rubbing(a, share):
    """The same joint with so much of its dry friction."""
    made = a.copy()
    for name in ("coulomb", "breakaway", "link_dry", "bristle"):
        made[name] *= share
    made["bristle_damping"] *= math.sqrt(share)
    return made


def beside(signal, n):
    """What is left of it beside its mean, taken twice."""
    for _ in range(2):
        signal = signal[n:-n] - np.convolve(signal, np.full(2 * n + 1, 1 / (2 * n + 1)), "valid")
    return signal


def _rms(values):
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0


def left(case, a, seed, policy=None, share=1.0):
    """What the motion leaves (`told`); None if it was not armed in time."""
    rig = Rig(case.loaded, a, seed, policy, share)
    return told(case, rig)[:3] if rig.arm() else None


def told(case, rig):
    """What the motion of an armed rig leaves: mrad/s by part and mass, the hand's torque, and the power, W,
    that it pays for the vibration; and all that the rig tells of its ticks, and of those in the 6 s after.
    """
    a = rig.a
    n, ticks = round(0.06 / rig.period_s), lambda seconds: round(seconds / rig.period_s)
    begins = ticks(float(a["from_s"][0]) - rig.time_s)
    moved = rig.run(float(a["to_s"][0]) - rig.time_s)[begins:]
    after = rig.run(6.0)
    held = after[ticks(2.0) : ticks(5.0)]
    found, least = {}, 0.5 * case.fastest * case.length_m
    for name, speed in (("motor", moved[:, 0]), ("link", moved[:, 1])):
        loud = 1e3 / case.length_m * beside(speed, n)
        strokes = np.abs(np.convolve(speed, np.full(2 * n + 1, 1 / (2 * n + 1)), "valid"))[n:-n] > least
        found |= {f"whole {name}": _rms(loud), f"strokes {name}": _rms(loud[strokes])}
    found["still"] = 1e3 / case.length_m * max(_rms(held[:, 0]), _rms(held[:, 1]))
    paid = float(np.mean(beside(moved[:, 2], n) * beside(moved[:, 1], n)))
    return found, _rms(moved[:, 2]), paid, moved, after


def beyond(found, *others):
    """By how much it is shaken more than all others, mrad/s, by name of what is."""
    over = {name: value - max(other[name] for other in others) for name, value in found.items()}
    return {name: value for name, value in over.items() if value > MORE[name.split()[0]]}


def judged(case, a, seed, share=1.0):
    """(shaken, beyond both, beyond every friction, the hand pays, its torque with help over that without)."""
    runs = [left(case, a, seed, None, share), left(case, a, seed, Policy.OFF)]
    if None in runs:
        return None
    (found, torque, paid), (plain, usual, _) = runs
    shaken, both, every = beyond(found, plain), {}, {}
    if shaken:
        others = [plain, *_without_help(case, a, seed, (LITTLE,))]
        both = beyond(found, *others)
        every = both and beyond(found, *others, *_without_help(case, a, seed, BETWEEN))
    return shaken, both, every, bool(both) and paid > 0 and set(both) != {"still"}, torque / usual


def _without_help(case, a, seed, shares):
    runs = (left(case, rubbing(a, share), seed, Policy.OFF) for share in shares)
    return [one[0] for one in runs if one is not None]


def make_of(a):
    """The joint by its gear: does the ratio of its masses tell who is shaken? (Decision 0105: no.)"""
    motor, link = float(a["motor"][0]), float(a["link"][0])
    return "rigid" if link == 0 else "motor twice the link or more" if motor >= 2 * link else "other gears"


def _said(name, of):
    """One line of those cases: rows of `main`."""
    shaken, both, every, paid = (sum(bool(one[i]) for one in of) for i in (2, 3, 4, 5))
    return (
        f"{name}: {len(of)}, shaken {shaken}, beyond both {both} (the hand pays in {paid}), "
        f"beyond every friction {every}"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--rigs", type=int, default=200)
    parser.add_argument("--hands", type=int, default=0, help="others of the box on each rig, not its own")
    parser.add_argument("--share", type=float, default=1.0, help="of the help")
    asked, found, rigs = parser.parse_args(), [], 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(asked.first, asked.first + asked.rigs):
            case = drawn(seed, folder)
            if case.loaded is None:
                continue
            rigs += 1
            for one in hands_of(case, seed, asked.hands) if asked.hands else [case]:
                verdict = judged(one, one.axis, seed, asked.share)
                if verdict is None:
                    click.echo(f"seed {seed}: not armed in time")
                    continue
                policy = one.loaded.config.axis[0].friction.policy
                found.append((seed, (in_box(one, one.axis), policy, make_of(one.axis)), *verdict))
                if verdict[1]:
                    words = ", ".join(f"{name} by {value:.0f}" for name, value in verdict[1].items())
                    pays = "the hand pays" if verdict[3] else "the joint gives"
                    click.echo(f"seed {seed}: {one.kind} at {one.fastest} rad/s: {words} mrad/s; {pays}")
    for box, policy in sorted({one[1][:2] for one in found}, reverse=True):
        of = [one for one in found if one[1][:2] == (box, policy)]
        click.echo(_said(f"{policy}, hands {'of' if box else 'beyond'} the box", of))
    for make in sorted({one[1][2] for one in found}):
        click.echo(_said(make, [one for one in found if one[1][2] == make]))
    with_one, torque = len({one[0] for one in found if one[3]}), np.mean([one[6] for one in found])
    click.echo(f"rigs {rigs}, with a hand beyond both {with_one}; torque left {torque:.3f}")


if __name__ == "__main__":
    main()
