"""The arrays that the law starts with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class LawArrays:
    """The law's arrays at the start of a run; shapes as in `rtctl.control.records`."""

    params: np.ndarray
    model: np.ndarray
    command: np.ndarray
    state: np.ndarray | None = None
