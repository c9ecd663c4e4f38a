"""The compiler of the control law; its cache key covers `rtctl/control` and `hw` (simulations inline both)."""

from __future__ import annotations

from pathlib import Path

import hw
from hw.jit import bound, compiler, plain, records

compiled = compiler(Path(__file__).parent, Path(hw.__file__).parent)

__all__ = ["bound", "compiled", "plain", "records"]
