"""What the tables of a rig file are made of: strict tables, bounded numbers, names, vectors."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from hw.plain_words import NAME_PATTERN


class Table(BaseModel):
    """Base of all tables: strict types, no unknown keys, finite numbers, immutable."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


def number(low: float, high: float, text: str, **more: Any) -> Any:  # noqa: ANN401
    """Field of a number within these bounds; `text` says what it means, with `more` its default."""
    return Field(ge=low, le=high, description=text, **more)


Name = Annotated[str, Field(pattern=NAME_PATTERN)]
Component = Annotated[float, Field(ge=-1e3, le=1e3)]
Vector = tuple[Component, Component, Component]
