"""The compiler of the mock rig."""

from __future__ import annotations

from hw.jit import compiled, inlined, records

__all__ = ["compiled", "inlined", "records"]
