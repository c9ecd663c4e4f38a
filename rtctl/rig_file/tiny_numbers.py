"""Numbers so near to 0 that nobody means them: what is divided by one of them is no number any more."""

from __future__ import annotations

from collections.abc import Iterator

from hw.plain_words import Key

# far below any unit's smallest quantity; 1e-300 squared is 0, and 1 over it infinite
LEAST = 1e-30
"""Smallest magnitude but 0 that a file of settings may name, in any unit."""


LEAST_COMPUTED = 1e-300
"""Least size of a number in a file that a program has written: differences may be tiny, but are normal
numbers."""


def too_small(data: object, least: float = LEAST) -> list[tuple[Key, float]]:
    """Key and value of each number in nested tables and lists that is nearer to 0 than `least`, and not 0."""
    return list(_found((), data, least))


def _found(key: Key, value: object, least: float) -> Iterator[tuple[Key, float]]:
    if isinstance(value, float):
        if 0 < abs(value) < least:
            yield key, value
    elif isinstance(value, dict):
        for name, item in value.items():
            yield from _found((*key, str(name)), item, least)
    elif isinstance(value, list):
        for k, item in enumerate(value):
            yield from _found((*key, k), item, least)
