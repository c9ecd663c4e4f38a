"""Free motion and the virtual spring on the real loop: figures and page of one run without and with
compensation."""

from __future__ import annotations

import io

import numpy as np

from rtctl.control.proofs import stability
from rtctl.errors import ConfigError
from rtctl.experiments import figures, real_run
from rtctl.experiments.order import Order
from rtctl.experiments.real_run import Columns
from rtctl.experiments.report import Outcome, Part
from rtctl.experiments.statistics import estimate, rms
from rtctl.friction.learn.report_page import Picture
from rtctl.friction.learn.report_tables import Table

Runs = dict[str, Columns]


def free_motion(order: Order) -> Outcome:
    """Compare on the rig of `order`, whose first axis must be free. Raises as `real_run.compare`,
    ConfigError."""
    _require(order, "free")
    runs = real_run.compare(order)
    # free motion should cost nothing: all of the torque is what friction and inertia ask for
    wanted = {name: np.zeros(len(one["time_ns"])) for name, one in runs.items()}
    title = f"Free motion on rig {order.loaded.config.rig.name}"
    return _outcome(order, "free-motion", title, runs, wanted, "torque of the hand")


def spring(order: Order) -> Outcome:
    """Compare on the rig of `order`, whose first axis must be a spring. Raises as `real_run.compare`,
    ConfigError."""
    _require(order, "spring")
    runs = real_run.compare(order)
    axis = order.loaded.config.axis[0]
    # in series: what the hand should feel
    stiffness = stability.felt_stiffness(axis.coupling.stiffness_nm_rad, axis.environment.stiffness_nm_rad)
    wanted = {
        name: stiffness * (one["position_rad"] - axis.environment.center_rad) for name, one in runs.items()
    }
    title = f"Virtual spring on rig {order.loaded.config.rig.name}"
    return _outcome(order, "spring", title, runs, wanted, "torque felt minus desired")


def _require(order: Order, kind: str) -> None:
    axis = order.loaded.config.axis[0]
    if axis.environment.kind != kind:
        raise ConfigError(
            f"{order.loaded.path}: axis[0].environment.kind: this experiment needs {kind!r}, not "
            f"{axis.environment.kind!r}; change it, or give another rig file"
        )


def _outcome(
    order: Order, name: str, title: str, runs: Runs, wanted: dict[str, np.ndarray], what: str
) -> Outcome:
    left = {phase: rms(one["hand_torque_nm"] - wanted[phase]) for phase, one in runs.items()}
    # a hand that felt nothing without help was not there: no share of that is said
    less = 1.0 - left["on"] / left["off"] if left["off"] > 0 else float("nan")
    key = (
        f"RMS of the {what}: {1e3 * left['off']:.1f} mN m without and {1e3 * left['on']:.1f} mN m with "
        f"compensation, {100 * less:.1f} % less, over {order.seconds:g} s each, as the force sensor sees "
        "it. One run: the hand moved it twice, and only as alike as the two curves of the angle show."
    )
    rows = tuple(_row(phase, one, left[phase]) for phase, one in runs.items())
    header: tuple[str, ...] = (
        "compensation",
        f"RMS {what}, mN m",
        "largest hand torque, mN m",
        "RMS speed, rad/s",
        "travel, rad",
        "energy of the hand, mJ",
        "least energy of the port, mJ",
    )
    shown = (
        _picture(name, runs, wanted, order.motion),
        Table("Measured on the loop, one run.", header, rows),
    )
    numbers = {
        "phases": {
            phase: {"rms_nm": left[phase], "ticks": len(one["time_ns"])} for phase, one in runs.items()
        },
        "reduction": estimate([less]),
    }
    return Outcome(
        name, title, key, (Part("Without and with compensation", shown=shown),), (), numbers, _ticks(runs)
    )


def _row(phase: str, one: Columns, left_nm: float) -> tuple[str, ...]:
    energy_j = one["energy_hand_j"]
    return (
        phase,
        f"{1e3 * left_nm:.1f}",
        f"{1e3 * np.abs(one['hand_torque_nm']).max():.0f}",
        f"{rms(one['velocity_rad_s']):.3f}",
        f"{np.ptp(one['position_rad']):.3f}",
        # the account goes on from arming: of this phase it is the difference
        f"{1e3 * (energy_j[-1] - energy_j[0]):.2f}",
        f"{1e3 * one['energy_port_j'].min():.2f}",
    )


def _picture(name: str, runs: Runs, wanted: dict[str, np.ndarray], motion: str) -> Picture:
    def time_s(one: Columns) -> np.ndarray:
        seconds: np.ndarray = 1e-9 * (one["time_ns"] - one["time_ns"][0])
        return seconds

    force = {phase: (time_s(one), one["hand_torque_nm"]) for phase, one in runs.items()}
    if name == "spring":
        force["desired (with)"] = (time_s(runs["on"]), wanted["on"])
    place = {phase: (time_s(one), one["position_rad"]) for phase, one in runs.items()}
    caption = (
        "Torque of the hand in N m (force sensor) and angle in rad over time in s since the phase began."
    )
    panels = [("hand torque [N m]", force), ("angle [rad]", place)]
    return Picture(f"{name.replace('-', '_')}_on_rig", caption, figures.stacked(panels, motion))


def _ticks(runs: Runs) -> dict[str, bytes]:
    out = io.BytesIO()
    columns = {f"{phase}_{field}": values for phase, one in runs.items() for field, values in one.items()}
    np.savez_compressed(out, allow_pickle=False, **columns)
    return {"ticks.npz": out.getvalue()}
