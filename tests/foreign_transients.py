"""Of those that are shaken: does it die by itself? `python tests/foreign_transients.py --rigs 100`.

Rigs, *shaken beyond both* and *fed* are those of `tests/foreign_moved.py`, or with `--contact` those of
`tests/foreign_contact.py`; policies `hybrid` and `observer`. How loud a mass is beside its motion, or after
it, is the RMS of `WINDOW_S` there. *Dies as soon*: from its loudest moment it falls to 1/e in no more than
`SLOWER` times what the slower of the two joints without help takes, of those that are loud themselves
(`MORE`). *Alone*: neither is, so nothing tells how soon. *Lasts*: its longest stretch above `MORE` is longer
than theirs by a quarter and `WINDOW_S`. A *transient* is fed nothing, dies as soon, and does not last. Judged
is what is loudest beyond both.
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
from foreign_shaken import LITTLE, MORE, beside, beyond, told

from rtctl.control.vocabulary import Policy

WINDOW_S, SLOWER = 0.1, 1.25
ASKED = ("hybrid", "observer")


class Heard(NamedTuple):
    """One run: what is left by name, mrad/s; loudness over time by mass, and `still` of the louder one after
    the motion, rad/s; energy given at a stretch, J; length of a sample, s."""

    left: dict
    loud: dict
    given_j: float
    sample_s: float


class Told(NamedTuple):
    """Of one rig: the word for it, and what is loudest beyond both; its loudest moment over that of the
    louder joint without help; decay to 1/e, its own and those that are loud without help, s; longest stretch
    above the bound, its own and theirs, s; energy it was given more than they, J."""

    kind: str
    loudest: str
    most: float
    decay_s: tuple
    longest_s: tuple
    fed_j: float


def loudness(speed, period_s):
    """RMS over `WINDOW_S` of a speed, rad/s."""
    n = max(1, round(WINDOW_S / period_s))
    return np.sqrt(np.maximum(np.convolve(np.square(speed), np.full(n, 1 / n), "valid"), 0.0))


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
    n, scale = round(0.06 / rig.period_s), 1 / case.length_m
    loud = {
        name: loudness(scale * beside(out[:, i], n), rig.period_s) for i, name in enumerate(("motor", "link"))
    }
    # a hand that swings out is slower than what is heard beside a motion
    loud["still"] = np.maximum(*(loudness(scale * after[:, i], rig.period_s) for i in range(2)))
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
    """`Told`, or "" where it is not asked or not shaken beyond both; None where it was not armed."""
    if foreign_moved.policy_of(case) not in ASKED:
        return ""
    make = partial(foreign_contact.Rig, case.world) if contact else Rig
    runs = [heard(case, case.axis, seed, policy, make) for policy in (None, Policy.OFF)]
    if None in runs:
        return None
    if not beyond(runs[0].left, runs[1].left):
        return ""
    runs.append(heard(case, rubbing(case.axis, LITTLE), seed, Policy.OFF, make))
    helped, *others = (one for one in runs if one is not None)
    over = beyond(helped.left, *(one.left for one in others))
    return _told(case, helped, others, max(over, key=over.get)) if over else ""


def _told(case, helped, others, loudest):
    name, bound, sample_s = loudest.split()[-1], 1e-3 * MORE[loudest.split()[0]], helped.sample_s
    own, *louds = (one.loud[name] for one in (helped, *others))
    decays = [decay_s(loud, sample_s) for loud in (own, *(loud for loud in louds if loud.max() > bound))]
    longest = longest_s(own, bound, sample_s), max(longest_s(loud, bound, sample_s) for loud in louds)
    given_j = max(one.given_j for one in others)
    most_j = foreign_moved.FED_J * max(float(case.axis["coulomb"][0]) * case.length_m / 0.25, 1.0)
    fed = case.kind not in ("nerves", "tremor") and helped.given_j > most_j + 1.25 * given_j
    kind = kind_of(fed, decays, longest[0] > SLOWER * longest[1] + WINDOW_S)
    most = float(own.max() / max(loud.max() for loud in louds))
    return Told(kind, loudest, most, tuple(decays), longest, helped.given_j - given_j)


def say(seed, case, one):
    decays = ", ".join(f"{value:.2f}" for value in one.decay_s)
    click.echo(
        f"seed {seed}: {one.kind}: {case.kind}, {getattr(case, 'habit', 'moves')}, {one.loudest}, loudest "
        f"moment {one.most:.2f} of that without help, to 1/e in {decays} s, above the bound for "
        f"{one.longest_s[0]:.2f} s ({one.longest_s[1]:.2f}) at a stretch, fed {1e3 * one.fed_j:.3g} mJ more"
    )


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--contact", action="store_true")
    asked, kinds, rigs = parser.parse_args(), Counter(), 0
    draw = foreign_contact.drawn if asked.contact else foreign_moved.drawn
    for seed, case, one in every_rig(asked, draw, partial(judged, contact=asked.contact)):
        rigs += foreign_moved.policy_of(case) in ASKED
        if one:
            kinds[one.kind] += 1
            say(seed, case, one)
    click.echo(f"{rigs} rigs, beyond both {kinds.total()}: {dict(kinds)}")


if __name__ == "__main__":
    main()
