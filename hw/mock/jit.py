"""The compiler of the mock rig; its cache key covers all of `hw`."""

from __future__ import annotations

from hw.jit import compiled, records

__all__ = ["compiled", "records"]
