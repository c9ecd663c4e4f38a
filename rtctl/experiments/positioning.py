"""What point-to-point and tracking share: controllers, runs over seeds and models, and the comparison in
words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rtctl.control.jit import records
from rtctl.control.vocabulary import Shape
from rtctl.errors import ConfigError
from rtctl.experiments import models, sizes, virtual
from rtctl.experiments.models import SVR, Compared
from rtctl.experiments.order import Order
from rtctl.experiments.position_gains import gains_of
from rtctl.experiments.position_loop import follow
from rtctl.experiments.report import Outcome
from rtctl.experiments.seeds import figures_over_seeds
from rtctl.experiments.statistics import Estimate, estimate, reduction

CONTROLLERS = ("PD", "PID")


@dataclass(frozen=True)
class Case:
    """One reference: name, (n, 3) position, velocity, acceleration from rest at 0, and how the law makes it.

    `rate`: see `rtctl.control.position`."""

    name: str
    reference: np.ndarray
    shape: Shape = Shape.STEP
    amplitude_rad: float = 0.0
    rate: float = 0.0

    @property
    def range_rad(self) -> tuple[float, float]:
        """Least and greatest position, from the start."""
        return float(self.reference[:, 0].min()), float(self.reference[:, 0].max())


@dataclass(frozen=True)
class Followed:
    """True position and torque sent, shape (n,), and the reference."""

    position_rad: np.ndarray
    torque_nm: np.ndarray
    reference: np.ndarray


Judge = Callable[[Case, Followed], dict[str, float]]
Found = dict[str, dict[str, dict[str, dict[str, np.ndarray]]]]
"""controller -> case -> model -> figure -> one value per seed."""


def scale(order: Order, reach_rad: float, speed_rad_s: float = 0.0) -> float:
    """Factor of the references, by `sizes.scale`; on the loop of a rig they are as they are, or refused
    (`positioning_on_rig`)."""
    return sizes.scale(order.loaded, reach_rad, speed_rad_s) if order.simulate else 1.0


def follow_once(order: Order, seed: int, controller: str, case: Case, model: Compared) -> Followed:
    """One run of a fresh rig `seed` without a hand, from rest."""
    # a rig of its own for each run: integral, bristles and temperature begin alike
    rig = virtual.make(order.loaded, seed)
    rig.plant_params["hand_kind"] = 0  # nobody holds it
    place = float(rig.plant_state["position_rad"][0, 0])
    out = np.zeros((len(case.reference), 2))
    # each seed at a place of its own: friction differs over a turn
    shifted = case.reference + np.array([place, 0.0, 0.0])
    follow(
        shifted,
        records(gains_of(order, controller)),
        records(model.record),
        rig.params,
        rig.plant_params,
        rig.plant_state,
        rig.tick,
        out,
    )
    return Followed(out[:, 0] - place, out[:, 1], case.reference)


Look = Callable[[str, Case, Compared], Followed]
"""A run of one controller, case and model to draw."""


def simulated(order: Order) -> Look:
    """Runs of seed 0."""
    return lambda controller, case, model: follow_once(order, 0, controller, case, model)


def run_all(order: Order, cases: Sequence[Case], compared: Sequence[Compared], judge: Judge) -> Found:
    """Every controller, case, model and seed."""
    found: Found = {}
    for number, controller in enumerate(CONTROLLERS):
        found[controller] = {}
        for at, case in enumerate(cases):
            # of .8: learning the models took the first fifth
            share = (number + at / len(cases)) / len(CONTROLLERS)
            order.progress(0.2 + 0.8 * share, f"{controller}, {case.name}")
            found[controller][case.name] = {
                model.name: _figures(order, controller, case, model, judge) for model in compared
            }
    return found


def _figures(
    order: Order, controller: str, case: Case, model: Compared, judge: Judge
) -> dict[str, np.ndarray]:
    def once(order: Order, seed: int) -> dict[str, float]:
        return judge(case, follow_once(order, seed, controller, case, model))

    return figures_over_seeds(order, once)


Page = Callable[[Order, list[Case], list[Compared], Found, Look], Outcome]


@dataclass(frozen=True)
class Experiment:
    """A positioning experiment: its references, the figures of a run, and its page."""

    name: str
    cases_of: Callable[[Order], list[Case]]
    judge: Judge
    page: Page

    def chosen(self, order: Order) -> list[Case]:
        """The cases asked for, or all. Raises ConfigError for one that there is not."""
        cases = {case.name: case for case in self.cases_of(order)}
        # before hours of runs
        for name in order.cases:
            if name not in cases:
                raise ConfigError(f"--case {name!r}: {self.name} has {', '.join(map(repr, cases))}")
        return [case for name, case in cases.items() if not order.cases or name in order.cases]

    def run(self, order: Order) -> Outcome:
        """Run it on the simulated rig. Raises ConfigError, DataError."""
        order.require_simulated(self.name)
        cases = self.chosen(order)
        compared = models.compared(order)
        found = run_all(order, cases, compared, self.judge)
        order.progress(1.0, self.name)
        return self.page(order, cases, compared, found, simulated(order))


def over_cases(found: Found, controller: str, model: str, figure: str) -> np.ndarray:
    """Mean of a figure over all cases, one value per seed."""
    mean: np.ndarray = np.mean([case[model][figure] for case in found[controller].values()], axis=0)
    return mean


def best_svr(found: Found, controller: str, figure: str, compared: Sequence[Compared]) -> str:
    """Name of the support-vector model with the smallest mean figure."""
    # one at least: `models.compared` has made sure
    names = [model.name for model in compared if model.name in SVR]
    return min(names, key=lambda name: float(over_cases(found, controller, name, figure).mean()))


def less(found: Found, controller: str, figure: str, model: str, than: str = "none") -> Estimate:
    """How much smaller the mean figure of a model is than another's, 0 to 1, paired by seed."""
    return reduction(
        over_cases(found, controller, than, figure), over_cases(found, controller, model, figure)
    )


def to_draw(cases: Sequence[Case], names: Sequence[str]) -> list[Case]:
    """The cases of these names; the first one where there is none of them."""
    # something is drawn in any case: `--case` may have left none of the usual
    return [case for case in cases if case.name in names] or list(cases[:1])


def best_of_all(found: Found, controller: str, figure: str, scale: float, unit: str) -> str:
    """Name the model with the smallest mean figure of all, and whether the seeds can tell it from the
    next."""
    means = {
        name: estimate(over_cases(found, controller, name, figure))
        for name in next(iter(found[controller].values()))
    }
    best, *others = sorted(means, key=lambda name: means[name].mean)
    text = f"Best of all: {best}, with {means[best].text(scale)} {unit}"
    if not others:  # one model alone, and no comparison
        return f"{text}."
    # seed by seed against the next best alone: against the mean of all even luck would look sure
    gain = less(found, controller, figure, best, others[0])
    next_best = f"{others[0]}, {means[others[0]].text(scale)} {unit}"
    if gain.count == 1:
        return f"{text}; next {next_best}, each run once."
    if gain.low > 0:
        return f"{text}, {gain.text(100, '.1f')} % less than the next ({others[0]})."
    return f"{text}; {gain.count} seeds cannot tell it from the next ({next_best})."


def verdict(found: Found, controller: str, figure: str, compared: Sequence[Compared], what: str) -> str:
    """Say plainly whether the best support-vector model beats each formula, and where it does not."""
    best = best_svr(found, controller, figure, compared)
    words = []
    for model in compared:
        if model.name in SVR or model.name == "none":  # against formulas alone
            continue
        gain = less(found, controller, figure, best, model.name)
        if gain.low > 0:
            words.append(f"{100 * gain.mean:.1f} % less than with {model.name}")
        elif gain.high < 0:
            words.append(f"{-100 * gain.mean:.1f} % MORE than with {model.name}: SVR does not win there")
        else:
            words.append(
                f"no difference from {model.name} that {gain.count} seeds can tell ({gain.text(100, '.1f')} "
                "%)"
            )
    text = f"{controller}: with the best support-vector model ({best}) the {what} is " + "; ".join(words)
    once = "" if _repetitions(found) > 1 else " Each was run once: a few per cent either way mean nothing."
    return f"{text}.{once} {_losses(found, controller, figure, best)}"


def _repetitions(found: Found) -> int:
    """Runs behind every figure."""
    cases = next(iter(found.values()))
    return len(next(iter(next(iter(next(iter(cases.values())).values())).values())))


def _losses(found: Found, controller: str, figure: str, best: str) -> str:
    """Say in which cases the best formula, or none, beats that model, and in which the seeds cannot tell."""
    lost, unclear = [], []
    for case, of in found[controller].items():
        values = {name: estimate(one[figure]).mean for name, one in of.items() if name not in SVR}
        # by the mean of this case: the best over all cases may lose in one
        winner = min(values, key=lambda name: values[name])
        gain = reduction(of[winner][figure], of[best][figure])
        if gain.high < 0:
            lost.append(f"{case} ({winner})")
        elif gain.low <= 0:
            unclear.append(f"{case} ({winner})")
    cases = len(found[controller])
    text = (
        f"A formula, or none, is better in {len(lost)} of {cases} cases: {', '.join(lost)}."
        if lost
        else "No formula is better in any case."
    )
    return f"{text} In {len(unclear)} more the seeds cannot tell: {', '.join(unclear)}." if unclear else text
