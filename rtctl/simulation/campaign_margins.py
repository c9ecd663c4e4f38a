"""Is what `rtctl check` certifies stable, and how far is what it refuses from unstable?
`rtctl campaign --margins`.

Every rig follows from `(seed, index)` alone. Certified ones use up to .9999 of the proven stiffness, behind
delays, lags and ages of samples no worse than declared; half of the hands are the worst there are
(`worst_rig`)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rtctl.control.proofs import stability
from rtctl.control.proofs.stability import Between
from rtctl.simulation import campaign_workers
from rtctl.simulation.campaign_draws import log_uniform
from rtctl.simulation.campaign_linear_rig import Case, Law, Plant, behind_a_joint, grows, network, regular
from rtctl.simulation.campaign_worst_rig import Loop, worst_elastic, worst_place, worst_rig

PART = 20
"""Rigs that a process makes before it reports."""

FARTHEST = 3.0
"""Refused stiffness over the proven one up to which an instability is looked for."""


@dataclass(frozen=True)
class Certified:
    """A rig inside its proof."""

    kind: str
    case: Case


@dataclass(frozen=True)
class Findings:
    """What the campaign found: certified rigs by kind, those of them that shake, and distances of the
    bound."""

    certified: dict[str, int]
    shaking: list[int]
    distances: np.ndarray
    """Least unstable stiffness over the proven one, less 1, of rigid joints; infinite where none was
    found."""

    def as_dict(self) -> dict[str, object]:
        """Plain values: rigs by kind, those that shake, quantiles of the distance (None: none found)."""
        quantiles = {
            f"{share:.0%}": float(value) if math.isfinite(value) else None
            for share in (0.0, 0.1, 0.5, 0.9)
            # a value that is there: between a number and infinity lies none
            for value in [np.quantile(self.distances, share, method="lower")]
        }
        return {"certified": self.certified, "shaking": self.shaking, "distance": quantiles}

    def text(self) -> str:
        """For people."""
        kinds = ", ".join(f"{kind.replace('_', ' ')} {n:,}" for kind, n in sorted(self.certified.items()))
        median, far = (float(np.quantile(self.distances, share, method="lower")) for share in (0.5, 0.9))
        return (
            f"{sum(self.certified.values()):,} certified rigs ({kinds}): {len(self.shaking)} "
            f"shake{self.named}\n"
            f"{len(self.distances):,} refused rigid ones: the least unstable coupling lies "
            f"{100 * median:.2g} % above the bound (median; {100 * far:.2g} % in nine of ten)"
        )

    @property
    def named(self) -> str:
        """The first of those that shake."""
        return f": rig {', '.join(map(str, self.shaking[:20]))}" if self.shaking else ""


def _lag_hz(tau: float, T: float) -> float:
    return 1 / (2 * math.pi * tau * T) if tau > 0 else 0.0


def _loop(draw: np.random.Generator) -> tuple[Loop, float]:
    """Period, delay, lag, guaranteed damping and b_c of a random rig, and the inertia of its joint."""
    T, b = log_uniform(draw, 1e-4, 4e-3), log_uniform(draw, 0.01, 0.3)
    J = log_uniform(draw, 1e-3, 0.1)
    b = min(b, 0.3 * J / T)  # what a single pole of the joint takes in a tick
    delay = float(draw.choice([0.0, 1.0, 2.0, draw.uniform(0, 3), draw.uniform(0, 3)]))
    tau = log_uniform(draw, 0.03, 3.0) if draw.random() < 0.5 else 0.0
    return Loop(T, delay, tau, 0.0, b * draw.uniform(0, 0.8), b), J


def certified(seed: int, index: int) -> Certified:
    """Rig `index`, inside what `rtctl check` proves."""
    draw = np.random.default_rng((seed, index))
    kinds: list[Callable[[np.random.Generator], Case]] = [
        _worst,
        _elastic,
        _worst_elastic,
        _old,
        _jittery,
        _old_and_jittery,
    ]
    made = kinds[index % len(kinds)]
    return Certified(made.__name__.strip("_"), made(draw))


def _proven(loop: Loop, between: Between, draw: np.random.Generator) -> float:
    """A stiffness inside the proof, often close to its edge."""
    share = 1 - log_uniform(draw, 1e-4, 0.3)  # up to .9999 of the bound: an error of the proof shows there
    return share * stability.k_max_between(loop.b, loop.b_c, loop.T, between)


def _faster(loop: Loop, draw: np.random.Generator) -> Loop:
    """Delay and lag that the proof was made for, or less."""
    if draw.random() < 0.5:
        return loop
    return Loop(
        loop.T, loop.delay * draw.uniform(0, 1), loop.tau * draw.uniform(0, 1), loop.k_c, loop.b_c, loop.b
    )


def _worst(draw: np.random.Generator) -> Case:
    """A rigid joint in the worst hand, before the worst world."""
    loop, J = _loop(draw)
    k = _proven(loop, Between(loop.delay, _lag_hz(loop.tau, loop.T)), draw)
    real = _faster(Loop(loop.T, loop.delay, loop.tau, k, loop.b_c, loop.b), draw)
    plant, law = worst_rig(real, J, worst_place(real))
    return Case(real.T, real.tau, regular(1, real.delay), plant, law)


def _hand(draw: np.random.Generator, J: float, b: float, T: float) -> Plant:
    """A link in a random hand without loss: masses on springs, resonances up to several times the rate."""
    w = np.sort(np.exp(draw.uniform(math.log(0.02), math.log(12.0), draw.integers(1, 6)))) / T
    between = draw.uniform(0.1, 0.9, len(w) - 1)
    return network(J, b, w**2, ((1 - between) * w[:-1] + between * w[1:]) ** 2)


def _world(draw: np.random.Generator, k_c: float) -> float:
    return math.inf if draw.random() < 0.4 else k_c * log_uniform(draw, 1e-2, 1e3)


def _dampings(draw: np.random.Generator, b: float) -> tuple[float, float, float]:
    """Dampings of motor, joint and link of which no hand can cancel b."""
    own, link = b * log_uniform(draw, 0.01, 3), b * log_uniform(draw, 0.05, 3)
    return b - min(0.9 * b, own * link / (own + link)), own, link


def _left(dampings: tuple[float, float, float]) -> float:
    # a hand that cancels the spring leaves both dampers one behind the other
    motor, own, link = dampings
    return motor + own * link / (own + link)


def _elastic(draw: np.random.Generator) -> Case:
    """An elastic joint in a random hand."""
    loop, J = _loop(draw)
    dampings = _dampings(draw, loop.b)
    loop = Loop(loop.T, loop.delay, loop.tau, 0.0, loop.b_c, _left(dampings))
    k = _proven(loop, Between(loop.delay, _lag_hz(loop.tau, loop.T)), draw)
    link = _hand(draw, J * log_uniform(draw, 0.1, 10), dampings[2], loop.T)
    stiffness = J * (log_uniform(draw, 0.01, 6.0) / loop.T) ** 2
    plant = behind_a_joint(link, J, dampings[0], stiffness, dampings[1])
    real = _faster(loop, draw)
    return Case(real.T, real.tau, regular(1, real.delay), plant, Law(k, loop.b_c, spring=_world(draw, k)))


def _worst_elastic(draw: np.random.Generator) -> Case:
    """An elastic joint in the hand that cancels most of its damping where the margin is least."""
    loop, J = _loop(draw)
    dampings = _dampings(draw, loop.b)
    loop = Loop(loop.T, loop.delay, loop.tau, 0.0, loop.b_c, _left(dampings))
    k = _proven(loop, Between(loop.delay, _lag_hz(loop.tau, loop.T)), draw)
    loop = Loop(loop.T, loop.delay, loop.tau, k, loop.b_c, loop.b)
    theta = worst_place(loop)
    w = 2 * theta / loop.T
    plant = worst_elastic(w, J * w * w, dampings, J)
    law = worst_rig(loop, J, theta)[1]
    return Case(loop.T, loop.tau, regular(1, loop.delay), plant, law)


def _old(draw: np.random.Generator) -> Case:
    """Samples that are fresh every n-th tick, or in any pattern with none older; joint, hand and world at
    random."""
    loop, J = _loop(draw)
    n = int(draw.integers(2, 5))
    k = _proven(loop, Between(loop.delay, _lag_hz(loop.tau, loop.T), n), draw)
    ages = [n] if draw.random() < 0.5 else [int(a) for a in draw.integers(1, n + 1, draw.integers(1, 4))]
    # a sample taken after `a` ticks is held for the ticks until the next one
    pattern: list[tuple[int, float]] = []
    for i, age in enumerate(ages):
        before = ages[i - 1]  # of the first the last: the pattern repeats
        pattern += [(before, loop.delay), *[(0, loop.delay)] * (age - 1)]
    # the worst hand for a loop of n times the period, whose samples are (n - 1)/2 ticks old in the mean: bad
    # here, too
    near = Loop(loop.T * n, (loop.delay + (n - 1) / 2) / n, loop.tau / n, k, loop.b_c, loop.b)
    if draw.random() < 0.6:
        plant = worst_rig(near, J, worst_place(near))[0]
    else:
        plant = _hand(draw, J, loop.b, loop.T)
    return Case(loop.T, loop.tau, tuple(pattern), plant, Law(k, loop.b_c, spring=_world(draw, k)))


def _jittery(draw: np.random.Generator) -> Case:
    """A delay that changes from tick to tick, in a pattern that repeats, within one tick."""
    loop, J = _loop(draw)
    whole = int(draw.integers(0, 3))
    low, high = sorted(draw.uniform(0.001, 0.999, 2))
    between = Between(whole + high, _lag_hz(loop.tau, loop.T), 1, high - low)
    k = _proven(loop, between, draw)
    shares = [draw.choice([low, high]) for _ in range(int(draw.integers(1, 6)))]
    real = Loop(loop.T, whole + high, loop.tau, k, loop.b_c, loop.b)
    plant, law = worst_rig(real, J, worst_place(real))
    if draw.random() < 0.5:
        plant = _hand(draw, J, loop.b, loop.T)
    return Case(loop.T, loop.tau, tuple((1, whole + float(f)) for f in shares), plant, law)


def _old_and_jittery(draw: np.random.Generator) -> Case:
    """Both together: old samples behind a delay that changes, with a current loop as declared or quicker."""
    loop, J = _loop(draw)
    n, whole = int(draw.integers(2, 4)), int(draw.integers(0, 3))
    low, high = sorted(draw.uniform(0.001, 0.999, 2))
    k = _proven(loop, Between(whole + high, _lag_hz(loop.tau, loop.T), n, high - low), draw)
    late = [whole + float(draw.choice([low, high])) for _ in range(n * int(draw.integers(1, 4)))]
    pattern = tuple((0 if tick % n else n, one) for tick, one in enumerate(late))
    tau = loop.tau * draw.choice([0.0, draw.uniform(0, 1), 1.0])
    near = Loop(loop.T * n, (whole + high + (n - 1) / 2) / n, tau / n, k, loop.b_c, loop.b)
    if draw.random() < 0.6:
        plant = worst_rig(near, J, worst_place(near))[0]
    else:
        plant = _hand(draw, J, loop.b, loop.T)
    return Case(loop.T, tau, pattern, plant, Law(k, loop.b_c, spring=_world(draw, k)))


def distance(seed: int, index: int) -> float:
    """Least unstable stiffness over the proven one, less 1, of a random rigid rig in the worst hand and
    world."""
    draw = np.random.default_rng((seed, index, 1))
    loop, J = _loop(draw)
    proven = stability.k_max_sampled_data(loop.b, loop.b_c, loop.T, loop.delay, _lag_hz(loop.tau, loop.T))
    loop = Loop(loop.T, loop.delay, loop.tau, proven, loop.b_c, loop.b)
    plant, law = worst_rig(loop, J, worst_place(loop))

    def unstable(share: float) -> bool:
        return grows(Case(loop.T, loop.tau, regular(1, loop.delay), plant, replace(law, k_c=share * proven)))

    low, high = 1.0, 1.02
    while not unstable(high):  # steps that double: most bounds are within some percent
        if high >= FARTHEST:
            return math.inf
        # the last one at the end itself: beyond 2.28 nothing would be looked at
        low, high = high, min(1 + 2 * (high - 1), FARTHEST)
    # to a 64th of the last step: .03 % where the bound is within 2 %
    for _ in range(6):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if unstable(middle) else (middle, high)
    return high - 1


def run(
    rigs: int, seed: int, jobs: int = 1, progress: Callable[[int], object] = lambda _rigs: None
) -> Findings:
    """`rigs` certified rigs, and the distance of the bound for a tenth as many refused ones, in `jobs`
    processes (0: one per core)."""
    count: dict[str, int] = {}
    shaking: list[int] = []
    distances: list[float] = []
    parts = [range(at, min(at + PART, rigs)) for at in range(0, rigs, PART)]
    for part in campaign_workers.results(_part, [seed] * len(parts), parts, jobs=jobs):
        for kind, index, shakes, far in part:
            count[kind] = count.get(kind, 0) + 1
            shaking += [index] if shakes else []
            distances += [] if far is None else [far]
        progress(len(part))
    return Findings(count, shaking, np.array(distances))


def _part(seed: int, indices: range) -> list[tuple[str, int, bool, float | None]]:
    """Kind, index, whether it shakes, and on every tenth the distance of the bound."""
    out = []
    for index in indices:
        rig = certified(seed, index)
        out.append((rig.kind, index, grows(rig.case), distance(seed, index) if index % 10 == 0 else None))
    return out
