"""An admittance a thousand times smaller or larger than the usual joint is certified by hands and worlds of
its own size, and shakes in them if it is not; an observer by hands at its own handle.
"""

import numpy as np
import pytest
from foreign_files import model, rig_file
from foreign_rig import JOINT, Rig, axis

from rtctl.check import observer_tuning, stability_report
from rtctl.check.verdict import hand_factor
from rtctl.control.environments.table import Environment
from rtctl.control.proofs import admittance_margin
from rtctl.control.proofs.admittance_sticking import calming_rest_damping, sticking
from rtctl.control.vocabulary import State
from rtctl.rig_file.config import Config, load
from rtctl.simulation.shipped_files import shipped_config

pytestmark = pytest.mark.compiled

TORQUES = ("_kgm2", "_nms_rad", "_nm_rad", "_nm", "_nm_s", "_nm_a")


def of_size(by, **admittance):
    """The shipped display with everything that has N m in its unit so many times as large."""
    loaded = load(shipped_config("admittance.toml"))
    table = loaded.config.model_dump(mode="json", by_alias=True)
    one = table["axis"][0]
    one["admittance"] |= admittance
    one["encoder_counts_per_rev"] = 4e6
    for told in (one, one["admittance"]):
        for key, value in told.items():
            if key.endswith(TORQUES):
                told[key] = value * by
    return loaded.model_copy(update={"config": Config.model_validate(table)})


def loop_of_size(by, **admittance):
    return stability_report.admittance_loop(of_size(by, **admittance), 0)


LOOSE = {"rest_damping_nms_rad": 0.0, "mass_max_kgm2": 0.0}
GROWS = {**LOOSE, "mass_kgm2": 0.006}


@pytest.mark.parametrize("by", [1e-4, 30.0])
def test_what_is_found_is_in_proportion_to_the_joint(by):
    usual, other = loop_of_size(1.0, **GROWS), loop_of_size(by, **GROWS)
    assert sticking(other).speed_rad_s == pytest.approx(sticking(usual).speed_rad_s, rel=0.05)
    rubbing = [admittance_margin.judge_rubbing(one)[0].radius for one in (usual, other)]
    assert rubbing[1] - 1 == pytest.approx(rubbing[0] - 1, rel=0.1)
    for searched in (
        admittance_margin.largest_hand,
        admittance_margin.least_damping,
        calming_rest_damping,
    ):
        assert searched(other) / by == pytest.approx(searched(usual), rel=0.1)


def test_a_small_joint_that_the_springs_of_a_usual_one_certified_shakes_and_is_refused():
    loose = of_size(1e-3, **LOOSE)
    found = sticking(stability_report.admittance_loop(loose, 0))
    assert 0.03 < found.speed_rad_s < 0.3
    calm = calming_rest_damping(stability_report.admittance_loop(loose, 0))
    named = of_size(1e-3, **LOOSE | {"rest_damping_nms_rad": 1e3 * calm})
    assert sticking(stability_report.admittance_loop(named, 0)).speed_rad_s == 0
    leans = {"amplitude": 0.02, "hz": 1.0, "from_s": 1.2, "to_s": 3.45}
    hand = {"spring": 0.0302, "damper": 1e-7, "mass": 5e-6, **leans}
    joint = {
        "motor": 1.2e-5,
        "viscous": 5e-5,
        "coulomb": 2.5e-4,
        "breakaway": 3.5e-4,
        "bristle": 0.5,
        "exponent": 0.0,
    }
    speeds = []
    for one in (loose, named):
        rig = Rig(one, [axis(**joint, **hand)], step_s=4e-5)
        rig.law[3]["environment_kind"], rig.law[3]["environment_stiffness_nm_rad"] = (
            int(Environment.SPRING),
            0.306,
        )
        moved, _, states = rig.run(7.0)
        assert states[-1] == State.ACTIVE
        speeds.append(float(np.sqrt(np.mean(np.square(moved[-2000:])))))
    assert speeds[1] < 0.002 < 0.05 < speeds[0] < found.speed_rad_s


def crank(folder, lever_m):
    """A crank of 5 kg m^2 with its handle so far out, a force sensor of 35 Hz and an observer; and its row in
    `rtctl check`.
    """
    says = {
        "inertia_kgm2": 5.07, "viscous_nms_rad": 6.5, "lever_m": [0.0, lever_m, 0.0], "torque_limit_nm": 30.0,
        "torque_rate_nm_s": 6e3, "current_limit_a": 200.0,
        "coupling": {"stiffness_nm_rad": 1.0, "damping_nms_rad": 1.9},
        "force": {"limit_n": 1e4, "sensor_lowpass_hz": 35.0}, "encoder_counts_per_rev": 1e7,
        "friction": {"policy": "observer", "gain": 0.9, "intent_nm": 0.3, "gate_nm": 0.15,
            "presliding_rad": 1e-3, "observer": {"gain": 0.88, "bandwidth_hz": 15.0}},
    }  # fmt: skip
    friction = dict(JOINT, viscous=6.5, coulomb=1.5, breakaway=1.515, bristle=1500.0)
    loaded = rig_file("mock.toml", [says], folder, models=[model(friction)])
    rows = stability_report.examine(loaded).axes[0].verdicts
    return loaded, next(row for row in rows if row.name == "disturbance observer in a hand")


def test_an_observer_is_tuned_and_judged_in_the_hands_that_hold_its_own_handle(tmp_path):
    """The hands of a handle .1 m away were tried at every one: this crank passed, and swung on for seconds in
    a hand of 60 kN/m at .4 m.
    """
    near, row = crank(tmp_path, 0.1)
    assert "hands to 600 N m/rad, 1 N m s/rad, 0.02 kg m^2" in row.meaning
    assert observer_tuning.of_axis(near, 0).own_ticks == 0
    far, row = crank(tmp_path, 0.4)
    assert "hands to 9600 N m/rad, 16 N m s/rad, 0.32 kg m^2" in row.meaning
    assert row.outcome.name == "PASS"
    assert observer_tuning.of_axis(far, 0).own_ticks > 0


@pytest.mark.parametrize(
    ("motion", "lever_m", "direction", "factor"),
    [
        ("rotary", (0.0, 0.1, 0.0), (0.0, 0.0, 0.0), 1.0),
        ("rotary", (0.3, 0.4, 0.0), (0.0, 0.0, 0.0), 25.0),
        ("rotary", (0.0, 0.01, 0.0), (0.0, 0.0, 0.0), 0.01),
        ("rotary", (0.0, 0.01, 0.0), (0.0, 0.0, 1.0), 1.0),
        ("linear", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 100.0),
    ],
)
def test_a_hand_is_the_same_at_every_handle(motion, lever_m, direction, factor):
    slide = load(shipped_config("mock-linear.toml")).config.axis[0]
    own = slide.model_copy(update={"motion": motion, "lever_m": lever_m, "axis_direction": direction})
    assert hand_factor(own) == pytest.approx(factor)
