"""The compiler of the simulation."""

from __future__ import annotations

from hw.jit import compiled, records

__all__ = ["compiled", "records"]
