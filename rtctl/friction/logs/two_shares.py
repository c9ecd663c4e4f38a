"""Friction as a share of two recorded torques: of what the motor gives, of what the hand gives, or of both.

Beside a hand the motor's part of a torque is not what the motion wants, so the column is made of the record.
Its noise is in the balance as well and would alone make a share; a column made of what the balance wants less
the *other* record has the other one's noise, with the other sign. A share is told where both say so, and
their mean is fitted (docs/theory.md 9.9)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rtctl.friction.logs.regressors import Regressors
from rtctl.friction.logs.torque_shape import ALIKE, KNOWN, KNOWN_BESIDE, Effect, PlainBalance

OF = {"both torques": (1.0, 1.0), "the motor torque": (1.0, 0.0), "the external torque": (0.0, 1.0)}
"""Weights of the motor's and of the hand's torque, by what friction is a share of."""


@dataclass(frozen=True)
class _Share:
    of: str
    recorded: Effect
    wanted: Effect

    @property
    def known(self) -> bool:
        """Whether the log tells it."""
        both = (self.recorded, self.wanted)
        return all(one.error <= KNOWN and one.beside_error <= KNOWN_BESIDE for one in both)

    @property
    def sure(self) -> bool:
        """Whether it is there by both columns, a gear's, and alike."""
        both = (self.recorded, self.wanted)
        return (
            all(one.sure() and one.of_gear() for one in both)
            # noise makes one too large and the other too small: alike, it makes neither
            and abs(self.wanted.value / self.recorded.value - 1) < ALIKE
        )


def with_share_of_two(
    signals: Regressors, external_nm: np.ndarray
) -> tuple[Regressors, tuple[str, ...], tuple[str, ...]]:
    """As `torque_shape.with_share`, of the signals of two torques; `external_nm` (n,) is the hand's part."""
    plain = PlainBalance(signals)
    bend = plain.bend()
    shares = list(_shares(plain, external_nm, bend))
    untold = tuple(
        f"whether friction is a share of {one.of}, as in gears: it hardly brakes the joint in this log; of "
        "a gear that loses a share k of what drives it all parameters are 1/(1 - k) times too large "
        "(record quick stops, or the motor alone)"
        for one in shares
        if not one.known
    )
    found = [
        one
        for one in shares
        if one.known and one.sure and not (bend.sure() and bend.rest < one.recorded.rest)
    ]
    if not found:
        return signals, (), untold[:1]
    # of both, the motor's and the hand's share: the column whose record leaves least over
    best = min(found, key=lambda one: one.recorded.rest)
    value, error = best.recorded.value, max(best.recorded.error, best.wanted.error)
    text = (
        f"{signals.source}: friction grows with {best.of}, by {value:.2g} of it (+- {2 * error:.1g}): it "
        "differs where a torque drives the joint and where it brakes it, as through a gear or a screw; "
        "that share is fitted as torque_share, Coulomb and viscous friction are what is left without "
        "torque, and the points hold it at the torques of this log (--by-load: at several, for rtctl fit "
        "--by-load)"
    )
    # the noise of one record is in either column with opposite signs
    column = 0.5 * (best.recorded.column + best.wanted.column)
    return replace(signals, share_nm=column), (text,), ()


def _shares(plain: PlainBalance, external: np.ndarray, bend: Effect) -> Iterator[_Share]:
    torque = plain.signals.torque_nm
    for name, (motor, hand) in OF.items():
        recorded = plain.direction * (motor * np.abs(torque - external) + hand * np.abs(external))
        # the whole torque that is wanted, so that the other record is what is left of it
        # offset and all: what is left of it for the other record must be that record, with its zero
        total = plain.balanced(recorded)
        wanted = plain.direction * (
            motor * np.abs(total - external) + hand * np.abs(total - torque + external)
        )
        yield _Share(name, plain.of(recorded, bend.column[:, None]), plain.of(wanted, bend.column[:, None]))
