"""Tracking of sine and triangular references with friction models from none to SVR (Tijani and
Akmeliawati)."""

from __future__ import annotations

import numpy as np

from hw.motion import words
from rtctl.control.vocabulary import Shape
from rtctl.experiments import comparison, figures, positioning
from rtctl.experiments.models import Compared
from rtctl.experiments.order import Order
from rtctl.experiments.positioning import Case, Followed, Found, Look
from rtctl.experiments.report import Outcome, Part
from rtctl.experiments.statistics import rms
from rtctl.friction.learn.report_page import Picture

TITLE = "Tracking"
# triangles of a fifth of the nominal joint's Stribeck speed, .1 rad/s, of that speed, and of five times it
SINE_RAD, SINES_HZ = 0.3, (0.1, 0.25, 0.5, 1.0)
TRIANGLE_RAD, TRIANGLES_RAD_S = 0.15, (0.02, 0.1, 0.5)
DRAWN_HZ, DRAWN_RAD_S = 0.25, 0.1

WORDS = comparison.Words("tracking", TITLE, "error_rms_rad", "RMS error", "RMS tracking error", "references")

FIGURES = {
    "error_rms_rad": ("RMS error, mrad", 1e3),
    "error_max_rad": ("largest error, mrad", 1e3),
    "effort_nm": ("RMS torque, mN m", 1e3),
}


def _outcome(order: Order, cases: list[Case], compared: list[Compared], found: Found, look: Look) -> Outcome:
    drawn = [_sine_name(DRAWN_HZ), _triangle_name(order, _factor(order) * DRAWN_RAD_S)]
    pictures = tuple(_picture(order, case, compared, look) for case in positioning.to_draw(cases, drawn))
    return comparison.outcome(
        WORDS, FIGURES, order, compared, found, Part("Errors over time", shown=pictures)
    )


def cases_of(order: Order) -> list[Case]:
    """Sines and triangles, two periods each, from rest."""
    factor = _factor(order)
    sines = [_sine(order, hz, factor * SINE_RAD) for hz in SINES_HZ]
    return sines + [_triangle(order, factor * v, factor * TRIANGLE_RAD) for v in TRIANGLES_RAD_S]


def _factor(order: Order) -> float:
    """By which the references are smaller than those of a joint with room; a sine goes two amplitudes
    away."""
    top_rad_s = max(2 * np.pi * SINE_RAD * max(SINES_HZ), *TRIANGLES_RAD_S)
    # all references by one factor: errors over speeds stay comparable
    return positioning.scale(order, max(2 * SINE_RAD, TRIANGLE_RAD), top_rad_s)


def _sine_name(hz: float) -> str:
    return f"sine {hz:g} Hz"


def _triangle_name(order: Order, speed_rad_s: float) -> str:
    return words(f"triangle {speed_rad_s:g} rad/s", order.motion)


def _sine(order: Order, hz: float, amplitude_rad: float) -> Case:
    rate_hz = order.loaded.config.loop.rate_hz
    # A (1 - cos w t) starts at rest, and goes 2 A away
    t, w = np.arange(round(2 / hz * rate_hz)) / rate_hz, 2 * np.pi * hz
    reference = amplitude_rad * np.column_stack([1 - np.cos(w * t), w * np.sin(w * t), w * w * np.cos(w * t)])
    return Case(_sine_name(hz), reference, Shape.SINE, amplitude_rad, w)


def _triangle(order: Order, speed_rad_s: float, amplitude_rad: float) -> Case:
    rate_hz = order.loaded.config.loop.rate_hz
    # of one factor both: the period stays what it is on a joint with room
    quarter_s = amplitude_rad / speed_rad_s
    t = np.arange(round(8 * quarter_s * rate_hz)) / rate_hz
    phase = (t / quarter_s) % 4
    up = (phase < 1) | (phase >= 3)
    place = np.where(phase < 1, phase, np.where(phase < 3, 2 - phase, phase - 4))
    # no acceleration is fed at the corners, where it would be without bounds: every controller errs there
    # alike
    velocity = np.where(up, speed_rad_s, -speed_rad_s)
    reference = np.column_stack([amplitude_rad * place, velocity, np.zeros(len(t))])
    return Case(_triangle_name(order, speed_rad_s), reference, Shape.TRIANGLE, amplitude_rad, speed_rad_s)


def judge(_case: Case, run: Followed) -> dict[str, float]:
    """RMS and largest error of the second half, rad, and RMS torque, N m."""
    half = len(run.position_rad) // 2  # the first period is the start from rest
    error = (run.reference[:, 0] - run.position_rad)[half:]
    return {
        "error_rms_rad": rms(error),
        "error_max_rad": float(np.abs(error).max()),
        # the same half: the start from rest costs torque as well
        "effort_nm": rms(run.torque_nm[half:]),
    }


def _picture(order: Order, case: Case, compared: list[Compared], look: Look) -> Picture:
    time_s = np.arange(len(case.reference)) * order.loaded.config.period_s
    half = slice(len(time_s) // 2, None)
    panels = []
    for controller in positioning.CONTROLLERS:
        lines = {}
        for model in compared:
            one = look(controller, case, model)
            lines[model.name] = (time_s[half], 1e3 * (case.reference[:, 0] - one.position_rad)[half])
        panels.append((f"{controller}: error [mrad]", lines))
    caption = (
        f"{case.name}: tracking error in mrad over time in s, second period, PD and PID with each friction "
        f"model. {order.shown_run}"
    )
    name = "tracking_" + case.name.replace(" ", "_").replace("/", "_per_").replace(".", "_")
    return Picture(name, caption, figures.stacked(panels, order.motion, 3.0))


EXPERIMENT = positioning.Experiment("tracking", cases_of, judge, _outcome)
run = EXPERIMENT.run
