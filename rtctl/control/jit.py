"""The compiler of the control law."""

from __future__ import annotations

from hw.code_cache import made_elsewhere
from hw.jit import bound, compiled, inlined, plain, records

__all__ = ["bound", "compiled", "inlined", "made_elsewhere", "plain", "records"]
