"""Force and current sensors that lie in power: the simulated rig stops, and a rig whose sensors are only
coarse does not.
"""

import numpy as np
import pytest

from rtctl.control.vocabulary import Environment, Fault, State
from rtctl.rig_file import config
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.shipped_files import shipped_config

FROZEN_AT_S = 3.3


def rig(folder, *changes, name="mock.toml"):
    text = shipped_config(name).read_text().replace("friction/mock.json", str(MODEL))
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "rig.toml"
    path.write_text(text)
    return Simulation(config.load(path))


MODEL = shipped_config("friction/mock.json")


def fault(channel, kind, at_s=FROZEN_AT_S, **more):
    return {"channel": channel, "kind": kind, "at_s": at_s, "for_s": 0, **more}


def lived(made, seconds, *faults):
    """(first fault or none, seconds from the first scripted one to it, ticks) of a rig that a hand swings."""
    made.script(list(faults))
    made.arm()
    began_s = made.time_s
    ticks = made.run(seconds)
    bad = np.flatnonzero(ticks["faults"])
    if not len(bad):
        return Fault(0), np.inf, ticks
    since_s = began_s + bad[0] * made.plan.period_s - (faults[0]["at_s"] if faults else 0.0)
    return Fault(int(ticks["faults"][bad[0]])), since_s, ticks


@pytest.mark.parametrize("at_s", [2.5, 3.0, FROZEN_AT_S])
def test_a_force_that_is_frozen_in_power_stops_the_rig(tmp_path, at_s):
    found, after_s, ticks = lived(rig(tmp_path), 8.0, fault("force", "frozen", at_s))
    assert found == Fault.FORCE_FROZEN
    assert 0.5 <= after_s < 3.0
    assert State(int(ticks["state"][-1])) is State.FAULT


NO_FRICTION = (('policy = "hybrid"', 'policy = "off"'),)
ANY_OFFSET = ("limit_n = 50.0", "limit_n = 50.0\noffset_nm = 1e4")


def test_one_that_shows_the_zero_is_known_by_the_energy_that_nobody_gave(tmp_path):
    """Frozen at its zero no direction of the friction seen is off, and a joint without compensation is braked
    only by b.
    """
    gone = fault("force", "scale", value=0.0)
    for changes in ([ANY_OFFSET], [ANY_OFFSET, *NO_FRICTION]):
        found, after_s, _ = lived(rig(tmp_path, *changes), 8.0, gone)
        assert found == Fault.FORCE_FROZEN
        assert 0.5 <= after_s < 4.0


COARSE = ("resolution_n = 0.005\nnoise_n = 0.005", "resolution_n = 0.5\nnoise_n = 0.0")
STILL = ('kind = "sine"', 'kind = "none"')


@pytest.mark.parametrize("name", ["mock.toml", "mock-wall.toml", "mock-stiction.toml"])
def test_a_coarse_and_quiet_sensor_in_a_moving_hand_is_none_of_this(tmp_path, name):
    made = rig(tmp_path, COARSE, name=name)
    found, _, ticks = lived(made, 30.0)
    assert found == Fault(0)
    assert int(ticks["state"][-1]) == State.ACTIVE


@pytest.mark.parametrize("resolution_n", [0.005, 0.5, 5.0])
def test_a_joint_that_nobody_holds_may_be_moved_for_ever_with_a_force_that_never_changes(
    tmp_path, resolution_n
):
    """The renderer swings it; the sensor shows its zero to the last bit all the while, and that is right."""
    coarse = (COARSE[0], f"resolution_n = {resolution_n}\nnoise_n = 0.0")
    quiet = ("drift_n_sqrt_s = 0.002", "drift_n_sqrt_s = 0.0")
    made = rig(tmp_path, coarse, quiet, STILL)
    made.arm(environment_kind=Environment.SPRING, environment_stiffness_nm_rad=8.0)
    swung = []
    for k in range(40):
        ticks = made.run(0.5, environment_center_rad=0.15 * (-1) ** k)
        assert not np.any(ticks["faults"]), Fault(int(np.bitwise_or.reduce(ticks["faults"])))
        swung.append(np.ptp(ticks["position_rad"]))
    assert np.mean(swung) > 0.1
    assert not np.any(np.diff(made.run(0.5)["force_n"], axis=0)), "the force was to stay"


def test_a_sensor_at_rest_may_repeat_itself_for_ever(tmp_path):
    made = rig(tmp_path, COARSE, ('kind = "sine"', 'kind = "rest"'))
    assert lived(made, 20.0)[0] == Fault(0)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("value", [50.0, -50.0])
def test_a_component_exactly_at_its_limit_is_clipped_at_the_third_sample(tmp_path, axis, value):
    found, after_s, ticks = lived(
        rig(tmp_path), 4.0, fault("force", "saturated", 3.0, axis=axis, value=value)
    )
    assert found & Fault.FORCE_CLIPPED
    assert after_s == pytest.approx(0.002, abs=1e-6)
    assert State(int(ticks["state"][-1])) is State.FAULT


def test_two_samples_at_the_limit_and_one_just_below_it_are_none(tmp_path):
    short = {**fault("force", "saturated", 3.0, axis=2, value=50.0), "for_s": None, "for_ticks": 2}
    below = fault("force", "saturated", 3.5, axis=2, value=49.99)
    assert lived(rig(tmp_path), 2.6, short, below)[0] == Fault(0)


@pytest.mark.parametrize("value", [4.0, -4.0])
def test_a_force_that_is_off_in_power_is_found_once_the_joint_has_slid_both_ways(tmp_path, value):
    found, after_s, ticks = lived(rig(tmp_path), 8.0, fault("force", "offset", 3.0, axis=1, value=value))
    assert found == Fault.FORCE_OFFSET
    assert after_s < 2.5, "a stroke each way"
    bad = int(np.flatnonzero(ticks["faults"])[0])
    assert np.sign(ticks["force_offset_nm"][bad, 0]) == np.sign(value)


def test_how_far_it_may_be_off_is_the_rig_files(tmp_path):
    small = fault("force", "offset", 3.0, axis=1, value=1.0)
    assert lived(rig(tmp_path), 8.0, small)[0] == Fault(0)
    strict = ("limit_n = 50.0", "limit_n = 50.0\noffset_nm = 0.06")
    assert lived(rig(tmp_path, strict), 8.0)[0] == Fault(0)
    assert lived(rig(tmp_path, strict), 8.0, small)[0] == Fault.FORCE_OFFSET
    assert lived(rig(tmp_path, ANY_OFFSET), 8.0, fault("force", "offset", 3.0, value=4.0))[0] == Fault(0)


@pytest.mark.parametrize(
    ("kind", "value"), [("scale", 0.6), ("scale", 1.5), ("offset", 0.4), ("offset", -0.4)]
)
def test_a_current_that_becomes_another_in_power_is_found_within_a_few_seconds(tmp_path, kind, value):
    found, after_s, ticks = lived(rig(tmp_path), 8.0, fault("current", kind, 4.0, value=value))
    assert found == Fault.CURRENT
    assert after_s < 4.0
    bad = int(np.flatnonzero(ticks["faults"])[0])
    if kind == "scale":
        assert ticks["running_gain"][bad, 0] == pytest.approx(value, abs=0.02)
    else:
        assert ticks["running_offset_nm"][bad, 0] == pytest.approx(0.768 * value, abs=0.02)
    assert ticks["arming_gain"][bad, 0] == pytest.approx(1.0, abs=0.05), "the pulse saw nothing"


def test_an_offset_of_a_current_that_never_changes_shows_too(tmp_path):
    """No friction is compensated and nothing pushes: the gap itself is all there is."""
    made = rig(tmp_path, *NO_FRICTION)
    found, after_s, ticks = lived(made, 8.0, fault("current", "offset", 4.0, value=0.4))
    assert found == Fault.CURRENT
    assert after_s < 4.0
    assert np.isnan(ticks["running_gain"][0, 0])


@pytest.mark.parametrize(
    ("key", "passes"), [("current_gain_error = 0.5", True), ("current_gain_error = 0.1", False)]
)
def test_the_bounds_of_the_pulse_are_the_rig_files(tmp_path, key, passes):
    made = rig(tmp_path, ("[axis.coupling]", f"[axis.drive]\n{key}\n\n[axis.coupling]"))
    made.script([fault("current", "scale", 0.0, value=0.75 if not passes else 0.6)])
    made.run(1.5)
    ticks = made.run(0.2, arm_count=1, epoch=int(made.state["epoch"][0]))
    assert bool(np.any(ticks["state"] == State.ACTIVE)) is passes
    assert bool(np.any(ticks["faults"] & int(Fault.CURRENT))) is not passes


@pytest.mark.parametrize(("share", "passes"), [(0.3, True), (0.05, False)])
def test_so_is_how_far_it_may_be_off_besides(tmp_path, share, passes):
    made = rig(
        tmp_path, ("[axis.coupling]", f"[axis.drive]\ncurrent_offset_share = {share}\n\n[axis.coupling]")
    )
    made.script([fault("current", "offset", 0.0, value=0.4 if passes else 0.2)])
    made.run(1.5)
    ticks = made.run(0.2, arm_count=1, epoch=int(made.state["epoch"][0]))
    assert bool(np.any(ticks["state"] == State.ACTIVE)) is passes
