"""The account of the compensation: what it puts in against what friction surely takes out."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from law_rig import LEVER, B, LawRig, T

from rtctl.control.assistance import CREEP_RAD_S, VISCOUS_SHARE, assistance_share, keep_assistance
from rtctl.control.dry_friction import credit_friction
from rtctl.control.jit import compiled
from rtctl.control.records import HELD
from rtctl.control.vocabulary import Policy, State

F, LENGTH, BANK = 0.25, 1e-3, 2e-4


def made(delay=0, **params):
    """A rig with a flat curve of `F`, armed accounts and nothing sent so far."""
    values = {
        "presliding_rad": LENGTH,
        "assistance_bank_j": BANK,
        "viscous_nms_rad": 0.0,
        "actuator_delay_ticks": delay,
    }
    rig = LawRig(**{**values, **params}).friction(stribeck=F, coulomb=F)
    keep_assistance(rig.state[0], rig.params[0], 0, 0.0, 1, 0.0, False)
    return rig


@compiled
def _period(state, params, model, dx, wanted, v):
    s, p = state[0], params[0]
    credit_friction(s, p, model[0], 0, dx, 1, v)
    keep_assistance(s, p, 0, dx, 1, v, True)
    share = assistance_share(s, p, 0)
    s.compensation_nm[0, s.ticks % HELD] = share * wanted
    s.ticks += 1
    return share


def period(rig, dx, wanted, velocity=None):
    """One tick: the last period's motion into the accounts, then what is wanted is sent, as far as they
    allow.
    """
    v = dx / T if velocity is None else velocity
    return float(_period(rig.state, rig.params, rig.model, dx, wanted, v))


def energies(rig):
    return rig.state["assistance_energy_j"][0, 0]


def test_it_is_full_while_no_torque_leaves_and_full_is_all_of_it():
    rig = made()
    assert energies(rig) == pytest.approx([BANK, BANK])
    rig.state["assistance_energy_j"] = -1.0
    keep_assistance(rig.state[0], rig.params[0], 0, 1e-3, 1, 1.0, False)
    assert energies(rig) == pytest.approx([BANK, BANK])
    assert assistance_share(rig.state[0], rig.params[0], 0) == 1.0


@pytest.mark.parametrize(
    ("energy", "share"), [(1.0, 1.0), (0.0, 1.0), (-0.5, 0.5), (-1.0, 0.0), (-7.0, 0.0), (math.nan, 0.0)]
)
def test_the_share_falls_over_one_bank_of_deficit_and_the_emptier_account_counts(energy, share):
    rig = made()
    for k in range(2):
        rig.state["assistance_energy_j"] = 0.5 * BANK
        rig.state["assistance_energy_j"][0, 0, k] = energy * BANK
        given = assistance_share(rig.state[0], rig.params[0], 0)
        assert given == pytest.approx(share) or (math.isnan(energy) and k == 1 and given == 1.0)
    rig.state["assistance_energy_j"] = math.nan
    assert assistance_share(rig.state[0], rig.params[0], 0) == 0.0
    rig.params["assistance_bank_j"] = 0.0
    rig.state["assistance_energy_j"] = 0.0
    assert assistance_share(rig.state[0], rig.params[0], 0) == 1.0
    rig.state["assistance_energy_j"] = -1e-9
    assert assistance_share(rig.state[0], rig.params[0], 0) == 0.0


@pytest.mark.parametrize("speed", [0.05, -1.0])
def test_in_sliding_a_compensation_below_the_friction_is_given_in_full(speed):
    rig = made()
    shares = [period(rig, speed * T, math.copysign(0.95 * F, speed)) for _ in range(2000)]
    assert min(shares[100:]) == 1.0
    assert energies(rig) == pytest.approx([BANK, BANK])


def test_in_sliding_viscous_damping_pays_too():
    rig = made(viscous_nms_rad=B)
    rig.state["bristle_share"], rig.state["assistance_energy_j"] = 1.0, -BANK
    period(rig, 1e-4, 0.0)
    assert energies(rig) == pytest.approx(-BANK + F * 1e-4 + VISCOUS_SHARE * B * 1e-8 / T)
    rig.state["bristle_share"], rig.state["assistance_energy_j"] = 0.0, -BANK
    period(rig, 1e-5, 0.0, velocity=1.0)
    assert energies(rig) == pytest.approx([-BANK + F * 5e-3 * 1e-5] * 2, abs=1e-11), (
        "not what bristles bend by"
    )


def test_a_vibration_within_the_bristles_empties_it_and_the_compensation_goes():
    rig = made()
    shares, place = [], 0.0
    for k in range(3000):
        now = 0.8 * LENGTH * math.sin(2 * math.pi * 20 * k * T)
        moving = math.copysign(1.0, math.cos(2 * math.pi * 20 * k * T))
        shares.append(period(rig, now - place, 0.9 * F * moving))
        place = now
    assert shares[0] == 1.0
    assert max(shares[1000:]) < 0.05


def test_creep_only_spends_and_a_stroke_fills():
    rig = made()
    rig.state["assistance_energy_j"] = -2 * BANK
    rig.state["bristle_share"] = 1.0
    for _ in range(500):
        assert period(rig, 0.9 * CREEP_RAD_S * T, 0.0) == 0.0
    assert energies(rig) == pytest.approx([-2 * BANK] * 2)
    rig.state["compensation_nm"] = 0.1
    period(rig, 0.5 * CREEP_RAD_S * T, 0.0, velocity=math.nan)
    assert energies(rig) == pytest.approx([-2 * BANK] * 2), (
        "friction pays for what is spent in creep, and no more"
    )
    rig.state["compensation_nm"] = 0.4
    period(rig, 0.5 * CREEP_RAD_S * T, 0.0)
    assert energies(rig) == pytest.approx([-2 * BANK - 0.15 * 0.5 * CREEP_RAD_S * T] * 2)
    rig.state["compensation_nm"] = 0.0
    assert [period(rig, 2 * CREEP_RAD_S * T, 0.0) for _ in range(200)][-1] == 1.0


@pytest.mark.parametrize("delay", [0, 2, 5])
def test_torque_is_charged_to_the_motion_it_acted_on_and_to_the_next(delay):
    rig = made(delay=delay, presliding_rad=1e9)
    now = int(rig.state["ticks"][0])
    for age, charged in ((delay, (0.0, 1.0)), (delay + 1, (1.0, 0.0)), (delay + 2, (1.0, 1.0))):
        rig.state["compensation_nm"] = 0.0
        rig.state["compensation_nm"][0, 0, (now - 1 - age) % HELD] = 0.4
        rig.state["assistance_energy_j"] = 0.0
        keep_assistance(rig.state[0], rig.params[0], 0, 1e-4, 1, 1.0, True)
        expected = [0.0 if free else -0.4 * 1e-4 for free in charged]
        assert energies(rig) == pytest.approx(expected, abs=1e-12)


def test_a_missed_sample_moves_neither_account():
    rig = made()
    rig.state["assistance_energy_j"], rig.state["compensation_nm"] = 1e-5, 0.3
    keep_assistance(rig.state[0], rig.params[0], 0, 0.0, 0, 0.5, True)
    assert energies(rig) == pytest.approx([1e-5, 1e-5])


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    delay=st.integers(0, 4),
    later=st.integers(0, 1),
    speed=st.floats(0.02, 3.0),
    follows=st.floats(-1.0, 1.0),
    hold=st.integers(1, 60),
)
def test_over_any_time_it_gives_out_no_more_than_friction_took_two_banks_and_a_bent_bristle(
    seed, delay, later, speed, follows, hold
):
    rig, rng, cap = made(delay=delay), np.random.default_rng(seed), 1.0
    sent, spent, least, worst = [0.0] * (delay + later + 1), 0.0, 0.0, 0.0
    friction_j, motion, wanted, fastest = 0.0, 0.0, 0.0, 0.0
    for k in range(600):
        if k % hold == 0:
            motion = speed * T * rng.normal() * rng.choice([1.0, 0.1])
            wanted = cap * (math.copysign(1.0, motion) if rng.random() < follows else rng.uniform(-1, 1))
        fastest = max(fastest, abs(motion))
        acted = sent[-1 - delay - later]
        share = period(rig, motion, wanted)
        friction_j += float(rig.state["friction_credit_j"][0, 0])
        spent += acted * motion
        sent.append(share * wanted)
        beyond = spent - friction_j
        least = min(least, beyond)
        worst = max(worst, beyond - least)
    assert worst <= 2 * BANK + 0.5 * F * LENGTH + (delay + 2) * cap * fastest + 1e-12


def active(policy=Policy.SIGN, **params):
    rig = LawRig(friction_policy=int(policy), friction_ungated_cap_nm=0.9, **params).friction().arm()
    rig.params["presliding_rad"] = LENGTH
    return rig


def test_the_law_sends_the_share_of_feed_forward_and_observer_alike_and_charges_what_it_sent():
    rig = active(observer_gain=0.5, observer_alpha=1.0, observer_smooth_alpha=1.0, friction_gain=0.5)
    rig.params["assistance_bank_j"] = BANK
    rig.force_n[1] = 0.58 / LEVER
    for _ in range(100):
        rig.state["assistance_energy_j"] = BANK
        rig.tick(rig.position[0] + 0.5 * T)
    full = {name: rig[name] for name in ("feedforward_torque_nm", "observer_torque_nm")}
    assert rig["assistance_share"] == 1.0
    assert min(full.values()) > 0.02
    rig.state["assistance_energy_j"] = -0.5 * BANK - 1e-6
    # friction pays for exactly that: share .5
    rig.state["compensation_nm"] = 0.35 + 0.1 * math.exp(-25) - 0.1
    rig.tick(rig.position[0] + 0.5 * T)
    share = rig["assistance_share"]
    assert 0.3 < share < 0.7
    assert rig["feedforward_torque_nm"] == pytest.approx(share * full["feedforward_torque_nm"], rel=1e-2)
    assert rig["observer_torque_nm"] == pytest.approx(share * full["observer_torque_nm"], rel=0.2)
    at = (int(rig.state["ticks"][0]) - 1) % HELD
    charged = float(rig.state["compensation_nm"][0, 0, at])
    assert charged == pytest.approx(rig["feedforward_torque_nm"] + rig["observer_torque_nm"])


def test_out_of_power_the_account_is_full_again():
    rig = active()
    rig.params["assistance_bank_j"] = BANK
    rig.state["assistance_energy_j"] = -1.0
    assert rig.tick()["assistance_share"] == 0.0
    rig.request("stop_count")
    rig.run(60)
    assert rig.mode is not State.ACTIVE
    assert rig["assistance_share"] == 1.0
