"""Columns of a file of friction points: the one table that reader, averages and documents take theirs from.

A column that is not here is kept as well where all its cells are numbers or empty; text is ignored."""

from __future__ import annotations

from dataclasses import dataclass

from rtctl.friction.presliding import LENGTH_MAX_RAD


@dataclass(frozen=True)
class Column:
    """One column: bounds in `unit`; `blank` cells may be written "nan"; `of_levels`: its mean over a level of
    speed says something."""

    name: str
    unit: str
    low: float
    high: float
    meaning: str
    required: bool = False
    blank: bool = True
    of_levels: bool = False


VELOCITY, TORQUE, DIRECTION, STD, COUNT = (
    Column("velocity_rad_s", "rad/s", -1e4, 1e4, "signed velocity of the run; 0: break-away", True, False),
    Column(
        "friction_torque_nm", "N m", -1e6, 1e6, "friction overcome, with the sign of the motion", True, False
    ),
    Column("direction", "", -1, 1, "+1 or -1, of a break-away point (else its torque's sign)", blank=False),
    Column("std_nm", "N m", -1e6, 1e6, "spread of the measurements behind the point", blank=False),
    Column("count", "", -1e12, 1e12, "number of measurements behind the point", blank=False),
)
"""What every point has, known or not: fields of `points.FrictionPoints`."""

BETWEEN = Column(
    "between_parts_nm",
    "N m",
    0.0,
    1e6,
    "standard deviation of the point between stretches of time of its log: a band of one log has it beside "
    "the errors held out",
)

BESIDE = (
    Column(
        "time_s", "s", -1e12, 1e12, "when the point was measured: `--folds time` holds out by it", blank=False
    ),
    Column("position_rad", "rad", -1e9, 1e9, "place; the mean of several"),
    Column("travel_rad", "rad", 0.0, 1e9, "way around the place that the point is the mean over"),
    Column(
        "load_nm",
        "N m",
        -1e6,
        1e6,
        "torque on the joint from outside (hand, weight), signed: it accelerates where positive",
        of_levels=True,
    ),
    Column("motor_nm", "N m", -1e6, 1e6, "the motor's, signed; without: friction less load", of_levels=True),
    Column("temperature_c", "degC", -100, 250, "of the motor; 0 throughout: no sensor", of_levels=True),
    Column("log", "", 0, 1e9, "number of the log, lap or session it is from"),
    Column("weakest_place_nm", "N m", -1e6, 1e6, "friction at the weakest place, signed as the motion"),
    Column(
        "zero_doubt_nm",
        "N m",
        0.0,
        1e6,
        "offset that was taken for the torque's zero: friction may be less by it in one direction",
    ),
    BETWEEN,
    Column("presliding_rad", "rad", 1e-12, LENGTH_MAX_RAD, "break-away points: presliding length"),
    Column(
        "presliding_spread_rad",
        "rad",
        0.0,
        LENGTH_MAX_RAD,
        "its standard deviation over ramps; 0: at most so long",
    ),
    Column("presliding_ramps", "", 1.0, 1e9, "ramps behind it"),
)
"""What a point may have beside: `FrictionPoints.columns`."""

COLUMNS = {column.name: column for column in (VELOCITY, TORQUE, DIRECTION, STD, COUNT, *BESIDE)}
