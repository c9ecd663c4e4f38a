"""From a validated rig file to the plain arrays the law runs on. The host does this before anything moves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hw import registry
from rtctl.check import lateness, observer_tuning, stability_report
from rtctl.check.axis_plan import ARMING_PART_S, arming_ticks, fill_arming, fill_axis, fill_force_feedback
from rtctl.check.devices_of_axis import joint_of_axis, taken_damping
from rtctl.check.lateness import STALE_LIMIT_TICKS
from rtctl.check.observer_tuning import Tuning
from rtctl.check.place_plan import fill_place
from rtctl.check.verdicts_of_admittance_steps import RESOLUTION_SHARE, moment_step_nm
from rtctl.control.braking import BRAKE_GATES
from rtctl.control.compensation_limit import ungated_cap
from rtctl.control.disturbance_observer import SMOOTHING
from rtctl.control.environments.table import PARAMETERS, Environment
from rtctl.control.gate import WINDOW_S
from rtctl.control.proofs import stability
from rtctl.control.proofs.delay_cover import delay_covered_ticks
from rtctl.control.records import HELD, new_records
from rtctl.control.resting import REST_HZ
from rtctl.control.trembling import LONGEST_S
from rtctl.control.velocity import lowpass_alpha
from rtctl.control.vocabulary import Display, Policy
from rtctl.friction import artefact
from rtctl.friction.adaptation import follows, largest_feedforward
from rtctl.friction.guarantee import guarantee, holds_flicker
from rtctl.friction.margins import most_load_nm
from rtctl.friction.model import FrictionModel
from rtctl.friction.roll_off import rolled_off
from rtctl.rig_file.axis_tables import OVERSHOOT_UNTOLD, AxisTable
from rtctl.rig_file.config import Config, LoadedConfig

SOFT_START_S = 0.5
READY_S = 0.5
STOP_TICKS, STOP_S = 50, 0.05
"""RAMP takes neither more ticks nor longer than this."""
TARGET_HOLD_TICKS, TARGET_HOLD_S = 20, 0.02
TARGET_STOP_TICKS, TARGET_STOP_S = 100, 0.1
"""Silence of a renderer is neither fewer ticks nor shorter than this: an ordinary process is not late by less
on a quicker loop."""
LATE_LIMIT_TICKS = 3
WAIVER_SHARE = 0.25
NEVER_SHORT_J = 1e6  # bank of an account that never holds anything back
SEEN_HZ = 5.0
"""Low-pass of the friction seen in sliding: longer than a gear's ripple, shorter than a stroke."""
SEEN_FACTOR = 1.5  # friction seen is believed up to so many times the learned peak
PLAIN_DELAY = 1.12  # a lag that overshoots by .05 asks for so much more than a delay as long, of 400 loops
SHORTEST_PROOF_TICKS = 1e-6  # 0 would say that delay and age are not watched

MIN_SOFT_START_TICKS = 500
"""Safety contract: authority ramps over at least 500 cycles, `ready` needs 500 green ones, RAMP takes 50."""


@dataclass(frozen=True)
class Plan:
    """What the law needs, as arrays: `params` and `command` of one row, `model` of one per axis; and what the
    model files said then (empty without one): they may say something else before the rig runs."""

    params: np.ndarray
    command: np.ndarray
    model: np.ndarray
    n_axes: int
    period_s: float
    period_ns: int
    ring_rows: int
    model_files: tuple[bytes, ...]


def build(loaded: LoadedConfig) -> Plan:
    """Fill the arrays from a rig file; reads and verifies the friction models.

    Raises
    ------
    ModelError
        A model that is missing, damaged, or made for another rig."""
    config, T = loaded.config, loaded.config.period_s
    params, _, command, model = new_records(config.n_axes)
    p = params[0]
    _fill_scalars(p, config)
    fill_force_sensor(p, config, present=any("force" in m.channels for m in loaded.members()))
    for member in loaded.members():
        # a recording's current answers another law's torque
        if "current" in member.channels and registry.lookup(member.kind).follows:
            p["follow_kind"][list(member.axes)] = 1
    lates = [lateness.of_axis(loaded, a).between for a in range(config.n_axes)]
    p["arming_ticks"] = arming_ticks(lates, T, ARMING_PART_S)
    for a, axis in enumerate(config.axis):
        joint, learned, between = joint_of_axis(loaded, a), _load_model(loaded, axis), lates[a]
        fill_axis(p, a, axis, T, joint, between)
        # what may be shown: age of samples and all of the lag count, rounded up
        p["follow_delay_ticks"][a] = min(math.ceil(stability.late_ticks(between, T)), HELD - 1)
        acting = between.delay + stability.lag_ticks(between.lag_hz, T)
        p["acting_delay_s"][a] = acting * T
        p["actuator_delay_ticks"][a] = round(acting)  # what acts; one tick more is covered
        fill_arming(p, a, axis, T, joint)
        fill_force_feedback(p, a, axis, T, between)
        _fill_command(command[0], a, axis)
        sure = guarantee(axis, learned)
        p["flicker_held"][a] = holds_flicker(axis, sure, joint.dry_share)
        p["mass_rest_rad"][a] = sure.credited_rad
        # judged and bounded at the largest factor; the law takes a share
        most, factor = largest_feedforward(axis, learned, T)
        _fill_compensation(p, a, most, config, learned, observer_tuning.of_axis(loaded, a))
        if learned is not None:
            ending = rolled_off(learned, axis, T, between, taken_damping(axis.viscous_nms_rad, joint))
            model[a] = _fill_friction(p, a, most, config, ending)
            fill_place(p, a, axis, learned)
            p["friction_raise"][a] = factor - 1.0
            if follows(axis, learned):
                p["friction_change_step"][a] = axis.friction.drift.adapt_per_min / 60 * T
    if all(registry.lookup(member.kind).follows for member in loaded.members()):
        _fill_proof(p, loaded)
    else:
        _let_go(p)
    return Plan(
        params=params,
        command=command,
        model=model,
        n_axes=config.n_axes,
        period_s=T,
        # whole ns: deadlines are sums of it and must not drift; 3 kHz is off by 1e-6
        period_ns=round(1e9 / config.loop.rate_hz),
        ring_rows=math.ceil(config.loop.ring_s * config.loop.rate_hz),
        model_files=tuple(artefact.content(path) for path in map(loaded.model_path, config.axis)),
    )


def _load_model(loaded: LoadedConfig, axis: AxisTable) -> FrictionModel | None:
    """The friction model that an axis uses, or None."""
    path = loaded.model_in_use(axis)
    if path is None:
        return None
    model = artefact.load(path)
    artefact.require_rig(model, loaded.config.rig.name, path, axis.motion)
    return model


def target_hold_ticks(rate_hz: float) -> int:
    """Age of a renderer's target that causes HOLD."""
    return max(TARGET_HOLD_TICKS, round(TARGET_HOLD_S * rate_hz))


def _fill_scalars(p: np.void, config: Config) -> None:
    rate_hz = config.loop.rate_hz
    p["period_s"] = config.period_s
    # by the contract a count of cycles, by a person a time
    p["ready_ticks"] = max(MIN_SOFT_START_TICKS, round(READY_S * rate_hz))
    p["soft_start_ticks"] = max(MIN_SOFT_START_TICKS, round(SOFT_START_S * rate_hz))
    # the least of both: below 1 kHz 50 ticks would be longer than 50 ms
    p["stop_ticks"] = min(STOP_TICKS, round(STOP_S * rate_hz))
    p["target_hold_ticks"] = target_hold_ticks(rate_hz)
    p["target_stop_ticks"] = max(TARGET_STOP_TICKS, round(TARGET_STOP_S * rate_hz))
    p["stale_limit_ticks"] = STALE_LIMIT_TICKS
    p["late_limit_ticks"] = 0 if config.may_be_late else LATE_LIMIT_TICKS
    p["waiver_share"] = _waiver_share(config)
    # the time constant is half the window (decision 0006)
    p["window_share"] = -math.expm1(-2 * config.period_s / WINDOW_S)
    p["energy_budget_j"] = config.passivity.budget_j
    p["energy_bank_j"] = config.passivity.bank_j
    p["renderer_store_j"] = config.passivity.renderer_store_j
    p["renderer_power_w"] = config.passivity.renderer_power_w


def _waiver_share(config: Config) -> float:
    """Share of the torque limit without real-time rights: all of it where nobody holds the rig."""
    if config.simulated:
        return 1.0
    return WAIVER_SHARE if config.loop.realtime in ("waive", "off") else 0.0


def fill_force_sensor(p: np.void, config: Config, *, present: bool = True) -> None:
    """Parameters of the force sensor as a whole; `present`: a device of the rig gives its force."""
    sensor, names = config.force_sensor, [axis.name for axis in config.axis]
    # a simulated rig may be told to have no sensor, though its device gives one
    p["force_used"] = p["force_answers"] = present and "force" not in config.rig.absent
    p["moment_used"] = sensor.moments
    p["moment_limit_nm"] = sensor.limit_nm
    p["off_axis_n"], p["off_axis_nm"] = sensor.off_axis_n, sensor.off_axis_nm
    p["force_step"] = (
        max(axis.force.resolution_n or RESOLUTION_SHARE * axis.force.limit_n for axis in config.axis),
        moment_step_nm(sensor),
    )
    p["chain_count"] = len(sensor.carried_by)
    p["chain_axis"][: len(sensor.carried_by)] = [names.index(name) for name in sensor.carried_by]
    p["tip_weight_n"][:3] = sensor.tip_kg * np.array(sensor.gravity_m_s2)
    p["tip_center_m"] = sensor.tip_center_m


def _let_go(p: np.void) -> None:
    """A recording answers no torque: delays are not watched, an observer has nothing to see, and nobody can
    be shaken."""
    p["force_answers"] = 0
    p["observer_gain"] = p["observer_alpha"] = p["friction_seen_alpha"] = 0.0
    p["assistance_bank_j"] = NEVER_SHORT_J  # the recorded motion was made by another law's help
    p["paying_nm"] = 0.0


def _fill_proof(p: np.void, loaded: LoadedConfig) -> None:
    """Delay up to which each coupling is proven."""
    period_s = loaded.config.period_s
    for a, axis in enumerate(loaded.config.axis):
        b, between, spring, load_loop = stability_report.bearing(loaded, a)
        coupling, age_ticks = axis.coupling, between.sample_ticks - 1
        declared = between.delay + stability.lag_ticks(between.lag_hz, period_s)
        # an admittance, and a current that is told to overshoot, are certified for what is declared
        covered = declared
        if not axis.may_show("admittance") and between.overshoot <= OVERSHOOT_UNTOLD:
            k_c = (1 + load_loop) * coupling.stiffness_nm_rad + spring
            b_c = (1 + load_loop) * coupling.damping_nms_rad
            left = b / PLAIN_DELAY if between.overshoot > 0 else b
            covered = delay_covered_ticks(left, k_c, b_c, period_s, declared, between.sample_ticks)
        p["proof_age_ticks"][a] = age_ticks
        p["declared_delay_s"][a] = declared * period_s
        # a current that is held as long as its samples seems to come later by up to their age
        p["proof_delay_s"][a] = max(covered, declared + age_ticks, SHORTEST_PROOF_TICKS) * period_s


def _fill_command(c: np.void, a: int, axis: AxisTable) -> None:
    environment = axis.environment
    c["environment_kind"][a] = Environment[environment.kind.upper()]
    for parameter in PARAMETERS:
        c[f"environment_{parameter.name}"][a] = getattr(environment, parameter.name)
    c["compensation"][a] = 1.0
    c["display_kind"][a] = Display[axis.display.upper()]
    shown = axis.admittance
    c["mass_kgm2"][a], c["mass_damping_nms_rad"][a] = shown.mass_kgm2, shown.damping_nms_rad


def _fill_compensation(
    p: np.void, a: int, axis: AxisTable, config: Config, model: FrictionModel | None, tuning: Tuning
) -> None:
    """Parameters of feed-forward, observer and account; those of the learned curve are `_fill_friction`'s."""
    friction, period_s = axis.friction, config.period_s
    policy = Policy[friction.policy.upper()]
    if policy == Policy.OFF or (model is None and policy != Policy.OBSERVER):
        return
    sure = guarantee(axis, model)
    p["friction_policy"][a] = policy
    p["friction_cap_nm"][a] = friction.cap_share * axis.torque_limit_nm
    p["friction_floor_nm"][a] = sure.floor_nm
    p["friction_sliding_doubt_nm"][a] = sure.sliding_doubt_nm
    p["friction_place_doubt_nm"][a] = sure.place_doubt_nm
    p["presliding_rad"][a] = sure.credited_rad
    p["assistance_bank_j"][a] = sure.bank_j
    p["friction_stop_rad"][a] = friction.stop_rad or sure.turn_rad(policy)
    p["rest_alpha"][a] = lowpass_alpha(REST_HZ, period_s)
    p["friction_gate_deadband_nm"][a] = sure.gate_deadband_nm
    p["friction_intent_nm"][a] = sure.intent_nm
    p["friction_gate_nm"][a] = sure.gate_nm
    p["tremble_turn_s"][a] = LONGEST_S
    p["friction_brake_nm"][a] = BRAKE_GATES * sure.gate_nm
    p["friction_gate_alpha"][a] = (
        -math.expm1(-period_s / friction.gate_lowpass_s) if friction.gate_lowpass_s else 1.0
    )
    if "force" in config.rig.absent:  # all below goes by a force
        return
    if policy in (Policy.HYBRID, Policy.OBSERVER):  # the others are baselines of the experiments
        p["paying_nm"][a] = p["friction_brake_nm"][a]
    p["observer_gain"][a] = friction.observer.gain
    p["observer_alpha"][a] = lowpass_alpha(tuning.bandwidth_hz, period_s)
    p["observer_smooth_alpha"][a] = lowpass_alpha(SMOOTHING * tuning.bandwidth_hz, period_s)
    p["observer_bandwidth_rad_s"][a] = 2 * math.pi * tuning.bandwidth_hz
    p["observer_late_ticks"][a], p["observer_excess"][a] = tuning.own_ticks, tuning.excess
    p["observer_deadband_nm"][a] = sure.observer_deadband_nm
    p["friction_seen_alpha"][a] = lowpass_alpha(SEEN_HZ, period_s)
    loaded_nm = 0.0 if model is None else most_load_nm(model, axis)
    p["friction_seen_max_nm"][a] = min(
        # no more than help could spend
        SEEN_FACTOR * (sure.peak_nm + loaded_nm),
        float(p["friction_cap_nm"][a]),
    )


def _fill_friction(p: np.void, a: int, axis: AxisTable, config: Config, model: FrictionModel) -> np.ndarray:
    """Parameters of the learned feed-forward; returns the compiled model's record."""
    friction = axis.friction
    p["friction_gain"][a] = friction.gain
    p["friction_viscous_gain"][a] = friction.viscous_gain
    p["friction_load_gain"][a] = friction.load_gain if model.load is not None else 0.0
    p["friction_ungated_cap_nm"][a] = ungated_cap(
        friction.gain, float(model.friction_min_nm.min()) - model.place_trough_nm
    )
    p["friction_tanh_rad_s"][a] = friction.tanh_rad_s
    p["friction_blend_rad_s"][a] = friction.blend_rad_s
    p["friction_deadband_rad_s"][a] = friction.deadband_rad_s
    # one up, one down
    p["friction_dither_ticks"][a] = max(2, round(config.loop.rate_hz / friction.dither_hz))
    p["friction_intent_alpha"][a] = lowpass_alpha(
        friction.intent_lowpass_at(config.loop.rate_hz), config.period_s
    )
    record: np.ndarray = model.record()[0]
    return record
