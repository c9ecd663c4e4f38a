"""Point-to-point positioning with friction models from none to SVR (Tijani and Akmeliawati)."""

from __future__ import annotations

import numpy as np

from hw.motion import unit, words
from rtctl.control.vocabulary import Shape
from rtctl.experiments import comparison, figures, positioning
from rtctl.experiments.models import Compared
from rtctl.experiments.order import Order
from rtctl.experiments.positioning import Case, Followed, Found, Look
from rtctl.experiments.report import Outcome, Part
from rtctl.experiments.statistics import rms
from rtctl.friction.learn.report_page import Picture

TITLE = "Point-to-point positioning"
STEPS_RAD = (0.01, 0.03, 0.1, 0.2, -0.03, -0.1)
DRAWN_RAD = (0.01, 0.1)
SECONDS = 1.5
REST_S = 0.2
"""The steady-state error is the mean over the last of these seconds."""

BAND = 0.05
"""Settled within this share of the step."""

WORDS = comparison.Words(
    "point-to-point", TITLE, "steady_error_rad", "steady-state error", "steady-state error", "steps"
)

FIGURES = {
    "rise_s": ("rise time 10 to 90 %, ms", 1e3),
    "settling_s": ("settling time (5 %), ms", 1e3),
    "overshoot": ("overshoot, %", 100.0),
    "steady_error_rad": ("steady-state error, mrad", 1e3),
    "effort_nm": ("RMS torque, mN m", 1e3),
}


def cases_of(order: Order) -> list[Case]:
    """Every step."""
    factor = _factor(order)
    return [_case(order, factor * step) for step in STEPS_RAD]


def _factor(order: Order) -> float:
    return positioning.scale(order, max(map(abs, STEPS_RAD)))


def _name(order: Order, step_rad: float) -> str:
    return words(f"step {1e3 * step_rad:g} mrad", order.motion)


def _outcome(order: Order, cases: list[Case], compared: list[Compared], found: Found, look: Look) -> Outcome:
    drawn = [_name(order, _factor(order) * step) for step in DRAWN_RAD]
    pictures = tuple(_picture(order, case, compared, look) for case in positioning.to_draw(cases, drawn))
    return comparison.outcome(WORDS, FIGURES, order, compared, found, Part("Step responses", shown=pictures))


def _case(order: Order, step_rad: float) -> Case:
    reference = np.zeros((round(SECONDS * order.loaded.config.loop.rate_hz), 3))
    # position alone: a step has no velocity that a controller could be fed
    reference[:, 0] = step_rad
    return Case(_name(order, step_rad), reference, Shape.STEP, step_rad)


def judge(case: Case, run: Followed) -> dict[str, float]:
    """Rise and settling time, s, NaN where never reached; overshoot, share; steady-state error, rad; RMS
    torque, N m."""
    step = float(case.reference[-1, 0])
    # by the step and its sign: a step back rises, too
    share = run.position_rad / step
    # by the run's own length: a loop of another rate has other ticks
    period_s = SECONDS / len(share)
    # settled after the last time it was outside, not before the first time inside
    outside = np.flatnonzero(np.abs(share - 1) > BAND)
    settled = (outside[-1] + 1 if len(outside) else 0) * period_s
    return {
        # NaN less a number is NaN: what never comes to a tenth has no rise either
        "rise_s": (_first(share >= 0.9) - _first(share >= 0.1)) * period_s,
        "settling_s": settled if len(outside) == 0 or outside[-1] + 1 < len(share) else float("nan"),
        # a response that never came so far has none, and no negative one
        "overshoot": max(float(share.max()) - 1, 0.0),
        # sizes of the errors, not their mean: a joint that hunts about its goal has none of the latter
        "steady_error_rad": float(np.mean(np.abs(step - run.position_rad[-round(REST_S / period_s) :]))),
        "effort_nm": rms(run.torque_nm),
    }


def _first(true: np.ndarray) -> float:
    return float(np.argmax(true)) if true.any() else float("nan")


def _picture(order: Order, case: Case, compared: list[Compared], look: Look) -> Picture:
    time_s = np.arange(len(case.reference)) * order.loaded.config.period_s
    panels = []
    for controller in positioning.CONTROLLERS:
        lines = {"reference": (time_s, 1e3 * case.reference[:, 0])}
        for model in compared:
            one = look(controller, case, model)
            lines[model.name] = (time_s, 1e3 * one.position_rad)
        panels.append((f"{controller}: angle [mrad]", lines))
    caption = (
        f"{case.name}: angle in mrad over time in s, PD and PID with each friction model. {order.shown_run}"
    )
    name = f"point_to_point_{abs(1e3 * case.reference[-1, 0]):g}_{unit('mrad', order.motion)}"
    return Picture(name, caption, figures.stacked(panels, order.motion, 3.0))


EXPERIMENT = positioning.Experiment("point-to-point", cases_of, judge, _outcome)
run = EXPERIMENT.run
