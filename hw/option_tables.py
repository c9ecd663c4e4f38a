"""What every table of options and of a rig file is made of: strict tables, bounded numbers. Host side
only."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class Table(BaseModel):
    """Base of all tables: strict types, no unknown keys, finite numbers, immutable."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


def number(low: float, high: float, text: str, default: object = ...) -> Any:  # noqa: ANN401 - as pydantic's own
    """Field of a number within these bounds; `text` says what it means. Without a default it must be
    given."""
    return Field(default, ge=low, le=high, description=text)
