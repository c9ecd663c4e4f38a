"""The compiler of the codec of recordings; its cache key covers this folder. Compiled code lets other threads run."""

from __future__ import annotations

from pathlib import Path

from hw.jit import compiler

compiled = compiler(Path(__file__).parent, nogil=True)
