"""The torque held is bounded by what the energy account can pay for until the gate has taken it back."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from law_rig import LawRig, T

from rtctl.control import take_back
from rtctl.control.jit import records
from rtctl.control.records import new_records
from rtctl.control.take_back import cost_to_take_back, torque_to_take_back
from rtctl.control.vocabulary import Fault, GateFlag, Policy, State

BUDGET, V_MAX = 0.02, 6.0
FLOOR = -take_back.FLOOR_FACTOR * BUDGET
WAY = take_back.OVERSPEED_FACTOR * V_MAX * T


def params_of(rate, budget=BUDGET, v_max=V_MAX):
    made = records(new_records(1)[0])
    made["period_s"], made["torque_rate_nm"], made["velocity_limit_rad_s"] = T, rate, v_max
    made["energy_budget_j"] = budget
    return made[0]


def given_out(torque, rate):
    """Energy that a torque gives out tick by tick until the gate has taken it back."""
    out = 0.0
    while torque > 0.0:
        out += WAY * torque
        torque -= rate
    return out


@settings(deadline=None)
@given(st.floats(0.0, 10.0), st.floats(0.01, 3.0))
def test_the_cost_covers_every_tick_until_the_torque_is_gone(torque, rate):
    cost = cost_to_take_back(params_of(rate), 0, torque)
    assert cost >= given_out(torque, rate) * (1 - 1e-9)
    assert cost == cost_to_take_back(params_of(rate), 0, -torque)
    assert cost <= given_out(torque, rate) + 0.13 * WAY * rate


@settings(deadline=None)
@given(st.floats(0.0, 10.0), st.floats(0.01, 3.0))
def test_one_step_of_the_gate_frees_what_the_tick_may_cost(torque, rate):
    p = params_of(rate)
    left = cost_to_take_back(p, 0, max(torque - rate, 0.0))
    assert left <= cost_to_take_back(p, 0, torque) - WAY * torque * (1 - 1e-9) + 1e-12


@settings(deadline=None)
@given(st.floats(-0.03, 2.0), st.floats(0.01, 3.0))
def test_the_torque_allowed_is_the_most_that_the_account_pays_for(energy, rate):
    p = params_of(rate)
    torque = torque_to_take_back(p, 0, energy)
    assert cost_to_take_back(p, 0, torque) <= (energy - FLOOR) * (1 + 1e-9)
    more = torque + 0.01 * rate + 1e-9
    jump = 0.125 * WAY * rate  # of the cost, just above one step of the gate
    assert cost_to_take_back(p, 0, more) >= (energy - FLOOR) * (1 - 1e-6) or more * WAY <= WAY * rate + jump


@pytest.mark.parametrize("energy", [FLOOR, FLOOR - 1e-6, -math.inf, math.nan])
def test_an_account_with_nothing_left_pays_for_no_torque(energy):
    assert torque_to_take_back(params_of(0.2), 0, energy) == 0.0


@pytest.mark.parametrize("rate", [0.0, math.nan])
def test_a_gate_that_never_takes_back_pays_for_no_torque(rate):
    assert torque_to_take_back(params_of(rate), 0, 1.0) == 0.0
    assert cost_to_take_back(params_of(rate), 0, 1.0) == math.inf


@pytest.mark.parametrize("torque", [math.nan, math.inf])
def test_a_torque_that_is_not_finite_costs_more_than_any_account(torque):
    assert cost_to_take_back(params_of(0.2), 0, torque) == math.inf


def thrown(seed, rate, viscous, late=0.0, ticks=1500):
    """A hand that presses slowly and lets go as fast as a motor, so many ticks late, may drive, again and
    again; rig, least energy, bound ticks.
    """
    draw = np.random.default_rng(seed)
    rig = LawRig(
        coupling_stiffness_nm_rad=draw.uniform(20.0, 500.0),
        torque_rate_nm=rate,
        torque_limit_nm=draw.uniform(1.0, 5.0),
        viscous_nms_rad=viscous,
        friction_policy=int(draw.choice([int(Policy.OFF), int(Policy.HYBRID)])),
        velocity_limit_rad_s=V_MAX,
        acting_delay_s=late * T,
    )
    kind = str(draw.choice(["spring", "wall", "detents", "damper"]))
    rig.friction().environment(kind, environment_stiffness_nm_rad=1e4, environment_pitch_rad=0.2).arm()
    energies, bound, x, v = [], 0, 0.0, 0.0
    for k in range(ticks):
        pull = math.copysign(1.0, rig["torque_applied_nm"])
        if k % 40 == 0:
            v = -0.5 * pull
        elif k % 40 == 20:
            v = draw.uniform(0.7, 0.99) * V_MAX * pull
        x += v * T
        rig.tick(x)
        energies.append(rig["energy_port_j"])
        bound += bool(int(rig["gate_flags"]) & GateFlag.SHARE)
        if rig.mode not in (State.ACTIVE, State.STOPPING):
            break
    return rig, min(energies), bound


@pytest.mark.parametrize(
    ("rate", "viscous", "late"),
    [(0.02, 0.0, 0.0), (0.2, 0.0, 0.0), (0.2, 0.05, 0.0), (2.0, 0.0, 0.0), (0.2, 0.0, 1.6), (2.0, 0.05, 3.0)],
)
def test_no_motion_of_a_stiff_spring_behind_any_gate_takes_more_than_the_floor(rate, viscous, late):
    needed = 0
    for seed in range(6):
        rig, least, bound = thrown(seed, rate, viscous, late)
        assert least >= FLOOR * (1 + 1e-9)
        assert not rig.faults & Fault.PASSIVITY_GROSS
        needed += bound > 0
    assert needed >= 2


def test_the_bound_shows_in_the_tick_and_as_a_flag_of_the_gate():
    rig = LawRig(coupling_stiffness_nm_rad=50.0, velocity_limit_rad_s=V_MAX)
    rig.environment("spring", environment_stiffness_nm_rad=1e4, environment_center_rad=-0.1).arm()
    rig.run(100)
    assert abs(rig["torque_applied_nm"]) == pytest.approx(3.0)
    for _ in range(10):
        rig.state["energy_port_j"] = -0.026
        rig.tick()
    allowed = torque_to_take_back(rig.params[0], 0, -0.026)
    assert 0.0 < allowed < 1.0
    assert rig["torque_share"] == pytest.approx(allowed / 3.0, rel=1e-6)
    assert abs(rig["torque_applied_nm"]) == pytest.approx(allowed, rel=1e-6)
    assert int(rig["gate_flags"]) & GateFlag.SHARE


@pytest.mark.parametrize("late", [0.0, 1.0, 2.5])
def test_torques_in_flight_are_paid_for_before_the_next_one(late):
    rig = LawRig(coupling_stiffness_nm_rad=50.0, velocity_limit_rad_s=V_MAX, acting_delay_s=late * T)
    rig.environment("spring", environment_stiffness_nm_rad=1e4, environment_center_rad=-0.1).arm()
    rig.run(100)
    for _ in range(10):
        rig.state["energy_port_j"] = 0.0
        rig.tick()
    before = abs(rig["torque_applied_nm"])
    rig.state["energy_port_j"], rig.state["held_nm"] = 0.0, before
    allowed = torque_to_take_back(rig.params[0], 0, -WAY * late * before)
    assert abs(rig.tick()["torque_applied_nm"]) == pytest.approx(allowed, rel=1e-6)
    assert 0.5 < allowed < 3.0


def test_the_account_keeps_what_taking_back_costs_while_the_torque_is_held():
    rig = LawRig(coupling_stiffness_nm_rad=50.0, velocity_limit_rad_s=V_MAX)
    rig.environment("spring", environment_stiffness_nm_rad=1e4, environment_center_rad=-0.1).arm()
    rig.run(100)
    held, stored = rig["torque_applied_nm"], rig.state["stored_energy_j"][0, 0]
    assert abs(held) == pytest.approx(3.0)
    rig.state["energy_port_j"] = 9.0
    p = rig.params[0]
    kept = stored + p["energy_bank_j"] + cost_to_take_back(p, 0, held)
    assert rig.tick()["energy_port_j"] == pytest.approx(kept)
    assert cost_to_take_back(p, 0, held) > 2 * BUDGET
