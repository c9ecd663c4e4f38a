"""The compiler of the mock rig; its cache key covers all of `hw`."""

from __future__ import annotations

from pathlib import Path

from hw.jit import compiler, records

compiled = compiler(Path(__file__).parent.parent)

__all__ = ["compiled", "records"]
