"""Rows of `rtctl check` on the help with friction: account, policy at rest, intent, disturbance observer."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from rtctl.check import devices_of_axis, verdicts_of_friction, verdicts_of_observer
from rtctl.check.law_plan import build
from rtctl.check.stability_report import examine
from rtctl.check.verdict import Outcome, Subject
from rtctl.control import disturbance_observer as law
from rtctl.control.dry_friction import guaranteed_friction
from rtctl.control.jit import records
from rtctl.control.records import new_records
from rtctl.friction import artefact
from rtctl.friction.guarantee import ASSUMED, LENGTH_FACTOR, guarantee
from rtctl.friction.policies import STANDINGS
from rtctl.rig_file.config import load
from rtctl.rig_file.friction_tables import FrictionTable
from rtctl.rounded import up
from rtctl.simulation.family import FAMILY, with_plant
from rtctl.tick import new_ticks

CONFIGS = Path(__file__).parents[3] / "configs"
ACCOUNT, REST, INTENT = (
    "energy account of the compensation",
    "policy at rest",
    "intent over the mass of a hand",
)
LOOP, COUNT, BIAS = (
    "disturbance observer in a hand",
    "observer, one encoder count",
    "observer, bias of the force sensor",
)
TWO_LINES = "feed-forward of any sign (two-line)"
MOVED = "help in the hand that moves the joint"


@pytest.fixture
def rig(tmp_path):
    """Write the shipped mock with changes in its text, beside its model."""

    def write(*changes, model=None):
        text = (CONFIGS / "mock.toml").read_text()
        for old, new in changes:
            assert old in text, old
            text = text.replace(old, new, 1)
        folder = tmp_path / "friction"
        folder.mkdir(exist_ok=True)
        found = artefact.load(CONFIGS / "friction" / "mock.json")
        artefact.save(dataclasses.replace(found, **(model or {})), folder / "mock.json")
        path = tmp_path / "mock.toml"
        path.write_text(text)
        return load(path)

    return write


def _rows(loaded, simulated=True):
    report = examine(loaded)
    if not simulated:
        subject = _subject(loaded, simulated=False)
        return {row.name: row for row in verdicts_of_friction.policy_at_rest(subject)}
    return {row.name: row for row in report.axes[0].verdicts}


def _subject(loaded, **changes):
    (axis,) = examine(loaded).axes
    joint = devices_of_axis.joint_of_axis(loaded, 0)
    subject = Subject(
        axis, loaded.config.axis[0], loaded.config.period_s, "rig.toml: axis[0]", joint, simulated=True
    )
    return dataclasses.replace(subject, **changes)


def test_an_encoder_whose_count_is_longer_than_the_joint_bends_hides_a_vibration_from_the_account(rig):
    def row(counts, *changes):
        coarse = rig(("encoder_counts_per_rev = 160000", f"encoder_counts_per_rev = {counts}"), *changes)
        return _rows(coarse).get("encoder count against the presliding length")

    length_rad = guarantee(
        load(CONFIGS / "mock.toml").config.axis[0], artefact.load(CONFIGS / "friction" / "mock.json")
    ).length_rad
    least = math.ceil(2 * math.pi / length_rad)
    assert row(160000).outcome == Outcome.PASS
    assert row(least).outcome == Outcome.PASS
    found = row(least - 1)
    assert found.outcome == Outcome.FAIL
    assert f"an encoder of {least} counts" in found.refusal
    assert row(2000, _policy("off")) is None


def _policy(name):
    return ('policy = "hybrid"', f'policy = "{name}"')


def test_the_shipped_mock_passes_every_row_and_says_what_a_hand_can_be_given(rig):
    loaded = rig()
    rows = _rows(loaded)
    seven = (ACCOUNT, REST, INTENT, LOOP, COUNT, BIAS, TWO_LINES)
    assert {rows[name].outcome for name in seven} == {Outcome.PASS}
    sure = examine(loaded).axes[0].guarantee
    model = artefact.load(CONFIGS / "friction" / "mock.json")
    assert model.presliding_rad == pytest.approx(1.03 * 0.35 / 250, rel=0.02)
    longest_rad = model.presliding_rad + 2 * model.presliding_spread_rad
    assert sure.credited_rad == pytest.approx(LENGTH_FACTOR * longest_rad, rel=1e-9)
    assert sure.given_most_j == pytest.approx(2.5 * sure.peak_nm * sure.credited_rad)
    assert f"{up(sure.given_most_j * 1e3)} mJ" == rows[ACCOUNT].figure


def test_a_length_that_nobody_measured_is_not_proved_and_one_that_is_given_is(rig):
    unknown = {"presliding_rad": None, "presliding_spread_rad": None, "presliding_ramps": 0}
    assumed = rig(model=unknown)
    rows = _rows(assumed)
    assert rows[ACCOUNT].outcome is Outcome.NOT_PROVED
    assert "rtctl identify" in rows[ACCOUNT].meaning
    assert "a joint that hardly bends" in rows[ACCOUNT].meaning
    assert rows[TWO_LINES].outcome is Outcome.NOT_PROVED
    assert examine(assumed).axes[0].to_dict()["guarantee"]["length_source"] == ASSUMED
    policy = _policy("hybrid")[0]
    given = _rows(rig((policy, f"{policy}\npresliding_rad = 0.002"), model=unknown))
    assert given[ACCOUNT].outcome is Outcome.PASS
    assert "rig file" in given[ACCOUNT].meaning
    assert "hardly bends" not in given[ACCOUNT].meaning


def test_the_least_friction_of_law_and_margins_is_one_rule(rig):
    loaded = rig((_policy("hybrid")[0], 'policy = "hybrid"\ndrift_nm = 0.01'))
    model = artefact.load(loaded.model_path(loaded.config.axis[0]))
    sure = guarantee(loaded.config.axis[0], model)
    spread, error = float(model.place_spread_nm.max()), float(model.error_max_nm.max())
    assert spread > error  # the shortfall at a place is below the curve: it holds the error
    assert sure.doubt_nm == pytest.approx(spread + 0.01)
    worse = dataclasses.replace(
        model, branches=tuple(dataclasses.replace(one, place_spread_nm=0.001) for one in model.branches)
    )
    assert guarantee(loaded.config.axis[0], worse).doubt_nm == pytest.approx(error + 0.01)
    assert examine(loaded).axes[0].friction.friction_floor_nm >= sure.floor_nm
    p = records(new_records(1)[0])[0]
    p["friction_floor_nm"] = sure.floor_nm
    record = records(model.record())[0]
    v = np.linspace(0.0, 1.9, 50)
    law = [guaranteed_friction(p, record, 0, float(x)) for x in v]
    lowest = model.branches[0].magnitude(v) - sure.doubt_nm
    assert np.all(np.array(law) <= lowest + 1e-12)


@pytest.mark.parametrize("policy", STANDINGS)
def test_policies_that_shake_a_resting_hand_warn_on_a_simulated_rig_and_fail_on_a_real_one(rig, policy):
    loaded = rig(_policy(policy))
    row, real = _rows(loaded).get(REST), _rows(loaded, simulated=False).get(REST)
    if policy == "off":
        assert row is None
    elif STANDINGS[policy].quiet:
        assert (row.outcome, real.outcome) == (Outcome.PASS, Outcome.PASS)
    else:
        assert (row.outcome, real.outcome) == (Outcome.WARN, Outcome.FAIL)
        assert 'policy = "hybrid"' in real.refusal
        assert examine(loaded).ok


@pytest.mark.parametrize(("policy", "told"), [("hybrid", "5.9%"), ("observer", "7.2%"), ("off", None)])
def test_help_is_proved_of_no_hand_that_moves_the_joint(rig, policy, told):
    """Decision 0094: `OK` alone would promise it."""
    report = examine(rig(_policy(policy)))
    row = {row.name: row for row in report.axes[0].verdicts}.get(MOVED)
    assert report.ok
    assert (row and (row.outcome, row.figure)) == (told and (Outcome.NOT_PROVED, f"{told} of hands"))


def test_every_policy_of_a_rig_file_has_a_standing_and_the_default_is_quiet():
    names = FrictionTable.model_fields["policy"].annotation.__args__
    assert set(names) == set(STANDINGS)
    assert STANDINGS[FrictionTable().policy].quiet
    assert [name for name in STANDINGS if STANDINGS[name].quiet] == ["off", "hybrid", "observer"]


def test_without_a_force_sensor_only_no_help_is_advised(rig):
    subject = _subject(rig(_policy("stop")), simulated=False)
    blind = dataclasses.replace(subject.axis, force_sensor=False)
    subject = dataclasses.replace(subject, axis=blind)
    (row,) = verdicts_of_friction.policy_at_rest(subject)
    assert 'policy = "off"' in row.refusal
    assert verdicts_of_observer.closed_loop(subject) == []


def test_an_intent_that_buzzes_on_the_mass_of_a_hand_is_refused_with_a_low_pass_that_does_not(rig):
    policy = _policy("hybrid")[0]
    open_loop = rig((policy, f"{policy}\nintent_lowpass_hz = 5000.0"))
    row = _rows(open_loop)[INTENT]
    assert row.outcome is Outcome.FAIL
    found = examine(open_loop).axes[0].friction.feedforward_max_nm
    lead = found / examine(open_loop).axes[0].guarantee.intent_nm * 0.02 / 0.032
    assert float(row.figure) == pytest.approx(lead, rel=0.01)  # alpha is 1
    bound_hz = float(row.refusal.split("the bound is ")[1].split()[0])
    assert _rows(rig((policy, f"{policy}\nintent_lowpass_hz = {bound_hz}")))[INTENT].outcome is Outcome.PASS
    assert (
        _rows(rig((policy, f"{policy}\nintent_lowpass_hz = {bound_hz + 0.2}")))[INTENT].outcome
        is Outcome.FAIL
    )


def test_an_intent_that_only_a_low_pass_below_a_tenth_of_a_hertz_would_settle_is_told(rig):
    """The bound is rounded down, here to 0, which divided. Without an observer, whose tuning for so late a
    force takes 20 s.
    """
    none = "intent_nm = 0.003\nobserver = { gain = 0.0 }"
    slow = ("rate_hz = 1000.0", "rate_hz = 250.0"), ("intent_nm = 0.05", none)
    row = _rows(rig(*slow, ("[axis.force]", "[axis.force]\nsensor_delay_s = 0.1")))[INTENT]
    assert row.outcome in (Outcome.NOT_PROVED, Outcome.FAIL)
    assert "and 0 with what is 25 ticks late" in row.meaning


@pytest.mark.parametrize("late", [0, 1, 3])
def test_the_intents_bound_is_where_a_hand_made_loop_begins_to_grow(late):
    lead, T = 4.0, 1e-3
    bound = verdicts_of_friction._late_bound_hz(lead, late, T)
    for share, grows in ((0.97, False), (1.03, True)):
        alpha = -math.expm1(-2 * math.pi * bound * share * T)
        y = [1.0] + [0.0] * 4000
        for k in range(4000):
            y[k + 1] = y[k] + alpha * (-lead * (y[k - late] if k >= late else 0.0) - y[k])
        assert (max(map(abs, y[-50:])) > max(map(abs, y[100:150]))) is grows


@pytest.mark.parametrize("name", FAMILY)
def test_the_default_observer_passes_on_every_plant_of_the_family(name):
    loaded = with_plant(load(CONFIGS / "mock.toml"), name)
    assert _rows(loaded)[LOOP].outcome is Outcome.PASS


def test_an_observer_too_quick_for_a_slow_drive_is_refused_with_gain_and_bandwidth_that_pass():
    loaded = with_plant(load(CONFIGS / "mock.toml"), "slow-drive")

    def tried(**observer):
        axis = loaded.config.axis[0]
        table = axis.friction.observer.model_copy(update=observer)
        changed = axis.model_copy(update={"friction": axis.friction.model_copy(update={"observer": table})})
        return loaded.model_copy(update={"config": loaded.config.model_copy(update={"axis": (changed,)})})

    row = _rows(tried(bandwidth_hz=150.0))[LOOP]
    assert row.outcome is Outcome.FAIL
    gain = float(row.refusal.split("gain of at most ")[1].split()[0])
    bandwidth_hz = float(row.refusal.split("or bandwidth_hz = ")[1].split()[0])
    assert _rows(tried(bandwidth_hz=150.0, gain=gain))[LOOP].outcome is Outcome.PASS
    assert _rows(tried(bandwidth_hz=bandwidth_hz))[LOOP].outcome is Outcome.PASS


def test_an_elastic_joint_of_unknown_stiffness_is_not_proved_where_some_resonance_fails(rig):
    loaded = rig(("[axis.friction]", "[axis.drive]\nmotor_share = 0.8\n[axis.friction]"))
    row = _rows(loaded)[LOOP]
    assert row.outcome is Outcome.NOT_PROVED
    assert "joint of 20 Hz" in row.meaning


def test_a_coarse_encoder_is_refused_with_a_bandwidth_that_passes(rig):
    coarse = ("encoder_counts_per_rev = 160000", "encoder_counts_per_rev = 2000")
    row = _rows(rig(coarse))[COUNT]
    assert row.outcome is Outcome.FAIL
    bandwidth_hz = float(row.refusal.split("bandwidth_hz = ")[1].split(",")[0])
    assert 0 < bandwidth_hz < 25
    observer = f"[axis.friction.observer]\nbandwidth_hz = {0.99 * bandwidth_hz}\n"
    text = (coarse, ("[[device]]", f"{observer}[[device]]"))
    assert _rows(rig(*text))[COUNT].outcome is Outcome.PASS
    off = (coarse, ("[[device]]", "[axis.friction.observer]\ngain = 0.0\n[[device]]"))
    assert _rows(rig(*off)).get(COUNT) is None


@pytest.mark.parametrize("excess", [0.0, 0.3])
def test_the_torque_of_a_count_is_what_the_law_sends(rig, excess):
    """One count in one tick, on a joint that slides quickly, where the observer does most: its largest torque
    after it. Behind a late sensor the law takes the inertia too high.
    """
    loaded = rig()
    plan, subject = build(loaded), _subject(loaded)
    tuned = dataclasses.replace(subject.axis.observer, excess=excess)
    subject = dataclasses.replace(subject, axis=dataclasses.replace(subject.axis, observer=tuned))
    p, state, t, model = (
        records(array)[0] for array in (plan.params, new_records(1)[1], new_ticks(1, 1), plan.model)
    )
    p["observer_deadband_nm"], t["compensation"], p["observer_excess"] = 0.0, 1.0, excess
    state["bristle_share"], t["velocity_rad_s"] = 1.0, 1.0
    torques = []
    for k in range(50):
        t["velocity_difference_rad_s"] = p["count_rad"] / p["period_s"] if k == 1 else 0.0
        law.observe_friction(t, state, p, 0, 1)
        torques.append(abs(law.observer_torque(t, state, p, model, 0, 1)))
    assert max(torques) == pytest.approx(verdicts_of_observer.count_torque_nm(subject, 20.0), rel=0.03)


def test_the_bias_at_which_a_joint_creeps_is_that_of_the_theory(rig):
    # docs/theory.md 6.2: (1 - kappa)/kappa F_s = 18.9 mN m at kappa .95, F_s .36; dead band and target share
    # on top
    loaded = rig(("[[device]]", "[axis.friction.observer]\ngain = 0.95\ndeadband_nm = 1e-9\n[[device]]"))
    row = _rows(loaded)[BIAS]
    sure = examine(loaded).axes[0].guarantee
    assert float(row.figure.split()[0]) == pytest.approx((1 / 0.95 / 0.97 - 1) * sure.floor_nm, rel=0.01)
