"""Load terms of the simulated joint, measured through its sensors: `python -m tests.bench.load_on_mock`.

A weak spring far away stands for a weight. The joint is turned both ways at constant speeds by a servo, and
each point is a mean motor current. So bristles, ripple, places, noise and encoder are in it, and the closed
form is the plant's own only where the joint slides steadily.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import click
import numpy as np

from rtctl.friction.learn.beside_speed import judge_load, rows_of
from rtctl.friction.learn.load_terms import Rows, fit_terms
from rtctl.friction.load import COEFFICIENTS
from rtctl.friction.points import FrictionPoints
from rtctl.rig_file.config import LoadedConfig, load
from rtctl.simulation import mock_points
from rtctl.simulation.family import FAMILY, with_plant

SHIPPED = Path(__file__).parents[2] / "configs" / "mock.toml"

SPRING_NM_RAD = 0.002
"""Stiffness of the spring that a weight is made of: a turn changes the weight by .013 N m, and that is
known."""

WEIGHTS = (-0.9, -0.6, -0.3, 0.0, 0.3, 0.6, 0.9)
"""Torques from outside, N m."""

SPEEDS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.5, 3.0, 5.0)
"""rad/s"""

PLACES = 10

SETTLE_RAD = 0.03
"""Way at a speed before friction is measured: under load bristles bend as much further as friction is
greater, 5 mrad, and six times that has to pass."""


class WeightedRig(mock_points.Rig):
    """The simulated rig with a weight of `outside_nm` on axis 0, which is hung there once the current's zero
    is read.
    """

    def __init__(self, loaded: LoadedConfig, outside_nm: float) -> None:
        super().__init__(loaded)
        self.bias_a = mock_points.rested_a(self)
        plant = self.plant[0][0]
        plant["hand_kind"][0] = 1  # rests where it is
        plant["hand_stiffness_nm_rad"][0], plant["hand_damping_nms_rad"][0] = SPRING_NM_RAD, 0.0
        plant["hand_center_rad"][0] = outside_nm / SPRING_NM_RAD
        self.plant[1][0]["hand_position_rad"][0] = outside_nm / SPRING_NM_RAD
        self.outside_nm = outside_nm

    def point(self, velocity: float) -> tuple[float, float]:
        """(motor's torque, torque from outside), N m, averaged over `PLACES` places of a turn."""
        jog = math.copysign(max(mock_points.JOG_RAD_S, abs(velocity)), velocity)
        jog_s = 2 * math.pi / PLACES / abs(jog)
        settle_s = mock_points.SETTLE_S + SETTLE_RAD / abs(velocity)
        cycle = [(jog, jog_s), (velocity, settle_s), (velocity, mock_points.WINDOW_S)]
        start = float(self.tick["position_rad"][0, 0])
        means_a = mock_points.turn_through(self, [(velocity, mock_points.SETTLE_S), *(cycle * PLACES)])[3::3]
        middle = (start + float(self.tick["position_rad"][0, 0])) / 2
        motor_nm = float(np.mean(means_a) - self.bias_a) * self.torque_per_ampere
        return motor_nm, self.outside_nm - SPRING_NM_RAD * middle


def points(
    loaded: LoadedConfig, weights: Sequence[float] = WEIGHTS, speeds: Sequence[float] = SPEEDS
) -> FrictionPoints:
    """Points of both directions with load_nm and motor_nm."""
    rows, loads, motors = [], [], []
    for weight in weights:
        rig = WeightedRig(loaded, weight)
        for speed in speeds:
            for sign in (1, -1):
                motor_nm, outside_nm = rig.point(sign * speed)
                friction_nm = sign * (motor_nm + outside_nm)
                if friction_nm > 0:
                    rows.append((sign * speed, friction_nm, sign, np.nan, np.nan))
                    loads.append(outside_nm)
                    motors.append(motor_nm)
    columns = {"load_nm": np.array(loads), "motor_nm": np.array(motors)}
    return FrictionPoints.from_rows(rows, "mock", "0" * 64, columns)


@click.command()
def main() -> None:
    """Print load coefficients, beside those of the plant, and the errors of the forms."""
    measured = points(with_plant(load(SHIPPED), "load-dependent"))
    rows, _ = rows_of(measured)
    told = FAMILY["load-dependent"].axis["load"]
    verdict = judge_load(measured, "speed")
    assert verdict.chosen is not None, verdict.reason
    found = verdict.chosen.terms
    click.echo(f"chosen by what was held out: {found.rung}")
    for name in COEFFICIENTS:
        true = told[name.replace("square_per_nm", "square_nm")]
        click.echo(
            f"{name}: {found.value(name):.4g}, in truth {true:.4g}, "
            f"{100 * (found.value(name) / true - 1):+.1f} %"
        )
    for rung in verdict.rungs:
        click.echo(
            f"{rung.terms.rung}: {1e3 * rmse_nm(rung.terms.rung, rows):.3g} mN m, held out "
            f"{1e3 * rung.rmse_nm:.3g}"
        )


def rmse_nm(rung: str, rows: Rows) -> float:
    """Error of a form on the rows it was fitted to, N m."""
    return float(np.sqrt(np.mean((fit_terms(rung, rows)(rows) - rows.friction_nm) ** 2)))


if __name__ == "__main__":
    main()
