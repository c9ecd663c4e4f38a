"""A rig whose sensor shows moments, hangs on its joint and carries a tip: the simulated one, against what was
put in.
"""

import numpy as np
import pytest

from rtctl.check import law_plan as plan
from rtctl.control.vocabulary import Fault, State
from rtctl.errors import ConfigError
from rtctl.rig_file import config
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.shipped_files import shipped_config

MODEL = shipped_config("friction/mock.json")
QUIET = ("resolution_n = 0.005\nnoise_n = 0.005", "resolution_n = 1e-6\nnoise_n = 0.0")
NO_DRIFT = ("drift_n_sqrt_s = 0.002", "drift_n_sqrt_s = 0.0")
NO_CROSSTALK = ("crosstalk = [[1.0, 0.02, -0.01], [0.01, 1.0, 0.015], [-0.02, 0.01, 1.0]]", "")
AXIS = ("[axis.velocity]", "axis_direction = [0.0, 0.0, 1.0]\n\n[axis.velocity]")
"""With it lever_m = [0, 0.1, 0] is the arm [.1, 0, 0]."""

CONTACT = (
    "[device.options.force]",
    "[device.options.force.moment]\ncontact_m = [0.06, 0.01, 0.02]\nbias_nm = [0.02, -0.03, 0.05]\n\n"
    "[device.options.force]",
)
GRAVITY = "[0.0, -9.81, 0.0]"
TIP = f"tip_kg = 0.2\ntip_center_m = [0.03, 0.0, 0.01]\ngravity_m_s2 = {GRAVITY}\n"
HEAVY = ("crosstalk = [[1.0", f"{TIP}crosstalk = [[1.0")


def write(folder, *changes, sensor="", name="mock.toml"):
    text = shipped_config(name).read_text().replace("friction/mock.json", str(MODEL))
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    if sensor:
        text = text.replace("[[axis]]", f"[force_sensor]\n{sensor}\n\n[[axis]]", 1)
    path = folder / "rig.toml"
    path.write_text(text)
    return path


def rig(folder, *changes, sensor=""):
    return Simulation(config.load(write(folder, *changes, sensor=sensor)))


def off_nm(made, seconds=4.0):
    """Largest error of the hand's torque while the hand swings the joint."""
    made.arm()
    made.run(1.0)
    ticks = made.run(seconds)
    assert not np.any(ticks["faults"]), Fault(int(np.bitwise_or.reduce(ticks["faults"])))
    assert np.ptp(ticks["position_rad"]) > 0.4
    true = np.asarray(made.truth["hand_torque_nm"])[:-1]
    return float(np.max(np.abs(ticks["hand_torque_nm"][1:] - true)))


PLAIN = (QUIET, NO_DRIFT, NO_CROSSTALK, AXIS, CONTACT)


def test_r_x_f_plus_m_wherever_the_hand_holds_the_tip(tmp_path):
    assert off_nm(rig(tmp_path, *PLAIN, sensor="moments = true")) < 1e-6


def test_forces_alone_are_wrong_by_the_way_from_sensor_to_hand(tmp_path):
    assert off_nm(rig(tmp_path, *PLAIN)) > 0.01


WEIGHED = (QUIET, NO_DRIFT, AXIS, CONTACT, (NO_CROSSTALK[0], TIP))


@pytest.mark.parametrize("moments", ["true", "false"])
def test_the_weight_of_a_tip_is_followed(tmp_path, moments):
    """Without moments the lever alone sees the weight's force; with them its centre of mass counts as
    well.
    """
    changes = WEIGHED if moments == "true" else (*WEIGHED[:3], WEIGHED[4])
    told = f'moments = {moments}\ncarried_by = ["joint"]\n{TIP}'
    assert off_nm(rig(tmp_path, *changes, sensor=told)) < 1e-3  # an encoder's step of the pose
    left_out = off_nm(rig(tmp_path, *changes, sensor=f"moments = {moments}"))
    assert left_out > 0.005


def test_the_tick_has_the_tared_vector(tmp_path):
    told = f'moments = true\ncarried_by = ["joint"]\n{TIP}'
    made = rig(tmp_path, *WEIGHED, ('kind = "sine"', 'kind = "none"'), sensor=told)
    made.arm()
    ticks = made.run(0.5)
    assert np.max(np.abs(ticks["force_tared_n"])) < 1e-3
    assert np.max(np.abs(ticks["moment_tared_nm"])) < 1e-4
    assert np.max(np.abs(ticks["force_n"])) > 1.0, "weight and bias"
    made.script([{"channel": "moment", "kind": "offset", "axis": 1, "value": 0.25, "at_s": 0.0, "for_s": 0},
                 {"channel": "force", "kind": "offset", "axis": 2, "value": 2.0, "at_s": 0.0,
                     "for_s": 0}])  # fmt: skip
    ticks = made.run(0.1)
    assert ticks["force_tared_n"][-1] == pytest.approx([0.0, 0.0, 2.0], abs=1e-3)
    assert ticks["moment_tared_nm"][-1] == pytest.approx([0.0, 0.25, 0.0], abs=1e-4)


@pytest.mark.parametrize(
    ("channel", "axis", "value", "stops"),
    [("force", 0, 6.0, True), ("force", 2, -6.0, True), ("force", 0, 3.0, False), ("moment", 0, 0.3, True),
     ("moment", 1, 0.1, False), ("moment", 2, 0.15, False)],
)  # fmt: skip
def test_a_push_across_the_joint_stops_the_rig_and_one_along_it_does_not(
    tmp_path, channel, axis, value, stops
):
    told = "moments = true\noff_axis_n = 5.0\noff_axis_nm = 0.2"
    changes = (
        QUIET,
        NO_DRIFT,
        NO_CROSSTALK,
        AXIS,
        CONTACT,
        ("limit_n = 50.0", "limit_n = 50.0\noffset_nm = 1e4"),
    )
    made = rig(tmp_path, *changes, sensor=told)
    made.arm()
    calm = made.run(2.0)
    assert not np.any(calm["faults"])
    made.script(
        [{"channel": channel, "kind": "offset", "axis": axis, "value": value, "at_s": 0.0, "for_s": 0}]
    )
    ticks = made.run(1.0)
    assert bool(np.any(ticks["faults"] & int(Fault.OFF_AXIS))) is stops
    if stops:
        assert np.flatnonzero(ticks["faults"])[0] == 2, "the third sample"
        assert State(int(ticks["state"][-1])) is State.FAULT


def test_a_moment_that_is_no_number_or_at_its_limit_is_a_fault(tmp_path):
    for kind, value, fault in (("nan", None, Fault.BAD_SAMPLE), ("offset", 50.0, Fault.FORCE_CLIPPED)):
        changes = (*PLAIN, ("bias_nm = [0.02", "range_nm = 4.0\nbias_nm = [0.02"))
        made = rig(tmp_path, *changes, sensor="moments = true\nlimit_nm = 4.0")
        made.arm()
        lies = [
            {
                "channel": "moment",
                "kind": kind,
                "at_s": 0.0,
                "for_s": 0,
                **({"value": value} if value else {}),
            }
        ]
        lies += (
            [{"channel": "moment", "kind": "clipped", "at_s": 0.0, "for_s": 0, "value": 4.0}] if value else []
        )
        made.script(lies)
        ticks = made.run(0.2)
        first = int(np.flatnonzero(ticks["faults"])[0])
        assert first == 2
        assert Fault(int(ticks["faults"][first])) & fault
    still = rig(tmp_path, *PLAIN)
    still.script([{"channel": "moment", "kind": "nan", "at_s": 0.0, "for_s": 0}])
    still.arm()
    assert not np.any(still.run(0.5)["faults"]), "a rig that does not use moments"


@pytest.mark.parametrize(
    ("changes", "sensor", "told"),
    [
        ((CONTACT,), "moments = true", "axis_direction"),
        ((AXIS,), "moments = true", "no device provides moment"),
        ((), 'carried_by = ["wrist"]', "no axis is called 'wrist'; there are joint"),
        ((), 'carried_by = ["joint"]', "axis_direction"),
        ((AXIS,), 'carried_by = ["joint", "joint"]', "twice"),
        ((AXIS,), 'carried_by = ["joint"]\ntip_kg = 0.1', "gravity_m_s2"),
        ((AXIS,), f"tip_kg = 0.1\ngravity_m_s2 = {GRAVITY}", "carried_by"),
        ((), "off_axis_nm = 1.0", "moments = true"),
        ((("[axis.velocity]", "axis_direction = [0, 1, 0]\n\n[axis.velocity]"),), "", "perpendicular"),
        ((("[axis.velocity]", "axis_direction = [0, 0, 2]\n\n[axis.velocity]"),), "", "unit vector"),
        ((("lever_m = [0.0, 0.1, 0.0]", "lever_m = [0.0, 0.0, 0.0]"), AXIS), "", "lever_m"),
        ((), "limit_nm = 0.0", "limit_nm"),
    ],
)
def test_what_does_not_fit_is_refused_by_its_key(tmp_path, changes, sensor, told):
    with pytest.raises(ConfigError) as refused:
        config.load(write(tmp_path, *changes, sensor=sensor))
    assert told in "\n".join(refused.value.faults), refused.value.faults


def test_a_rig_of_three_forces_is_as_it_was(tmp_path):
    params = plan.build(config.load(write(tmp_path))).params[0]
    assert (params["moment_used"], params["chain_count"], params["off_axis_n"], params["off_axis_nm"]) == (
        0,
        0,
        0,
        0,
    )
    assert params["lever_m"].tolist() == [[0.0, 0.1, 0.0]]
