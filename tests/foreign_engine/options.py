"""Keys of `[device.options]` of kind mujoco: only the host imports them."""

from pydantic import BaseModel, ConfigDict, Field


class EngineOptions(BaseModel):
    """A model file, what its sensors hiss, and what the hand's actuator is given."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)

    model: str = Field(min_length=1, max_length=500)
    current_loop_hz: float = Field(0.0, ge=0, le=1e5)
    current_noise_a: float = Field(0.002, ge=0, le=10)
    force_noise_n: float = Field(0.005, ge=0, le=10)
    hand: float = Field(0.0, ge=-100, le=100)
    hand_hz: float = Field(0.5, ge=0, le=50)
    hand_from_s: float = Field(1.0, ge=0, le=1e6)
    seed: int = Field(1, ge=0, le=2**31 - 1)
