"""How far the parameters of a log depend on how its friction and its rows are read: the part of an interval
that is not random.

What is random in a log moves a parameter by its standard error. A model that is not quite that of the joint
moves it the same way in every block, and no scatter tells. But another model, or other rows, are moved
otherwise. So the balance is solved again with what joints do besides (`_readings`): a torque that is late,
friction that bends over speed, that remembers a turn, that grows with the torque, a scale of the torque that
bends, and with rows further from the turns. A parameter that changes by more than chance has changed by d;
what is beyond chance of the largest d is its doubt (docs/theory.md 9.6)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from rtctl.friction.logs.dynamics import SAMPLES_MIN, SAMPLES_PER_CUTOFF
from rtctl.friction.logs.even_motion import largest_inertia
from rtctl.friction.logs.intervals import Estimate, time_blocks
from rtctl.friction.logs.offsets import offset_columns
from rtctl.friction.logs.regressors import Regressors

PEAK_SHARE = 0.25
"""Speed at which the peak of another reading has fallen to 1/e, share of the log's speed."""

MEMORY_RAD = 0.03
"""Travel after a turn over which another reading lets friction build up."""

SPEEDS = 20
"""Parts of the range of speeds that count alike in another line."""

ROWS_LEAST = 60
"""Fewest rows of another reading."""

KNOWS_LESS = 3.0
"""A reading whose standard error is so many times larger knows too little of a parameter to cast doubt on
it."""

NOISE_MOST = 0.5
"""Share of an acceleration that is noise from which on all of it may be: steps of slow motion make up to
twice what white noise does. The inertia is bounded by the torque alone."""

SHORT_MOST = 0.98
"""Largest share of an inertia that is taken to be lost in the steps of the position: beyond it nothing is
known of it."""

# chosen on 110 foreign logs (decision 0050)
TIMES = 1.5
"""What is not known of a model is taken for so many times what was seen of it. Of blind logs of foreign
joints the 95 % intervals then held the inertia in 85 %, Coulomb friction in 94 % (65 and 88 % without); with
what came after (docs/theory.md 9.7) 96 and 94 %."""


def doubts(signals: Regressors, late: Estimate | None = None) -> np.ndarray:
    """Doubt of inertia, viscous and Coulomb friction, (3,), added to both sides of their intervals.

    `late` is the delay that looks left in the torque, s; where it surely is not 0 the motion as it was so
    much earlier is another reading."""
    rows, offset = signals.sliding, offset_columns(signals)
    nuisance = np.hstack([offset.logs, offset.drift, signals.besides])
    block = np.full(len(rows), -1)
    block[rows] = time_blocks(signals)
    # each drift column has used up one block
    free = max(1, block.max() - len(offset.owner))
    motion = np.column_stack([signals.acceleration_rad_s2, signals.velocity_rad_s, signals.direction])
    plain = _solved(signals, motion, np.zeros((len(rows), 0)), nuisance, rows, block)
    largest = np.zeros(3)
    for read, more, kept in _readings(signals, motion, motion @ plain[0], late):
        v = signals.velocity_rad_s[kept]
        if len(v) < ROWS_LEAST or min((v > 0).sum(), (v < 0).sum()) < SAMPLES_MIN // 2:
            continue
        other = _solved(signals, read, more, nuisance, kept, block)
        chance = ((other[1] - plain[1]) ** 2).sum(axis=0) * len(plain[1]) / free
        beyond = np.sqrt(np.maximum((other[0] - plain[0]) ** 2 - chance, 0.0))
        # a poorer reading differs by chance, and where blocks are few by more than they say chance is
        knows = (other[1] ** 2).sum(axis=0) <= KNOWS_LESS**2 * (plain[1] ** 2).sum(axis=0)
        largest = np.maximum(largest, np.where(knows, beyond, 0.0))
    largest[1:] = np.maximum(largest[1:], _of_other_speeds(signals, motion, nuisance, block, free))
    found: np.ndarray = TIMES * largest + _moved_by_half_a_period(signals, np.hstack([motion, nuisance]))
    short = min(signals.inertia_short, SHORT_MOST)
    # what is too small by the share n lacks n/(1 - n) of itself
    lost = short / (1 - short) * abs(plain[0][0])
    if short > NOISE_MOST:
        lost = max(lost, largest_inertia(signals, abs(plain[0][2])))
    others = np.column_stack([motion[:, 1:], nuisance])[rows]
    alike = np.linalg.lstsq(others, motion[rows, 0], rcond=1e-9)[0][:2]
    # an inertia that is off takes the others with it, by what its acceleration has in common with them
    found += lost * np.array([1.0, *np.abs(alike)])
    return found


def _of_other_speeds(
    signals: Regressors, motion: np.ndarray, nuisance: np.ndarray, block: np.ndarray, free: int
) -> np.ndarray:
    """By how much viscous and Coulomb friction, (2,), differ when the straight line through friction that
    bends is drawn through other speeds, beyond chance.

    The rows that are used have fewer slow ones than the motion, for those near turns are left out; a line
    through every speed alike has more."""
    # the bend's own part, beside all other columns: a line through other speeds differs by the bend alone
    rows, v, s = signals.sliding, signals.velocity_rad_s, signals.direction
    bends = np.column_stack([v * np.abs(v), s * np.exp(-np.abs(v) / _peak_speed(signals))])
    others = np.hstack([motion, nuisance])[rows]
    others = others / (np.sqrt((others**2).mean(axis=0)) + np.finfo(float).tiny)
    both = np.column_stack([bends, signals.torque_nm])[rows]
    own = both - others @ np.linalg.lstsq(others, both, rcond=1e-9)[0]
    inverse = np.linalg.pinv(own[:, :2].T @ own[:, :2], rcond=1e-9, hermitian=True)
    found = inverse @ (own[:, :2].T @ own[:, 2])
    scores = np.zeros((int(block.max()) + 1, 2))
    np.add.at(scores, block[rows], own[:, :2] * (own[:, 2] - own[:, :2] @ found)[:, None])
    scores = scores @ inverse
    line = motion[:, 1:]
    lines = [_line(line, bends, weight) for weight in _weights(signals)]
    largest = np.zeros(2)
    for other in lines[1:]:
        changed = (other - lines[0]) @ found
        chance = (((other - lines[0]) @ scores.T) ** 2).sum(axis=1) * len(scores) / free
        largest = np.maximum(largest, np.sqrt(np.maximum(changed**2 - chance, 0.0)))
    return np.asarray(largest)


def _weights(signals: Regressors) -> Iterator[np.ndarray]:
    """Weights of all rows (n,): those that are used; all that move as fast; the used ones with every speed
    alike."""
    rows, speed = signals.sliding.astype(float), np.abs(signals.velocity_rad_s)
    yield rows
    used = speed[signals.sliding]
    yield (speed >= used.min()).astype(float)
    edges = np.linspace(used.min(), used.max(), SPEEDS + 1)
    at = np.clip(np.searchsorted(edges, speed, side="right") - 1, 0, SPEEDS - 1)
    yield rows / np.maximum(np.bincount(at[signals.sliding], minlength=SPEEDS), 1)[at]


def _line(line: np.ndarray, bends: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """The line (viscous, Coulomb) nearest to each of the bends, (2, 2), by weighted least squares."""
    root = np.sqrt(weight)[:, None]
    return np.asarray(np.linalg.lstsq(root * line, root * bends, rcond=1e-12)[0])


def _peak_speed(signals: Regressors) -> float:
    """Speed at which the peak of another reading has fallen to 1/e."""
    return PEAK_SHARE * float(np.quantile(np.abs(signals.velocity_rad_s[signals.sliding]), 0.95))


def _moved_by_half_a_period(signals: Regressors, columns: np.ndarray) -> np.ndarray:
    """By how much inertia, viscous and Coulomb friction, (3,), change when a motor torque beside a hand's was
    measured with the position.

    What a motor that damps gives late is acceleration: the balance does not tell by itself when it was
    measured."""
    if signals.external_nm is None or not signals.held_s:
        return np.zeros(3)
    rows = signals.sliding
    late = signals.held_s * np.gradient(signals.torque_nm - signals.external_nm, signals.time_s)
    matrix = columns[rows]
    scale = np.sqrt((matrix**2).mean(axis=0)) + np.finfo(float).tiny
    return np.asarray(np.abs(np.linalg.lstsq(matrix / scale, late[rows], rcond=1e-9)[0] / scale)[:3])


def doubted(parameters: Mapping[str, Estimate], by: np.ndarray) -> dict[str, Estimate]:
    """The parameters with those doubts in their intervals; that of an offset is random alone."""
    of = dict(zip(("inertia", "viscous", "coulomb"), by.tolist(), strict=True))
    of["level"] = of["coulomb"]
    return {name: each.doubted(of.get(name.split("_")[0], 0.0)) for name, each in parameters.items()}


def _readings(
    signals: Regressors, motion: np.ndarray, wanted: np.ndarray, late: Estimate | None
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Columns of the motion, those that are added (the first of them no friction), and the rows; `wanted` is
    the torque that the plain one wants, (n,)."""
    v, s, rows = signals.velocity_rad_s, signals.direction, signals.sliding
    turns = np.flatnonzero(np.diff(np.sign(v), prepend=np.sign(v[0]) + 1))
    x = signals.position_rad
    # travel since the turn, as `regressors` counts it
    since = np.abs(x - x[turns[np.searchsorted(turns, np.arange(len(v)), side="right") - 1]])
    usual = _peak_speed(signals)
    none = np.zeros(len(v))
    jerk, a = signals.jerk_rad_s3, signals.acceleration_rad_s2
    if late is not None and not late.holds(0.0):
        earlier = np.column_stack([a - late.value * jerk, v - late.value * a, s])
        yield earlier, none[:, None], rows
    # a torque late by d is J (a - d jerk) while the joint slides
    yield motion, np.column_stack([jerk]), rows
    # friction that bends at both ends: a power of speed, and a peak at rest
    yield motion, np.column_stack([none, v * np.abs(v), s * np.exp(-np.abs(v) / usual)]), rows
    # bristles that still bend where rows already count as sliding (decision 0080)
    yield motion, np.column_stack([none, s * np.exp(-since / (MEMORY_RAD * signals.radian))]), rows
    # a gear that rubs by the torque that accelerates it
    yield motion, np.column_stack([none, s * np.abs(a)]), rows
    if signals.share_nm is None:
        # a share of the whole torque; not where that is fitted already
        yield motion, np.column_stack([none, s * np.abs(wanted)]), rows
    # a sensor or a drive that saturates softly, whose error grows with the cube
    yield motion, np.column_stack([wanted**3]), rows
    # half a period of the cut-off to either side
    reach = np.ones(SAMPLES_PER_CUTOFF + 1)
    yield motion, none[:, None], rows & (np.convolve(~rows, reach, mode="same") < 0.5)
    # whatever a turn leaves behind, of whatever law
    yield motion, none[:, None], rows & (since > np.median(since[rows]))


def _solved(
    signals: Regressors,
    motion: np.ndarray,
    more: np.ndarray,
    nuisance: np.ndarray,
    rows: np.ndarray,
    block: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Inertia, viscous and Coulomb friction with the columns `more`, of which what is friction is told as
    viscous and Coulomb, and what each block moved them by."""
    matrix, torque = np.hstack([motion, more, nuisance])[rows], signals.torque_nm[rows]
    scale = np.sqrt((matrix**2).mean(axis=0))
    scale[scale == 0] = 1.0
    scaled = matrix / scale
    inverse = np.linalg.pinv(scaled.T @ scaled, rcond=1e-12, hermitian=True)
    found = inverse @ (scaled.T @ torque) / scale
    moved = scaled @ inverse[:, :3] * (torque - matrix @ found)[:, None] / scale[:3]
    scores = np.zeros((int(block.max()) + 1, 3))
    np.add.at(scores, block[rows], moved)
    values = found[:3].copy()
    if more.shape[1] > 1:
        friction = [1, 2, *range(4, 3 + more.shape[1])]
        plain = np.column_stack([motion[rows][:, 1:], nuisance[rows]])
        # as the plain balance would have told it: viscous and Coulomb friction of both readings are then of
        # one kind
        values[1:] = np.linalg.lstsq(plain, matrix[:, friction] @ found[friction], rcond=1e-9)[0][:2]
    return values, scores
