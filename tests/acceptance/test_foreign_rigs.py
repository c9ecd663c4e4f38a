"""Whole rigs of another make (`tests/foreign_rig.py`) that `rtctl check` lets pass: no hand is shaken, none
is given more than is promised, no fault without a cause.

Beside `test_foreign_joints.py`: linear axes, several axes, slow devices and slow force sensors, models that
are wrong, hands that grip and tap, renderers that want the hand's energy, and an admittance display in hands
of its box.
"""

import math

import numpy as np
import pytest
from amounts import asked_often, seeds_of
from foreign_files import DIRECTIONS, certified, fitted, model, rig_file
from foreign_foes import PUSH
from foreign_luck import Luck, device, hand, joint, on_rail
from foreign_rig import DEVICE, HAND, JOINT, Rig, axis

from rtctl.control.vocabulary import Environment, Fault, State

pytestmark = pytest.mark.compiled

QUIET_RAD_S = 0.002
FED_J = 1e-3
CALMER = 0.8
"""What moves so much less than 2.5 s before comes to rest."""
ALLOWED = {0: "none", int(Fault.OVERSPEED): "a hand that swings a joint in resonance"}


def told(luck, own, i, lag_hz, length, linear):
    """What the rig file says of it; a coupling that `fitted` makes as stiff as may be."""
    limit = luck.within(5.0, 10.0) * own["breakaway"]
    says = {
        "inertia_kgm2": own["motor"] + own["link"], "viscous_nms_rad": own["viscous"],
        "torque_limit_nm": limit, "torque_rate_nm_s": 100 * limit, "velocity_limit_rad_s": 6.0 * length,
        "current_limit_a": 5 * limit / (15.0 if linear else 0.77), "drive": {"current_loop_hz": lag_hz},
        "coupling": {"delay_ticks": 0.0, "damping_nms_rad": own["viscous"] * luck.within(0.0, 0.6),
            "stiffness_nm_rad": 1e-3},
        "force": {"limit_n": 1e4, "resolution_n": 0.005},
        "encoder_counts_per_rev": luck.one(2e4, 1e5) if linear else luck.one(1.6e5, 1e6), "friction": {
            "policy": luck.one("hybrid", "hybrid", "observer"), "gain": luck.one(0.8, 0.9),
            "intent_nm": 0.2 * own["coulomb"], "gate_nm": 0.1 * own["coulomb"],
            "presliding_rad": own["breakaway"] / own["bristle"],
        },
        "environment": {
            "kind": luck.one("free", "spring", "wall", "detents"),
            "stiffness_nm_rad": min(luck.spread(1, 1e5) / length**2, 1e6),
            "center_rad": 0.05 * length * luck.within(-1, 1), "pitch_rad": max(0.1 * length, 1e-3),
        },
    }  # fmt: skip
    return says if linear else says | {"lever_m": [0.1 * one for one in DIRECTIONS[i]]}


def drawn(seed, folder):
    """A rig on its axes and the lengths that a radian of each is; None where `check` refuses it."""
    luck = Luck(seed)
    linear, number = luck.one(True, False), luck.one(1, 1, 2, 2)
    number = 1 if linear else number
    length = luck.spread(0.03, 0.3) if linear else 1.0
    sample_ticks, delay = luck.one(1, 1, 2, 3), luck.one(0.0, 1.0, luck.within(0.0, 2.5))
    lag_hz = luck.one(0.0, luck.spread(80, 3000))
    base, name, motion = (
        ("mock-linear.toml", "slide", "linear") if linear else ("mock.toml", "mock", "rotary")
    )
    rows, axes, models = [], [], []
    for i in range(number):
        own, holder = on_rail(joint(luck), length), on_rail(hand(luck), length)
        rows.append(axis(**own, **holder, **device(luck, delay, lag_hz)))
        axes.append(told(luck, own, i, lag_hz, length, linear))
        models.append(model(own, name, motion, luck.one(1.0, 1.0, 1.2, 0.8)))
    timing = {"timing": {"sample_every_ticks": sample_ticks, "transport_delay_ticks": delay}}
    # or it is not ready before the hand moves
    rate_hz = luck.one(1000.0, 2000.0, 4000.0, 500.0 if sample_ticks < 3 else 1000.0)
    loaded = fitted(
        base, axes, folder, luck.one(0.5, 0.9, 0.995), models=models, device=timing, rate_hz=rate_hz
    )
    return None if loaded is None else (Rig(loaded, rows, sample_ticks, seed=seed), length)


def rms(speeds):
    return np.sqrt(np.mean(np.square(speeds), axis=0))


@asked_often
def test_certified_rigs_of_another_make_rest_in_every_hand(tmp_path):
    certified_rigs, seeds = 0, seeds_of(80)
    for seed in seeds:
        made = drawn(seed, tmp_path)
        if made is None:
            continue
        certified_rigs += 1
        rig, length = made
        speeds, given, states = rig.run(15.0)
        window = round(2.5 / rig.period_s)
        last, before = rms(speeds[-window:]) / length, rms(speeds[-2 * window : -window]) / length
        rests = (last <= QUIET_RAD_S) | (last < CALMER * before)
        fault = int(rig.law[1]["fault_first"][0])
        assert (0 if fault < 0 else 1 << fault) in ALLOWED, (seed, Fault(1 << max(fault, 0)))
        assert rests.all(), (seed, last, before)
        fed = given[-1] - given[round(9.2 / rig.period_s)]
        assert ((fed <= FED_J) | (last < CALMER * before)).all(), (seed, fed)
        assert (states == State.ACTIVE).any(), seed
    assert certified_rigs > len(seeds) // 2


def foes(luck, length):
    """A renderer, whatever it sends."""
    return {
        "foe": luck.one(*range(1, 9)), "reach": luck.spread(2e-3, 1.0) * length, "rate": luck.spread(2, 60),
        "follow": luck.one(0.0, 1.0, luck.within(-2, 2)), "push": luck.spread(1, 1e5) / length**2,
        "every": luck.one(1, 1, 5, 17), "silent": luck.one(0, 0, 22, 60, 150),
        "between": luck.one(300, 700, 1500), "moods": 1,
    }  # fmt: skip


def beyond_promise(rig, states, given):
    """J, most that the hand was given beyond store (an arming's) and power (docs/theory.md 4.5), by axis."""
    p = rig.law[2][0]
    first = int(np.argmax(states == State.ACTIVE))
    now = states[first:]
    armings = 1 + np.cumsum((now[1:] == State.ACTIVE) & (now[:-1] == State.ARMING))
    allowed = p["renderer_store_j"] * armings + p["renderer_power_w"] * rig.period_s * np.arange(1, len(now))
    return np.max(given[first + 1 :] - given[first] - allowed[:, None], axis=0)


def pursued(seed, folder, store_j, power_w, **foe):
    """A soft hand that holds still on an elastic joint of load friction; a renderer after its energy."""
    luck = Luck(1000, seed)
    own = joint(luck)
    holder = dict(
        HAND,
        spring=luck.spread(0.3, 100),
        damper=luck.spread(1e-3, 0.5),
        mass=luck.one(0.0, luck.spread(1e-3, 0.05)),
        amplitude=0.0,
    )
    loaded = fitted(
        "mock.toml", [told(luck, own, 0, 0.0, 1.0, linear=False)], folder, 0.9, models=[model(own)]
    )
    if loaded is None:
        return None
    rig = Rig(loaded, [axis(**own, **holder, **device(luck, 0.0, 0.0), **(foes(luck, 1.0) | foe))], seed=seed)
    rig.law[2]["renderer_store_j"], rig.law[2]["renderer_power_w"], rig.rearms = store_j, power_w, True
    rig.law[3]["environment_kind"] = int(Environment.REMOTE) if rig.axes["foe"][0] <= PUSH else 0
    return rig, *rig.run(8.0)[1:]


@asked_often
def test_no_renderer_gives_a_hand_more_than_is_promised(tmp_path):
    asked, seeds = 0, seeds_of(40)
    for seed in seeds:
        found = pursued(seed, tmp_path, 0.02, 0.05)
        if found is None:
            continue
        asked += 1
        rig, given, states = found
        assert beyond_promise(rig, states, given)[0] <= 1.5 * rig.law[2]["energy_budget_j"][0], seed
    assert asked > len(seeds) // 2


def test_the_meter_sees_what_a_renderer_with_a_full_purse_gives(tmp_path):
    rig, given, states = pursued(0, tmp_path, 5.0, 10.0, foe=PUSH, reach=0.3, silent=0, every=1)
    rig.law[2]["renderer_store_j"], rig.law[2]["renderer_power_w"] = 0.02, 0.05
    assert beyond_promise(rig, states, given)[0] > 0.1


def leaning(**sensor):
    """A carriage of load friction; a hand swings it, then leans on a wall: its force stays, to the bit."""
    own = dict(
        JOINT, motor=0.5448, viscous=1.53, coulomb=0.4987, breakaway=0.628, stribeck=0.0612, bristle=1279.0,
        exponent=0.6, backward=0.965, load_motor=0.2915, load_hand=0.2671,
    )  # fmt: skip
    holder = dict(HAND, spring=2106.7, damper=5.95, stiffening=688.8, amplitude=0.01608, hz=1.0, to_s=3.659)
    says = {
        "inertia_kgm2": 0.5448, "viscous_nms_rad": 1.53, "torque_limit_nm": 3.2, "torque_rate_nm_s": 320.0,
        "velocity_limit_rad_s": 1.25, "current_limit_a": 1.06, "force": {"limit_n": 192.0},
        "encoder_counts_per_rev": 20000.0,
        "coupling": {"delay_ticks": 0.0, "damping_nms_rad": 0.5476, "stiffness_nm_rad": 1.0},
        "friction": {"gain": 0.9, "intent_nm": 0.1, "gate_nm": 0.05, "blend_rad_s": 0.0167,
            "presliding_rad": 4.91e-4},
        "environment": {"kind": "wall", "stiffness_nm_rad": 110839.0, "center_rad": 0.00168},
    }  # fmt: skip
    return own, holder, says, dict(DEVICE, delay_ticks=1.0, force_step=0.005, force_delay_s=0.00515, **sensor)


def test_a_quiet_sensor_under_a_hand_that_leans_on_a_wall_is_not_called_frozen(tmp_path):
    own, holder, says, sensor = leaning()
    timing = {"timing": {"sample_every_ticks": 1, "transport_delay_ticks": 1.0}}
    loaded = fitted("mock-linear.toml", [says], tmp_path, 0.995, models=[model(own, "slide", "linear")],
        device=timing, rate_hz=2000.0)  # fmt: skip
    rig = Rig(loaded, [axis(**own, **holder, **sensor)])
    states = rig.run(9.0)[2]
    assert states[-1] == State.ACTIVE, Fault(1 << int(rig.law[1]["fault_first"][0]))


@pytest.mark.parametrize("noise_a", [0.0, 0.002])
@pytest.mark.parametrize("lag_ticks", [0.9, 1.4, 2.1, 2.7, 3.9])
def test_a_current_loop_just_as_slow_as_declared_is_armed(tmp_path, lag_ticks, noise_a):
    """The row of lags that were tried, a quarter apart, let 2.7 ticks look like 2.84."""
    lag_hz = 2000.0 / (2 * math.pi * lag_ticks)
    says = {
        "drive": {"current_loop_hz": lag_hz},
        "coupling": {"stiffness_nm_rad": 0.5, "damping_nms_rad": 0.0},
    }
    loaded = rig_file("mock.toml", [says], tmp_path, rate_hz=2000.0)
    assert certified(loaded)
    rig = Rig(loaded, [axis(lag_s=1 / (2 * math.pi * lag_hz), current_noise=noise_a, amplitude=0.0)])
    rig.run(1.3)
    assert int(rig.law[1]["fault_first"][0]) < 0
    told_ticks = float(rig.law[0]["arming_delay_ticks"][0, 0])
    assert lag_ticks - 0.35 <= told_ticks <= lag_ticks + 0.05


@asked_often
def test_an_admittance_of_another_make_rests_in_the_hands_of_its_box(tmp_path):
    """All but worlds that are not linear is proved: in detents hands swung on, at up to .2 rad/s."""
    heavy = {"mass_kgm2": 0.03, "damping_nms_rad": 0.6, "mass_max_kgm2": 0.0, "damping_max_nms_rad": 0.0}
    loaded = rig_file("admittance.toml", [{"admittance": heavy}], tmp_path)
    box = loaded.config.axis[0].admittance
    for seed in seeds_of(40):
        luck = Luck(2000, seed)
        dry, spring = (
            luck.spread(0.1, 0.4),
            box.hand_stiffness_nm_rad * luck.one(1.0, luck.within(0.05, 1.0) ** 2),
        )
        own = dict(JOINT, coulomb=dry, breakaway=dry * luck.within(1.02, 1.6),
            stribeck=luck.spread(0.03, 0.3), bristle=4 * dry * luck.spread(100, 2000),
            exponent=luck.one(0.6, 1.0, 1.5))  # fmt: skip
        holder = dict(HAND, spring=spring, damper=luck.one(0.0, 1e-3, 0.1),
            mass=box.hand_inertia_kgm2 * luck.one(0.0, 1.0, luck.within(0, 1)), amplitude=0.5 / spring,
            hz=1.0, to_s=3.5)  # fmt: skip
        rig = Rig(loaded, [axis(**own, **holder,
            **dict(DEVICE, current_noise=0.005, force_noise=0.005, force_step=0.005))],
            seed=seed)  # fmt: skip
        world = luck.one(Environment.FREE, Environment.SPRING, Environment.WALL, Environment.DAMPER)
        rig.law[3]["environment_kind"], rig.law[3]["environment_stiffness_nm_rad"] = (
            int(world),
            luck.spread(1, 1e4),
        )
        rig.law[3]["environment_center_rad"] = 0.02 * luck.within(-1, 1)
        speeds, _, states = rig.run(10.0)
        window = round(2.5 / rig.period_s)
        last, before = rms(speeds[-window:])[0], rms(speeds[-2 * window : -window])[0]
        assert states[-1] == State.ACTIVE, seed
        assert last <= QUIET_RAD_S or last < CALMER * before, (seed, world, last, before)
