"""`rtctl fit --config`: what to write into the rig file, and how far from the truth a simulated rig's model
is."""

from __future__ import annotations

import os
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hw.outside import real

if TYPE_CHECKING:
    from rtctl.friction.gain import AxisGain
    from rtctl.friction.model import FrictionModel
    from rtctl.rig_file.config import LoadedConfig
    from rtctl.simulation.friction_truth import Deviation


def body(model: FrictionModel, loaded: LoadedConfig | None, out: Path) -> dict[str, Any]:
    """Recommended tables and, of the mock, the deviation from the truth; empty without a rig file."""
    if loaded is None:
        return {}
    named = _named(out, loaded)
    axes = [
        {
            **asdict(axis),
            # properties: `asdict` has the fields alone
            "start_gain": axis.start_gain,
            "start_cap_share": axis.start_cap_share,
            "snippet": axis.snippet(named) + _observer(axis, loaded, out),
        }
        for axis in _axes(model, loaded)
    ]
    return {"recommended": axes, "truth": [asdict(one) for one in _truth(model, loaded)]}


def show(model: FrictionModel, loaded: LoadedConfig | None, out: Path) -> None:
    """Print the table to paste into the rig file, per axis, and the deviation from the truth."""
    from rtctl.friction.gain import told

    if loaded is None:
        return
    if loaded.config.n_axes > 1:  # points do not say whose they are
        click.echo("\nfor each axis, as if the points were its own: take the lines of the one they are of")
    for axis in _axes(model, loaded):
        # not `<= 0`: a NaN is no friction to compensate
        if not (model.friction_min_nm > 0).all():
            click.echo(
                f"\naxis {axis.axis}: the curve has no dry friction to compensate (least "
                f"{float(model.friction_min_nm.min()):.4g} N m): leave friction.model empty"
            )
            continue
        # no gain passes where none is needed: a snippet with gain 0 would hide what has to be mended
        if axis.margin_at_zero_nm < 0:
            click.echo(
                f"\naxis {axis.axis}: no gain passes the two-line test: without compensation "
                f"{-axis.margin_at_zero_nm:.4g} N m are missing; lower the coupling's stiffness or damping, "
                "or use a finer encoder"
            )
            continue
        click.echo(
            f"\nfor {loaded.path.name} (largest gain that passes the two-line test: {told(axis.gain)}):\n"
        )
        click.echo(axis.snippet(_named(out, loaded)) + _observer(axis, loaded, out))
    deviations = _truth(model, loaded)
    if deviations:
        click.echo("\nlearned curve against the true friction of the simulated rig:")
    for one in deviations:
        click.echo(f"  {one}")


def presliding_body(model: FrictionModel) -> dict[str, float | int | None]:
    """Presliding length, spread and ramps, as in the model file."""
    return {
        "length_rad": model.presliding_rad,
        "spread_rad": model.presliding_spread_rad,
        "ramps": model.presliding_ramps,
    }


def presliding_text(model: FrictionModel) -> str:
    """The model's presliding length in words."""
    from rtctl.friction.presliding import Presliding

    if model.presliding_rad is None:
        return "not measured (rtctl identify measures it; --presliding gives it by hand)"
    return str(Presliding(model.presliding_rad, model.presliding_spread_rad, model.presliding_ramps))


def _axes(model: FrictionModel, loaded: LoadedConfig) -> tuple[AxisGain, ...]:
    from rtctl.friction import gain as report_gain

    return report_gain.recommend(model, loaded).axes


def _observer(axis: AxisGain, loaded: LoadedConfig, out: Path) -> str:
    """Lines on the disturbance observer, where that of the rig file would be refused beside this model; ""
    where no gain passes."""
    from rtctl.check import observer_advice

    return observer_advice.snippet(loaded, axis, out) if axis.start_gain > 0 else ""


def _named(out: Path, loaded: LoadedConfig) -> str:
    """Path of the model as the rig file names it: relative to its folder."""
    # relative: rig file and model are copied together, to a service too
    return Path(os.path.relpath(real(out), loaded.path.parent)).as_posix()


def _truth(model: FrictionModel, loaded: LoadedConfig) -> tuple[Deviation, ...]:
    """Deviation from the friction law of the mock, when the rig file is of one with a single axis."""
    from rtctl.simulation import friction_truth

    # of several axes nobody said which one was measured
    known = friction_truth.is_known(loaded) and loaded.config.n_axes == 1
    return friction_truth.of_model(loaded, 0, model) if known else ()
