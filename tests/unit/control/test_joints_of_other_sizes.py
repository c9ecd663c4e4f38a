"""An admittance a thousand times smaller or larger than the usual joint is certified by hands and worlds of
its own size, and shakes in them if it is not.
"""

import numpy as np
import pytest
from foreign_rig import Rig, axis

from rtctl.check import stability_report
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
