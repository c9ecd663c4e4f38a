"""Load terms of published actuators, found again from steady points:
`python -m tests.bench.load_models --data FOLDER`.

FOLDER has a folder for each actuator with m3.json to m6.json in it, in the words of Rhoban/bam. Only
parameters are read.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping
from pathlib import Path

import click
import numpy as np

from rtctl.friction.learn.beside_speed import rows_of
from rtctl.friction.learn.load_terms import Rows, fit_terms
from tests import loaded_gear

LOADS = {"mx106": (3.0, 5.0), "xl330": (0.3, 10.0), "erob80_100": (40.0, 3.5)}
"""Largest weight, N m, and speed, rad/s, of each actuator."""

NOISE_SHARE = 0.001
"""Noise of a point (a mean of many measurements), share of the largest weight."""

_WORDS = {
    "friction_base": ("coulomb_nm",),
    "friction_viscous": ("viscous_nms_rad",),
    "friction_stribeck": ("stribeck_nm",),
    "load_friction_base": ("outside", "motor"),
    "load_friction_stribeck": ("outside_peak", "motor_peak"),
    "load_friction_external": ("outside",),
    "load_friction_motor": ("motor",),
    "load_friction_external_stribeck": ("outside_peak",),
    "load_friction_motor_stribeck": ("motor_peak",),
    "load_friction_external_quad": ("outside_square_per_nm",),
    "load_friction_motor_quad": ("motor_square_per_nm",),
    "dtheta_stribeck": ("stribeck_rad_s",),
    "alpha": ("stribeck_power",),
}


def parameters(published: Mapping[str, float]) -> dict[str, float]:
    """Published numbers by the names of `load_terms.NAMES`."""
    named = {
        name: float(published[word]) for word, names in _WORDS.items() if word in published for name in names
    }
    return loaded_gear.as_told(named)


def judged(
    model: str, values: Mapping[str, float], load_nm: float, fastest: float
) -> tuple[float, dict[str, float]]:
    """Friction error over that of Coulomb + viscous, and the error of each coefficient that matters, share of
    it.
    """
    made, truth = loaded_gear.points(values, load_nm, fastest, NOISE_SHARE * load_nm, seed=0)
    rows, kept = rows_of(made)
    true = truth[kept]
    clean = Rows(rows.speed, true, rows.outside_nm, true - rows.outside_nm, rows.backward)
    error = {
        rung: float(np.sqrt(np.mean((fit_terms(rung, rows)(clean) - true) ** 2)))
        for rung in ("coulomb_viscous", loaded_gear.RUNG_OF[model])
    }
    found = fit_terms(loaded_gear.RUNG_OF[model], rows)
    wanted = loaded_gear.that_matter(values, load_nm, float(true.max()))
    off = {name: found.value(name) / value - 1 for name, value in wanted.items()}
    return error[loaded_gear.RUNG_OF[model]] / error["coulomb_viscous"], off


def every(folder: Path) -> Iterator[tuple[str, str, float, dict[str, float]]]:
    """(actuator, model, error over that of Coulomb + viscous, errors of coefficients) of each published
    set.
    """
    for actuator, (load_nm, fastest) in LOADS.items():
        for model in loaded_gear.RUNG_OF:
            published = json.loads((folder / actuator / f"{model}.json").read_text())
            yield actuator, model, *judged(model, parameters(published), load_nm, fastest)


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True)
    for actuator, model, share, off in every(parser.parse_args().data):
        told = ", ".join(f"{name} {100 * error:+.1f} %" for name, error in off.items())
        click.echo(f"{actuator:12}{model}  error {100 * (1 - share):5.1f} % below Coulomb + viscous; {told}")


if __name__ == "__main__":
    main()
