"""Arithmetic with discs of complex numbers: the result of an operation holds every result of numbers of its
operands.

A disc is a centre and a radius, arrays of one shape. Sums, differences and inverses are the smallest discs; a
product is the usual one, |c| r' + r |c'| + r r'. A disc that holds 0 has an inverse of infinite radius, which
makes everything after it infinite or NaN: neither passes a comparison with a bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Disc:
    """All numbers no farther than `radius` from `center`."""

    center: np.ndarray
    radius: np.ndarray

    def __add__(self, other: Disc | complex | np.ndarray) -> Disc:
        if isinstance(other, Disc):
            return Disc(self.center + other.center, self.radius + other.radius)
        return Disc(self.center + other, self.radius)

    def __neg__(self) -> Disc:
        return Disc(-self.center, self.radius)

    def __sub__(self, other: Disc | complex | np.ndarray) -> Disc:
        return self + (-other)

    def __mul__(self, other: Disc | complex | np.ndarray) -> Disc:
        if isinstance(other, Disc):
            a, b = np.abs(self.center), np.abs(other.center)
            wide = a * other.radius + self.radius * b + self.radius * other.radius
            return Disc(self.center * other.center, wide)
        return Disc(self.center * other, self.radius * np.abs(other))

    def inverse(self) -> Disc:
        """1/x of every x; infinite where the disc holds 0."""
        # 1/x of a disc is a disc, but not about 1/c: what is nearer to 0 goes farther out
        left = np.abs(self.center) ** 2 - self.radius**2
        with np.errstate(divide="ignore", invalid="ignore"):
            center, radius = np.conj(self.center) / left, self.radius / left
        holds = ~(left > 0)  # so written that NaN holds 0, too: nothing is proved by it
        return Disc(np.where(holds, 0.0, center), np.where(holds, np.inf, radius))

    @property
    def most(self) -> np.ndarray:
        """Largest absolute value."""
        return np.abs(self.center) + self.radius


def point(value: np.ndarray) -> Disc:
    """A disc of one number."""
    return Disc(value, np.zeros(np.shape(value)))


def exponential(x: Disc) -> Disc:
    """e^x of every x, within a disc about that of the centre: |e^(c + d) - e^c| <= |e^c| (e^|d| - 1)."""
    center = np.exp(x.center)
    return Disc(center, np.abs(center) * np.expm1(x.radius))


def one_less_exponential(x: Disc) -> Disc:
    """1 - e^x, exact for small x, too: on the detour around z = 1 |x| is 1e-5 at 1 kHz, where a difference
    would leave eleven digits."""
    return Disc(-np.expm1(x.center), np.abs(np.exp(x.center)) * np.expm1(x.radius))
