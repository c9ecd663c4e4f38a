"""Keys of `[device.options]` of kind engine: only the host imports them."""

from pydantic import BaseModel, ConfigDict, Field


class EngineOptions(BaseModel):
    """A row of `engines`, its joint (fields of `plants.Joint`), its step, and what its sensors hiss."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)

    engine: str = Field(min_length=1, max_length=20)
    joint: dict[str, float] = {}
    step_s: float = Field(1e-4, gt=0, le=1e-2)
    current_loop_hz: float = Field(0.0, ge=0, le=1e5)
    current_noise_a: float = Field(0.002, ge=0, le=10)
    force_noise_n: float = Field(0.005, ge=0, le=10)
    seed: int = Field(1, ge=0, le=2**31 - 1)
