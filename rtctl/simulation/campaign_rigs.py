"""Random rigs: inertia, friction, delay, encoder, coupling, environment, hand, and faults on a schedule.

Each rig follows from `(seed, index)` alone, so that one of a million can be made again. The coupling is
drawn inside its proven region; everything the law is told about the device is true within stated bounds."""
# longer than 300 lines: one rig is drawn in one order; a draw that moves makes every rig of every seed
# another one

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hw.fault_kinds import KINDS, Channel, Kind
from hw.generator import seed_words
from hw.simulators.mock_records import Hand
from rtctl.control.environments.kind import DAMPING, STIFFNESS
from rtctl.control.environments.table import OWN, Environment
from rtctl.control.proofs import stability
from rtctl.control.proofs.delay_cover import delay_covered_ticks
from rtctl.control.vocabulary import Policy
from rtctl.friction.guarantee import LENGTH_FACTOR, bank_j
from rtctl.rig_file.config import LoadedConfig
from rtctl.simulation import campaign_plants
from rtctl.simulation.campaign_draws import log_uniform
from rtctl.simulation.campaign_monitor import memory_dtype
from rtctl.simulation.campaign_pursuit import FOE, foe_record
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.jit import records

_FEEDBACK_STREAM = 7
_RENDERER_STREAM = 11
_VELOCITY_STREAM = 13
_PLANT_STREAM = 17
_FOE_STREAM = 19
_DISPLAY_STREAM = 23
_FACTOR_STREAM = 29
"""Draws of the force feedback, of a renderer's store, of velocity sensors, of the plant, of a renderer after
the hand's energy, of admittance displays and of followed friction are streams of their own: the rigs are
otherwise those of earlier campaigns."""

SHARE_OF_ADMITTANCES = SHARE_OF_FOLLOWERS = 0.3

SHARES = {"margin": (0.3, 0.98), "friction": (1.0, 1.3)}
"""Stiffness used of the proven one; true friction as a share of the model's."""


_POLICIES = [
    int(policy) for policy in (Policy.OFF, Policy.HYBRID, Policy.STOP_GATED, Policy.OBSERVER, Policy.LUGRE)
]


@dataclass
class Rig:
    """Everything `drive` needs for one rig."""

    simulation: Simulation
    memory: np.ndarray
    rng: np.ndarray
    foe: np.ndarray
    faults: list[str]
    plant: str


ARMED_S = 0.5
"""Time that arming takes at most, its test pulse included, from the moment on at which a rig may arm."""


def make(loaded: LoadedConfig, seed: int, index: int, *, passive: bool, faults: int, ticks: int) -> Rig:
    """Rig `index` of campaign `seed`.

    Parameters
    ----------
    loaded
        Mock rig that is varied.
    passive
        No faults, true figures, a tare without a hand: the energy claims hold. Half of the rigs have a
        renderer after the hand's energy.
    faults, ticks
        How many faults to spread over the run."""
    draw = np.random.default_rng((seed, index))
    made = Simulation(loaded)
    p, command, plant = made.params[0], made.command[0], made.plant_params[0]
    p["ready_ticks"] = draw.integers(20, 500)
    p["soft_start_ticks"] = draw.integers(50, 600)
    p["late_limit_ticks"] = 3  # a mock is not judged for lateness by itself; a campaign's is
    # never pressed by the rig file: whether it is, the schedule of faults says
    plant["estop_from_s"] = plant["estop_to_s"] = 0.0
    name = campaign_plants.drawn(np.random.default_rng((seed, index, _PLANT_STREAM)))
    for axis in range(made.plan.n_axes):
        _device(p, plant, made.model[axis], axis, draw)
        _plant(loaded, name, p, plant, axis)
        _presliding(p, plant, axis)
        _coupling(p, axis, draw)
        _world(command, axis, draw, passive=passive)
        _hand(plant, axis, draw)
    feedback = np.random.default_rng((seed, index, _FEEDBACK_STREAM))
    for axis in range(made.plan.n_axes):
        _force_feedback(p, axis, feedback)
    renderer = np.random.default_rng((seed, index, _RENDERER_STREAM))
    p["renderer_store_j"], p["renderer_power_w"] = (
        log_uniform(renderer, 1e-3, 10.0),
        log_uniform(renderer, 0.01, 20.0),
    )
    _device_velocity(p, plant, np.random.default_rng((seed, index, _VELOCITY_STREAM)))
    _factor(p, np.random.default_rng((seed, index, _FACTOR_STREAM)))
    if passive:
        _take_hold(p, plant)
    else:
        _display(p, command, np.random.default_rng((seed, index, _DISPLAY_STREAM)))
    names = [] if passive else _faults(plant, faults, ticks, draw)
    made.plant_state["rng"] = seed_words(int(draw.integers(1 << 62)))
    memory = records(np.zeros(1, memory_dtype(made.plan.n_axes)))
    # -1: no stop was asked for yet
    memory["stop_age"] = -1
    pursuer = np.random.default_rng((seed, index, _FOE_STREAM))
    foe = foe_record(pursuer) if passive and pursuer.random() < 0.5 else np.zeros(1, FOE)
    return Rig(made, memory, seed_words(int(draw.integers(1 << 62))), records(foe), names, name)


def _plant(loaded: LoadedConfig, name: str, p: np.void, plant: np.void, axis: int) -> None:
    """Put a plant of the family in place of the plain joint; the law is told what is late in it."""
    if name == campaign_plants.AS_DRAWN:
        return
    like, delay_ticks = campaign_plants.reference(loaded, name)
    usual, _ = campaign_plants.reference(loaded, next(iter(campaign_plants.NAMES)))
    campaign_plants.put_plant(plant, like, usual, axis)
    campaign_plants.put_timing(p, plant, like, delay_ticks)


def _presliding(p: np.void, plant: np.void, axis: int) -> None:
    """Tell the law how long this plant's bristles are, as `rtctl identify` would, and give its account their
    size."""
    length = float(plant["bristle_max_nm"][axis] / plant["bristle_stiffness_nm_rad"][axis])
    p["presliding_rad"][axis] = LENGTH_FACTOR * length
    p["friction_stop_rad"][axis] = length
    p["assistance_bank_j"][axis] = bank_j(float(plant["bristle_max_nm"][axis]), LENGTH_FACTOR * length)


def _device(p: np.void, plant: np.void, model: np.void, axis: int, draw: np.random.Generator) -> None:
    """Inertia, damping, delay, encoder, limits, friction; the law is told the truth, friction from below."""
    period_s = float(p["period_s"])
    inertia, viscous = log_uniform(draw, 1e-3, 0.1), draw.uniform(0.02, 0.2)
    plant["inertia_kgm2"][axis] = p["inertia_kgm2"][axis] = inertia
    p["viscous_nms_rad"][axis] = p["sure_viscous_nms_rad"][axis] = viscous
    p["hold_damping_nms_rad"][axis] = viscous
    p["injected_damping_max_nms_rad"][axis] = viscous
    plant["viscous_nms_rad"][axis] = viscous * draw.uniform(1.0, 1.3)  # the law is told the least
    count = 2 * math.pi / log_uniform(draw, 2e3, 4e5)
    plant["count_rad"][axis] = p["count_rad"][axis] = p["velocity_band_rad"][axis] = count
    delay = int(draw.integers(0, 3))
    plant["torque_delay_ticks"][axis] = p["follow_delay_ticks"][axis] = delay
    p["actuator_delay_ticks"][axis] = delay
    limit = log_uniform(draw, 0.5, 5.0)
    p["torque_limit_nm"][axis] = p["torque_continuous_nm"][axis] = limit
    if draw.random() < 0.3:
        p["torque_continuous_nm"][axis] = limit * draw.uniform(0.2, 0.9)
    p["torque_rate_nm"][axis] = limit * draw.uniform(0.05, 0.5)
    p["velocity_limit_rad_s"][axis] = draw.uniform(4.0, 12.0)
    plant["current_max_a"][axis] = 1e3  # no cut of the device's own: it is not what is judged
    p["current_limit_a"][axis] = 1e3
    p["arming_torque_nm"][axis] = min(
        0.05 * limit,
        # a bare joint goes tau t^2 / 2J in its test: an eighth of the travel that refuses to arm
        inertia * float(p["arming_travel_rad"][axis]) / (4 * (float(p["arming_ticks"]) * period_s) ** 2),
    )
    p["temperature_kind"][axis] = draw.integers(0, 2)
    p["temperature_warn_c"][axis], p["temperature_trip_c"][axis] = 70.0, 90.0
    _friction(p, plant, model, axis, draw)


def _friction(p: np.void, plant: np.void, model: np.void, axis: int, draw: np.random.Generator) -> None:
    """Friction of another size, and a model of it that is never too high."""
    scale = log_uniform(draw, 0.05, 2.0)
    truth = scale * draw.uniform(*SHARES["friction"])
    for name in (
        "coulomb_nm",
        "breakaway_nm",
        "bristle_max_nm",
        "bristle_stiffness_nm_rad",
        "thinning_nms_rad",
    ):
        plant[name][axis] *= truth
    for name in ("coefficient", "friction_min_nm", "viscous_nms_rad"):
        model[name] *= scale
    for name in ("friction_ungated_cap_nm", "friction_floor_nm", "friction_seen_max_nm"):
        p[name][axis] *= scale
    for name in ("friction_intent_nm", "friction_gate_nm", "observer_deadband_nm"):
        p[name][axis] *= scale
    p["friction_gate_deadband_nm"][axis] *= scale
    p["friction_cap_nm"][axis] = draw.uniform(0.05, 0.3) * p["torque_limit_nm"][axis]
    p["friction_policy"][axis] = draw.choice(_POLICIES)
    p["friction_gain"][axis] = draw.uniform(0.0, 0.9)


def _factor(p: np.void, draw: np.random.Generator) -> None:
    """Three axes of ten follow a friction that changes, at paces up to reckless ones; their gain is that of
    the largest factor."""
    for axis in range(len(p["friction_raise"])):
        if draw.random() < SHARE_OF_FOLLOWERS:
            p["friction_raise"][axis] = draw.uniform(0.0, 0.1)
            p["friction_change_step"][axis] = log_uniform(draw, 1e-7, 1e-2)


def _coupling(p: np.void, axis: int, draw: np.random.Generator) -> None:
    """A coupling inside the region in which the sampled loop is passive."""
    b, period_s = float(p["viscous_nms_rad"][axis]), float(p["period_s"])
    delay = int(p["follow_delay_ticks"][axis])
    share = draw.uniform(*SHARES["margin"])
    damping = draw.uniform(0.0, 0.3) * b
    # room for a stiffness
    while stability.damping_needed_sampled_data(0.0, damping, period_s, delay) > 0.9 * b:
        damping *= 0.5
    most = stability.k_max_sampled_data(b, damping, period_s, delay)
    p["coupling_stiffness_nm_rad"][axis] = share * most
    p["coupling_damping_nms_rad"][axis] = damping
    covered = delay_covered_ticks(b, share * most, damping, period_s, delay)
    p["declared_delay_s"][axis], p["proof_delay_s"][axis] = delay * period_s, max(covered * period_s, 1e-9)


def _force_feedback(p: np.void, axis: int, draw: np.random.Generator) -> None:
    """On in half of the rigs, with gains and filters up to reckless ones; what it may spend is the truth."""
    period_s, delay = float(p["period_s"]), int(p["follow_delay_ticks"][axis])
    k_c, b_c = (float(p[name][axis]) for name in ("coupling_stiffness_nm_rad", "coupling_damping_nms_rad"))
    count = float(p["count_rad"][axis])
    p["force_feedback_gain"][axis] = log_uniform(draw, 0.2, 20.0) if draw.random() < 0.5 else 0.0
    p["force_feedback_alpha"][axis] = draw.uniform(0.01, 1.0)
    p["force_feedback_deadband_nm"][axis] = draw.uniform(0.0, 0.01)
    p["force_feedback_cap_nm"][axis] = draw.uniform(0.05, 0.3) * p["torque_limit_nm"][axis]
    p["force_feedback_share"][axis] = draw.uniform(0.5, 0.98)
    # what the coupling leaves: a feedback that spends more is told an untruth
    margin = stability.margin_sampled_data(float(p["viscous_nms_rad"][axis]), k_c, b_c, period_s, delay)
    p["force_feedback_damping_nms_rad"][axis] = max(0.0, margin)
    p["force_feedback_reserve_nm"][axis] = k_c * count / 2 + b_c * count / period_s


def _display(p: np.void, command: np.void, draw: np.random.Generator) -> None:
    """Three axes of ten show an admittance, or may be changed to one, at gains from timid to reckless,
    certified or not."""
    for axis in range(len(command["display_kind"])):
        if draw.random() >= SHARE_OF_ADMITTANCES:
            continue
        inertia, limit = float(p["inertia_kgm2"][axis]), float(p["torque_limit_nm"][axis])
        p["display_kind"][axis] = command["display_kind"][axis] = draw.integers(0, 2)
        p["display_change"][axis] = 1 if p["display_kind"][axis] == 0 else draw.integers(0, 2)
        p["mass_kgm2"][axis] = command["mass_kgm2"][axis] = inertia * log_uniform(draw, 0.1, 4.0)
        damping = log_uniform(draw, 0.01, 1.0)
        p["mass_damping_nms_rad"][axis] = command["mass_damping_nms_rad"][axis] = damping
        p["mass_max_kgm2"][axis] = p["mass_kgm2"][axis] * draw.choice([1.0, log_uniform(draw, 1.0, 10.0)])
        p["mass_damping_max_nms_rad"][axis] = damping * draw.choice([1.0, log_uniform(draw, 1.0, 10.0)])
        p["mass_compensation"][axis] = draw.random()
        p["mass_forward"][axis], p["mass_forward_alpha"][axis] = draw.random(), draw.uniform(0.05, 1.0)
        p["mass_force_alpha"][axis], p["servo_velocity_alpha"][axis] = draw.uniform(0.05, 1.0, 2)
        p["mass_force_deadband_nm"][axis] = draw.choice([0.0, 0.01 * limit])
        p["servo_velocity_gain_nms_rad"][axis] = log_uniform(draw, 0.05, 20.0)
        p["servo_position_gain_nm_rad"][axis] = draw.choice([0.0, log_uniform(draw, 0.5, 200.0)])
        p["watch_floor_nm"][axis] = 0.01 * limit
        p["force_feedback_gain"][axis] = 0.0  # refused beside it


def _device_velocity(p: np.void, plant: np.void, draw: np.random.Generator) -> None:
    """In half of the rigs a velocity sensor, late, off and noisy, that the law records, checks or uses."""
    if draw.random() < 0.5:
        return
    tolerance = draw.uniform(0.1, 0.4) * float(p["velocity_limit_rad_s"].min())
    p["device_velocity_kind"] = draw.integers(0, 3)
    p["device_tolerance_rad_s"] = tolerance
    plant["velocity_sensor"] = 1
    plant["velocity_share"] = draw.uniform(0.2, 1.0)
    plant["velocity_scale"] = draw.uniform(0.98, 1.02)
    plant["velocity_bias_rad_s"] = draw.uniform(-0.3, 0.3) * tolerance
    plant["velocity_noise_rad_s"] = draw.uniform(0.0, 0.3) * tolerance
    plant["velocity_resolution_rad_s"] = draw.choice([0.0, 0.1 * tolerance])


def _world(command: np.void, axis: int, draw: np.random.Generator, *, passive: bool) -> None:
    # an active world may put energy in: the claim that is judged would not hold
    kinds = [kind for kind in Environment if not (passive and kind.about.active)]
    command["environment_kind"][axis] = int(draw.choice([int(kind) for kind in kinds]))
    command["environment_stiffness_nm_rad"][axis] = log_uniform(draw, *STIFFNESS.tried)
    command["environment_damping_nms_rad"][axis] = draw.uniform(*DAMPING.tried)
    command["environment_center_rad"][axis] = draw.uniform(-0.2, 0.2)
    for own in OWN:
        value = draw.choice([-1, 1]) if own.sign else draw.uniform(*own.tried)
        command[f"environment_{own.name}"][axis] = value
    command["compensation"][axis] = draw.choice([0.0, 1.0, draw.uniform()])


def _hand(plant: np.void, axis: int, draw: np.random.Generator) -> None:
    """A passive hand: spring, damper, inertia; it rests, sweeps, or pushes."""
    plant["hand_kind"][axis] = int(
        draw.choice([int(kind) for kind in (Hand.NONE, Hand.REST, Hand.SINES, Hand.TRIANGLE, Hand.PUSH)])
    )
    plant["hand_stiffness_nm_rad"][axis] = log_uniform(draw, 0.1, 50.0)
    plant["hand_damping_nms_rad"][axis] = log_uniform(draw, 1e-3, 1.0)
    plant["hand_inertia_kgm2"][axis] = draw.choice([0.0, draw.uniform(0.0, 0.02)])
    plant["hand_start_s"][axis] = draw.uniform(0.5, 2.0)
    plant["hand_center_rad"][axis] = draw.uniform(-0.2, 0.2)
    plant["hand_amplitude_rad"][axis] = draw.uniform(0.05, 0.5)
    plant["hand_speed_rad_s"][axis] = log_uniform(draw, 0.01, 2.0)
    plant["hand_sine_rad"][axis] = 0.0
    plant["hand_sine_rad"][axis, :2] = draw.uniform(0.02, 0.25, 2)
    plant["hand_sine_rad_s"][axis, :2] = 2 * math.pi * np.exp(draw.uniform(math.log(0.1), math.log(5.0), 2))
    plant["grip_count"][axis] = 0


def _take_hold(p: np.void, plant: np.void) -> None:
    """Let the hands take hold of the armed rig: one that leans on the joint during the tare is taken for the
    sensor's zero."""
    samples_s = float(p["period_s"]) * max(float(plant["sample_every_ticks"]), 1.0)
    plant["grip_count"] = 1
    plant["grip_from_s"][:, 0] = ARMED_S + samples_s * max(
        float(p["tare_ticks"].max()), float(p["ready_ticks"])
    )
    plant["grip_to_s"][:, 0] = math.inf


def _value(kind: Kind, draw: np.random.Generator) -> float:
    """A value that hurts: small and large, of both signs where the kind allows."""
    size = log_uniform(draw, 1e-3, 1e3)
    return float(min(max(size * draw.choice([-1.0, 1.0]), kind.low), kind.high)) if kind.unit else 0.0


def _faults(plant: np.void, count: int, ticks: int, draw: np.random.Generator) -> list[str]:
    """Spread `count` faults over the run; returns their names, for a person."""
    # the loop's lateness is drawn tick by tick
    kinds = [kind for kind in KINDS.values() if kind.channel is not Channel.LOOP]
    names = []
    plant["fault_count"] = count
    for k in range(count):
        kind = kinds[draw.integers(len(kinds))]
        plant["fault_channel"][k], plant["fault_effect"][k] = int(kind.channel), int(kind.effect)
        plant["fault_axis"][k] = -1
        plant["fault_from_tick"][k] = draw.integers(ticks)
        plant["fault_ticks"][k] = max(1, round(log_uniform(draw, 1, 400)))
        plant["fault_every_ticks"][k] = 0
        plant["fault_probability"][k] = draw.choice([1.0, draw.uniform(0.05, 1.0)])
        plant["fault_value"][k] = _value(kind, draw)
        names.append(
            f"{kind.channel.name.lower()}.{kind.name} at {plant['fault_from_tick'][k]} for "
            f"{plant['fault_ticks'][k]}"
        )
    return names
