"""The same simulated joint displayed as an impedance and as an admittance, and what a hand feels of
either."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from hw.simulators.mock_records import Hand
from rtctl.control.vocabulary import Environment, State
from rtctl.errors import FaultError
from rtctl.rig_file.config import Config, LoadedConfig
from rtctl.simulation.certificate import bears
from rtctl.simulation.closed_loop import Simulation

RUBS = ("coulomb_nm", "breakaway_nm", "bristle_max_nm", "thinning_nms_rad")
SLIPPERY = 0.01
"""Share of the dry friction that is left where an inertia is to be felt by itself."""
CALM_NM = 0.02
"""Hand torque above 9 Hz, RMS, from which on a contact rings."""
RING_HZ = 9.0
JUDGED_S = 0.5
"""End of a contact that is judged: some periods of what rings at `RING_HZ`."""
HAND_NM_RAD = 30.0
"""Stiffness of the hand that leans on worlds."""
# by ratio: the damping is told at the slow ones, the mass at the fast
FELT_HZ = (0.5, 1.1, 2.3, 5.0)


class Rubbing(StrEnum):
    """The joint that is measured, as its tables call it."""

    HARDLY = "hardly rubs"
    """A hundredth of the dry friction, no compensation, no dead band of the force, no noise."""
    BARE = "rubs"
    """As it is, without compensation."""
    COMPENSATED = "rubs, compensated"
    """As it is, with what the rig file compensates."""


@dataclass(frozen=True)
class Shown:
    """Numbers of an admittance display. Units as in the rig file."""

    mass_kgm2: float
    damping_nms_rad: float
    velocity_gain_nms_rad: float
    position_gain_nm_rad: float
    feedforward: float = 1.0


def usual(loaded: LoadedConfig) -> Shown:
    """The rig file's own numbers, or, where it has none: the joint's inertia, twice its damping, forty times
    its damping as K_v.

    K_p is 14 K_v per second: what friction holds up, the servo has taken back within a fourteenth of a
    second. Less of it leaves more of the damping felt to friction; more of it costs a slow drive what its
    hand may be."""
    axis = loaded.config.axis[0]
    own = axis.admittance
    # all or none: half of a display with made-up numbers for the rest would be nobody's
    if min(own.mass_kgm2, own.damping_nms_rad, own.velocity_gain_nms_rad) > 0:
        return Shown(
            own.mass_kgm2,
            own.damping_nms_rad,
            own.velocity_gain_nms_rad,
            own.position_gain_nm_rad,
            own.feedforward,
        )
    gain = 40 * axis.viscous_nms_rad
    return Shown(axis.inertia_kgm2, 2 * axis.viscous_nms_rad, gain, 14 * gain)


def displayed(loaded: LoadedConfig, shown: Shown | None) -> LoadedConfig:
    """The rig with its first axis displayed as this admittance, or as the rig file's impedance."""
    table = loaded.config.model_dump(mode="json", by_alias=True)
    axis = table["axis"][0]
    axis["display"] = "impedance" if shown is None else "admittance"
    axis["display_change"] = False  # one display at a time: the other need not be proved
    if shown is not None:
        # one mass: a range would have to be proved
        axis["admittance"] |= {**vars(shown), "mass_max_kgm2": 0.0, "damping_max_nms_rad": 0.0}
        axis["force_feedback"]["gain"] = 0.0
    return loaded.model_copy(update={"config": Config.model_validate(table)})


def slippery(simulation: Simulation) -> None:
    """Leave hardly any dry friction in the joint, no noise, and no dead band of the force."""
    for name in RUBS:
        simulation.plant_params[name] *= SLIPPERY
    for name in ("force_noise_n", "force_resolution_n", "current_noise_a"):
        simulation.plant_params[name] = 0.0
    # it hides the smallest forces, which are those of a mass by itself
    simulation.params["mass_force_deadband_nm"] = 0.0


def hold(simulation: Simulation, stiffness_nm_rad: float, damping_nms_rad: float) -> None:
    """Give the hand this spring and damper, and nothing that it wants."""
    plant = simulation.plant_params
    plant["hand_kind"] = int(Hand.SINES)
    plant["hand_stiffness_nm_rad"], plant["hand_damping_nms_rad"] = stiffness_nm_rad, damping_nms_rad
    # a mass of the hand would be felt as one of the display
    plant["hand_inertia_kgm2"] = plant["hand_sine_rad"] = plant["hand_sine_rad_s"] = 0.0


def fit_mass(speed_rad_s: np.ndarray, hand_nm: np.ndarray, period_s: float) -> tuple[float, float]:
    """Mass, kg m^2, and damping, N m s/rad, of tau = m dv/dt + b v, by least squares."""
    # true speed of the simulation, every tick: three points err by .02 % at 5 Hz
    parts = np.stack([np.gradient(speed_rad_s, period_s), speed_rad_s], axis=1)
    (mass, damping), *_ = np.linalg.lstsq(parts, hand_nm, rcond=None)
    return float(mass), float(damping)


def felt(loaded: LoadedConfig, joint: Rubbing) -> tuple[float, float]:
    """Mass and damping that a hand of 5 N m/rad feels between .5 and 5 Hz. NaN where the rig stopped."""
    simulation = Simulation(loaded)
    if joint is Rubbing.HARDLY:
        slippery(simulation)
    hold(simulation, 5.0, 0.1)
    # amplitudes over frequency: each sine has the same speed, and mass and damping are told alike
    trace = _armed_run(simulation, 4.0, _compensation(joint), {hz: 0.15 / hz for hz in FELT_HZ})
    if trace is None:
        return math.nan, math.nan
    truth = simulation.truth
    return fit_mass(truth["velocity_rad_s"][:, 0], truth["hand_torque_nm"][:, 0], simulation.plan.period_s)


def _compensation(joint: Rubbing) -> float:
    return float(joint is Rubbing.COMPENSATED)


def impedance_felt(loaded: LoadedConfig, hz: float) -> complex:
    """Torque of a hand over its speed at one frequency, N m s/rad, on a joint that hardly rubs. NaN where the
    rig stopped."""
    simulation = Simulation(loaded)
    slippery(simulation)
    hold(simulation, 20.0, 0.1)
    # whole periods, so that the sine leaks nowhere; 1/hz: of the same speed at all
    trace = _armed_run(simulation, math.ceil(hz * 2.0) / hz, 0.0, {hz: 0.1 / hz})
    if trace is None:
        return complex(math.nan, math.nan)
    at = np.exp(-2j * math.pi * hz * simulation.plan.period_s * np.arange(len(trace)))
    truth = simulation.truth
    return complex(truth["hand_torque_nm"][:, 0] @ at / (truth["velocity_rad_s"][:, 0] @ at))


@dataclass(frozen=True)
class Contact:
    """A hand that leans on a virtual spring or wall."""

    stiffness_nm_rad: float
    """Felt: torque over way between two loads. NaN where the rig stopped."""
    ring_nm: float
    """RMS of the hand's torque above 9 Hz."""
    account_min_j: float
    stopped: bool
    way_rad: float = math.nan
    """From the place where the world begins to where the joint stands under the larger load."""

    @property
    def calm(self) -> bool:
        """Neither ringing nor stopped."""
        return not self.stopped and self.ring_nm <= CALM_NM


def contact(
    loaded: LoadedConfig, kind: Environment, stiffness_nm_rad: float, joint: Rubbing = Rubbing.HARDLY
) -> Contact:
    """Lean on it with .2 and with .4 of the torque limit, through a hand of 30 N m/rad, and look."""
    simulation = Simulation(loaded)
    if joint is Rubbing.HARDLY:
        slippery(simulation)
    hold(simulation, HAND_NM_RAD, 0.1)
    command, limit = simulation.command, float(simulation.params["torque_limit_nm"][0, 0])
    command["environment_kind"], command["environment_side"] = int(kind), 1
    command["environment_stiffness_nm_rad"], command["environment_damping_nms_rad"] = stiffness_nm_rad, 0.0
    # the world begins where the joint is: the first touch is no jump
    rest = float(simulation.plant_state["position_rad"][0, 0])
    command["environment_center_rad"] = rest
    simulation.plant_params["hand_center_rad"] = rest
    judged = round(JUDGED_S / simulation.plan.period_s)
    # lets the joint lie on the world before it is loaded
    if _armed_run(simulation, 0.2, _compensation(joint)) is None:
        return Contact(math.nan, math.nan, math.nan, stopped=True)
    loads, rings, least = [], 0.0, 0.0
    for share in (0.2, 0.4):
        simulation.plant_params["hand_center_rad"] = rest + share * limit / HAND_NM_RAD
        # what rings on goes on to the end: only that is judged, and the step of the load itself is over
        trace = simulation.run(1.5)
        if not np.all(trace["state"] == State.ACTIVE):
            return Contact(math.nan, math.nan, float(trace["energy_port_j"].min()), stopped=True)
        torque, place = (
            simulation.truth["hand_torque_nm"][-judged:, 0],
            simulation.truth["position_rad"][-judged:, 0],
        )
        loads.append((float(torque.mean()), float(place.mean())))
        rings = max(rings, above(torque, RING_HZ, simulation.plan.period_s))
        least = min(least, float(trace["energy_port_j"].min()))
    (low_nm, low_rad), (high_nm, high_rad) = loads
    way = high_rad - low_rad
    stiffness = (high_nm - low_nm) / way if way != 0 else math.inf  # of two loads: friction and zero cancel
    return Contact(stiffness, rings, least, stopped=False, way_rad=high_rad - rest)


def above(signal: np.ndarray, hz: float, period_s: float) -> float:
    """RMS of what a signal has above a frequency."""
    # less its mean, whose cut ends would be in every frequency
    spectrum = np.fft.rfft(signal - signal.mean())
    spectrum[np.fft.rfftfreq(len(signal), period_s) < hz] = 0
    return float(np.sqrt(np.mean(np.square(np.fft.irfft(spectrum, len(signal))))))


def widest(loaded: LoadedConfig, shown: Shown | None, damping_nms_rad: float) -> float:
    """Stiffest rigid wall that is calm: largest k_c with this b_c, or largest K_p with this b_v, N m/rad; 0
    where none is."""
    return _largest(lambda stiffness: _wall(loaded, shown, damping_nms_rad, stiffness).calm)


def widest_certified(loaded: LoadedConfig, shown: Shown, damping_nms_rad: float) -> float:
    """Largest K_p with this b_v at which the matrices bear every hand to `HAND_NM_RAD` in any linear world,
    N m/rad; 0: none."""

    def bears_hand(stiffness: float) -> bool:
        held = replace(shown, position_gain_nm_rad=stiffness, damping_nms_rad=damping_nms_rad)
        return bears(displayed(loaded, held), HAND_NM_RAD)

    return _largest(bears_hand)


def _largest(passes: Callable[[float], bool], most: float = 4000.0) -> float:
    """Up to where a stiffness passes, N m/rad, found by halving ratios between 1 and `most`; 0 where it does
    not."""
    # ratios are halved: stiffnesses of one and of a thousand are both of interest
    # `most` itself is never tried: a rig that is calm there ends 1.6 % below it
    low, high = 0.0, most
    # 9 halvings of a ratio of 4000: to 1.6 %, finer than a contact is told from one that rings
    for _ in range(9):
        middle = math.sqrt(max(low, 1.0) * high)
        low, high = (middle, high) if passes(middle) else (low, middle)
    return low


def _wall(loaded: LoadedConfig, shown: Shown | None, damping: float, stiffness: float) -> Contact:
    """A rigid wall behind a coupling, or on a mass, of this stiffness and damping."""
    if shown is not None:
        held = replace(shown, position_gain_nm_rad=stiffness, damping_nms_rad=damping)
        return contact(displayed(loaded, held), Environment.WALL, 1e5)
    one = displayed(loaded, None)
    table = one.config.model_dump(mode="json", by_alias=True)
    table["axis"][0]["coupling"] |= {"stiffness_nm_rad": stiffness, "damping_nms_rad": damping}
    return contact(one.model_copy(update={"config": Config.model_validate(table)}), Environment.WALL, 1e5)


def _armed_run(
    simulation: Simulation, seconds: float, compensation: float, wish: Mapping[float, float] | None = None
) -> np.ndarray | None:
    """Arm, let the hand wish sines (frequency in Hz -> amplitude in rad), let a second go, run; None if it
    was not ACTIVE."""
    try:
        simulation.arm(compensation=compensation)
    except FaultError:
        return None
    plant = simulation.plant_params
    for k, (hz, amplitude_rad) in enumerate((wish or {}).items()):
        plant["hand_sine_rad"][0, 0, k] = amplitude_rad
        plant["hand_sine_rad_s"][0, 0, k] = 2 * math.pi * hz
    # what the hand's wish does to a joint at rest dies out first
    simulation.run(1.0)
    trace = simulation.run(seconds)
    return trace if np.all(trace["state"] == State.ACTIVE) else None
