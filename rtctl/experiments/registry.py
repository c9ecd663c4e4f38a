"""Every experiment by its name on the command line."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass, replace

from rtctl.errors import ConfigError
from rtctl.experiments import on_rig
from rtctl.experiments.order import Order
from rtctl.experiments.report import Outcome, in_units_of

Run = Callable[[Order], Outcome]


def _positioning(module: str) -> Run:
    """The run of a positioning experiment on the loop."""

    def run(order: Order) -> Outcome:
        from rtctl.experiments import positioning_on_rig  # the host, zmq and all: only where a rig is moved

        found = importlib.import_module(f"rtctl.experiments.{module}").EXPERIMENT
        return positioning_on_rig.reported(order, found)

    return run


@dataclass(frozen=True)
class Experiment:
    """What an experiment is. `weight`: its share of the time of the combined report, s on the shipped rig."""

    name: str
    module: str
    about: str
    weight: float
    on_rig: Run | None = None
    in_papers: bool = True
    of_joints: bool = False
    """True of one whose numbers are those of a joint: it refuses a linear axis."""
    hands_off: bool = False
    """On the loop it moves by itself, with nobody at the handle."""

    def run(self, order: Order) -> Outcome:
        """Run it: simulated, or on the real loop where it can. Raises ConfigError, DataError, FaultError."""
        if not order.simulate:
            if self.on_rig is None:
                raise ConfigError(
                    f"{order.loaded.path}: {self.name} runs on the simulated rig alone; add --simulate. On "
                    "the loop of a rig run free-motion, spring, point-to-point and tracking"
                )
            return in_units_of(self.on_rig(order), order.motion)
        found: Run = importlib.import_module(f"rtctl.experiments.{self.module}").run
        return in_units_of(found(order), order.motion)


EXPERIMENTS: dict[str, Experiment] = {
    one.name: one
    for one in (
        Experiment("free-motion", "free_motion", "Bi, Figs. 6 and 7", 30.0, on_rig.free_motion),
        Experiment("spring", "spring", "Bi, Figs. 8 and 9", 10.0, on_rig.spring),
        Experiment("friction-model", "friction_model", "Bi, Figs. 2 to 5, Tables I and II", 30.0),
        Experiment(
            "identification", "identification", "the same from many identifications", 200.0, in_papers=False
        ),
        Experiment(
            "point-to-point", "point_to_point", "Tijani", 5.0, _positioning("point_to_point"), hands_off=True
        ),
        Experiment("tracking", "tracking", "Tijani", 10.0, _positioning("tracking"), hands_off=True),
        Experiment("stability-map", "stability_map", "the impedances that can be rendered", 5.0),
        Experiment(
            "admittance", "admittance", "impedance and admittance on the same joint", 20.0, of_joints=True
        ),
        Experiment("policies", "policies", "what decides the direction near rest", 60.0),
    )
}

PAPERS = "papers"
"""All of them on one page, but those that measure the learning and not the rig."""


def papers(order: Order) -> list[Outcome]:
    """Run every experiment that the axis can do on the simulated rig, one after the other; progress is that
    of the whole."""
    together = [
        one
        for one in EXPERIMENTS.values()
        if one.in_papers and not (one.of_joints and order.motion == "linear")
    ]
    # by weight: a bar that stands at a ninth for most of the time tells nobody anything
    total = sum(one.weight for one in together)
    done, outcomes = 0.0, []
    for one in together:
        part = order.part(done / total, (done + one.weight) / total, f"{one.name}: ")
        outcomes.append(one.run(replace(order, progress=part)))
        done += one.weight
    return outcomes
