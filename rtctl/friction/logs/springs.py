"""A torque that goes by the place alone: a spring, a gas spring, gravity on an arm, a cable's weight.

It belongs to no other parameter: left in the balance, a stroke that begins on one side and ends on the other
shows it as inertia. Where it is plainly there and the same in both directions, as what stores energy is and
friction by place is not, it is parameters of its own, and the points are without it (decision 0167)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rtctl.errors import DataError
from rtctl.friction.logs.balance import Balance, Fit
from rtctl.friction.logs.balance_faults import LEFT_LEAST, POSITION_SHARE, explained_as_well
from rtctl.friction.logs.dynamics import SAMPLES_MIN, AxisLog
from rtctl.friction.logs.in_place_of_torque import in_place_of_torque
from rtctl.friction.logs.log_checks import external_of
from rtctl.friction.logs.regressors import Regressors
from rtctl.friction.logs.torque_shape import PlainBalance
from rtctl.friction.logs.waves import ALIKE, TAKEN_RATIO

MORE_RATIO = 0.9
"""Share of what a plainer form leaves over, RMS, to which another must come to be taken in its place."""

SURELY = 4.0
"""Standard errors by which it must differ from 0."""

TOLD_APART = 1.1
"""Times as much as the form that is taken leaves over from which on another form is not it."""

Logs = tuple[tuple[AxisLog, ...], ...]

Shape = Callable[[np.ndarray], np.ndarray]


OWN_LEAST = 0.05
"""Share of the place, RMS, that the motion must not have for a log to tell a spring."""

APART = 20.0
"""Largest condition number of the columns of a form of which each is told by itself."""

SEEN_MOST = 5.0
"""Times the torque that was seen, from one end of the travel to the other, from which on a coefficient of
gravity is a guess beyond it."""

GROWS_MOST = 20.0
"""Most that the pull of a gas spring grows over the travel, as a factor."""

SERIES = ("stiffness_nm_rad", "stiffness_rise_nm_rad2", "stiffness_bend_nm_rad3")
"""Derivatives of a torque by the place at the mean position, from the first on."""


@dataclass(frozen=True)
class Form:
    """What a torque that goes by the place may be: its name, and a column for each of its parameters."""

    name: str
    shapes: dict[str, Shape]

    def columns(self, position: np.ndarray) -> np.ndarray:
        """The columns at positions (n,) in rad, (n, k)."""
        return np.column_stack([shape(position) for shape in self.shapes.values()])


def _forms(balance: Balance, logs: Logs) -> tuple[Form, ...]:
    """Forms for the axis of this balance, the plainest first."""
    spring = _series("a spring", balance.signals, 1)
    if balance.signals.radian != 1.0:
        return spring, _gas_spring(balance, logs)
    gravity: dict[str, Shape] = {"gravity_sine_nm": np.sin, "gravity_cosine_nm": np.cos}
    return (
        spring,
        Form("gravity on an arm", gravity),
        Form("gravity on an arm and a spring", gravity | spring.shapes),
    )


def _series(name: str, signals: Regressors, terms: int) -> Form:
    """The first terms of a Taylor series about the mean position: any torque, over a short travel."""
    middle = middle_rad(signals)

    def term(power: int) -> Shape:
        return lambda x: (x - middle) ** power / math.factorial(power)

    return Form(name, {SERIES[k]: term(k + 1) for k in range(terms)})


def _gas_spring(balance: Balance, logs: Logs) -> Form:
    """The gas spring that leaves least over: u/(1 - b u) of the way u from the mean position, whose
    coefficient is the stiffness there."""
    from scipy.optimize import minimize_scalar

    middle = middle_rad(balance.signals)
    ends = [end for stretches in logs for log in stretches for end in _ends(log.position_rad)]
    low, high = min(ends) - middle, max(ends) - middle

    def form(growth: float) -> Form:
        # `growth` is the logarithm of the ratio of the pull at the ends of the travel, high to low
        ratio = math.exp(growth)
        bend = (ratio - 1) / (ratio * high - low)
        stiffer, end = math.exp(2 * abs(growth)), "largest" if growth > 0 else "smallest"
        return Form(
            f"a gas spring that is {stiffer:.3g} times as stiff at the {end} position as at the other end",
            {SERIES[0]: lambda x: (x - middle) / (1 - bend * (x - middle))},
        )

    def left(growth: float) -> float:
        return balance.fit(added=form(growth).columns(balance.position)).rest

    # over all first: it may have a minimum for each of the two ends
    tried = np.linspace(-math.log(GROWS_MOST), math.log(GROWS_MOST), 15)
    best = int(np.argmin([left(growth) for growth in tried]))
    around = tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)]
    return form(float(minimize_scalar(left, bounds=around, method="bounded", options={"xatol": 0.02}).x))


def _ends(x: np.ndarray) -> tuple[float, float]:
    return float(x.min()), float(x.max())


def middle_rad(signals: Regressors) -> float:
    """Mean position of the sliding rows, at which a stiffness is told."""
    return float(signals.position_rad[signals.sliding].mean())


@dataclass(frozen=True)
class Spring:
    """A torque that goes by the place: its form and coefficients, the means of the form's columns over the
    sliding rows, its columns about those on the rows of the signals (n,) by the names of their parameters,
    and what is said of it."""

    form: Form
    coefficients: np.ndarray
    means: np.ndarray
    columns: dict[str, np.ndarray]
    told: str

    def torque(self, position_rad: np.ndarray) -> np.ndarray:
        """That torque at positions (n,), N m, but for its mean, which no log tells from an offset."""
        return np.asarray((self.form.columns(position_rad) - self.means) @ self.coefficients)

    def taken_out(self, logs: Logs) -> Logs:
        """The logs without that torque."""

        def without(log: AxisLog) -> AxisLog:
            return replace(log, torque_nm=log.torque_nm - self.torque(log.position_rad))

        return tuple(tuple(without(one) for one in stretches) for stretches in logs)

    def put_back(self, signals: Regressors) -> Regressors:
        """Signals of logs that it was taken out of with it, and with its columns as unknowns."""
        place_nm = np.column_stack(list(self.columns.values())) @ self.coefficients
        return replace(
            signals,
            torque_nm=signals.torque_nm + place_nm,
            place_nm=place_nm,
            by_place=self.columns,
            warnings=(*signals.warnings, self.told),
        )


def spring_in(signals: Regressors, logs: Logs, speed_min_rad_s: float) -> Spring | None:
    """The torque that goes by the place in these logs, of which `signals` are; None where none plainly
    does."""
    balance = Balance.of(signals)
    if min(int((balance.velocity > 0).sum()), int((balance.velocity < 0).sum())) < SAMPLES_MIN:
        return None  # the fit itself says what is missing
    plain = balance.fit()
    if plain.rest <= LEFT_LEAST * balance.spread:
        return None
    # a motor that plays a spring, its sign turned beside the hand's torque, looks like one of twice as much
    external_nm = external_of(logs, signals.cutoff_hz, speed_min_rad_s)
    balance = Balance.of(replace(signals, external_nm=external_nm))
    forms = _forms(balance, logs)
    fits = [balance.fit(added=form.columns(balance.position)) for form in forms]
    k = _plainest([fit.rest for fit in fits])
    if not _is_there(balance, plain, fits[k], forms[k]):
        return None
    form, fit = forms[k], fits[k]
    more = ""
    if _is_a_guess(balance, form, fit):
        near = _series(f"what a short travel shows of {form.name}", signals, len(form.shapes))
        as_near = balance.fit(added=near.columns(balance.position))
        if as_near.rest < TOLD_APART * fit.rest:
            form, fit = near, as_near
            more = "; its slope at the mean position, and how that bends, are told, and nothing beyond"

    def passed(shape: Shape) -> np.ndarray:
        # of the position as it was recorded: a sine of a low-passed angle is no low-passed sine
        return in_place_of_torque(
            logs, lambda log: shape(log.position_rad), signals.cutoff_hz, speed_min_rad_s
        )

    passed_on = np.column_stack([passed(shape) for shape in form.shapes.values()])
    means = passed_on[signals.sliding].mean(axis=0)
    # about their means: of sine and cosine over a short travel most is a constant
    columns = dict(zip(form.shapes, (passed_on - means).T, strict=True))
    matrix = (passed_on - means)[signals.sliding]
    coefficients = balance.fit(added=matrix).added
    # beside a form of three columns one of two that leaves as much over is no other: it is a part of it
    others = [
        other.name
        for other, left in zip(forms, fits, strict=True)
        if other is not forms[k] and len(other.shapes) <= 2 and left.rest < TOLD_APART * fits[k].rest
    ]
    if others:
        more += f"; {' and '.join(others)} would look alike over this travel"
    told = _text(signals, form, float(np.std(matrix @ coefficients)), more)
    return Spring(form, coefficients, means, columns, told)


def hidden(signals: Regressors) -> tuple[str, ...]:
    """What a motion of one frequency cannot tell: there the place is the acceleration turned over."""
    balance = Balance.of(signals)
    if min(int((balance.velocity > 0).sum()), int((balance.velocity < 0).sum())) < SAMPLES_MIN:
        return ()
    others = np.hstack([balance.motion, balance.nuisance])
    x = balance.position - balance.position.mean()
    # what of the place the motion does not say anyway is all that a spring could be told by
    own = x - others @ np.linalg.lstsq(others, x, rcond=1e-9)[0]
    if signals.by_place or own.std() > OWN_LEAST * x.std():
        return ()
    return (
        "whether a spring or gravity acts: this motion is of one frequency, at which its torque and that of "
        "an inertia are one; a stiffness of k at w rad/s makes the inertia k/w^2 too small (record strokes "
        "of several speeds)",
    )


def _plainest(rests: list[float]) -> int:
    """The plainest form that none with more columns leaves far less over than."""
    best = 0
    for k in range(1, len(rests)):
        if rests[k] < MORE_RATIO * rests[best]:
            best = k
    return best


def _is_there(balance: Balance, plain: Fit, fit: Fit, form: Form) -> bool:
    """Whether it is plainly there, alike in both directions, and nothing else says it better."""
    if fit.rest > TAKEN_RATIO * plain.rest or not fit.is_joint(balance.speed):
        return False
    profile = form.columns(balance.signals.position_rad) @ fit.added
    here = profile[balance.signals.sliding]
    if np.std(here) < POSITION_SHARE * balance.spread:
        return False
    try:
        value, error, _ = PlainBalance(balance.signals).coefficient(profile)
    except DataError:
        return False  # too short for intervals: the fit itself says so
    if value < SURELY * error:
        return False
    # friction by place turns with the direction; viscous friction that differs between the two is not it
    here = here - here.mean()
    ways = np.column_stack([here, here * balance.direction, np.abs(balance.velocity)])
    both, turned, _ = balance.fit(added=ways).added
    if abs(turned) > ALIKE * abs(both):
        return False
    return not explained_as_well(balance, plain, fit)


def _is_a_guess(balance: Balance, form: Form, fit: Fit) -> bool:
    """Whether the coefficients of a form say more than its sum: columns that are alike, or gravity far
    beyond what was seen of it."""
    columns = form.columns(balance.position)
    columns = columns - columns.mean(axis=0)
    apart = np.linalg.cond(columns / np.sqrt((columns**2).mean(axis=0))) < APART
    gravity = [abs(one) for name, one in zip(form.shapes, fit.added, strict=True) if name not in SERIES]
    return not apart or max(gravity, default=0.0) > SEEN_MOST * float(np.ptp(columns @ fit.added))


def _text(signals: Regressors, form: Form, size_nm: float, more: str) -> str:
    return (
        f"{signals.source}: the torque depends on the position ({size_nm:.3g} N m RMS), alike in both "
        f"directions: it is taken for {form.name}, fitted ({', '.join(form.shapes)}, about the mean position "
        f"{middle_rad(signals):.4g} rad), and not in the points{more}; a hand or a cable that pulls as "
        "evenly looks like that, too: map its torque"
    )
