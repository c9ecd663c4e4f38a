"""The simulated rig of an experiment: seeds, motions of the hand, and variants of the controller.

A seed draws the noise of every sensor, the place on the circle where the motion happens (friction varies
over a turn) and the hand's stiffness and damping. The same seed gives the same rig to every variant, so
that variants are compared run by run."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hw.motion import own_size
from hw.simulators.mock_energy import stored_j
from hw.simulators.mock_records import Hand
from rtctl.control.velocity import lowpass_alpha
from rtctl.control.vocabulary import Policy, State, state_and_cause
from rtctl.errors import DataError
from rtctl.experiments import sizes
from rtctl.experiments.order import Order
from rtctl.experiments.seeds import over_seeds
from rtctl.rig_file.config import LoadedConfig
from rtctl.simulation.closed_loop import Simulation

HAND_SPREAD = 0.1
"""Standard deviation of the logarithm of the hand's stiffness and damping."""

FORCE_LOWPASS_HZ = 30.0
"""Cut-off of the optional low-pass on the force."""

FEEDBACK_GAIN = 4.0
"""Gain of the optional local force feedback where the rig file has none."""

SETTLE_S = 6.0
"""From the first tick to the measurement: tare, arming, soft start, and the hand's first strokes."""

# the sum differs from that by the trapezium by .8 of it at most (shipped rig, 5 controllers, 3 motions)
FED_J = 1e-6
"""Energy above which a hand in motion counts as fed: what the sum over its ticks errs by. A stroke against
friction costs it some .1 J."""

Change = Callable[[Simulation], None]


@dataclass(frozen=True)
class Motion:
    """One scripted trajectory of the hand; the measurement is a whole number of periods."""

    name: str
    kind: Hand
    amplitude_rad: float
    speed_rad_s: float = 0.1
    frequency_hz: float = 0.5
    periods: int = 2
    hold_s: float = 1.0
    rest_s: float = 1.0

    @property
    def period_s(self) -> float:
        """Length of one period, s."""
        if self.kind == Hand.SINES:
            return 1 / self.frequency_hz
        stroke_s = abs(self.amplitude_rad) / self.speed_rad_s
        return 4 * stroke_s if self.kind == Hand.TRIANGLE else 2 * stroke_s + self.hold_s + self.rest_s

    @property
    def top_rad_s(self) -> float:
        """Highest speed of the hand's wish, rad/s."""
        if self.kind == Hand.SINES:
            return 2 * math.pi * self.frequency_hz * abs(self.amplitude_rad)
        return self.speed_rad_s

    def on(self, loaded: LoadedConfig) -> Motion:
        """The same motion on the first axis of a rig, as large as it has room for, with the same period."""
        factor = sizes.scale(loaded, abs(self.amplitude_rad), self.top_rad_s)
        return replace(self, amplitude_rad=factor * self.amplitude_rad, speed_rad_s=factor * self.speed_rad_s)

    def apply(self, simulation: Simulation) -> None:
        """Make the simulated hand do it, around where the joint starts."""
        p = simulation.plant_params[0]
        p["hand_kind"][0] = int(self.kind)
        p["hand_amplitude_rad"][0], p["hand_speed_rad_s"][0] = self.amplitude_rad, self.speed_rad_s
        p["hand_hold_s"][0], p["hand_rest_s"][0] = self.hold_s, self.rest_s  # of a push alone
        # all sines first: a rig file may have given the hand several
        p["hand_sine_rad"][0], p["hand_sine_rad_s"][0] = 0.0, 0.0
        p["hand_sine_rad"][0, 0] = self.amplitude_rad
        p["hand_sine_rad_s"][0, 0] = 2 * math.pi * self.frequency_hz


FAST_SINE = Motion("fast sine", Hand.SINES, 0.3, frequency_hz=0.5, periods=6)
SLOW_TRIANGLE = Motion("slow triangle", Hand.TRIANGLE, 0.15, speed_rad_s=0.1, periods=2)
PUSH = Motion("push", Hand.PUSH, 0.6, speed_rad_s=0.3, periods=2)


def unchanged(_simulation: Simulation) -> None:
    """Leave the rig file's controller as it is."""


@dataclass(frozen=True)
class Variant:
    """One controller to compare: share of the compensation, and what else differs from the rig file."""

    name: str
    compensation: float = 1.0
    change: Change = unchanged


def with_force_lowpass(simulation: Simulation) -> None:
    """Low-pass the force, as Bi against the gearbox' vibration."""
    simulation.params["force_alpha"] = lowpass_alpha(FORCE_LOWPASS_HZ, simulation.plan.period_s)


def with_feedback(simulation: Simulation) -> None:
    """Switch the local force feedback on, with the rig file's gain if it has one."""
    if not simulation.params["force_feedback_gain"][0, 0] > 0:
        simulation.params["force_feedback_gain"] = FEEDBACK_GAIN


def with_policy(policy: Policy) -> Change:
    """Let another zero-velocity policy decide the direction of the feed-forward."""

    def change(simulation: Simulation) -> None:
        simulation.params["friction_policy"] = int(policy)

    return change


def with_gain(gain: float, viscous_gain: float = 0.0) -> Change:
    """Compensate these shares of the dry and of the viscous friction."""

    def change(simulation: Simulation) -> None:
        p = simulation.params
        # it is gain times the least friction
        p["friction_ungated_cap_nm"] *= gain / np.maximum(p["friction_gain"], 1e-9)
        p["friction_gain"], p["friction_viscous_gain"] = gain, viscous_gain

    return change


def with_observer(gain: float) -> Change:
    """Give the disturbance observer this gain, 0 for none, at the rig file's bandwidth."""

    def change(simulation: Simulation) -> None:
        simulation.params["observer_gain"] = gain

    return change


def with_model_scaled(scale: float) -> Change:
    """Make the friction model wrong by a factor; the controller believes it."""

    def change(simulation: Simulation) -> None:
        # the waves over place, too: a quarter less of friction is a quarter less everywhere
        for name in ("coefficient", "place_coefficient", "friction_min_nm", "viscous_nms_rad"):
            simulation.model[name] *= scale
        # all that the controller derives from its model is as wrong as that
        for name in ("friction_ungated_cap_nm", "friction_floor_nm", "assistance_bank_j"):
            simulation.params[name] *= scale

    return change


def both(*changes: Change) -> Change:
    """One change after the other."""

    def change(simulation: Simulation) -> None:
        for one in changes:
            one(simulation)

    return change


def _hand(loaded: LoadedConfig) -> tuple[float, float]:
    """Factors of the hand's stiffness and damping: a carriage whose rig file tells none is held as a joint
    is, at its handle."""
    table = loaded.config.device[0].options
    # the first is that of the first axis, or of all: a second axis may have a hand of its own
    told = [one for one in table.get("hand", ())[:1] if {"stiffness_nm_rad", "damping_nms_rad"} & set(one)]
    motion = "rotary" if told else loaded.config.axis[0].motion
    return own_size("stiffness_nm_rad", 1.0, motion), own_size("damping_nms_rad", 1.0, motion)


def make(loaded: LoadedConfig, seed: int) -> Simulation:
    """Rig `seed` of the experiment, nothing run yet (see the module's text)."""
    options = dict(loaded.options)
    draw = np.random.default_rng((int(options["seed"]), seed))
    axis = loaded.config.axis[0]
    room = min(axis.position_max_rad, -axis.position_min_rad)
    # friction differs over a turn, where there is a turn
    place = float(draw.uniform(-math.pi, math.pi)) if room > 2 * math.pi else 0.0
    # as factors: a hand is never less than nothing
    stiffness, damping = np.exp(HAND_SPREAD * draw.standard_normal(2))
    # drawn and not added: rig 2 of seed 1 would be rig 1 of seed 2
    options["seed"] = int(draw.integers(1 << 62))
    made = Simulation(loaded.model_copy(update={"options": options}))
    made.plant_state["position_rad"][0, 0] += place
    made.plant_params["hand_center_rad"][0, 0] += place
    own_stiffness, own_damping = _hand(loaded)
    made.plant_params["hand_stiffness_nm_rad"][0, 0] *= own_stiffness * stiffness
    made.plant_params["hand_damping_nms_rad"][0, 0] *= own_damping * damping
    made.command["environment_center_rad"][0, 0] += place  # the world goes where the joint goes
    return made


@dataclass(frozen=True)
class Run:
    """One measured run: the ticks, the truth at the same ticks, and the simulation at its end."""

    trace: np.ndarray
    truth: np.ndarray
    simulation: Simulation
    start_j: float
    """Energy in the moving joint, its bristles and its elasticity when the measurement began, J."""
    start_rad: float


def measure(loaded: LoadedConfig, seed: int, motion: Motion, variant: Variant) -> Run:
    """Arm, let it settle, measure whole periods of the motion.

    Raises
    ------
    DataError
        The rig left ACTIVE: the figures would be of a rig without torque."""
    simulation = make(loaded, seed)
    motion.on(loaded).apply(simulation)
    variant.change(simulation)
    simulation.arm(compensation=variant.compensation)
    # from the first tick on, so that every variant is measured at the same phase of the hand's wish
    simulation.run(max(SETTLE_S - simulation.time_s, simulation.plan.period_s))
    start_rad = float(simulation.plant_state["position_rad"][0, 0])
    start_j = float(stored_j(simulation.plant_state, simulation.plant_params, 0)[0])
    trace = simulation.run(motion.periods * motion.period_s)
    require_active(trace, f"{motion.name}, {variant.name}, seed {seed}")
    return Run(trace, simulation.truth, simulation, start_j, start_rad)


def stroke_ends_s(simulation: Simulation, motion: Motion) -> float:
    """Time at which the hand's wish is back where it began, in full motion: after two periods, or more where
    the rig took longer to arm. A hand that stopped before would leave nothing to be judged."""
    ends_s = float(simulation.plant_params["hand_start_s"][0, 0]) + 2 * motion.period_s
    while ends_s <= simulation.time_s:
        ends_s += motion.period_s  # whole periods: where it began
    return ends_s


def require_active(trace: np.ndarray, what: str) -> None:
    """Refuse a run that was stopped on the way. Raises DataError."""
    if np.all(trace["state"] == State.ACTIVE):
        return
    first = trace[int(np.argmax(trace["state"] != State.ACTIVE))]
    raise DataError(
        f"{what}: the rig left ACTIVE at tick {int(first['tick'])} for {state_and_cause(first)}; "
        "lower the gains or look at it with rtctl run"
    )


def hand_energy_min_j(run: Run) -> float:
    """Least energy the hand has put in since the measurement began, above what it found stored, J.

    Below zero the hand was fed: the joint moved it."""
    # from where the joint stood as the measurement began: the first step counts, too
    steps_rad = np.diff(run.truth["position_rad"][:, 0], prepend=run.start_rad)
    # what was stored when it began may come back without the hand being fed
    return run.start_j + float(np.cumsum(run.truth["hand_torque_nm"][:, 0] * steps_rad).min())


def speeds_after_release(order: Order, variant: Variant) -> list[float]:
    """`speed_after_release` of every seed, rad/s."""

    def once(order: Order, seed: int) -> float:
        return speed_after_release(order.loaded, seed, variant)

    return over_seeds(order, once)


def speed_after_release(loaded: LoadedConfig, seed: int, variant: Variant) -> float:
    """RMS speed 1 to 5 s after the hand lets go at full speed of the fast sine, true, rad/s."""
    simulation = make(loaded, seed)
    FAST_SINE.on(loaded).apply(simulation)
    variant.change(simulation)
    simulation.plant_params["grip_count"][0, 0] = 1  # one grip, from the beginning on
    simulation.plant_params["grip_from_s"][0, 0, 0] = 0.0
    simulation.plant_params["grip_to_s"][0, 0, 0] = math.inf
    simulation.arm(compensation=variant.compensation)
    release_s = stroke_ends_s(simulation, FAST_SINE)
    # a sine is fastest where it passes its middle, which is where it began
    simulation.plant_params["grip_to_s"][0, 0, 0] = release_s
    simulation.run(release_s - simulation.time_s)
    # what the hand left in bristles and springs goes first
    simulation.run(1.0)
    simulation.run(4.0)
    return float(np.sqrt(np.mean(np.square(simulation.truth["velocity_rad_s"][:, 0]))))
