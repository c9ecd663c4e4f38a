"""The credit of dry friction: a stop operator, and a lower bound of what bristles of every kind have taken
out.
"""

import math

import numpy as np
import pytest
from law_rig import LawRig, T

from rtctl.control.dry_friction import SEEN_SHARE, credit_friction, guaranteed_friction, seen_friction
from rtctl.control.jit import compiled

F, LENGTH = 0.25, 1e-3
STICTION, STRIBECK_RAD_S = 0.35, 0.1


def made(n_axes=1, length=LENGTH, stribeck=F):
    """A rig whose curve is flat unless told otherwise, with these bristles."""
    rig = LawRig(n_axes).friction(stribeck=stribeck, coulomb=F)
    rig.params["presliding_rad"] = length
    return rig


def credit(rig, dx, velocity=None, axis=0, elapsed=1):
    """Credit of one period, J."""
    v = dx / T if velocity is None else velocity
    credit_friction(rig.state[0], rig.params[0], rig.model[axis], axis, dx, elapsed, v)
    return float(rig.state["friction_credit_j"][0, axis])


@compiled
def credits(state, params, model, dx):
    """Credits of one period in which each axis has moved by dx, J."""
    given = np.zeros(len(dx))
    for i in range(len(dx)):
        credit_friction(state[0], params[0], model[i], i, dx[i], 1, dx[i] / T)
        given[i] = state[0].friction_credit_j[i]
    return given


@compiled
def _through(state, params, model, moves):
    total = 0.0
    for dx in moves:
        credit_friction(state[0], params[0], model[0], 0, dx, 1, dx / T)
        total += state[0].friction_credit_j[0]
    return total


def run_through(rig, places):
    """Credit of a whole motion, J."""
    return _through(rig.state, rig.params, rig.model, np.diff(places, prepend=0.0))


@pytest.mark.parametrize("sign", [1, -1])
def test_bristles_first_bend_then_slide(sign):
    rig = made()
    assert credit(rig, sign * LENGTH / 2) == pytest.approx(F * LENGTH / 8)
    assert credit(rig, sign * LENGTH / 2) == pytest.approx(F * 3 * LENGTH / 8)
    assert rig.state["bristle_share"][0, 0] == sign
    assert credit(rig, sign * LENGTH) == pytest.approx(F * LENGTH)
    assert credit(rig, -sign * LENGTH / 2) == pytest.approx(-F * LENGTH * 3 / 8)
    assert credit(rig, 0.0) == 0.0


@pytest.mark.parametrize("amplitude", [0.3, 0.9, 1.0, 1.5, 4.0, 30.0])
def test_a_closed_motion_is_credited_four_times_what_its_amplitude_exceeds_the_bristles_by(amplitude):
    rig, a = made(), amplitude * LENGTH
    loop = a * np.sin(np.linspace(0.0, 2 * math.pi, 4001))
    run_through(rig, loop)  # the first turn bends them from rest
    assert run_through(rig, loop) == pytest.approx(4 * F * max(a - LENGTH, 0.0), rel=2e-3, abs=1e-9)


def test_without_a_length_everything_is_friction_at_once():
    rig = made(length=0.0)
    assert credit(rig, 1e-4) == pytest.approx(0.5 * F * 1e-4)
    assert credit(rig, 1e-4) == pytest.approx(F * 1e-4)


def test_what_was_stored_is_withdrawn_at_the_friction_of_rest_however_fast_the_joint_is_by_then():
    rig = made(stribeck=STICTION)
    rig.state["bristle_share"] = 1.0
    assert credit(rig, LENGTH / 2, velocity=2.0) == pytest.approx(F * LENGTH / 2, rel=1e-3)
    assert credit(rig, -LENGTH / 2, velocity=-2.0) == pytest.approx(-STICTION * LENGTH * 3 / 8, rel=1e-3)


def test_a_velocity_against_the_motion_does_not_choose_the_place_on_the_curve():
    rig = made(stribeck=STICTION)
    rig.state["bristle_share"] = 1.0
    slow = credit(rig, 1e-6, velocity=1e-3)
    assert slow == pytest.approx(STICTION * 1e-6, rel=1e-2)
    assert credit(rig, 1e-3, velocity=-1e-3) == pytest.approx(F * 1e-3, rel=1e-3)
    assert credit(rig, 1e-3, velocity=math.nan) == pytest.approx(F * 1e-3, rel=1e-3)
    assert credit(rig, 1e-4, velocity=0.0, elapsed=10) == pytest.approx(
        (F + (STICTION - F) * math.exp(-0.01)) * 1e-4, rel=1e-2
    )


def test_the_curve_is_lowered_as_much_as_its_minimum_was():
    rig = made(stribeck=STICTION)
    rig.params["friction_floor_nm"] = 0.2

    def at(v):
        return float(guaranteed_friction(rig.params[0], rig.model[0], 0, v))

    assert at(0.0) == pytest.approx(STICTION - 0.05)
    assert at(1.0) == at(-1.0) == pytest.approx(0.2)
    assert at(4.01) == at(-4.01) == at(math.nan) == 0.2
    rig.params["friction_floor_nm"] = 0.0
    assert at(0.0) == 0.0


@pytest.mark.parametrize(("seen", "share"), [(0.3, 0.3 * SEEN_SHARE), (0.7, 0.5), (-0.3, F), (0.1, F)])
def test_friction_seen_counts_in_sliding_its_own_direction_and_up_to_its_cap(seen, share):
    rig = made()
    rig.params["friction_seen_alpha"], rig.params["friction_seen_max_nm"] = 0.03, 0.5
    rig.state["friction_seen_nm"] = [[[seen, 9.0]]]
    rig.state["bristle_share"] = 0.5
    assert credit(rig, LENGTH / 4) == pytest.approx(F * LENGTH * 5 / 32), "bristles that still bend"
    rig.state["bristle_share"] = 1.0
    assert credit(rig, LENGTH) == pytest.approx(share * LENGTH)
    assert credit(rig, -LENGTH) == pytest.approx(-F * LENGTH / 2), (
        "what bristles give back is what they were credited"
    )
    assert credit(rig, -LENGTH) == pytest.approx(0.5 * LENGTH / 2)
    assert seen_friction(rig.state[0], rig.params[0], 0, False) == 0.5
    rig.params["friction_seen_alpha"] = 0.0
    assert seen_friction(rig.state[0], rig.params[0], 0, False) == 0.0, "no force sensor"


def test_a_friction_seen_that_is_not_a_number_is_none():
    rig = made()
    rig.params["friction_seen_alpha"], rig.params["friction_seen_max_nm"] = 0.03, 0.5
    rig.state["friction_seen_nm"], rig.state["bristle_share"] = math.nan, 1.0
    assert credit(rig, LENGTH) == pytest.approx(F * LENGTH)


# true friction, many joints at a time, far finer than a tick

STEPS, TICKS = 25, 800
ELEMENTS = np.arange(10)


def curve(v):
    return F + (STICTION - F) * np.exp(-((v / STRIBECK_RAD_S) ** 2))


def one_bristle(case, z, dx, v, elastic):
    """LuGre (elastic 0) and elasto-plastic bristles: work of one step, J, and the bristle after it."""
    steady = curve(v) / case["stiffness"]
    if elastic > 0:
        low = elastic * steady
        phase = np.clip((np.abs(z) - 0.5 * (steady + low)) / (steady - low), -0.5, 0.5)
        share = np.where(z * v <= 0, 0.0, 0.5 * np.sin(math.pi * phase) + 0.5)
    else:
        share = 1.0
    most = STICTION / case["stiffness"]
    after = np.clip(z + dx - share * z * np.abs(dx) / steady, -most, most)
    h = T / STEPS
    force = case["stiffness"] * 0.5 * (z + after) + case["damping"] * (after - z) / h
    return force * dx, after


def elements(case, bent, dx, v):
    """Maxwell-slip, ten elements of equal stiffness that yield one after the other: work, and forces after
    it.
    """
    each = case["stiffness"][:, None] / len(ELEMENTS)
    most = (2 * ELEMENTS + 1) / len(ELEMENTS) ** 2 * curve(v)[:, None]
    after = np.clip(bent + each * dx[:, None], -most, most)
    return 0.5 * (bent + after).sum(axis=1) * dx, after


@pytest.mark.parametrize("kind", ["lugre", "elasto-plastic", "maxwell-slip"])
def test_it_is_a_lower_bound_of_bristles_up_to_two_thirds_of_its_length(kind):
    n, rng = 60, np.random.default_rng(4)
    stiffness = np.exp(rng.uniform(math.log(50), math.log(2000), n))
    case = {"stiffness": stiffness, "damping": rng.choice([0.0, 0.1, 0.3, 1.0], n)}
    length = STICTION / stiffness
    first = 2 * math.pi * np.exp(rng.uniform(math.log(0.5), math.log(40), n))
    motion = [
        (length * np.exp(rng.uniform(math.log(0.2), math.log(10), n)), first),
        (length * rng.choice([0.0, 0.0, 0.3, 1.0, 3.0], n), first * rng.choice([0.13, 3.7], n)),
    ]
    rig = made(n, length=1.5 * length, stribeck=STICTION)
    bristles = np.zeros((n, len(ELEMENTS))) if kind == "maxwell-slip" else np.zeros(n)
    place, sampled, ahead, top, drop = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    taken = 0.0
    for k in range(1, TICKS * STEPS + 1):
        now = sum(a * np.sin(w * k * T / STEPS) for a, w in motion)
        dx = now - place
        v, place = dx * STEPS / T, now
        if kind == "maxwell-slip":
            work, bristles = elements(case, bristles, dx, v)
        else:
            work, bristles = one_bristle(case, bristles, dx, v, 0.7 if kind == "elasto-plastic" else 0.0)
        ahead += work
        if k % STEPS == 0:
            given = credits(rig.state, rig.params, rig.model, place - sampled)
            ahead, sampled, taken = ahead - given, place, taken + given
            top = np.maximum(top, ahead)
            drop = np.maximum(drop, top - ahead)
    half_bristle = 0.5 * STICTION * 1.5 * length
    assert (drop / half_bristle).max() < 1.5
    assert np.median(taken) > 10 * np.median(half_bristle), "a credit of nothing would be a lower bound too"


@pytest.mark.parametrize("v", [0.3, -1.0, 3.9])
def test_viscous_friction_is_not_credited_as_dry_where_the_curves_slope_is_too_low(v):
    rig = made()
    rig.model["viscous_nms_rad"] = 0.4 * rig.params["viscous_nms_rad"]  # of a curve that has all of it
    assert guaranteed_friction(rig.params[0], rig.model[0], 0, v) == pytest.approx(F, rel=1e-6)
    rig.model["viscous_nms_rad"] = 1.5 * rig.params["viscous_nms_rad"]
    assert guaranteed_friction(rig.params[0], rig.model[0], 0, v) == pytest.approx(F, rel=1e-6), (
        "never below the floor"
    )
