"""The shape of a motor's current loop, told by the mean of many test pulses.

The answer to what was sent is fitted by least squares as a gain and an offset of a delayed loop of second
order,

    1/(1 + s tau + m s^2 tau^2),     m = 1/(4 zeta^2)

which is one family from a first-order lag (m = 0) by two equal lags (m = 1/4) to loops that overshoot. For
each m of a row delay and lag are those that fit best; those m that leave not surely more than the best one
are the shapes that the pulses cannot tell apart (a profile likelihood). What is told is their range, and of
them the one that the coupling of the rig bears least is what the rig file should say.

What no m fits is a shape of another kind (a loop with a zero, a limit of the voltage): that is told, too, and
nothing is to be declared."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

OVERSHOOTS = (0.001, 0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.1, 0.12, 0.14, 0.16,
    0.18, 0.2, 0.23, 0.26, 0.3, 0.34, 0.38, 0.42, 0.46, 0.5, 0.55, 0.6)  # fmt: skip
LAGS_M = (0.0, 0.05, 0.1, 0.15, 0.19, 0.22, 0.24)
"""m of what does not overshoot: of one lag, and of two; .1 are two of which one is 8 times the other."""

SURE = 9.0
"""A shape is out of question that leaves this many variances more than the best one: three standard
errors."""

OTHER_SHARE = 0.015
"""What the best shape leaves beyond noise, RMS as a share of the step: more is a loop of another shape."""

ANEW = 8
"""Every so many shapes delay and lag are looked for from the start."""

UNSEEN_TICKS = 0.25
"""No sample shows a shape of a loop whose lag is shorter than that: it has settled before the next."""


def m_of(overshoot: float) -> float:
    """The m of a loop that exceeds its steps by this share: (pi^2 + ln^2 o)/(4 ln^2 o); 1/4 for 0."""
    return 0.25 * (1 + (math.pi / math.log(overshoot)) ** 2) if overshoot > 0 else 0.25


ROW = (*((m, 0.0) for m in LAGS_M), *((m_of(o), o) for o in OVERSHOOTS))
"""Shapes that are tried: m and overshoot."""


@dataclass(frozen=True)
class Fit:
    """The best loop of one shape.

    Attributes
    ----------
    m, overshoot
        The shape.
    delay, lag
        Ticks.
    gain
        Torque by the current over torque sent.
    left
        Sum of squares left, in variances of the noise."""

    m: float
    overshoot: float
    delay: float
    lag: float
    gain: float
    left: float


@dataclass(frozen=True)
class Told:
    """What the pulses tell of one axis.

    Attributes
    ----------
    shape : str
        "first order", "two lags", "overshoots", "not told" (several of these fit), "another" (none fits) or
        "too quick" (a lag that samples do not show).
    overshoot, overshoot_low, overshoot_high : float
        Of the best fit, and the range that contains it surely: NaN where nothing is told.
    best : Fit
        The best one.
    possible : tuple of Fit
        All that are within noise of it, and the next one to either side.
    noise : float
        Standard deviation of a sample, and what the best fit leaves beyond noise: shares of the pulse.
    pulses : int
        How many were taken."""

    shape: str
    overshoot: float
    overshoot_low: float
    overshoot_high: float
    best: Fit
    possible: tuple[Fit, ...]
    noise: float
    beyond: float
    pulses: int


def step_answer(t: np.ndarray, lag: float, m: float) -> np.ndarray:
    """Answer to a step at 0 of the loop of `lag` and `m`; `t` and `lag` in the same unit."""
    since = np.maximum(t, 0.0)
    if m == 0:
        return np.asarray(-np.expm1(-since / lag))
    root = np.sqrt(complex(1 - 4 * m)) or complex(1e-4)  # two equal lags: as two that are hardly apart
    one, other = 0.5 * lag * (1 + root), 0.5 * lag * (1 - root)
    return np.asarray(
        (1 - (one * np.exp(-since / one) - other * np.exp(-since / other)) / (one - other)).real
    )


class Pulses:
    """Means of the pulses of one axis.

    Parameters
    ----------
    sent : array, shape (ticks,)
        Torque sent in each tick of the test, N m, the same in all pulses.
    shown : array, shape (pulses, ticks)
        Torque by the current at the end of each tick, N m; NaN where no fresh sample shows it."""

    def __init__(self, sent: np.ndarray, shown: np.ndarray) -> None:
        counts = np.sum(np.isfinite(shown), axis=0)
        self.at = np.flatnonzero(counts > 0)
        self.counts = counts[self.at]
        self.mean = np.nansum(shown[:, self.at], axis=0) / self.counts
        # a drift of the offset from pulse to pulse is no noise of a sample
        off = shown[:, self.at] - self.mean
        off = off - np.nanmean(off, axis=1, keepdims=True)
        spare = int(np.sum(self.counts)) - len(self.at) - len(shown) + 1
        self.step = float(np.max(np.abs(sent)))
        noise = math.sqrt(float(np.nansum(off * off)) / spare) if spare > 0 else math.inf
        self.noise = max(noise, 1e-6 * self.step)
        # of a current without steps no two samples are alike, and the least gap is next to none
        gaps = np.diff(np.unique(shown[np.isfinite(shown)]))
        self.rounded = float(np.min(gaps[gaps > 1e-9 * self.step], initial=self.step)) / math.sqrt(12)
        self.steps = np.flatnonzero(np.diff(sent, prepend=0.0))
        self.heights = np.diff(sent, prepend=0.0)[self.steps]
        self.number = len(shown)

    def answer(self, delay: float, lag: float, m: float) -> np.ndarray:
        """What the loop shows of what was sent, with gain 1."""
        since = self.at[:, None] + 1.0 - self.steps - delay
        return np.asarray(step_answer(since, lag, m) @ self.heights)

    def _left(self, loop: np.ndarray, m: float) -> tuple[np.ndarray, float]:
        """What delay and lag leave, in standard errors, and the gain."""
        weight = np.sqrt(self.counts) / self.noise
        columns = np.stack([self.answer(float(loop[0]), float(loop[1]), m), np.ones(len(self.at))], axis=1)
        found = np.linalg.lstsq(columns * weight[:, None], self.mean * weight, rcond=None)[0]
        return (self.mean - columns @ found) * weight, float(found[0])

    def fit(self, m: float, overshoot: float, starts: Sequence[tuple[float, float]]) -> Fit:
        """The best delay and lag of this shape, from these starts (ticks)."""
        best = None
        for start in starts:
            found = least_squares(
                lambda loop: self._left(loop, m)[0],
                np.clip(start, (0.0, 0.02), (30.0, 60.0)),
                bounds=((0.0, 0.01), (31.0, 61.0)),
                x_scale=(1.0, 1.0),
                max_nfev=60,
            )
            best = found if best is None or found.cost < best.cost else best
        assert best is not None
        delay, lag = map(float, best.x)
        return Fit(m, overshoot, delay, lag, self._left(best.x, m)[1], 2 * float(best.cost))

    def late(self) -> float:
        """Delay and lag together, roughly: by how much the mean answer lags what was sent, ticks."""
        sent = np.zeros(int(self.at[-1]) + 1)
        for at, height in zip(self.steps, self.heights, strict=True):
            sent[at:] += height
        shown = np.interp(np.arange(len(sent)), self.at, self.mean)
        every = [float(np.dot(np.roll(sent, k), shown)) for k in range(len(sent) // 4)]
        return float(np.argmax(every)) + 0.5


def told(pulses: Pulses) -> Told:
    """What these pulses tell of the shape."""
    late = max(pulses.late(), 0.3)
    starts = [(share * late, (1 - share) * late) for share in (0.0, 0.4, 0.8)]
    fits: list[Fit] = []
    for i, (m, overshoot) in enumerate(ROW):
        # from the shape before, and now and then anew: the squares have more than one valley
        before = [(one.delay, one.lag) for one in fits[-1:]]
        fits.append(pulses.fit(m, overshoot, before + starts if i % ANEW == 0 else before))
    best = min(fits, key=lambda one: one.left)
    spare = max(len(pulses.at) - 5, 1)
    # noise, or what this family does not fit, whichever is more
    unit = max(best.left / spare, 1.0)
    within = [i for i, one in enumerate(fits) if one.left <= best.left + SURE * unit]
    first, last = max(within[0] - 1, 0), min(within[-1] + 1, len(fits) - 1)
    possible = tuple(fits[i] for i in range(first, last + 1))
    noise = pulses.noise / pulses.step
    beyond = noise * math.sqrt(max(best.left / spare - 1.0, 0.0) / float(np.mean(pulses.counts)))
    low, high = fits[first].overshoot if first < within[0] else 0.0, fits[last].overshoot
    shape = _shape(fits, within, best)
    if best.lag < UNSEEN_TICKS or within[-1] == len(fits) - 1:
        shape = "too quick" if best.lag < 1.0 else "not told"
    # neither chance nor what the steps of a current leave behind is a shape
    surely = best.left > spare + 4.0 * math.sqrt(2 * spare)
    if surely and beyond > math.hypot(OTHER_SHARE, pulses.rounded / pulses.step):
        shape = "another"
    if shape in ("too quick", "another"):
        low = high = math.nan
    return Told(shape, best.overshoot, low, high, best, possible, noise, beyond, pulses.number)


def _shape(fits: Sequence[Fit], within: Sequence[int], best: Fit) -> str:
    low, high = fits[within[0]], fits[within[-1]]
    if high.m <= LAGS_M[2]:
        return "first order"
    if low.overshoot > 0:
        return "overshoots"
    # two lags: one is surely more than a tenth of the other
    if low.m > LAGS_M[2] and high.overshoot <= OVERSHOOTS[2]:
        return "two lags"
    return "not told"


def to_declare(found: Told, bears: Callable[[float, float, float], float]) -> Fit | None:
    """The one of all possible shapes that the coupling bears least; None where none is told.

    Parameters
    ----------
    bears
        The stiffest coupling behind a delay and a lag, in ticks, with an overshoot."""
    if found.shape in ("another", "too quick", "not told") and not found.overshoot_high <= 0.3:
        return None
    # where nothing is borne: the one that overshoots most
    return min(found.possible, key=lambda one: (bears(one.delay, one.lag, declared(one)), -declared(one)))


def declared(one: Fit) -> float:
    """The overshoot that covers this shape: of two lags a thousandth."""
    return one.overshoot if one.overshoot > 0 or one.m <= LAGS_M[1] else OVERSHOOTS[0]
