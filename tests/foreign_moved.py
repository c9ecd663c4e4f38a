"""Does the help of a certified rig shake the arm that moves it? `python tests/foreign_moved.py --rigs 100`.

Joints and arms of `tests/foreign_arms.py`, rigs of `tests/foreign_rests.py`; the arm goes to and fro by a
sine, turns at once, or stops after each step, .05 to 1.6 rad/s, then holds. *Shaken*, *beyond both* and
*beyond every friction* are those of `tests/foreign_shaken.py`. *Fed* is a passive arm that is given more
energy at a stretch than without help and with little friction, by more than `FED_J` and a quarter; *unseen*
who is fed and no PASSIVITY was raised, *false* a PASSIVITY where nobody is fed or shaken. `--ends`: of rigs
whose friction was measured up to .9 of the arm's largest speed at most (decision 0134).
"""

import math
from functools import partial
from typing import NamedTuple

import click
import numpy as np
from foreign_arms import Rig
from foreign_rests import Luck, every_rig, parser_of, rubbing
from foreign_rests import drawn as at_rest
from foreign_shaken import BETWEEN, LITTLE, beyond, told

from rtctl.control.vocabulary import Fault, Policy

POLICIES = ("hybrid", "hybrid", "observer", "stop_gated")
MANNERS = ("sine", "turns", "stops")
_AMPLITUDE = (1.0, 1.0, 0.84)
"""Of the three manners, for the same largest speed."""
FED_J = 2e-3
"""Of friction of .25 N m, and in proportion above."""


class _Ends(Luck):
    """Up to which speed the friction of a case was measured."""

    FIRST = 99173


def drawn(seed, folder, stribecks=40.0):
    """A random rig file with its joint and the arm that moves it."""
    case = at_rest(seed, folder, POLICIES, stribecks)
    manner = Luck(seed, 1).one(0, 1, 2)
    case.axis["manner"] = manner
    case.axis["amplitude"] *= _AMPLITUDE[manner]
    return case


def drawn_with_an_end(seed, folder):
    """The same with a model that ends below the arm's speed; `loaded` None where it does not."""
    stribecks = _Ends(seed, 7).spread(4, 40)
    case = drawn(seed, folder, stribecks)
    ends = stribecks * float(case.axis["stribeck"][0])
    return case if ends <= 0.9 * case.fastest * case.length_m else case._replace(loaded=None)


class Motion(NamedTuple):
    """What is left of it, mrad/s by part and mass; the torque; the power that the arm pays for vibration, W;
    the most energy that it was given at a stretch beyond what the joint's masses lost, J; the fault that
    ended it."""

    left: dict
    torque: float
    paid_w: float
    given_j: float
    fault: int


def motion(case, a, seed, policy=None, share=1.0, make=Rig):
    """Armed, moved, held; None if it was not armed in time."""
    rig = make(case.loaded, a, seed, policy, share)
    if not rig.arm():
        return None
    left, torque, paid_w, moved, after = told(case, rig)
    out, one = np.concatenate([moved, after]), a[0]
    own = 0.5 * (one["motor"] * out[:, 0] ** 2 + one["link"] * out[:, 1] ** 2)
    given = np.cumsum(out[:, 3]) + own
    most = float((given - np.minimum.accumulate(given)).max())
    return Motion(left, torque, paid_w, most, -1 if rig.active else rig.fault)


class Judged(NamedTuple):
    """With help and without, and what is said of it (the docstring of this file)."""

    helped: Motion
    plain: Motion
    shaken: dict
    both: dict
    every: dict
    fed: bool
    unseen: bool
    false: bool
    stopped: int
    """Fault of the joint with little friction and no help, where it was asked; -1 for none."""


def judged(case, seed, share=1.0, make=Rig):
    """None where it was not armed in time."""
    a = case.axis
    helped, plain = (motion(case, a, seed, policy, share, make) for policy in (None, Policy.OFF))
    if helped is None or plain is None:
        return None
    passivity = helped.fault == int(Fault.PASSIVITY).bit_length() - 1
    shaken, both, every, stopped = beyond(helped.left, plain.left), {}, {}, -1
    most = FED_J * max(float(a["coulomb"][0]) * case.length_m / 0.25, 1.0)
    fed = case.kind not in ("nerves", "tremor") and helped.given_j > most + 1.25 * plain.given_j
    if shaken or fed or helped.fault >= 0:
        others = [plain, *_without_help(case, seed, (LITTLE,), make)]
        stopped = others[-1].fault
        both = shaken and beyond(helped.left, *(one.left for one in others))
        fed = fed and helped.given_j > most + 1.25 * max(one.given_j for one in others)
    if both:
        others += _without_help(case, seed, BETWEEN, make)
        every = beyond(helped.left, *(one.left for one in others))
    false = passivity and not (fed or shaken)
    return Judged(helped, plain, shaken, both, every, fed, fed and not passivity, false, stopped)


def _without_help(case, seed, shares, make):
    runs = (motion(case, rubbing(case.axis, share), seed, Policy.OFF, 1.0, make) for share in shares)
    return [one for one in runs if one is not None]


def name_of(fault):
    return Fault(1 << fault).name if fault >= 0 else "none"


def say(seed, case, one, where=""):
    """A line of whoever is shaken beyond both, fed, or stopped."""
    words = []
    if one.both:
        by = ", ".join(f"{name} by {value:.0f}" for name, value in one.both.items())
        words.append(f"{by} mrad/s, {'the arm pays' if one.helped.paid_w > 0 else 'the joint gives'}")
    if one.fed:
        words.append(f"fed {1e3 * one.helped.given_j:.3g} mJ ({1e3 * one.plain.given_j:.3g} without help)")
    if one.helped.fault >= 0 or one.plain.fault >= 0:
        own = f"{name_of(one.plain.fault)} without help, {name_of(one.stopped)} with little friction"
        words.append(f"fault {name_of(one.helped.fault)} ({own})")
    if words:
        a = case.axis[0]
        gear = f"gear {math.sqrt(a['gear'] * (1 / a['motor'] + 1 / a['link'])) / 6.283:.0f} Hz" if (
            a["link"] > 0
        ) else "rigid"  # fmt: skip
        who = f"{case.kind}, {MANNERS[int(a['manner'])]} of {case.fastest} rad/s{where}"
        click.echo(f"seed {seed}: {who}, {policy_of(case)}, {gear}: {'; '.join(words)}")


def policy_of(case):
    return case.loaded.config.axis[0].friction.policy


def counts(name, of):
    shaken, both, every, fed, unseen, false = (sum(bool(one[i]) for one in of) for i in range(2, 8))
    torque = np.median([one.helped.torque / one.plain.torque for one in of])
    most = 1e3 * max(one.helped.given_j if one.fed else 0.0 for one in of)
    click.echo(
        f"{name}: {len(of)}, shaken {shaken}, beyond both {both}, beyond every friction {every}; fed {fed} "
        f"(at most {most:.3g} mJ), PASSIVITY unseen {unseen}, false {false}; faults "
        f"{sum(one.helped.fault >= 0 for one in of)}; median torque left {torque:.3f}"
    )


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--share", type=float, default=1.0, help="of the help")
    parser.add_argument("--ends", action="store_true")
    asked, found = parser.parse_args(), []
    draw = drawn_with_an_end if asked.ends else drawn
    for seed, case, one in every_rig(asked, draw, partial(judged, share=asked.share)):
        found.append((case, one))
        say(seed, case, one)
    for part in (
        lambda case: case.kind,
        policy_of,
        lambda case: MANNERS[int(case.axis["manner"][0])],
        lambda case: f"{case.fastest} rad/s",
        lambda case: "all",
    ):
        for name in sorted({part(case) for case, _ in found}):
            counts(name, [one for case, one in found if part(case) == name])


if __name__ == "__main__":
    main()
