"""What is wrong with a log, by its balance of torques: each possible cause is let into the fit, and told if
the parameters then differ.

The balance is ``tau = J a + b v + F_c s + o`` (`rtctl.friction.logs.regression`). A cause (a torque that is
late, a spring, a column in another unit, friction that changes) is one more column or another reading of one.
It is told when it explains much that was left over *and* moves a parameter; so a log of which the parameters
are right gives no alarm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.logs.balance import Balance, Fit
from rtctl.friction.logs.changed_within import changed_within
from rtctl.friction.logs.high_passed import high_passed
from rtctl.friction.logs.late_torques import delayed
from rtctl.friction.logs.lost_counts import lost_counts

TOLD_RATIO = 0.75
"""A cause is told when what is left over, RMS, falls to this share of it or less,"""

TOLD_CHANGE = 0.08
"""and inertia, viscous or Coulomb friction change by this share or more (viscous friction as torque, against
Coulomb friction, too)."""

PLAIN_RATIO = 0.5
"""A cause is told from this share on of much that was left over although the parameters hardly change: what
is left over without a name looks like anything."""

REFUSED_RATIO, REFUSED_CHANGE = 0.7, 0.3
"""Both bounds for parameters that are not given out at all,"""

EXPLAINED = 0.1
"""Share of the torque left over without the cause below which parameters are given out all the same."""

LEFT_LEAST = 0.025
"""Share of the torque left over without a cause below which no cause is sought: friction that is not quite
Coulomb + viscous leaves as much."""

POSITION_SHARE = 0.04
"""Least size of a torque that depends on the position, share of the torque."""

ALIKE = 1.5
"""Causes that leave up to this many times as much over as the best do as well: the one tried first is
told."""

SMALL_SHARE = 0.1
"""Least size of a torque, share of the other, whose weight is looked at."""

DOUBTFUL_SHARE, UNEXPLAINED_SHARE = 0.3, 0.5
"""Share of the torque about its mean, RMS, that the motion does not explain: worth a word, and refused. Sound
logs have .02 to .25."""

# three is the least of which a median says what is usual, and so which part is the other one
PARTS, PART_ROWS = 3, 150
"""Parts of a log that are compared, and fewest rows of one."""

CHANGES_WITHIN = "changes within"
"""Words of a warning that something differs between the parts of a log: `log_checks` tells no drift of a
scale beside it."""

CHANGES = 0.2
"""Share by which Coulomb friction or inertia differ between parts of a log that is told."""


def changed(balance: Balance, before: Fit, after: Fit) -> float:
    """Largest change of a parameter, share of what it is after; viscous friction against the whole friction
    where that is larger."""
    # against a quarter of the whole friction: of a joint with next to no viscous part any change is manifold
    viscous = max(abs(after.viscous), 0.25 * abs(after.coulomb) / balance.speed)
    return max(
        abs(before.inertia - after.inertia) / max(abs(after.inertia), 1e-12),
        abs(before.viscous - after.viscous) / viscous,
        abs(before.coulomb - after.coulomb) / max(abs(after.coulomb), 1e-12),
    )


def diagnosed(balance: Balance, noted: Sequence[str] = ()) -> tuple[str, ...]:
    """Warnings about the balance of a log; `noted` is what was found in its columns before.

    Raises
    ------
    DataError
        A cause that makes the parameters useless, named with the remedy; or the motion explains too little.
    """
    plain, source = balance.fit(), balance.signals.source
    refusals, doubts, least = [], [], plain.rest
    for find in _SEARCHED if plain.rest > LEFT_LEAST * balance.spread else ():
        found = find(balance, plain)
        if found is None:
            continue
        text, other = found
        if other.rest > DOUBTFUL_SHARE * balance.spread:
            continue  # nor is it explained with that
        least = min(least, other.rest)
        ratio, change = other.rest / plain.rest, changed(balance, plain, other)
        much = plain.rest > EXPLAINED * balance.spread
        if ratio <= REFUSED_RATIO and change >= REFUSED_CHANGE and much:
            refusals.append((other.rest, text))
        elif (ratio <= TOLD_RATIO and change >= TOLD_CHANGE) or (ratio <= PLAIN_RATIO and much):
            doubts.append((other.rest, text))
    if refusals and min(refusals)[0] <= ALIKE * least:
        # a refusal's words before a doubt's, even where the doubt leaves a little less over: it is why
        # nothing is given out
        text = next(text for rest, text in (*refusals, *doubts) if rest <= ALIKE * least)
        raise DataError("; besides: ".join([f"{source}: {text}", *noted]))
    told = [text for rest, text in doubts if rest <= ALIKE * least]
    warnings = [f"{source}: {text}" for text in (*told, *_over_time(balance, ALIKE * least))]
    left = plain.rest / balance.spread
    if left > UNEXPLAINED_SHARE:
        raise DataError(
            "; besides: ".join([_unexplained(source, left, UNEXPLAINED_SHARE), *noted, *warnings])
        )
    if left > DOUBTFUL_SHARE:
        warnings.append(_unexplained(source, left, DOUBTFUL_SHARE))
    return tuple(warnings)


def explained_as_well(balance: Balance, plain: Fit, by_place: Fit) -> bool:
    """Whether another cause says what is left over better than a torque that goes by the place, or a plainer
    one about as well."""
    as_well = min(ALIKE * by_place.rest, TOLD_RATIO * plain.rest)
    for k, find in enumerate(_SEARCHED):
        found = find(balance, plain) if find is not _position else None
        if found and found[1].rest <= (as_well if k < _SEARCHED.index(_position) else by_place.rest):
            return True
    return False


def _unexplained(source: str, left: float, most: float) -> str:
    return (
        f"{source}: the motion explains too little of the torque: {100 * left:.0f} % of it, RMS about its "
        f"mean, is something else (at most {100 * most:.0f} %); map the torque of the same axis and every "
        "torque on the joint, look at the sensor's zero, and leave out what is not free motion; a hand, "
        "play, an elastic shaft, a command that the drive cut off at a limit of its own, and counts or "
        "torques that wrapped look like that, too"
    )


def _velocity_as_position(balance: Balance, plain: Fit) -> tuple[str, Fit] | None:
    """The position column read as a velocity."""
    velocity, acceleration = balance.position, balance.velocity
    # the sign of a velocity about 0 is noise, and of a position there is no sign to compare with
    moving = np.abs(velocity) > 0.1 * np.abs(velocity).max()
    motion = np.column_stack([acceleration, velocity, np.sign(velocity)])
    as_it_is, other = balance.fit(rows=moving), balance.fit(motion=motion, rows=moving)
    if not (other.inertia > 0 and other.coulomb > 0 and other.rest < 0.5 * as_it_is.rest):
        return None
    # a spring that swings has its torque in step with the position as well, and is likelier
    if _position_fit(balance).rest < 1.5 * other.rest:
        return None
    return (
        f"column position: looks like a velocity: read as one, {100 * other.rest / balance.spread:.0f} % of "
        f"the torque is left over, read as a position {100 * as_it_is.rest / balance.spread:.0f} %; map the "
        "column with the angle",
        # it has fewer rows: brought to what the plain fit leaves on all of them
        replace(other, rest=other.rest * plain.rest / as_it_is.rest),
    )


def _weight(balance: Balance, plain: Fit) -> tuple[str, Fit] | None:
    """The weight with which the smaller of two torques enters; 1 where both are in the same unit and sign."""
    if balance.external is None:
        return None
    motor, external = balance.torque - balance.external, balance.external
    # the smaller gets the weight: of the larger nearly all of the torque would be its own noise
    # by what varies: a constant in either is an offset of the balance, and says nothing of its unit
    smaller_is_motor = motor.std() < external.std()
    small, large = (motor, external) if smaller_is_motor else (external, motor)
    if small.std() == 0:
        return None
    other = balance.fit(torque=large, added=-small[:, None])
    weight = float(other.added[0])
    names = ("motor torque", "external torque") if smaller_is_motor else ("external torque", "motor torque")
    thousand = 0.7 < abs(weight) / 1000 < 1.4
    if abs(weight - 1) < 0.15 or (small.std() < SMALL_SHARE * large.std() and not thousand):
        return None  # of a torque that adds little the weight is mostly noise
    text = _weight_text(names, weight, other)
    # what was fitted is in the unit of the larger torque: back to that of the smaller
    # of a weight below 1 the larger torque is taken for the one in N m, and the parameters are of that
    # already
    unit = max(abs(weight), 1.0)
    return text, Fit(
        other.inertia / unit, other.viscous / unit, other.coulomb / unit, other.added, other.rest / unit
    )


def _weight_text(names: tuple[str, str], weight: float, other: Fit) -> str:
    small, large = names
    if abs(weight + 1) < 0.2:
        turned = large if other.inertia < 0 and other.coulomb < 0 else small
        return f"{turned}: its sign is turned: the torques balance if it is (scale -1)"
    if 0.7 < abs(weight) / 1000 < 1.4:
        return (
            f"{large}: is a thousand times too large against the {small}, as if in mN m; correct the unit "
            f"of the {large}, or of the {small}"
        )
    if abs(weight) < 0.1:
        return (
            f"{small}: has no part in the balance (weight {weight:.2g}, 1 is wanted); map the column that "
            "was measured on this axis, or leave it out"
        )
    return (
        f"{small}: enters the balance with the weight {weight:.3g} against the {large}, 1 is wanted; "
        "correct the unit or the scale of one of them (a current as N m? torque constant, gear ratio, "
        "lever?)"
    )


def _position_fit(balance: Balance) -> Fit:
    return balance.fit(added=_by_position(balance))


def _by_position(balance: Balance) -> np.ndarray:
    """Columns of a spring and of gravity on a turn, (n, 3)."""
    # a carriage has no turn, but a spring and a weight's way are seen by the same columns
    x = balance.position / balance.signals.radian
    return np.column_stack([x - x.mean(), np.sin(x), np.cos(x)])


def _position(balance: Balance, _plain: Fit) -> tuple[str, Fit] | None:
    """A spring, or gravity: torque that depends on the position."""
    other = _position_fit(balance)
    if not (other.inertia > 0 and other.coulomb > 0):
        return None
    part = _by_position(balance) @ other.added
    # its own: beside a spring that is fitted already the same columns may cancel each other
    part = part - balance.nuisance @ np.linalg.lstsq(balance.nuisance, part, rcond=1e-9)[0]
    if np.std(part) < POSITION_SHARE * balance.spread:
        return None
    return (
        f"the torque depends on the position ({float(np.std(part)):.3g} N m RMS: a spring, gravity, a "
        "cable, another hand, or friction that varies with the place); map that torque, take it away, or "
        f"balance the joint: without it inertia would be {other.inertia:.3g} kg m^2, viscous friction "
        f"{other.viscous:.3g} N m s/rad and Coulomb friction {other.coulomb:.3g} N m",
        other,
    )


# the plainest mistakes first: of causes that leave as little over the first is told (`ALIKE`)
_SEARCHED = (_velocity_as_position, _weight, high_passed, delayed, _position, lost_counts, changed_within)


def _over_time(balance: Balance, most: float) -> list[str]:
    """Parts of each log whose friction or inertia differ, where they leave at most `most` over."""
    told = []
    for k, source in enumerate(balance.signals.sources):
        rows = np.flatnonzero(balance.log == k)
        if len(rows) < PARTS * PART_ROWS:
            continue
        parts = np.array_split(rows, PARTS)
        # in a part that is mostly of one direction friction is an offset
        if any(abs(np.sign(balance.velocity[part]).mean()) > 0.6 for part in parts):
            continue
        fits = [balance.fit(rows=part) for part in parts]
        if not all(fit.is_joint(balance.speed) for fit in fits):
            continue
        rest = float(np.sqrt(np.mean([fit.rest**2 for fit in fits])))
        if rest > min(most, TOLD_RATIO * balance.fit(rows=rows).rest):
            continue
        bends = balance.bends()
        own = float(np.sqrt(np.mean([balance.fit(added=bends, rows=part).rest ** 2 for part in parts])))
        if own > TOLD_RATIO * balance.fit(added=bends, rows=rows).rest:
            continue  # one friction that bends over speed says as much: the parts are of other speeds
        for name, unit, of, values in (
            ("Coulomb friction", "N m", 2, [fit.coulomb for fit in fits]),
            ("inertia", "kg m^2", 0, [fit.inertia for fit in fits]),
        ):
            usual = float(np.median(values))
            furthest = parts[int(np.argmax(np.abs(np.subtract(values, usual))))]
            if max(values) - min(values) > CHANGES * usual and _needed(balance, furthest, of, usual):
                began_s = balance.signals.began_s(k)  # a person looks for it by the time of that file
                times = ", ".join(f"{balance.time_s[part[0]] - began_s:.3g} s" for part in parts)
                told.append(
                    f"{name} {CHANGES_WITHIN} {source}: {', '.join(f'{value:.3g}' for value in values)} "
                    f"{unit} in the parts from {times} on (temperature, load, a part touched, two logs in "
                    "one); cut the log there, or take the mean for what it is"
                )
    return told


def _needed(balance: Balance, rows: np.ndarray, of: int, usual: float) -> bool:
    """Whether rows need a parameter of their own in place of the usual one: the slow part of a chirp hardly
    tells an inertia."""
    motion = balance.motion
    # `motion` is made anew at each call: the balance keeps its own
    given, motion[:, of] = usual * motion[:, of], 0.0
    without = balance.fit(torque=balance.torque - given, motion=motion, rows=rows)
    return balance.fit(rows=rows).rest < TOLD_RATIO * without.rest
