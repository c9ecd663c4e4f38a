"""What every table of options and of a rig file is made of: strict tables, bounded numbers. Host side
only."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo


class Table(BaseModel):
    """Base of all tables: strict types, no unknown keys, finite numbers, immutable."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


def number(low: float, high: float, text: str, default: object = ...) -> Any:  # noqa: ANN401 - as pydantic's own
    """Field of a number within these bounds; `text` says what it means. Without a default it must be
    given."""
    return Field(default, ge=low, le=high, description=text)


def short_life(time_to_live_ms: float, info: ValidationInfo) -> None:
    """The safety contract: without the host no torque after 10 periods (never asked below 10 ms)."""
    rate_hz = (info.context or {}).get("rate_hz")
    longest_ms = max(10.0, 1e4 / rate_hz) if rate_hz else 100.0
    if rate_hz and time_to_live_ms < 2e3 / rate_hz:
        raise ValueError(
            f"time_to_live_ms {time_to_live_ms:g} must be at least {2e3 / rate_hz:g}, 2 periods: one command "
            "that comes late must not stop the drive"
        )
    if time_to_live_ms > longest_ms:
        raise ValueError(f"time_to_live_ms {time_to_live_ms:g} must be at most {longest_ms:g}: 10 periods")
