"""The first run on real input: recordings of a haptic teleoperation rig (TU/e, MIT licence), kept elsewhere.

The master lever is moved by a hand; its strain gauge gives the torque of the hand. On the slave lever in
free motion the motor overcomes inertia and friction alone.
"""

from pathlib import Path

import pytest

from rtctl.friction.logs.log_input import Gearing, options_of
from rtctl.friction.logs.log_points import checked
from rtctl.simulation.playback_job import Job, run

DATA = Path(__file__).parents[2].parent / "shared" / "data" / "tue_haptic_1dof"

pytestmark = [
    pytest.mark.realdata,
    pytest.mark.skipif(not DATA.is_dir(), reason=f"no recordings in {DATA}"),
]

INERTIA_KGM2 = 1 / 631.36
"""The maker's figure for one lever."""


def free_motion(letter):
    return DATA / f"question1{letter}_free_motion.csv.gz"


def job(judged, *trained, **more):
    return Job(
        log=free_motion(judged),
        fit_from=tuple(free_motion(letter) for letter in trained),
        time={"column": "time_s"},
        torque_limit_nm=1.125,
        lever_m=0.075,
        counts_per_rev=300_000.0,
        **more,
    )


MASTER = {"position": {"column": "pos_master_rad"}, "hand_torque": {"column": "neg_torque_human_nm"}}
SLAVE = {
    "position": {"column": "pos_slave_rad"},
    "motor_torque": {"column": "torque_cmd_slave_nm"},
    "bias": "zero",
    "inertia_kgm2": INERTIA_KGM2,
}


@pytest.fixture(scope="module")
def master():
    return run(job("f", "e", **MASTER))


@pytest.fixture(scope="module")
def slave():
    return run(job("f", "d", "e", "f", train_share=0.6, **SLAVE))


def test_a_whole_recording_goes_through_the_loop_without_a_fault(master):
    found = master["interaction"]
    assert found["first_fault"] is None
    assert found["ticks"] >= 8814
    assert found["counted_ticks"] > 6000


def test_compensation_learned_from_one_recording_takes_most_of_the_hands_effort_in_another(master):
    whole = master["interaction"]["all"]
    assert 0.030 < whole["hand_rms_nm"] < 0.040
    assert whole["left_rms_nm"] < 0.010
    assert whole["reduction"] > 0.7
    for direction in ("forward", "backward"):
        assert master["interaction"][direction]["reduction"] > 0.7


def test_the_feed_forward_never_exceeds_the_friction_nor_what_the_hand_needed(master):
    for part in ("forward", "backward"):
        found = master["interaction"][part]
        assert found["feedforward_rms_nm"] < min(found["friction_rms_nm"], found["hand_rms_nm"])
    # where it turns, bristles have not bent yet and friction is less than the curve of sliding says: by a
    # tenth; the hand still needs less than before
    slow = master["interaction"]["slow"]
    assert slow["feedforward_rms_nm"] < 1.15 * slow["friction_rms_nm"]
    assert slow["left_rms_nm"] < 0.6 * slow["hand_rms_nm"]


def test_what_goes_by_the_place_is_no_friction_of_another_day(master):
    # the gauge's torque depends on the position: counted as friction it made 3.2 mN m of this, and the
    # inertia .28 g m^2
    assert master["prediction"]["rmse_nm"] < 2.0e-3
    assert master["log"]["inertia_kgm2"] == pytest.approx(0.8e-3, rel=0.15)


def test_the_slave_lever_has_the_makers_inertia_and_asymmetric_friction(slave):
    for log in slave["fit"]["logs"]:
        found = log["regression"]
        assert found["inertia_kgm2"] == pytest.approx(INERTIA_KGM2, rel=0.1)
        assert found["level_forward_nm"] == pytest.approx(0.02, abs=0.006)
        assert found["level_backward_nm"] == pytest.approx(-0.04, abs=0.008)


def test_one_curve_per_direction_predicts_unseen_friction_far_better_than_one_for_both(slave):
    found = slave["held_out"]
    assert found["rmse_nm"] <= 6.8e-3
    assert found["rmse_symmetric_nm"] > 1.5 * found["rmse_nm"]


def test_friction_of_one_controllers_run_predicts_anothers():
    found = run(job("f", "e", **SLAVE))["prediction"]
    assert found["rmse_nm"] <= 6.8e-3


@pytest.mark.parametrize("letter", ["d", "e", "f"])
def test_a_short_travel_is_told_no_gravity_of_a_robot(letter):
    # 2 mN m over .1 rad were told as a gravity of -24.7 N m beside a spring of 24.7 N m/rad
    columns = {"time": {"column": "time_s"}, "position": {"column": "pos_master_rad"}}
    columns["motor_torque"] = {"column": "neg_torque_human_nm"}
    found = checked([options_of(free_motion(letter), columns, None)], Gearing())
    parameters = found.fit.symmetric.parameters
    assert not [name for name in parameters if name.startswith("gravity")]
    assert parameters["stiffness_nm_rad"].value == pytest.approx(0.07, abs=0.035)
