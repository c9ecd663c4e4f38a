"""A torque that goes by the place: springs, and gravity on an arm, are parameters of their own."""

import json
import re
from functools import cache

import numpy as np
import pytest
from click.testing import CliRunner

from rtctl.cli.identify_log import command
from rtctl.friction.logs.dynamics import AxisLog
from rtctl.friction.logs.log_checks import diagnose
from rtctl.friction.logs.log_input import samples
from rtctl.friction.logs.log_points import SPEED_MIN_RAD_S
from rtctl.friction.logs.plausibility import doubtful_offsets
from rtctl.friction.logs.regression import joint_fit
from rtctl.friction.logs.regressors import regressors
from rtctl.friction.logs.springs import hidden, spring_in

RATE_HZ, INERTIA, COULOMB, VISCOUS = 250.0, 0.02, 0.2, 0.05
TRUTH = {"inertia_kgm2": INERTIA, "coulomb_nm": COULOMB, "viscous_nms_rad": VISCOUS}


@cache
def motion(travel):
    t = np.arange(int(20 * RATE_HZ)) / RATE_HZ
    waves = ((0.62, 0.31, 0.0), (0.25, 0.83, 1.0), (0.12, 1.9, 2.0), (0.06, 3.7, 0.5))
    x = travel * sum(a * np.sin(2 * np.pi * f * t + p) for a, f, p in waves)
    v = travel * sum(2 * np.pi * f * a * np.cos(2 * np.pi * f * t + p) for a, f, p in waves)
    a = -travel * sum((2 * np.pi * f) ** 2 * a * np.sin(2 * np.pi * f * t + p) for a, f, p in waves)
    return t, x, v, a


def joint(pull, travel=1.0, radian=1.0, by_place=0.0, turns=0.0):
    """A joint on what `pull` gives of the position, more of it forwards by `turns`; friction larger on one
    side by `by_place`."""
    t, x, v, a = motion(travel)
    friction = (COULOMB * np.sign(v) + VISCOUS * v) * (1 + by_place * x / travel)
    torque = (
        INERTIA * a
        + friction
        + pull(x) * (1 + turns * np.sign(v))
        + 0.02
        + np.random.default_rng(1).normal(0, 0.003, len(t))
    )
    return AxisLog(RATE_HZ, x, torque, "log.csv", "0", radian=radian)


def found(log):
    """What is taken for a spring in a log, and its signals with that."""
    slowest = SPEED_MIN_RAD_S * log.radian
    spring = spring_in(regressors(log, 20.0, slowest), ((log,),), slowest)
    if spring is None:
        return None, regressors(log, 20.0, slowest)
    ((free,),) = spring.taken_out(((log,),))
    return spring, spring.put_back(regressors(free, 20.0, slowest))


SPRING, GRAVITY, BOTH = "a spring", "gravity on an arm", "gravity on an arm and a spring"


@pytest.mark.parametrize(
    ("pull", "travel", "form", "values"),
    [
        (lambda x: 0.8 * (x - 0.1), 1.0, SPRING, {"stiffness_nm_rad": 0.8}),
        (
            lambda x: 0.9 * np.sin(x + 0.5),
            2.0,
            GRAVITY,
            {"gravity_sine_nm": 0.79, "gravity_cosine_nm": 0.431},
        ),
        (
            lambda x: 0.9 * np.sin(x) - 0.4 * x,
            2.0,
            BOTH,
            {"gravity_sine_nm": 0.9, "gravity_cosine_nm": 0.0, "stiffness_nm_rad": -0.4},
        ),
    ],
)
def test_what_goes_by_the_place_is_told_beside_the_joint(pull, travel, form, values):
    spring, signals = found(joint(pull, travel))
    assert spring.form.name == form
    fit = joint_fit(signals)
    parameters = fit.symmetric.parameters
    for name, value in TRUTH.items():
        assert parameters[name].value == pytest.approx(value, rel=0.06), name
    for name, value in values.items():
        assert parameters[name].value == pytest.approx(value, abs=0.01), name
        assert parameters[name].standard_error < 0.01
    assert set(values) < set(fit.per_direction.parameters)
    assert not diagnose(((spring.taken_out(((joint(pull, travel),),))[0][0],),), signals)


@pytest.mark.parametrize("gas", [0.3, -0.8])
def test_a_slide_on_a_gas_spring_is_told_with_how_much_stiffer_it_gets(gas):
    log = joint(lambda x: 2.0 / (1 - gas * x), radian=0.9)
    spring, signals = found(log)
    ends = [1 / (1 - gas * end) ** 2 for end in (log.position_rad.min(), log.position_rad.max())]
    told, end = re.search(
        r"gas spring that is (\S+) times as stiff at the (\w+) position", spring.told
    ).groups()
    assert float(told) == pytest.approx(max(ends) / min(ends), rel=0.1)
    assert end == ("largest" if gas > 0 else "smallest")
    parameters = joint_fit(signals).symmetric.parameters
    assert parameters["stiffness_nm_rad"].value == pytest.approx(2 * gas, rel=0.05)
    for name, near in (("inertia_kgm2", 0.03), ("coulomb_nm", 0.05)):
        assert parameters[name].value == pytest.approx(TRUTH[name], rel=near), name


def test_an_offset_beside_a_spring_is_told_as_its_pull():
    _, signals = found(joint(lambda x: 0.8 * x + 5.0))
    (told,) = doubtful_offsets(joint_fit(signals))
    assert "an offset of 5.02 N m" in told
    assert "the pull of what goes by the place at the mean position (a preload, a weight)" in told
    (told,) = doubtful_offsets(joint_fit(found(joint(lambda x: 0 * x + 5.0))[1]))
    assert "a preload" not in told


@pytest.mark.parametrize(
    "log",
    [joint(lambda x: 0 * x), joint(lambda x: 0 * x, by_place=0.6), joint(lambda x: 0.8 * x, turns=0.6)],
    ids=["no spring", "friction by place", "a rope that goes slack"],
)
def test_what_is_no_spring_stays(log):
    assert found(log)[0] is None


def test_a_torque_that_is_late_is_no_spring():
    log = joint(lambda x: 0 * x)
    late = AxisLog(RATE_HZ, log.position_rad, np.roll(log.torque_nm, 10), "log.csv", "0")
    assert found(late)[0] is None


def test_a_motion_of_one_frequency_tells_no_spring():
    t = np.arange(5000) / RATE_HZ
    turn = 2 * np.pi * 1.3
    x, v, a = np.sin(turn * t), turn * np.cos(turn * t), -(turn**2) * np.sin(turn * t)
    torque = INERTIA * a + 0.5 * x + COULOMB * np.sign(v) + VISCOUS * v
    signals = regressors(AxisLog(RATE_HZ, x, torque, "log.csv", "0"), 20.0)
    assert "one frequency" in hidden(signals)[0]
    assert hidden(regressors(joint(lambda x: 0.0 * x), 20.0)) == ()


def test_a_motor_that_plays_a_spring_with_its_sign_turned_is_no_spring():
    log = joint(lambda x: 0.8 * x)  # what the hand does against the motor's spring
    turned = log.torque_nm + 0.8 * log.position_rad
    both = AxisLog(RATE_HZ, log.position_rad, turned, "log.csv", "0", external_nm=log.torque_nm)
    assert found(both)[0] is None


def test_over_a_short_travel_gravity_and_a_spring_are_told_together():
    spring, signals = found(joint(lambda x: 0.9 * np.sin(x), travel=0.3))
    assert spring.form.name == SPRING
    assert "gravity on an arm would look alike" in spring.told
    spring, signals = found(joint(lambda x: 3 * np.sin(x + 0.6) + 2 * x, travel=0.3))
    assert "what a short travel shows of gravity on an arm and a spring" in spring.told
    found_there = joint_fit(signals).symmetric.parameters
    assert found_there["inertia_kgm2"].value == pytest.approx(INERTIA, rel=0.1)
    middle = joint(np.zeros_like).position_rad.mean() * 0.3
    assert found_there["stiffness_nm_rad"].value == pytest.approx(3 * np.cos(middle + 0.6) + 2, abs=0.1)


def test_the_points_are_without_the_spring():
    log = joint(lambda x: 0.8 * x)
    _, signals = found(log)
    friction = samples(signals, joint_fit(signals), "0", remove_offset=True)
    wanted = COULOMB * np.sign(friction.velocity_rad_s) + VISCOUS * friction.velocity_rad_s
    assert np.abs(friction.friction_nm - wanted).max() < 0.03


def test_the_command_names_a_spring_of_a_slide_in_its_units(tmp_path):
    t, x, _, _ = motion(1.0)
    log = joint(lambda x: 0.8 * (x - 0.1))
    np.savez(tmp_path / "log.npz", t=t, x=x, f=log.torque_nm)
    columns = ("--column", "time=t", "--column", "position=x:m", "--column", "torque=f:N:1.0")
    told = CliRunner().invoke(command, ["--log", str(tmp_path / "log.npz"), *columns, "--json"])
    assert told.exit_code == 0, told.output
    document = json.loads(told.output)
    stiffness = document["symmetric"]["parameters"]["stiffness_n_m"]
    assert stiffness["low"] < 0.8 < stiffness["high"]
    assert any("stiffness_n_m, about the mean position" in text for text in document["warnings"])


def test_what_is_left_of_the_place_beside_a_spring_is_no_more_than_was_left():
    # a cable beside the spring, which the spring's form does not hold
    log = joint(lambda x: 8.0 / (1 - 0.4 * x) + 0.4 * np.abs(x), radian=0.9)
    spring, signals = found(log)
    told = diagnose(((spring.taken_out(((log,),))[0][0],),), signals)
    (size,) = re.findall(r"depends on the position \((\S+) N m RMS: a spring", " ".join(told))
    assert float(size) < 0.2
