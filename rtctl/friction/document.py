"""The model file's document: its schema, its one rendering as text, its checksum.

A model file is JSON with exactly one valid spelling: what `render` writes. Any other text of the same
numbers is treated as edited."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from rtctl.control.records import MAX_SEGMENTS, PLACE_ORDERS
from rtctl.friction.kind_harmonics import ORDER_MAX, ORDERS_MOST
from rtctl.friction.kind_table import KINDS
from rtctl.friction.model import SELF_TEST_VECTORS
from rtctl.friction.presliding import LENGTH_MAX_RAD
from rtctl.rig_file.fields import Name, Table

FORMAT = "rtctl friction model"
SCHEMA = 2

Number = Annotated[float, Field(ge=-1e15, le=1e15)]
Coefficient = Annotated[float, Field(ge=-1e30, le=1e30)]
"""Coefficients of a cubic: between two knots nm/s apart, as points of a carriage at even speeds are, the
third is 1e17 N/(m/s)^3 and harmless."""
Torque = Annotated[float, Field(ge=0, le=1e6)]
Damping = Annotated[float, Field(ge=0, le=1e15)]
Speed = Annotated[float, Field(ge=0, le=1e4)]
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
if TYPE_CHECKING:
    Kind = str  # a type checker takes no Literal that is computed
else:
    Kind = Literal[tuple(KINDS)]
Temperature = Annotated[float, Field(ge=-100, le=300)]
Text = Annotated[str, Field(max_length=80)]
Position = Annotated[float, Field(ge=-1e4, le=1e4)]
Period = Annotated[float, Field(ge=1e-3, le=1e4)]
Share = Annotated[float, Field(ge=0, le=10)]
Presliding = Annotated[float, Field(gt=0, le=LENGTH_MAX_RAD)]


class BandDocument(Table):
    """The band: the fields of `rtctl.friction.band.Band`."""

    edges_rad_s: tuple[Speed, ...] = Field(max_length=16, strict=False)  # JSON has lists, no tuples
    half_width_nm: tuple[Torque, ...] = Field(min_length=1, max_length=17, strict=False)
    way: Text
    units: int = Field(ge=1, le=10**9)
    errors: int = Field(ge=1, le=10**9)
    slowest_rad_s: Speed = 0.0


class PartDocument(Table):
    """One curve of a mean: its share, and the fields of `rtctl.friction.kind_curve.Curve`."""

    share: float = Field(gt=0, le=1)
    kind: Kind
    parameters: dict[Text, Number] = Field(max_length=16)
    intercept: Number
    support_vectors: list[Speed] = Field(max_length=MAX_SEGMENTS)
    dual_coef: list[Number] = Field(max_length=MAX_SEGMENTS)


class BranchDocument(Table):
    """One direction; the fields are those of `rtctl.friction.model.Branch`."""

    n_points: int = Field(ge=1, le=10**9)
    speed_max_rad_s: float = Field(gt=0, le=1e4)
    friction_min_nm: float = Field(ge=-1e6, le=1e6)
    friction_max_nm: Torque
    viscous_nms_rad: Damping
    train_mean_error_nm: Torque
    train_rmse_nm: Torque
    train_max_error_nm: Torque
    validation_rmse_nm: Torque
    validation_max_error_nm: Torque
    compile_bound_nm: Torque
    friction_lower_nm: Torque
    secant_damping_nms_rad: Damping
    slope_damping_nms_rad: Number
    place_spread_nm: Torque | None = None
    support_places: list[Position] = Field(default=[], max_length=MAX_SEGMENTS)
    test_max_error_nm: Torque | None = None
    single_max_error_nm: Torque | None = None
    sliding_doubt_nm: Torque | None = None
    band: BandDocument | None = None
    hyper_parameters: dict[Text, Number] = Field(max_length=16)
    parameters: dict[Text, Number] = Field(max_length=16)
    intercept: Number
    support_vectors: list[Speed] = Field(max_length=MAX_SEGMENTS)
    dual_coef: list[Number] = Field(max_length=MAX_SEGMENTS)
    parts: list[PartDocument] = Field(default=[], max_length=32)
    knots: list[Speed] = Field(min_length=1, max_length=MAX_SEGMENTS)
    coefficients: list[Annotated[list[Coefficient], Field(min_length=4, max_length=4)]] = Field(
        min_length=1, max_length=MAX_SEGMENTS
    )


class PlaceDocument(Table):
    """Kernel of place: the fields of `rtctl.friction.kind_place.PlaceKernel`."""

    period_rad: Period
    orders: int = Field(ge=1, le=PLACE_ORDERS)
    share: float = Field(ge=0, le=1)
    decay: float = Field(ge=0, le=1)


class ConservativeDocument(Table):
    """The conservative part: the fields of `rtctl.friction.kind_harmonics.Harmonics`."""

    period_rad: Period
    orders: list[Annotated[int, Field(ge=1, le=ORDER_MAX)]] = Field(min_length=1, max_length=ORDERS_MOST)
    cos: list[Annotated[float, Field(ge=-1e6, le=1e6)]] = Field(min_length=1, max_length=ORDERS_MOST)
    sin: list[Annotated[float, Field(ge=-1e6, le=1e6)]] = Field(min_length=1, max_length=ORDERS_MOST)


class LoadDocument(Table):
    """What the torque through the gear adds: the fields of `rtctl.friction.load.Load`."""

    outside: Share
    motor: Share
    outside_peak: Share
    motor_peak: Share
    outside_square_per_nm: Annotated[float, Field(ge=0, le=1e6)]
    motor_square_per_nm: Annotated[float, Field(ge=0, le=1e6)]
    stribeck_rad_s: float = Field(gt=0, le=1e5)
    stribeck_power: float = Field(ge=0.1, le=20)
    most_nm: float = Field(gt=0, le=1e6)
    doubt_share: Share
    second_share: Share = 0.0
    second_rad_s: float = Field(default=1.0, gt=0, le=1e5)


class BranchesDocument(Table):
    """Both directions."""

    forward: BranchDocument
    backward: BranchDocument


class ModelDocument(Table):
    """A whole model file. `kind` says what was learned: a sum of kernels, or a formula.

    `motion` and `units` stand in that of a linear axis: which unit each ending of its keys means.

    Keys with a default came later: a file without them is one that does not know."""

    format: Literal["rtctl friction model"]
    schema_version: Literal[2] = Field(alias="schema")
    kind: Kind
    motion: Literal["rotary", "linear"] = "rotary"
    units: dict[Text, Text] = Field(default={}, max_length=16)
    rig: Name
    created: Text
    versions: dict[Text, Text] = Field(max_length=16)
    data_sha256: Sha256
    temperature_min_c: Temperature | None
    temperature_max_c: Temperature | None
    evaluation_ns: Annotated[float, Field(ge=0, le=1e9)] | None
    selection: str = Field(max_length=1000)
    presliding_rad: Presliding | None = None
    presliding_spread_rad: Annotated[float, Field(ge=0, le=LENGTH_MAX_RAD)] | None = None
    presliding_ramps: int = Field(default=0, ge=0, le=10**9)
    place: PlaceDocument | None = None
    conservative: ConservativeDocument | None = None
    load: LoadDocument | None = None
    friction_max_nm: Torque
    speed_fade_rad_s: float = Field(gt=0, le=1e4)
    branches: BranchesDocument
    self_test: list[Annotated[list[Number], Field(min_length=2, max_length=2)]] = Field(
        min_length=SELF_TEST_VECTORS, max_length=SELF_TEST_VECTORS
    )
    sha256: Sha256


def checksum(document: dict[str, Any]) -> str:
    """SHA-256 (hex) over the rendered document without its `sha256`."""
    # by the one spelling there is, so that another order of keys is another text and not another model
    content = {key: value for key, value in document.items() if key != "sha256"}
    return hashlib.sha256(render(content).encode()).hexdigest()


def render(document: dict[str, Any]) -> str:
    """Write the document as text: one key a line, one row of a table a line. Raises ValueError for NaN."""
    return _value(document, 0) + "\n"


def _value(value: object, depth: int) -> str:
    rows: list[str] = []
    if isinstance(value, dict) and value:
        rows = [f"{json.dumps(key)}: {_value(item, depth + 1)}" for key, item in value.items()]
    elif isinstance(value, list) and value and isinstance(value[0], list | dict):
        rows = [_value(item, depth + 1) for item in value]
    if not rows:
        return json.dumps(value, allow_nan=False)
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    pad = "  " * (depth + 1)
    return opening + "\n" + ",\n".join(pad + row for row in rows) + "\n" + "  " * depth + closing
