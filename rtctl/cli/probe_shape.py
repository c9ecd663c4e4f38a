"""`rtctl probe --pulses`: the shape of each axis' current loop, by many test pulses of arming."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from hw.motion import words
from rtctl.cli.json_text import end_with

if TYPE_CHECKING:
    from rtctl.rig_file.config import LoadedConfig

WARNING = (
    "The rig of {rig} will be armed and stopped {pulses} times, each time with its test pulse of at most "
    "5 % of the torque limit.\nTake your hands off it. Ctrl-C ends it at any moment."
)

SAID = {
    "first order": "of first order",
    "two lags": "of two lags, without overshoot",
    "overshoots": "exceeds its steps",
    "not told": "of a shape that these pulses do not tell: more of them (--pulses), or finer samples",
    "another": "of another shape than a loop of first or second order: nothing of this kind is proved",
    "too quick": "quicker than its samples show",
}
"""What is said of each shape (`rtctl.identify.current_shape.Told`)."""


def tell(loaded: LoadedConfig, pulses: int, runtime_dir: str | None, *, as_json: bool, yes: bool) -> None:
    """Ask, arm, and print what was found. Raises as `shapes`."""
    if not (yes or loaded.config.simulated):
        click.echo(WARNING.format(rig=loaded.config.rig.name, pulses=pulses), err=True)
        click.confirm("Is nobody touching the rig?", abort=True, err=True)
    found = shapes(loaded, pulses, runtime_dir, quiet=as_json)
    if as_json:
        end_with({"ok": True, "actuators": found}, 0)
    click.echo("\n".join(line_of(one) for one in found))


def shapes(
    loaded: LoadedConfig, pulses: int, runtime_dir: str | None, *, quiet: bool
) -> list[dict[str, Any]]:
    """Arm the rig of `loaded` so many times; what its pulses tell of each axis, as plain values.

    Raises
    ------
    FaultError
        The rig refused its pulse, or was stopped.
    KeyboardInterrupt
        Ctrl-C before the end."""
    from rtctl.host.supervisor import Host
    from rtctl.identify.pulses import PulseRun, only_pulses

    def announce(text: str) -> None:
        click.echo(text, err=True)

    def progress(taken: int) -> None:
        if not quiet and taken % 10 == 0:
            click.echo(f"{taken} of {pulses} pulses", err=True)

    run = PulseRun(pulses, progress)
    with Host(only_pulses(loaded), observers=[run], runtime_dir=runtime_dir, announce=announce) as host:
        ticks = 4 * int(host.plan.params["arming_ticks"][0])
        host.run()
    if not run.complete:
        raise KeyboardInterrupt
    return [shape_of(loaded, index, run.blocks, ticks) for index in range(len(loaded.config.axis))]


def shape_of(loaded: LoadedConfig, index: int, blocks: list[Any], ticks: int) -> dict[str, Any]:
    """What the ticks of these pulses tell of one axis."""
    from rtctl.check.borne_stiffness import stiffest
    from rtctl.errors import DataError
    from rtctl.identify import current_shape
    from rtctl.identify.pulses import sent_and_shown

    axis, T = loaded.config.axis[index], loaded.config.period_s
    body: dict[str, Any] = {"axis": axis.name, "motion": axis.motion}
    try:
        sent, shown = sent_and_shown(blocks, index, ticks)
    except DataError as why:
        return body | {"shape": None, "why": str(why)}
    found = current_shape.told(current_shape.Pulses(sent, shown))
    worst = current_shape.to_declare(found, stiffest(loaded, index))
    return body | {
        "shape": found.shape,
        "pulses": found.pulses,
        "overshoot": found.overshoot,
        "overshoot_from": None if math.isnan(found.overshoot_low) else found.overshoot_low,
        "overshoot_to": None if math.isnan(found.overshoot_high) else found.overshoot_high,
        "delay_ms": found.best.delay * T * 1e3,
        "lag_ms": found.best.lag * T * 1e3,
        "noise_share": found.noise,
        "left_share": found.beyond,
        "declare": worst
        and {
            "delay_ticks": round(worst.delay, 3),
            "current_loop_hz": round(1 / (2 * math.pi * worst.lag * T), 2),
            "current_overshoot": current_shape.declared(worst),
        },
    }


def line_of(one: dict[str, Any]) -> str:
    """The shape of one axis' loop for a person, and what to put into its file."""
    if one["shape"] is None:
        return f"axis {one['axis']}: shape of the current loop not told: {one['why']}"
    told = f"axis {one['axis']}: by {one['pulses']} pulses the current loop is {SAID[one['shape']]}"
    if one["overshoot_to"] is not None:
        told += f", overshoot {one['overshoot_from']:.2g} to {one['overshoot_to']:.2g}"
    told += f"; delay {one['delay_ms']:.3g} ms and lag {one['lag_ms']:.3g}, "
    told += f"noise {one['noise_share']:.2g} of the pulse"
    if one["declare"]:
        said = "delay_ticks = {delay_ticks:g} in [axis.coupling]; current_loop_hz = {current_loop_hz:g} and "
        said += "current_overshoot = {current_overshoot:g} in [axis.drive]"
        told += "\n  in the rig file: " + said.format(**one["declare"])
    return words(told, one["motion"])
