"""Of those that are shaken: does it die by itself? `python tests/foreign_transients.py --rigs 100`; `--contact`.

Rigs, *shaken beyond both* and *fed* are those of `tests/foreign_moved.py` and `tests/foreign_contact.py`,
policies `hybrid` and `observer`. How loud a mass is beside its motion is the RMS of `WINDOW_S` there. *Dies as
soon*: from its loudest moment it falls to 1/e in no more than `SLOWER` times what the slower of the two joints
without help takes, of those that are loud themselves (`MORE`). *Alone*: neither is, so nothing tells how soon.
*Lasts*: its longest stretch above `MORE` is longer than theirs by a quarter and `WINDOW_S`. A *transient* is fed
nothing, dies as soon, and does not last. Judged is the mass that is loudest beyond both.
"""

from collections import Counter
from functools import partial
from typing import NamedTuple

import click
import foreign_contact
import foreign_moved
import numpy as np
from foreign_arms import Rig
from foreign_rests import every_rig, parser_of, rubbing
from foreign_shaken import LITTLE, MORE, _beside, beyond, told

from rtctl.control.vocabulary import Policy

WINDOW_S, SLOWER = 0.1, 1.25
ASKED = ("hybrid", "observer")


class Heard(NamedTuple):
    """One run: what is left by name, mrad/s; loudness over time of motor and link, rad/s, shape (2, n); energy
    given at a stretch, J; length of a sample, s."""

    left: dict
    loud: np.ndarray
    given_j: float
    sample_s: float


class Told(NamedTuple):
    """Of one rig, as the docstring of this file says; `most` is its loudest moment over that of the louder joint
    without help, `decay_s` and `longest_s` its own and the longest of those."""

    most: float
    decay_s: tuple
    longest_s: tuple
    fed_j: float
    fed: bool
    kind: str


def loudness(speed, period_s, beside_s=0.06):
    """RMS over `WINDOW_S` of what is left of a speed, rad/s, beside its mean."""
    left = np.square(_beside(speed, round(beside_s / period_s)))
    n = max(1, round(WINDOW_S / period_s))
    return np.sqrt(np.maximum(np.convolve(left, np.full(n, 1 / n), "valid"), 0.0))


def decay_s(loud, sample_s):
    """From the loudest moment to the first below 1/e of it; to the end where there is none."""
    at = int(np.argmax(loud))
    below = np.flatnonzero(loud[at:] < loud[at] / np.e)
    return (int(below[0]) if len(below) else len(loud) - at) * sample_s


def longest_s(loud, bound, sample_s):
    """Longest stretch above the bound."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], loud > bound, [0]]).astype(int)))
    return float((edges[1::2] - edges[::2]).max()) * sample_s if len(edges) else 0.0


def heard(case, a, seed, policy, make):
    rig = make(case.loaded, a, seed, policy)
    if not rig.arm():
        return None
    left, _, _, moved, after = told(case, rig)
    out, one = np.concatenate([moved, after]), a[0]
    own = 0.5 * (one["motor"] * out[:, 0] ** 2 + one["link"] * out[:, 1] ** 2)
    given = np.cumsum(out[:, 3]) + own
    loud = np.array([loudness(out[:, i], rig.period_s) for i in range(2)]) / case.length_m
    return Heard(left, loud, float((given - np.minimum.accumulate(given)).max()), rig.period_s)


def kind_of(fed, decays, lasts):
    """The word for it; `decays`: own, and those of the joints that are loud without help."""
    if fed:
        return "fed"
    if lasts:
        return "lasts"
    if len(decays) == 1:
        return "alone"
    return "transient" if decays[0] <= SLOWER * max(decays[1:]) else "dies slower"


def judged(case, seed, contact=False):
    """None where it is not asked or was not armed, () where it is not shaken, or `Told`."""
    if foreign_moved.policy_of(case) not in ASKED:
        return ()
    make = partial(foreign_contact.Rig, case.world) if contact else Rig
    runs = [heard(case, case.axis, seed, policy, make) for policy in (None, Policy.OFF)]
    if None in runs:
        return None
    if not beyond(runs[0].left, runs[1].left):
        return {}
    runs.append(heard(case, rubbing(case.axis, LITTLE), seed, Policy.OFF, make))
    runs = [one for one in runs if one is not None]
    over = beyond(runs[0].left, *(one.left for one in runs[1:]))
    return of_runs(case, runs, over) if over else {}


def of_runs(case, runs, over):
    loudest = max(over, key=over.get)
    mass = 0 if loudest.endswith("motor") else 1
    bound = 1e-3 * MORE[loudest.split()[0]]
    louds = [one.loud[mass] for one in runs]
    sample_s = runs[0].sample_s
    decays = [decay_s(loud, sample_s) for loud in louds[:1] + [one for one in louds[1:] if one.max() > bound]]
    longest = [longest_s(loud, bound, sample_s) for loud in louds]
    fed_j = runs[0].given_j - max(one.given_j for one in runs[1:])
    most_j = foreign_moved.FED_J * max(float(case.axis["coulomb"][0]) * case.length_m / 0.25, 1.0)
    fed = runs[0].given_j > most_j + 1.25 * max(one.given_j for one in runs[1:])
    lasts = longest[0] > 1.25 * max(longest[1:]) + WINDOW_S
    return Told(
        float(louds[0].max() / max(loud.max() for loud in louds[1:])), tuple(decays),
        (longest[0], max(longest[1:])), fed_j, fed, kind_of(fed, decays, lasts),
    )  # fmt: skip
