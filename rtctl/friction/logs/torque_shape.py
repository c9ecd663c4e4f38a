"""What the torque as a whole does to its balance: friction that is a share of it, a scale that bends, scales
that drift.

With u = J a + b v + F_c s, what the motion wants, a gear that rubs by the torque it transmits needs m = u + k
s |m|, a sensor or a drive that saturates softly shows m = u (1 - c (u/U)^2), U the largest u, and a position
whose scale drifts by d over a log shows J a + b v that grow by d. Each is one more column of the balance,
made of what the balance itself wants: made of the recorded torque it would repeat that one's noise. It is
told when it is surely there, alone and beside whatever else bends a balance (docs/theory.md 9.9)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rtctl.friction.logs.intervals import covariance, time_blocks
from rtctl.friction.logs.offsets import offset_columns
from rtctl.friction.logs.other_readings import PEAK_SHARE
from rtctl.friction.logs.regressors import Regressors

SURELY, SURELY_BESIDE = 4.0, 3.0  # a share of .2 leaves over less than noise (decision 0063)
"""Standard errors by which a coefficient must differ from 0: alone, and beside the other columns."""

EXPLAINS = 0.98
"""Largest share of what is left over without it, RMS, that is left over with what is told."""

SHARE_LEAST, SHARE_TOLD, SHARE_MOST = 0.03, 0.4, 0.6
"""Shares of the torque that are told as those of a gear, and the most that is tried."""

ALIKE = 0.4
"""Share by which that of a gear may differ beside other columns: what only looks like it goes into them."""

BEND_LEAST = 0.06
"""Least share of the largest torque that is told to be missing."""

EXPLAINS_MUCH = 0.6
"""Largest share of what was left over that is left over with a bend or a drift that is told: sensors and
drives that saturate leave .03 to .12, scales that drift .02 to .43, friction that is not quite Coulomb +
viscous .54 and more."""

PLAINLY_BESIDE, INERTIA_MOVED = 10.0, 0.05
"""Standard errors beside the other columns from which on a bend that is alike with and without them, and
changes the inertia by that share, is told, whatever else is left over (decision 0173)."""

DRIFT_LEAST = 0.1
"""Least change of a scale over a log that is told."""

DRIFT_BESIDE = 0.05
"""The same beside other columns."""

KNOWN, KNOWN_BESIDE = 0.02, 0.03
"""Largest standard errors of the share of a gear that a log is said to tell, alone and beside other
columns."""

OWN_LEAST = 1e-3
"""Share of a column, RMS, that the others must not have: below it nothing is known of it."""

ROUNDS = 6
"""Times that a column is made anew of what is wanted with it."""


@dataclass(frozen=True)
class Effect:
    """Coefficient of a column, on all rows (n,): alone and beside others, with standard errors; what is left
    over with it alone and without it, RMS."""

    column: np.ndarray
    value: float
    error: float
    beside: float
    beside_error: float
    rest: float
    before: float

    def sure(self) -> bool:
        """Whether it surely is there, whatever else there is."""
        return (
            abs(self.value) > SURELY * self.error
            and abs(self.beside) > SURELY_BESIDE * self.beside_error
            and self.value * self.beside > 0
            and self.rest < EXPLAINS * self.before
        )

    def alike(self) -> bool:
        """Whether it is the same beside the others."""
        return abs(self.beside / self.value - 1) < ALIKE

    def of_gear(self) -> bool:
        """Whether it is a share that a gear can lose, and the same beside the others."""
        return SHARE_LEAST < self.value < SHARE_TOLD and self.alike()


class PlainBalance:
    """The balance of a log on its sliding rows, to which columns are added."""

    def __init__(self, signals: Regressors) -> None:
        offset = offset_columns(signals)
        self.signals, self.rows, self.slow = signals, signals.sliding, len(offset.owner)
        self.direction = signals.direction
        a, v = signals.acceleration_rad_s2, signals.velocity_rad_s
        self.motion = np.column_stack([a, v, signals.direction])
        self.nuisance = np.hstack([offset.logs, offset.drift, signals.besides])
        self.block = time_blocks(signals)
        usual = PEAK_SHARE * float(np.quantile(np.abs(v[self.rows]), 0.95))
        x = signals.position_rad / signals.radian
        self.others = np.column_stack(
            [
                signals.jerk_rad_s3,
                v * np.abs(v),
                signals.direction * np.exp(-np.abs(v) / max(usual, 1e-12)),
                x - x.mean(),
                np.sin(x),
                np.cos(x),
            ]
        )

    def wanted(self, column: np.ndarray | None) -> tuple[np.ndarray, float]:
        """What the motion wants on every row, without offset and `column`; and the coefficient of that."""
        _, found = self._solved(column)
        # a scale that bends, or a gear, sees the torque of a spring as well
        wanted = self.motion @ found[:3] + self.signals.place_nm
        return wanted, float(found[-1]) if column is not None else 0.0

    def balanced(self, column: np.ndarray) -> np.ndarray:
        """The whole torque that the balance with `column` wants on every row, offset and all."""
        matrix, found = self._solved(column)
        return np.asarray(matrix @ found)

    def inertia_without(self, column: np.ndarray) -> float:
        """How many times as large the inertia is without `column` as with it, beside the others."""
        both = (np.column_stack([self.others, column]), self.others)
        with_it, without = (float(self._solved(more)[1][0]) for more in both)
        return without / with_it

    def _solved(self, column: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Columns of the balance on every row, `column` (n,) or several (n, k) the last, and their
        coefficients."""
        more = np.zeros((len(self.rows), 0)) if column is None else column
        matrix = np.column_stack([self.motion, self.nuisance, more])
        scale = np.sqrt((matrix[self.rows] ** 2).mean(axis=0))
        scale[scale == 0] = 1.0
        found = np.linalg.lstsq((matrix / scale)[self.rows], self.signals.torque_nm[self.rows], rcond=1e-9)[0]
        return matrix, found / scale

    def coefficient(self, column: np.ndarray, more: np.ndarray | None = None) -> tuple[float, float, float]:
        """Coefficient of a column: value, standard error by blocks, what is left over; an infinite error
        where the others have all of it."""
        beside = [] if more is None else [more]
        matrix = np.hstack([self.motion, self.nuisance, *beside])[self.rows]
        matrix = matrix / np.maximum(np.sqrt((matrix**2).mean(axis=0)), 1e-300)
        both = np.column_stack([column, self.signals.torque_nm])[self.rows]
        own, torque = (both - matrix @ np.linalg.lstsq(matrix, both, rcond=1e-9)[0]).T
        if own.std() <= OWN_LEAST * np.std(column[self.rows]):  # as with a torque that only drives
            return 0.0, np.inf, float(np.sqrt(np.mean(torque**2)))
        value = float(own @ torque / (own @ own))
        rest = torque - value * own
        error = float(np.sqrt(covariance(own[:, None], rest, self.block, self.slow)[0, 0]))
        return value, error, float(np.sqrt(np.mean(rest**2)))

    def effect(
        self, make: Callable[[np.ndarray, float], np.ndarray], more: np.ndarray | None = None
    ) -> Effect:
        """The effect whose column `make` makes of what is wanted and of its coefficient so far; `more` beside
        the usual others."""
        u, value = self.wanted(None)
        column = make(u, 0.0)
        for _ in range(ROUNDS):
            u, value = self.wanted(column)
            value = float(np.clip(value, -SHARE_MOST, SHARE_MOST))  # 1 - k stays above 0
            column = make(u, value)
        return self.of(column, more)

    def of(self, column: np.ndarray, more: np.ndarray | None = None) -> Effect:
        """The effect of a column (n,); `more` beside the usual others."""
        others = self.others if more is None else np.hstack([self.others, more])
        # twice: alone it may be there because of what bends a balance anyway, beside that it may be hidden
        value, error, rest = self.coefficient(column)
        beside, beside_error, _ = self.coefficient(column, others)
        before = self.coefficient(np.zeros(len(column)))[2]  # a column of nothing takes nothing off
        return Effect(column, value, error, beside, beside_error, rest, before)

    def is_explained(self, rest: float) -> bool:
        """Whether so much that is left over, RMS, is far less than before, and than friction that bends over
        speed leaves."""
        none = np.zeros(len(self.rows))
        over_speed = self.coefficient(none, self.others[:, 1:3])[2]
        return rest < min(EXPLAINS_MUCH * self.coefficient(none)[2], over_speed)

    def share(self, bend: Effect) -> Effect:
        """Friction that is a share of the torque; what bends is one of the columns beside."""

        def column(u: np.ndarray, k: float) -> np.ndarray:
            return np.asarray(self.direction * np.abs(u / (1 - k * np.sign(u * self.direction))))

        return self.effect(column, bend.column[:, None])

    def bend(self) -> Effect:
        """A scale that falls with the torque: its coefficient is the share of the largest that is missing."""

        def column(u: np.ndarray, _: float) -> np.ndarray:
            # of what is wanted where rows are used: a spike of the acceleration elsewhere is no torque
            largest = max(float(np.quantile(np.abs(u[self.rows]), 0.99)), 1e-300)
            return np.asarray(-(u**3) / largest**2)  # minus: c > 0 is a torque that falls short

        return self.effect(column)


def with_share(signals: Regressors) -> tuple[Regressors, tuple[str, ...], tuple[str, ...]]:
    """The signals of a single torque with the share of it that friction is as a column, where the log tells
    one; the warning about it; what the log cannot tell."""
    plain = PlainBalance(signals)
    bend = plain.bend()
    share = plain.share(bend)
    known = share.error <= KNOWN and share.beside_error <= KNOWN_BESIDE
    if known and share.sure() and share.of_gear() and not (bend.sure() and bend.rest < share.rest):
        text = (
            f"{signals.source}: friction grows with the torque itself, by {share.value:.2g} of it (+- "
            f"{2 * share.error:.1g}): it differs where the torque drives the joint and where it brakes it, "
            "as through a gear or a screw; that share is fitted as torque_share, Coulomb and viscous "
            "friction are what is left without torque, and the points hold it at the torques of this log; "
            "play between motor and load looks alike: turn the load by hand at rest"
        )
        return replace(signals, share_nm=share.column), (text,), ()
    if known:
        return signals, (), ()
    untold = (
        "whether friction is a share of the torque, as in gears: the torque hardly brakes the joint in this "
        "log; of a gear that loses a share k all parameters are 1/(1 - k) times too large (record "
        "quick stops)"
    )
    return signals, (), (untold,)


def bent(signals: Regressors) -> tuple[str, ...]:
    """The warning that a single torque does not grow as the motion wants, where friction that bends over
    speed does not say it better."""
    plain = PlainBalance(signals)
    found = plain.bend()
    if not found.sure():
        return ()
    plainly = abs(found.beside) > PLAINLY_BESIDE * found.beside_error and found.alike()
    plainly = plainly and abs(plain.inertia_without(found.column) - 1) > INERTIA_MOVED
    if not plainly and not (abs(found.value) > BEND_LEAST and plain.is_explained(found.rest)):
        return ()
    short, text = "small", "its sensor or drive saturates softly, or there is play"
    if found.value < 0:
        short, text = "large", "the motor makes less of a large current than its constant says, or play"
    return (
        f"{signals.source}: the torque is not proportional to what the motion wants: at its largest it is "
        f"{100 * abs(found.value):.0f} % too {short} against small torques "
        f"({text}); inertia and friction are off by up to as much: move less briskly, or raise the range",
    )


def drifting(signals: Regressors) -> tuple[str, ...]:
    """The warning that a scale changes over the log: of the position, or of the torque."""
    plain = PlainBalance(signals)
    share = np.zeros(len(signals.time_s))
    for k in range(len(signals.sources)):
        mine = np.flatnonzero(signals.log == k)
        share[mine] = np.linspace(-0.5, 0.5, len(mine))
    u, _ = plain.wanted(None)
    dry = u - _moving(plain, u - signals.place_nm)
    moving, level = share * (u - dry), share * dry
    motion = plain.coefficient(moving, level[:, None])
    friction = plain.coefficient(level, moving[:, None])
    beside = plain.coefficient(moving, np.column_stack([level, plain.others]))
    if not (abs(motion[0]) > SURELY * motion[1] and abs(motion[0]) > DRIFT_LEAST):
        return ()
    if not (motion[0] * beside[0] > 0 and abs(beside[0]) > max(SURELY_BESIDE * beside[1], DRIFT_BESIDE)):
        return ()  # parts of other speeds look like it, where friction bends over speed
    if not plain.is_explained(motion[2]):
        return ()
    together = abs(friction[0] - motion[0]) < max(0.5 * abs(motion[0]), 2 * friction[1])
    amount = f"by {100 * abs(motion[0]):.0f} % from its first to its last row"
    if together and friction[0] * motion[0] > 0:
        what = (
            f"inertia and friction {_way(motion[0])} together {amount}: the scale of the torque drifts (a "
            "torque constant that warms, an amplifier)"
        )
    else:
        what = (
            f"inertia and viscous friction {_way(motion[0])} together {amount}, Coulomb friction does not: "
            "the scale of the position drifts (a belt, a potentiometer, counts that are lost), or what is "
            "moved changes"
        )
    what += "; the parameters are of its mean: cut the log there, or mend the scale"
    return (f"{signals.source}: {what}",)


def _moving(plain: PlainBalance, u: np.ndarray) -> np.ndarray:
    """The part of what is wanted that goes with acceleration and speed."""
    return np.asarray(plain.motion[:, :2] @ np.linalg.lstsq(plain.motion, u, rcond=1e-12)[0][:2])


def _way(change: float) -> str:
    return "grow" if change > 0 else "fall"
