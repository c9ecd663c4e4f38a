"""The compiler of the campaign; its cache key covers the law and the plant it inlines, and the campaign itself."""

from __future__ import annotations

from pathlib import Path

import hw
import rtctl.control
from hw.jit import compiler, records

compiled = compiler(Path(__file__).parent, Path(rtctl.control.__file__).parent, Path(hw.__file__).parent)

__all__ = ["compiled", "records"]
