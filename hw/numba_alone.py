"""Numba, imported without what it imports only to look whether it is there.

SciPy for its version, YAML for a file of options in the working directory, coverage for its own tests: none
of them is used here, and together they take a third of what importing Numba takes in every process. Whoever
may be the first to import Numba does so from here."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

LOOKED_FOR = ("coverage", "scipy", "yaml")


@contextmanager
def _absent(names: tuple[str, ...]) -> Iterator[None]:
    """As if these were not installed; those that are imported already stay."""
    hidden = [name for name in names if name not in sys.modules]
    sys.modules.update(dict.fromkeys(hidden))  # type: ignore[arg-type] # None: ImportError
    try:
        yield
    finally:
        for name in hidden:
            del sys.modules[name]


with _absent(LOOKED_FOR):
    import numba
    from numba.core import caching, config
    from numba.core.runtime import nrt
    from numba.np import numpy_support

__all__ = ["LOOKED_FOR", "caching", "config", "nrt", "numba", "numpy_support"]
