"""Random numbers as campaigns draw them."""

from __future__ import annotations

import math

import numpy as np


def log_uniform(draw: np.random.Generator, low: float, high: float) -> float:
    """A number from low to high, > 0, every factor as likely."""
    return float(math.exp(draw.uniform(math.log(low), math.log(high))))
