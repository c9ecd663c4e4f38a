"""Keys of `[device.options]`. Only the host imports this; the loop process gets the validated values."""

from pydantic import BaseModel, ConfigDict, Field


class UdpBoardOptions(BaseModel):
    """[device.options] of kind udp-board."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)

    host: str = Field(min_length=1, max_length=253, description="address of the board")
    port: int = Field(9100, ge=1, le=65535)
    torque_max_nm: float = Field(5.0, ge=1e-3, le=1e3, description="the board's own limit: commands saturate")
    lost_after_s: float = Field(0.01, ge=0.002, le=1.0, description="silence after which the board is lost")
