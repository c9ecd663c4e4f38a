"""Options that are a number within bounds."""

from __future__ import annotations

import math

import click


class Number(click.FloatRange):
    """A number within bounds: `nan`, which is neither below nor above any, is none."""

    def convert(self, value: float, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number, once it was held against the bounds."""
        number = float(super().convert(value, param, ctx))
        if math.isnan(number):
            self.fail(f"{value!r} is not a number", param, ctx)
        return number
