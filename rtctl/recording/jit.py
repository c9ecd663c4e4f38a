"""The compiler of the codec of recordings: its compiled code lets other threads run."""

from __future__ import annotations

from hw.jit import compiler

compiled = compiler(nogil=True)
