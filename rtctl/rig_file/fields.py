"""What the tables of a rig file are made of: strict tables, bounded numbers, names, vectors."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from hw.option_tables import Table, number
from hw.plain_words import NAME_PATTERN

__all__ = ["Component", "Name", "Table", "Vector", "number"]


Name = Annotated[str, Field(pattern=NAME_PATTERN)]
Component = Annotated[float, Field(ge=-1e3, le=1e3)]
Vector = tuple[Component, Component, Component]
