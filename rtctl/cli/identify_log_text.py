"""What `rtctl identify --log` prints: parameters, speeds, offsets, presliding, what memory of a turn is
worth, and units."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

from hw.motion import FORCE_UNITS, HANDLE_M, name
from hw.playback.reader import CURRENT_UNITS, TORQUE_UNITS
from rtctl.errors import ConfigError

if TYPE_CHECKING:
    from rtctl.friction.logs.least_squares import Regression
    from rtctl.friction.logs.regression import JointFit
    from rtctl.friction.logs.reversal_memory import Reversals
    from rtctl.friction.presliding import Presliding

DEFAULT_UNITS = {
    "time": "s",
    "position": "rad",
    "motor_torque": "N m",
    "current": "A",
    "hand_torque": "N m",
    "velocity": "rad/s",
    "temperature": "degC",
}


def units_of(mapped: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Unit that each column was read in."""
    return {
        str(table["column"]): str(table.get("unit", DEFAULT_UNITS[role])) for role, table in mapped.items()
    }


def units_line(mapped: Mapping[str, Mapping[str, Any]]) -> str:
    """The units taken."""
    return "units: " + ", ".join(f"{name} in {unit}" for name, unit in units_of(mapped).items())


def ungeared(mapped: Mapping[str, Mapping[str, Any]], given: Mapping[str, float | None]) -> tuple[str, ...]:
    """What is taken as 1 since nobody gave it: the torque constant of a current, counts a turn; without a rig
    file, and a scale in their place.

    Raises
    ------
    ConfigError
        A position in counts, of which nobody said how many are a turn."""
    # what is not mapped has nothing to be taken for: as if its scale were given
    position, current = (mapped.get(role, {"scale": 1.0}) for role in ("position", "current"))
    if position.get("unit") == "counts" and "scale" not in position and not given["counts_per_rev"]:
        raise ConfigError(
            "the position is in counts: give --counts-per-rev (after quadrature), or --config RIG"
        )
    # a scale in N m/A does the same as the option
    if "scale" in current or given["torque_constant"]:
        return ()
    return (
        "the current is taken for a torque by 1 N m/A, since no torque constant is given: inertia, viscous "
        "and Coulomb friction are in A, and no torques; give --torque-constant (and --gear-ratio, if the "
        "current is that of a motor before a gear), or --config RIG",
    )


def unheld(
    mapped: Mapping[str, Mapping[str, Any]], given: Mapping[str, float | None]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What nothing in a log holds, without a rig file: the scale of its only torque, and of position and time
    where no velocity is mapped. First what is a warning, since nobody said what torque the motor's is; then
    what cannot be told."""
    warned, told = [], []
    # one torque alone: with two, or a rig file, a wrong factor leaves something over
    (torque, *others) = {"motor_torque", "current", "hand_torque"} & set(mapped)
    if not others:
        scale = (
            "whether the scale of the only torque is right (its unit, a torque constant, per peak or per RMS "
            "ampere, a gear, a feed-forward that is not in it, a hand that nobody recorded and that does a "
            "constant share of the work): inertia, viscous and Coulomb friction are all wrong by a factor in "
            "it; --config, or a second torque, holds it"
        )
        said = torque == "hand_torque" or "scale" in mapped[torque] or given["gear_ratio"]
        if said:
            told.append(scale)
        else:
            ratio = "--gear-ratio: 1 where it is at the joint, else that of the gear behind the motor"
            warned.append(f"cannot be told: {scale}; at least say where the torque is ({ratio})")
    if "velocity" not in mapped:
        told.append(
            "whether the scales of position and time are right (a gear ratio, counts a turn; a unit, ticks "
            "of a clock, --rate-hz): a factor in either goes into inertia and viscous friction; a velocity "
            "of another source, or --config, holds them"
        )
    return tuple(warned), tuple(told)


def units_to_confirm(
    known: Mapping[str, Mapping[str, Any]], unsaid: Collection[str], fit: JointFit, motion: str
) -> tuple[str, ...]:
    """What a person is asked first: the unit of the only torque, where the file says none.

    A factor in it makes inertia and friction wrong alike and leaves nothing over, so that no log can tell it;
    who looks at what moves can."""
    (role, *others) = {"motor_torque", "current", "hand_torque"} & set(known)
    column, unit = known[role]["column"], str(known[role].get("unit", DEFAULT_UNITS[role]))
    # -1 turns a sign; any other scale is a unit that somebody has worked out
    if others or column not in unsaid or abs(known[role].get("scale", 1.0)) != 1:
        return ()
    family = next(each for each in (CURRENT_UNITS, FORCE_UNITS, TORQUE_UNITS) if unit in each)
    inertia, of = fit.symmetric.parameters["inertia_kgm2"].value, "kg" if motion == "linear" else "kg m^2"
    # reversed: of two spellings of a unit the first of the table is told
    by_factor = {factor: text for text, factor in reversed(family.items()) if factor != family[unit]}
    # J = tau / a: by what the torque is another, so is the inertia
    would_be = [
        f"in {text} {inertia * factor / family[unit]:.3g} {of}" for factor, text in sorted(by_factor.items())
    ]
    slides = ""
    if motion == "rotary" and not any("unit" in known[each] for each in (role, "position")):
        slides = (
            "; nobody says that the axis turns: of one that slides say so, position=NAME:m, torque=NAME:N"
        )
    # a mass at a handle, which a person can weigh in the hand
    hand = "" if motion == "linear" else f" (as {inertia / HANDLE_M**2:.3g} kg at {1e3 * HANDLE_M:.0f} mm)"
    return (
        f"is {column!r} in {unit}? The file does not say, and no log can: what moves has {inertia:.3g} {of}"
        f"{hand} then, {', '.join(would_be)}; write the unit behind the column's name, or give --config RIG"
        f"{slides}",
    )


def fit_lines(fit: JointFit, bent: Presliding | None, radian: float, motion: str) -> list[str]:
    """Both tables, then what is said of delay, speeds, offsets and presliding; units of a rotary axis, but
    for the names of parameters."""
    from rtctl.friction.logs.speeds_seen import STRIBECK_RAD_S

    lines = [*_table("symmetric", fit.symmetric, motion), *_table("per direction", fit.per_direction, motion)]
    late = fit.remaining_delay_s
    if late:
        lines.append(
            f"delay left in the torque: {1e3 * late.value:.3g} ms ({1e3 * late.low:.3g} to "
            f"{1e3 * late.high:.3g})"
        )
    for way, speed in zip(("forwards", "backwards"), fit.speeds, strict=True):
        lines.append(
            f"{way}: {speed.rows} rows, {speed.lowest_rad_s:.3g} to {speed.highest_rad_s:.3g} rad/s, "
            f"{speed.low_speed_rows} of them below {STRIBECK_RAD_S * radian:.3g} rad/s"
        )
    for each in fit.offsets:
        drift = (
            f"drift of {1e3 * each.drift_range_nm:.3g} mN m about it removed"
            if each.terms
            else "taken as constant"
        )
        lines.append(f"{name(each.parameter, motion)}: {each.source}, {drift}")
    lines.append(
        "an offset may be the zero of the torque or a difference between the directions: a fit counts with "
        "both (--offset-is-zero, --keep-offset)"
    )
    unknown = "not told by these turns (rtctl identify CONFIG measures it; rtctl fit --presliding gives it)"
    return [*lines, f"presliding length: {bent or unknown}"]


RUNGS = {
    "speed": ("by speed alone, as a curve says", ""),
    "lag": ("its peak at rest late behind the speed", "s"),
    "acceleration": ("by speed and acceleration", ""),
    "stop": ("turning over a travel (stop operator)", "rad"),
    "lugre": ("turning over a travel (LuGre's bristle)", "rad"),
    "maxwell": ("springs of several lengths (Maxwell-slip)", "rad"),
}
"""What a rung of `reversal_memory` says of friction, and the unit of its parameter."""


def reversal_lines(turned: Reversals | None) -> list[str]:
    """What memory of a turn is worth, rung by rung, on parts of the logs that were not fitted to."""
    from rtctl.friction.logs.reversal_memory import NEAR_S, TURNS_MIN

    if turned is None:
        return [
            f"reversals: fewer than {TURNS_MIN} turns, all of them at one time, or strokes too short to tell"
        ]
    lines = [
        f"reversals: error within {NEAR_S:g} s of {turned.turns} turns, on parts held out",
        f"  {'friction':<42} {'error':>10} {'less':>15} {'all rows':>10}",
    ]
    for rung in turned.rungs:
        text, unit = RUNGS[rung.name]
        less = (
            "" if rung.name == "speed" else f"{100 * rung.gain:.0f} +- {100 * rung.gain_standard_error:.0f} %"
        )
        value = f"  {1e3 * rung.parameter:.3g} m{unit}" if unit else ""
        lines.append(
            f"  {text:<42} {1e3 * rung.near_nm:5.3g} mN m {less:>15} {1e3 * rung.rms_nm:5.3g} mN m{value}"
            + ("  <- the simplest that will do" if rung.name == turned.chosen else "")
        )
    return lines


def _table(title: str, found: Regression, motion: str) -> list[str]:
    lines = [
        f"{title}: {found.n} rows, condition number {found.condition:.3g}, relative error "
        f"{100 * found.relative_error:.2f} %, residual {1e3 * found.rms_nm:.3g} mN m",
        f"  {'':<26} {'value':>12} {'std. error':>12}   95 % interval",
    ]
    for key, each in found.parameters.items():
        lines.append(
            f"  {name(key, motion):<26} {each.value:12.6g} {each.standard_error:12.2g}   {each.low:.6g} .. "
            f"{each.high:.6g}"
        )
    return lines
