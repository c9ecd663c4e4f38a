"""No stream of parameters feeds more energy than the renderer's store and power, nor jumps the torque.

Energy is counted as the motor gives it: the torque of a tick is held while the joint goes to the next sample.
What holding it costs, (k_c/2 + b_c/T) dx^2 a tick, is what the device's own damping is there for (SD-1).

The account (derived here). Torque -f_k is sent at x_k and held while the joint moves by D; at x_k + D a
parameter's step does the work W on U, then the proxy moves by pi in a solution that pays V_after - V <=
f_(k+1) pi. With s = x - p and the damper's slip d = D - pi, f = k_c s + b_c d/T:

    moved       k_c s_k D = dU_moved - k_c D^2/2
    solved      dU_solved <= f_(k+1) pi - k_c s_(k+1) pi - k_c pi^2/2 = b_c d pi/T - k_c pi^2/2
    together    f_k D + (k_c/2 + b_c/T) D^2 >= dU - W + b_c/T (d_k D + D^2 - d D + d^2)
    and         d_k D + D^2 - d D + d^2 = (d^2 - d_k^2)/2 + (D + d_k)^2/2 + (D - d)^2/2

so what the joint takes is at least -(U_0 + b_c d_0^2/(2 T)) - sum W. A remote proxy is put where it is, by
pi, and its damper follows a velocity of its own, by w a tick: d = D - w. Its motion does W_s = dU_solved on
the spring, exactly, and

    d_k D + D^2 = (d^2 - d_k^2)/2 + (D + d_k)^2/2 + d w + w^2/2  >=  (d^2 - d_k^2)/2 + d w

so that with W = W_s + W_d, W_d = -b_c d w/T, the same holds; both are paid where they are positive. The
second term belongs to the damping in the first torque: its slip d_0 holds the proxy's own motion too, for one
that starts at the joint before a spring elsewhere relaxes with b_c/k_c, 125 ticks in the example with a
broken number.
"""

import math

import numpy as np
from amounts import asked_often, some_of
from energy_account import Account, T
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rtctl.control.environments.coupling import coupling_torque
from rtctl.control.environments.laws import environment_energy
from rtctl.control.jit import compiled, records
from rtctl.control.records import new_records
from rtctl.control.vocabulary import Environment

RATE_NM = 0.05
LOCAL = [kind for kind in Environment if kind is not Environment.REMOTE]

couplings = {"k_c": st.floats(0.5, 300.0), "b_c": st.floats(0.0, 0.2)}
seeds = st.integers(0, 2**32 - 1)


def records_of(k_c, b_c, store_j, power_w, inertia=0.01, limit=3.0):
    params, state, command, _ = (records(array)[0] for array in new_records(1))
    params["period_s"], params["target_hold_ticks"] = T, 20
    params["coupling_stiffness_nm_rad"][0], params["coupling_damping_nms_rad"][0] = k_c, b_c
    params["torque_rate_nm"][0], params["velocity_limit_rad_s"][0] = RATE_NM, 6.0
    params["inertia_kgm2"][0], params["torque_limit_nm"][0] = inertia, limit
    params["renderer_store_j"], params["renderer_power_w"] = store_j, power_w
    return params, state, command


def jump(command, rng, kinds):
    """Any environment, far away or near, soft or as stiff as the bounds of the protocol let it be."""
    command["environment_kind"][0] = int(rng.choice([int(kind) for kind in kinds]))
    command["environment_stiffness_nm_rad"][0] = rng.choice([0.0, 10.0 ** rng.uniform(-1, 6)])
    command["environment_damping_nms_rad"][0] = rng.choice([0.0, rng.uniform(0, 10)])
    command["environment_center_rad"][0] = rng.uniform(-1, 1) * rng.choice([0.01, 1.0])
    command["environment_side"][0] = rng.choice([-1, 1])
    command["environment_pitch_rad"][0] = rng.uniform(0.01, 0.5)


def stored(params, state):
    stretch = state["position_rad"][0] - state["proxy_position_rad"][0]
    spring = 0.5 * params["coupling_stiffness_nm_rad"][0] * stretch**2
    return environment_energy(state, 0, state["proxy_position_rad"][0]) + spring


def damper_torque(params, state, torque):
    """What the coupling's damper has of the torque."""
    stretch = state["position_rad"][0] - state["proxy_position_rad"][0]
    return torque + params["coupling_stiffness_nm_rad"][0] * stretch


def start(params, state, command, rng):
    """Another environment in force at once, as at an arm."""
    jump(command, rng, LOCAL)
    coupling_torque(state, params, command, 0, 1, 0.0, True)


@asked_often
@settings(max_examples=some_of(200), deadline=None)
@given(
    **couplings,
    store_j=st.sampled_from([0.0, 1e-3, 0.1, 10.0]),
    power_w=st.sampled_from([0.0, 0.1, 1.0, 20.0]),
    limit=st.sampled_from([math.inf, 3.0, 0.3]),
    every=st.integers(1, 60),
    broken=st.sampled_from([0.0, 0.05]),
    reach=st.floats(1e-6, 0.02),
    turn=st.floats(0.0, 0.99),
    seed=seeds,
)
@example(
    k_c=60.0,
    b_c=0.01,
    store_j=0.0,
    power_w=0.0,
    limit=0.3,
    every=17,
    broken=0.0,
    reach=1e-3,
    turn=0.9,
    seed=1,
)
@example(
    k_c=1.0,
    b_c=0.125,
    store_j=0.1,
    power_w=0.0,
    limit=math.inf,
    every=1,
    broken=0.05,
    reach=0.00390625,
    turn=0.0,
    seed=438796,
)
def test_no_stream_of_parameters_feeds_more_than_the_store_and_the_power(
    k_c, b_c, store_j, power_w, limit, every, broken, reach, turn, seed
):
    params, state, command = records_of(k_c, b_c, store_j, power_w, limit=min(limit, 3.0))
    rng = np.random.default_rng(seed)
    account, step, torque = Account(params, limit), 0.0, math.nan
    start(params, state, command, rng)
    for k in range(400):
        if k % every == 0:
            jump(command, rng, LOCAL)
            spoil(command, rng, broken)
        step = turn * step + (1 - turn) * reach * rng.uniform(-1, 1)
        state["position_before_rad"][0] = state["position_rad"][0]
        state["position_rad"][0] += step
        state["velocity_rad_s"][0] = step / T
        before, torque = torque, coupling_torque(state, params, command, 0, 1, step / T, False)
        if math.isnan(torque):  # the law cuts; somebody arms again
            start(params, state, command, rng)
        elif math.isnan(before):
            account.begin(stored(params, state), damper_torque(params, state, torque))
        else:
            account.held(before, step)
            account.check(state["renderer_grant_j"][0])


def spoil(command, rng, share):
    """Break one of the numbers now and then."""
    if rng.random() < share:
        name = rng.choice(["stiffness_nm_rad", "damping_nms_rad", "center_rad", "pitch_rad"])
        command[f"environment_{name}"][0] = rng.choice([math.nan, math.inf, -math.inf])


@asked_often
@settings(max_examples=some_of(50), deadline=None)
@given(**couplings, inertia=st.floats(5e-3, 0.1), every=st.integers(1, 60), seed=seeds)
def test_no_stream_of_parameters_throws_a_joint_faster_than_the_gate_lets_its_torque_follow(
    k_c, b_c, inertia, every, seed
):
    """Nothing holds the joint, nothing brakes it, its store never ends: torque changes stay within the
    rate.
    """
    params, state, command = records_of(k_c, b_c, 1e3, 1e6, inertia=inertia)
    rng = np.random.default_rng(seed)
    command["environment_kind"][0] = int(Environment.FREE)
    coupling_torque(state, params, command, 0, 1, 0.0, True)
    speed = 0.0
    for k in range(800):
        if k % every == 0:
            jump(command, rng, [Environment.FREE, Environment.SPRING, Environment.WALL])
            command["environment_damping_nms_rad"][0] = 0.0
        torque = coupling_torque(state, params, command, 0, 1, speed, False)
        stiffness = state["world_stiffness_nm_rad"][0]
        series = k_c * stiffness / (k_c + stiffness)
        # exact energy of the sampled spring needs its damping k_c T/2 (SD-1): the joint's own
        torque = min(max(torque, -3.0), 3.0)
        speed += (torque - (0.5 * k_c * T + b_c) * speed) / inertia * T
        assert abs(series * speed * T) <= RATE_NM * (1 + 1e-6)
        state["position_before_rad"][0] = state["position_rad"][0]
        state["position_rad"][0] += speed * T
        state["velocity_rad_s"][0] = speed


@asked_often
@settings(max_examples=some_of(100), deadline=None)
@given(k_c=couplings["k_c"], every=st.integers(1, 60), seed=seeds)
def test_no_stream_of_parameters_jumps_the_torque_on_a_joint_at_rest(k_c, every, seed):
    params, state, command = records_of(k_c, 0.0, 0.1, 1.0)
    rng = np.random.default_rng(seed)
    kinds = [Environment.FREE, Environment.SPRING, Environment.WALL]
    state["position_rad"][0] = state["position_before_rad"][0] = rng.uniform(-0.1, 0.1)
    jump(command, rng, kinds)
    command["environment_damping_nms_rad"][0] = 0.0
    command["environment_center_rad"][0] = state["position_rad"][0]
    coupling_torque(state, params, command, 0, 1, 0.0, True)
    before = 0.0
    for k in range(400):
        if k % every == 0:
            jump(command, rng, kinds)
            command["environment_damping_nms_rad"][0] = 0.0
        torque = coupling_torque(state, params, command, 0, 1, 0.0, False)
        assert abs(torque - before) <= RATE_NM * (1 + 1e-6)
        before = torque


@compiled
def at_rest(state, params, command, ticks):
    for _ in range(ticks):
        coupling_torque(state, params, command, 0, 1, 0.0, False)


@settings(max_examples=20, deadline=None)
@given(**couplings, seed=seeds)
def test_what_is_commanded_is_reached_and_then_is_in_force_to_the_last_bit(k_c, b_c, seed):
    params, state, command = records_of(k_c, b_c, 1e6, 1.0, inertia=1e6, limit=1e6)
    params["torque_rate_nm"][0] = 1.0
    rng = np.random.default_rng(seed)
    jump(command, rng, LOCAL)
    coupling_torque(state, params, command, 0, 1, 0.0, True)
    jump(command, rng, LOCAL)
    command["environment_center_rad"][0] = rng.uniform(-0.05, 0.05)
    at_rest(state, params, command, 4000)
    names = ("kind", "stiffness_nm_rad", "damping_nms_rad", "center_rad")
    assert [state[f"world_{name}"][0] for name in names] == [
        command[f"environment_{name}"][0] for name in names
    ]


def aimed(strategy, k, x, step, rng):
    """Position and velocity of a target that is random, in resonance, or always ahead of the motion."""
    ahead = math.copysign(1.0, step)
    if strategy == "random":
        return rng.uniform(-0.5, 0.5), rng.choice([0.0, rng.uniform(-20, 20), 1e6])
    if strategy == "swing":
        return 0.4 * math.sin(12.0 * k * T), 4.8 * math.cos(12.0 * k * T)
    if strategy == "lead":
        return x + 0.1 * step / T, step / T
    return x + 0.2 * ahead, 6.0 * ahead


@asked_often
@settings(max_examples=some_of(200), deadline=None)
@given(
    **couplings,
    store_j=st.sampled_from([0.0, 1e-3, 0.1, 10.0]),
    power_w=st.sampled_from([0.0, 0.1, 1.0, 20.0]),
    strategy=st.sampled_from(["random", "swing", "lead", "push"]),
    every=st.integers(1, 60),
    reach=st.floats(1e-6, 0.02),
    turn=st.floats(0.0, 0.99),
    seed=seeds,
)
def test_no_stream_of_targets_feeds_more_than_the_store_and_the_power(
    k_c, b_c, store_j, power_w, strategy, every, reach, turn, seed
):
    """The joint goes anywhere: what a hand and a device could do is among it."""
    params, state, command = records_of(k_c, b_c, store_j, power_w, limit=1e3)
    rng = np.random.default_rng(seed)
    command["environment_kind"][0] = int(Environment.REMOTE)
    coupling_torque(state, params, command, 0, 1, 0.0, True)
    account, step, torque = Account(params, math.inf), 0.0, 0.0
    for k in range(400):
        state["target_age_ticks"] += 1
        if k % every == 0:
            x = state["position_rad"][0]
            state["target_age_ticks"] = 0
            state["target_position_rad"][0], state["target_velocity_rad_s"][0] = aimed(
                strategy, k, x, step, rng
            )
        step = turn * step + (1 - turn) * reach * rng.uniform(-1, 1)
        state["position_before_rad"][0] = state["position_rad"][0]
        state["position_rad"][0] += step
        proxy = state["proxy_position_rad"][0]
        account.held(torque, step)
        torque = coupling_torque(state, params, command, 0, 1, step / T, False)
        assert abs(state["proxy_position_rad"][0] - proxy) <= 6.0 * T * (1 + 1e-12)
        account.check(state["renderer_grant_j"][0])
