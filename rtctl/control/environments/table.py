"""The table of environments: rig files, messages, clients, reports, pages, campaigns, records and documents
read it.

A new kind is a file beside this one and a row here, and a drawing in `rtctl/client/view_static/drawings.js`.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, Literal

from rtctl.control.environments import damper, detents, free, remote, spring, wall
from rtctl.control.environments.kind import SHARED, Kind, KindFile, Parameter


class Environment(IntEnum):
    """Kinds of environment, by the numbers that records and messages carry: a number, once given, stays."""

    about: Kind
    file: KindFile

    def __new__(cls, number: int, file: KindFile = free) -> Environment:
        """A row of the table. It always has its file: to a type checker a look-up by number is a call of
        this, too."""
        row = int.__new__(cls, number)
        row._value_, row.file, row.about = number, file, file.ABOUT
        return row

    @property
    def word(self) -> str:
        """The name in rig files and messages."""
        return self.name.lower()

    FREE = 0, free
    SPRING = 1, spring
    WALL = 2, wall
    DAMPER = 3, damper
    DETENTS = 4, detents
    REMOTE = 5, remote


NAMES = tuple(kind.word for kind in Environment)

if TYPE_CHECKING:
    KindName = str
else:
    KindName = Literal[NAMES]

PARAMETERS: tuple[Parameter, ...] = tuple(
    # each once, in order
    dict.fromkeys((*SHARED, *(one for kind in Environment for one in kind.about.parameters)))
)
OWN = PARAMETERS[len(SHARED) :]
"""Parameters that are a kind's own, which nothing leads from one value of to another (`kind.SHARED`)."""


def using(parameter: Parameter) -> tuple[Environment, ...]:
    """The kinds that a parameter means something to."""
    return tuple(kind for kind in Environment if parameter in kind.about.parameters)


def meaning(parameter: Parameter) -> str:
    """What a parameter is: "spring, wall: k; detents: greatest slope"."""
    kinds: dict[str, list[str]] = {}
    for kind in using(parameter):
        kinds.setdefault(kind.about.parameters[parameter], []).append(kind.word)
    return "; ".join(f"{', '.join(words)}: {text}" for text, words in kinds.items())
