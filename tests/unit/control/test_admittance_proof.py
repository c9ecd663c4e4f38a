"""The proof between the points of the grid: discs, the characteristic function, cells, and where it ends."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rtctl.control.environments.kind import DAMPING, STIFFNESS
from rtctl.control.proofs import admittance_loop, admittance_margin, admittance_proof
from rtctl.control.proofs.admittance_loop import AdmittanceLoop, Box, eigenvalues, points, spectral_radii
from rtctl.control.proofs.admittance_spectrum import HandCell, Joint, coefficients
from rtctl.control.proofs.discs import Disc, exponential, one_less_exponential, point
from rtctl.control.proofs.drive_in_hand import resonance

RIG = AdmittanceLoop(
    0.012, 0.05, 1e-3, 0.03, 0.3, 2.0, force_lowpass_hz=150.0, velocity_lowpass_hz=100.0, delay=1.0
)
ELASTIC = replace(RIG, joints=(resonance(0.012, 40.0),), link_viscous_nms_rad=0.02)
LATE = replace(RIG, delay=1.6, lag_hz=200.0, position_gain_nm_rad=8.0, intake_lowpass_hz=300.0)
AT_LINK = replace(ELASTIC, encoder="link", delay=0.3, position_gain_nm_rad=3.0)


def _cell(row, mass):
    """A cell of one hand and one world."""
    k, b, m, _, _, k_e, b_e = row
    box = np.array([[[one, one] for one in (k, b, m, k_e, b_e, mass)]])
    return box, HandCell(box[:, 0], box[:, 1], box[:, 2])


def _characteristic(loop, s, row):
    box, hands = _cell(row, loop.mass_kgm2)
    drive = Joint(loop, loop.joints[0], row[3])
    at = admittance_proof._corners(
        coefficients(drive, point(np.array([s])), hands), point(np.array([s])), drive, box
    )
    value = admittance_proof._value(at).ravel()[0]
    return abs(value), admittance_proof._radius(at).ravel()[0], admittance_proof._most(at).ravel()[0]


@pytest.mark.parametrize(
    "loop",
    [
        RIG,
        LATE,
        replace(RIG, delay=0.4),
        ELASTIC,
        AT_LINK,
        replace(LATE, feedforward=0.8, feedforward_lowpass_hz=30.0, told_viscous_nms_rad=0.05),
        replace(AT_LINK, feedforward=1.0),
        replace(RIG, sensor_hz=60.0),
        replace(LATE, sensor_hz=900.0, sensor_ticks=3, feedforward=0.8, feedforward_lowpass_hz=30.0),
        replace(LATE, sensor_hz=190.0),
        replace(AT_LINK, sensor_hz=90.0, sensor_ticks=1),
        replace(LATE, sensor_ticks=4),
    ],
)
def test_the_characteristic_function_is_zero_just_at_the_eigenvalues(loop):
    rng = np.random.default_rng(3)
    for bristle in (0.0, 250.0):
        row = [
            300 * rng.random() + 2,
            rng.random(),
            0.02 * rng.random(),
            bristle,
            0,
            10 ** (4 * rng.random()),
            0.3 * rng.random(),
        ]
        at = points([tuple(row)])
        roots = eigenvalues(loop, at)[0]
        roots = roots[(np.abs(roots) > 0.6) & (roots.imag > 1e-6)]
        assert roots.size > 0
        for z in roots:
            s = np.log(z) / loop.period_s
            value, radius, most = _characteristic(loop, s, row)
            assert value <= radius  # the aliases that are only bounded
            assert radius < 1e-2 * most
            beside, radius, _ = _characteristic(loop, 1.05 * s, row)
            assert beside > radius


@pytest.mark.parametrize("loop", [ELASTIC, replace(ELASTIC, mass_max_kgm2=0.08)])
def test_a_cell_holds_the_values_of_all_its_hands_and_worlds(loop):
    """Random points of random cells: the direction of F lies within the half-plane that the cell is proved
    by.
    """
    rng = np.random.default_rng(5)
    drive = Joint(loop, loop.joints[0], 0.0)
    ends, box = admittance_proof._first(loop)
    some = rng.choice(len(ends), 40, replace=False)
    proved, _ = admittance_proof.examine(drive, ends[some], box[some])
    assert 5 < proved.sum() < 40
    for i in some[proved]:
        values = []
        for _ in range(16):
            row = box[i, :, 0] + (box[i, :, 1] - box[i, :, 0]) * rng.random(6) ** 3
            one = np.stack([row, row], axis=1)[None]
            s = point(np.array([ends[i, 0] + (ends[i, 1] - ends[i, 0]) * rng.random()]))
            c = coefficients(drive, s, HandCell(one[:, 0], one[:, 1], one[:, 2]))
            values.append(admittance_proof._value(admittance_proof._corners(c, s, drive, one)).ravel()[0])
        directions = np.sort(np.angle(np.array(values) / values[0]))
        gaps = np.diff(np.append(directions, directions[0] + 2 * math.pi))
        assert gaps.max() > math.pi  # all in one open half-plane


@pytest.mark.parametrize(
    "loop", [RIG, replace(RIG, mass_kgm2=0.03, virtual_damping_nms_rad=0.2, position_gain_nm_rad=20.0)]
)
def test_a_display_is_proved_and_random_hands_and_worlds_find_nothing_against_it(loop):
    found = admittance_margin.proof(loop)
    assert found.proved
    assert found.cells < admittance_proof.BUDGET
    rng = np.random.default_rng(11)
    rows = [
        (
            600 * rng.random() ** 3,
            rng.random() ** 4,
            0.02 * rng.random(),
            0.0,
            0,
            10 ** (8 * rng.random() - 2),
            rng.integers(2) * rng.random() ** 4,
        )
        for _ in range(3000)
    ]
    assert spectral_radii(loop, points(rows)).max() <= admittance_margin.edge(loop)


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_the_proof_ends_where_the_eigenvalues_do(share):
    hand = Box(share * admittance_margin.largest_hand(RIG), 1.0, 0.02)
    found = admittance_proof.prove(replace(RIG, box=hand), budget=16_000)
    assert found.proved == (share < 1)
    assert found.unstable == (share > 1)


def test_all_masses_that_may_be_asked_for_are_proved_and_a_light_one_among_them_is_found():
    wide = replace(RIG, mass_kgm2=0.03, mass_max_kgm2=0.12)
    assert admittance_margin.proof(wide).proved
    rng = np.random.default_rng(12)
    for mass in 0.03 + 0.09 * rng.random(20):
        rows = [(600 * rng.random() ** 3, 0.0, 0.0, 0.0, 0, 10 ** (6 * rng.random()), 0.0) for _ in range(60)]
        at = replace(RIG, mass_kgm2=float(mass), virtual_damping_nms_rad=0.3 + rng.random())
        assert spectral_radii(at, points(rows)).max() <= admittance_margin.edge(at)
    too_light = admittance_proof.prove(replace(wide, mass_kgm2=0.016), budget=16_000)
    assert not too_light.proved
    assert too_light.unstable


def test_an_elastic_joint_is_proved_and_a_lazy_sensor_is_not():
    assert admittance_margin.proof(replace(ELASTIC, mass_kgm2=0.04)).proved
    lazy = admittance_margin.proof(replace(RIG, sample_ticks=2))
    assert not lazy.proved
    assert not lazy.unstable


def test_discs_hold_what_numbers_of_them_give():
    rng = np.random.default_rng(2)
    c = rng.normal(size=(2, 500)) + 1j * rng.normal(size=(2, 500))
    r = 0.3 * rng.random((2, 500))
    turn = np.exp(2j * math.pi * rng.random((2, 500)))
    a, b = (Disc(c[i], r[i]) for i in range(2))
    x, y = (c[i] + r[i] * turn[i] for i in range(2))
    for disc, number in (
        (a + b, x + y),
        (a - b, x - y),
        (a * b, x * y),
        (-a * 2j, -2j * x),
        (a.inverse(), 1 / x),
        (exponential(a), np.exp(x)),
        (one_less_exponential(a), 1 - np.exp(x)),
    ):
        inside = np.abs(number - disc.center) <= disc.radius * (1 + 1e-12) + 1e-12
        assert inside.all()
        assert (np.abs(number) <= disc.most * (1 + 1e-12)).all()
    assert np.isinf(Disc(np.array([0.1 + 0j]), np.array([0.2])).inverse().radius[0])


def test_the_worlds_that_are_proved_are_all_that_a_program_may_ask_for():
    assert STIFFNESS.high == admittance_loop.WORLD_STIFFNESS_NM_RAD
    assert DAMPING.high == admittance_loop.WORLD_DAMPING_NMS_RAD
