"""A virtual angular spring: torque desired, felt without and felt with compensation (Bi, Figs. 8 and 9)."""

from __future__ import annotations

import numpy as np

from hw.motion import own_size
from rtctl import pictures
from rtctl.control.proofs import stability
from rtctl.control.vocabulary import Environment, Policy
from rtctl.experiments import figures, virtual
from rtctl.experiments.order import Order
from rtctl.experiments.policies_on_family import hybrid_alone, observer_alone
from rtctl.experiments.report import Outcome, Part, Target
from rtctl.experiments.seeds import figures_over_seeds
from rtctl.experiments.statistics import Estimate, estimate, reduction, rms
from rtctl.experiments.virtual import PUSH, Run, Variant
from rtctl.friction.learn.report_page import Picture
from rtctl.friction.learn.report_tables import Table
from rtctl.simulation.closed_loop import Simulation

TITLE = "Virtual spring"
# wound by the .6 rad of `PUSH` it is felt with .6 k k_c / (k + k_c) = 1.7 of the shipped motor's 2 N m
STIFFNESS_NM_RAD = 3.0
"""Where the rig file has no spring; the policy is then stop_gated, as in the shipped spring rig."""

ALIKE = 1.25
"""Factor within which what two policies leave is about alike."""

OFF = Variant("off", 0.0)
ON = Variant("default")
"""As the rig file says, or policy stop_gated where it has no spring: feed-forward, and the observer on what
it leaves."""
ALONE = Variant("feed-forward alone", 1.0, virtual.with_observer(0.0))
HYBRID = Variant("policy hybrid", 1.0, virtual.with_policy(Policy.HYBRID))
HYBRID_ALONE = Variant("policy hybrid, feed-forward alone", 1.0, hybrid_alone)
FEEDBACK = Variant("default + force feedback", 1.0, virtual.with_feedback)
VARIANTS = (
    OFF,
    ON,
    ALONE,
    HYBRID,
    HYBRID_ALONE,
    Variant("observer alone", 1.0, observer_alone),
    Variant("policy stop_gated", 1.0, virtual.with_policy(Policy.STOP_GATED)),
    Variant("default, force low-pass", 1.0, virtual.with_force_lowpass),
    FEEDBACK,
    Variant("default + force feedback, force low-pass", 1.0,
        virtual.both(virtual.with_force_lowpass, virtual.with_feedback)),
    Variant("model 25 % too low", 1.0, virtual.with_model_scaled(0.75)),
    Variant("model 25 % too low + force feedback", 1.0,
        virtual.both(virtual.with_model_scaled(0.75), virtual.with_feedback)),
    Variant("model 25 % too high", 1.0, virtual.with_model_scaled(1.25)),
)  # fmt: skip

Measured = dict[str, dict[str, np.ndarray]]


def run(order: Order) -> Outcome:
    """Run the experiment on the simulated rig. Raises ConfigError, DataError as `free_motion.run`."""
    order.require_simulated("spring --simulate")
    found: Measured = {}
    for at, variant in enumerate(VARIANTS):
        order.progress(at / len(VARIANTS), f"spring: {variant.name}")

        def once(order: Order, seed: int, variant: Variant = variant) -> dict[str, float]:
            return _figures(_measure(order, seed, variant))

        found[variant.name] = figures_over_seeds(order, once)
    pictures = _pictures(order)
    order.progress(1.0, "spring")
    return _outcome(order, found, pictures)


def _stiffness(simulation: Simulation) -> float:
    """Stiffness the hand should feel: environment and coupling in series, N m/rad."""
    # of this very run: a variant may have changed it
    k_c = float(simulation.params["coupling_stiffness_nm_rad"][0, 0])
    # a hand feels the coupling in series: against the spring alone every controller would be wrong
    return stability.felt_stiffness(k_c, float(simulation.command["environment_stiffness_nm_rad"][0, 0]))


def _measure(order: Order, seed: int, variant: Variant) -> Run:
    def change(simulation: Simulation) -> None:
        command = simulation.command
        if command["environment_kind"][0, 0] != int(Environment.SPRING):
            command["environment_kind"][0, 0] = int(Environment.SPRING)
            command["environment_stiffness_nm_rad"][0, 0] = own_size(
                "stiffness_nm_rad", STIFFNESS_NM_RAD, simulation.motion
            )
            # slack at first: the hand has not wound it up
            command["environment_center_rad"][0, 0] = simulation.plant_state["position_rad"][0, 0]
            virtual.with_policy(Policy.STOP_GATED)(simulation)
        variant.change(simulation)

    return virtual.measure(order.loaded, seed, PUSH, Variant(variant.name, variant.compensation, change))


# from the true angle, not the encoder's: what is desired is a spring, and no measurement of one
def _desired(run: Run) -> np.ndarray:
    """Torque the hand should need, from the true angle: k (theta - theta0), N m."""
    centre = float(run.simulation.command["environment_center_rad"][0, 0])
    wanted: np.ndarray = _stiffness(run.simulation) * (run.truth["position_rad"][:, 0] - centre)
    return wanted


def _figures(run: Run) -> dict[str, float]:
    desired = _desired(run)
    # the true torque of the hand: a sensor's noise is felt by nobody
    error = run.truth["hand_torque_nm"][:, 0] - desired
    return {
        "error_rms_nm": rms(error),
        "error_max_nm": float(np.abs(error).max()),
        "sensed_error_rms_nm": rms(run.trace["hand_torque_nm"][:, 0] - desired),
        "desired_rms_nm": rms(desired),
        "hand_energy_min_j": virtual.hand_energy_min_j(run),
        "port_energy_min_j": float(run.trace["energy_port_j"].min()),
    }


def _pictures(order: Order) -> list[Picture]:
    runs = {variant.name: _measure(order, 0, variant) for variant in (OFF, ON, FEEDBACK)}
    time_s = np.arange(len(runs[OFF.name].trace)) * order.loaded.config.period_s
    # a panel for each controller: desired and felt beside each other, not one controller beside another
    panels = []
    for name, one in runs.items():
        felt = one.truth["hand_torque_nm"][:, 0]
        panels.append((f"{name}\n[N m]", {"desired": (time_s, _desired(one)), "felt": (time_s, felt)}))
    over_time = Picture(
        "spring_time",
        "Torque of the virtual spring, desired and felt by the hand, in N m over time in s; without and with "
        "compensation (Bi, Figs. 8 and 9), and with local force feedback. Seed 0.",
        figures.stacked(panels, order.motion),
    )
    return [over_time, _loops(runs, order.motion)]


def _loops(runs: dict[str, Run], motion: str) -> Picture:
    figure = pictures.blank(8, 4.8)
    plot = figure.subplots()
    for name, one in runs.items():
        angle = one.truth["position_rad"][:, 0] - one.simulation.command["environment_center_rad"][0, 0]
        plot.plot(angle, one.truth["hand_torque_nm"][:, 0], linewidth=0.8, label=name)
    # after the runs were drawn: the line of the desired spring goes as far as they do
    ends = np.array(plot.get_xlim())
    # the same of all runs: they differ by the controller alone
    stiffness = _stiffness(next(iter(runs.values())).simulation)
    plot.plot(ends, stiffness * ends, "k--", linewidth=1, label=f"desired, {stiffness:.3g} N m/rad")
    figures.label(plot, "angle from rest [rad]", "torque of the hand [N m]")
    plot.legend(fontsize="small")
    caption = (
        "The spring as the hand feels it: torque in N m over angle in rad. The width of a loop is friction."
    )
    return Picture("spring_loop", caption, figures.png(figure, motion))


def _outcome(order: Order, found: Measured, pictures: list[Picture]) -> Outcome:
    # against no compensation in the same spring, seed by seed
    less = {
        name: reduction(found[OFF.name]["error_rms_nm"], one["error_rms_nm"]) for name, one in found.items()
    }
    key = (
        f"The torque felt differs from that of the virtual spring by {_rms(found, OFF.name)} mN m RMS "
        f"without compensation and {_rms(found, ON.name)} mN m with it: {less[ON.name].text(100, '.1f')} % "
        f"less; with local force feedback {less[FEEDBACK.name].text(100, '.1f')} % less."
    )
    rows = tuple(_row(name, one, less[name]) for name, one in found.items())
    header = (
        "controller",
        "RMS (felt - desired), mN m",
        "largest, mN m",
        "as the sensor sees it, mN m",
        "reduction, %",
        "least energy of the hand, mJ",
        "least energy of the port, mJ",
    )
    desired = estimate(found[ON.name]["desired_rms_nm"]).text(1e3, ".0f")
    caption = (
        f"Mean over {order.seeds} seeds ± half of the 95 % confidence interval; energies are the worst of "
        f"all seeds. The desired torque itself is {desired} mN m RMS: spring and coupling in series, from "
        "the true angle."
    )
    shown: tuple[Table | Picture, ...] = (*pictures, Table(caption, header, rows))
    why = (
        "Near rest the hybrid policy takes the direction of the feed-forward from the torque of the hand. "
        "A hand that is led back by a spring pulls one way and moves the other, and the displacement "
        "(stop_gated, which the shipped spring rig uses, and this experiment on a rig file without a spring) "
        "tells the direction there. Of the torque error hybrid leaves "
        f"{_left(less, HYBRID_ALONE)} % by itself and {_left(less, HYBRID)} % with the disturbance observer, "
        f"which sees what opposes the motion, this rig's own policy {_left(less, ALONE)} % and "
        f"{_left(less, ON)} %: {_better(less)}."
    )
    fed = _fed(found)
    numbers = {
        "variants": {
            name: {**{figure: estimate(values) for figure, values in one.items()}, "reduction": less[name]}
            for name, one in found.items()
        }
    }
    target = Target("virtual spring: RMS of (felt - desired) less by", less[ON.name], 0.75)
    return Outcome(
        "spring", TITLE, key, (Part("Desired, without, with", (why, fed), shown),), (target,), numbers
    )


def _fed(found: Measured) -> str:
    """Say plainly with which controllers the rig gave the hand more energy than it took from it."""
    least_j = {name: float(one["hand_energy_min_j"].min()) for name, one in found.items()}
    # by the worst seed: a mean would hide a hand that was fed once
    fed = [
        f"{name} (up to {-1e3 * value:.3g} mJ)" for name, value in least_j.items() if value < -virtual.FED_J
    ]
    if not fed:
        return "With no controller did the hand get more energy from the rig than it had given."
    return (
        f"The hand got more energy than it had given with: {', '.join(fed)}. A spring holds the force gate "
        "open, so a model that is too high drives the joint along; what the law accounts for as friction "
        "is not there."
    )


def _better(less: dict[str, Estimate]) -> str:
    """Which of the two policies the errors left speak for; `less` has what is saved."""
    ours, hybrid = (1 - less[one.name].mean for one in (ON, HYBRID))
    if max(ours, hybrid) < ALIKE * min(ours, hybrid):
        return "the two are about alike there, and hybrid leaves hands that hold still alone (docs/check.md)"
    return "in a spring, use the one that leaves less"


def _left(less: dict[str, Estimate], variant: Variant) -> str:
    # what is left, where `less` has what is saved
    return f"{100 * (1 - less[variant.name].mean):.0f}"


def _rms(found: Measured, name: str) -> str:
    return estimate(found[name]["error_rms_nm"]).text(1e3, ".1f")


def _row(name: str, one: dict[str, np.ndarray], less: Estimate) -> tuple[str, ...]:
    return (
        name,
        estimate(one["error_rms_nm"]).text(1e3, ".1f"),
        estimate(one["error_max_nm"]).text(1e3, ".0f"),
        estimate(one["sensed_error_rms_nm"]).text(1e3, ".1f"),
        "-" if name == OFF.name else less.text(100, ".1f"),
        f"{1e3 * one['hand_energy_min_j'].min():.3f}",
        f"{1e3 * one['port_energy_min_j'].min():.2f}",
    )
