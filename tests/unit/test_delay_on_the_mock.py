"""Torque that comes later, or samples that come more rarely, than the coupling is proven for: the simulated
rig stops.
"""

import numpy as np
import pytest

from rtctl.check import law_plan as plan
from rtctl.check import stability_report
from rtctl.check.verdict import Outcome
from rtctl.control.detectors import age_fault
from rtctl.control.vocabulary import Environment, Fault, State
from rtctl.errors import FaultError
from rtctl.rig_file import config
from rtctl.rig_file.measured_timing import AxisTiming
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.shipped_files import shipped_config

PER_AMPERE = 0.768
"""N m at the joint per ampere of configs/mock.toml: gear ratio, efficiency, torque constant."""


def rig(folder, *changes, name="mock.toml", **plant):
    text = shipped_config(name).read_text().replace('model = "friction/mock.json"', 'model = ""')
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "rig.toml"
    path.write_text(text)
    made = Simulation(config.load(path))
    for field, value in plant.items():
        made.plant_params[field] = value
    return made


def tried(made):
    """(faults that appeared, was it ever ACTIVE) when somebody arms it, once."""
    ticks = made.run(1.5)
    ticks = np.concatenate([ticks, made.run(0.2, arm_count=1, epoch=int(made.state["epoch"][0]))])
    return (
        Fault(int(np.bitwise_or.reduce(ticks["faults"]))),
        bool(np.any(ticks["state"] == State.ACTIVE)),
        ticks,
    )


def covered(made):
    return float(made.params["proof_delay_s"][0, 0]) / made.plan.period_s


@pytest.mark.parametrize("delay", [0, 1, 2, 3, 4])
@pytest.mark.parametrize("stiffness", [60.0, 25.0, 10.0])
def test_a_rig_whose_true_delay_its_file_does_not_tell_arms_only_if_its_coupling_bears_it(
    tmp_path, delay, stiffness
):
    made = rig(
        tmp_path, ("stiffness_nm_rad = 60.0", f"stiffness_nm_rad = {stiffness}"), torque_delay_ticks=delay
    )
    assert (
        {60.0: 0.3, 25.0: 1.6, 10.0: 4.0}[stiffness]
        < covered(made)
        < {60.0: 0.5, 25.0: 1.9, 10.0: 5.5}[stiffness]
    )
    faults, active, ticks = tried(made)
    if delay < covered(made):
        assert (faults, active) == (Fault(0), True)
        assert ticks["arming_delay_ticks"][-1, 0] == pytest.approx(delay, abs=0.02)
    else:
        assert (faults & Fault.DELAY, active) == (Fault.DELAY, False)
        assert State(int(ticks["state"][-1])) is State.FAULT
        assert int(ticks["fault_first"][-1]) == Fault.DELAY.bit_length() - 1
    found = ticks["arming_delay_ticks"][:, 0]
    assert np.isnan(found[0]), "nothing is known before the pulse"


def test_a_delay_that_is_declared_is_proven_and_passes(tmp_path):
    made = rig(
        tmp_path,
        ("stiffness_nm_rad = 60.0", "stiffness_nm_rad = 18.0\ndelay_ticks = 2"),
        torque_delay_ticks=2,
    )
    assert covered(made) >= 2.0
    faults, active, ticks = tried(made)
    assert (faults, active) == (Fault(0), True)
    assert ticks["arming_gain"][-1, 0] == pytest.approx(1.0, abs=0.05)
    assert ticks["arming_offset_nm"][-1, 0] == pytest.approx(0.01 * PER_AMPERE, abs=0.006)


@pytest.mark.parametrize(
    ("scale", "fault"), [(0.6, Fault.CURRENT), (0.8, None), (1.2, None), (1.5, Fault.CURRENT)]
)
def test_a_hall_sensor_of_another_scale_is_found_by_the_pulse(tmp_path, scale, fault):
    made = rig(tmp_path)
    made.script([{"channel": "current", "kind": "scale", "value": scale, "at_s": 0.0, "for_s": 1000.0}])
    faults, active, ticks = tried(made)
    assert active == (fault is None)
    assert bool(faults & Fault.CURRENT) == (fault is not None)
    assert ticks["arming_gain"][-1, 0] == pytest.approx(scale, abs=0.05)


def test_a_torque_constant_that_is_off_does_not_show_in_the_current(tmp_path):
    """It scales the torque behind the current: no figure of this page claims to see it."""
    nominal = rig(tmp_path).plant_params["torque_per_ampere"][0, 0]
    for scale in (0.6, 1.0, 1.5):
        faults, active, ticks = tried(rig(tmp_path, torque_per_ampere=nominal * scale))
        assert (faults, active) == (Fault(0), True)
        assert ticks["arming_gain"][-1, 0] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(("bias_a", "passes"), [(0.1, True), (-0.1, True), (0.4, False), (-0.4, False)])
def test_a_biased_hall_sensor_is_refused_from_a_tenth_of_the_limit_on(tmp_path, bias_a, passes):
    faults, active, ticks = tried(rig(tmp_path, current_bias_a=bias_a))
    assert active is passes
    assert bool(faults & (Fault.CURRENT | Fault.ACTUATOR_LAG)) is not passes
    if passes:
        assert ticks["arming_offset_nm"][-1, 0] == pytest.approx(bias_a * PER_AMPERE, abs=0.006)


def test_a_delay_that_grows_while_running_is_noticed_within_a_few_seconds(tmp_path):
    made = rig(tmp_path)
    made.arm(environment_kind=Environment.SPRING, environment_stiffness_nm_rad=5.0)
    calm = made.run(4.0)
    assert not np.any(calm["faults"])
    assert calm["running_delay_ticks"][-1, 0] == pytest.approx(0.0, abs=0.3)
    made.plant_params["torque_delay_ticks"] = 3
    ticks = made.run(8.0)
    stopped = np.flatnonzero(ticks["state"] != State.ACTIVE)
    assert len(stopped)
    assert stopped[0] * made.plan.period_s < 6.0
    assert Fault(int(ticks["faults"][stopped[0]])) & Fault.DELAY
    shown = ticks["running_delay_ticks"][stopped[0], 0]
    assert shown == pytest.approx(3.0, abs=0.6)


def lost(every_ticks, for_ticks, at_s=0.0):
    return [
        {"channel": "link", "kind": "drop", "at_s": at_s, "for_ticks": for_ticks, "every_ticks": every_ticks}
    ]


def test_a_device_that_is_fresh_every_third_tick_does_not_arm(tmp_path):
    made = rig(tmp_path)
    made.script(lost(3, 2))
    faults, active, _ = tried(made)
    assert (faults, active) == (Fault.SAMPLE_AGE, False)


def test_one_that_becomes_so_while_running_is_stopped_within_a_tenth_of_a_second(tmp_path):
    made = rig(tmp_path)
    made.arm()
    at = made.time_s + 0.5
    made.script(lost(3, 2, at))
    ticks = made.run(1.0)
    stopped = np.flatnonzero(ticks["faults"] & int(Fault.SAMPLE_AGE))
    assert 0.5 < stopped[0] * made.plan.period_s < 0.6
    assert State(int(ticks["state"][stopped[0]])) is State.STOPPING


@pytest.mark.parametrize(("stiffness", "every_ticks", "for_ticks", "stops"), [
    (60.0, 25, 1, False), (60.0, 25, 2, True), (60.0, 2, 1, True), (25.0, 2, 1, False), (25.0, 3, 2, True),
    (10.0, 3, 2, False),
])  # fmt: skip
def test_how_old_samples_may_be_is_what_the_coupling_bears(
    tmp_path, stiffness, every_ticks, for_ticks, stops
):
    made = rig(tmp_path, ("stiffness_nm_rad = 60.0", f"stiffness_nm_rad = {stiffness}"))
    made.script(lost(every_ticks, for_ticks))
    faults, active, _ = tried(made)
    assert bool(faults & Fault.SAMPLE_AGE) is stops
    assert active is not stops


def test_single_lost_samples_are_none_of_this(tmp_path):
    made = rig(tmp_path)
    made.script(lost(21, 1))
    made.arm()
    ticks = made.run(20.0)
    assert np.mean(ticks["sample_age_ticks"] > 0) == pytest.approx(1 / 21, rel=0.02)
    assert not np.any(ticks["faults"])


def ages(made, ticks):
    """What is said of the age of the sample, tick by tick."""
    found = []
    for _ in range(ticks):
        found.append(int(age_fault(made.state[0], made.params[0])))
        made.state["ticks"] += 1
    return found


def test_samples_refused_because_the_joint_is_out_of_reach_are_not_the_devices(tmp_path):
    """A joint about as fast as its limit: every third position is beyond the reach of a tick."""
    made = rig(tmp_path)
    made.arm()
    made.state["jump_count"][0, 0] = 1
    made.state["sample_age_ticks"] = 2
    assert not any(ages(made, 200))
    made.state["jump_count"][0, 0] = 0
    assert ages(made, 200)[-1] == int(Fault.SAMPLE_AGE)


def test_a_recording_is_not_watched(tmp_path):
    rows = "\n".join(f"{k / 1000!r},0.0,0.0,0.0" for k in range(100))
    (tmp_path / "log.csv").write_text("t,x,q,h\n" + rows + "\n")
    text = shipped_config("mock.toml").read_text()
    text = text[: text.index("[[device]]")].replace('model = "friction/mock.json"', 'model = ""')
    text += (
        '[[device]]\nkind = "playback"\n[device.options]\nfile = "log.csv"\ntime = { column = "t" }\n'
        '[[device.options.axis]]\nposition = { column = "x" }\nmotor_torque = { column = "q" }\n'
        'hand_torque = { column = "h" }\n'
    )
    path = tmp_path / "playback.toml"
    path.write_text(text)
    assert plan.build(config.load(path)).params["proof_delay_s"][0, 0] == 0.0


def test_a_rig_that_never_arms_says_so(tmp_path):
    made = rig(tmp_path, torque_delay_ticks=2)
    with pytest.raises(FaultError, match="state FAULT"):
        made.arm()
    assert int(made.state["fault_first"][0]) == Fault.DELAY.bit_length() - 1


@pytest.mark.parametrize(("transport", "shown"), [(0.5, 0.0), (1.5, 1.0), (2.9, 2.0)])
def test_of_a_fraction_of_a_period_only_the_whole_part_shows(tmp_path, transport, shown):
    made = rig(tmp_path, transport_delay_ticks=transport)
    faults, active, ticks = tried(made)
    assert active == (shown < covered(made))
    assert np.nanmax(ticks["arming_delay_ticks"]) == pytest.approx(shown, abs=0.02)
    assert bool(faults & Fault.DELAY) != active


def test_a_device_slower_than_it_says_does_not_arm(tmp_path):
    faults, active, _ = tried(rig(tmp_path, sample_every_ticks=3))
    assert (faults, active) == (Fault.SAMPLE_AGE, False)


SLOW = ("[device.options.force]", "[device.options.timing]\nsample_every_ticks = 3\n\n[device.options.force]")


def test_one_that_declares_it_is_proven_with_it_and_arms(tmp_path):
    made = rig(tmp_path, SLOW, ("stiffness_nm_rad = 60.0", "stiffness_nm_rad = 7.4"))
    assert int(made.params["proof_age_ticks"][0, 0]) == 2
    assert covered(made) == pytest.approx(5.75, abs=0.02), "of a delay of two ticks it would be 6.06"
    assert not np.any(made.arm()["faults"])
    ticks = made.run(3.0)
    assert int(ticks["sample_age_ticks"].max()) == 2
    assert not np.any(ticks["faults"])


def test_one_so_slow_that_it_would_never_arm_is_refused(tmp_path):
    """A sample of three ticks is STALE, whatever the coupling bears: such files passed, and never left
    INIT.
    """
    text = shipped_config("mock.toml").read_text().replace('model = "friction/mock.json"', 'model = ""')
    text = text.replace("stiffness_nm_rad = 60.0", "stiffness_nm_rad = 1.0")
    for every, ok in ((3, True), (4, False)):
        (tmp_path / "rig.toml").write_text(text.replace(SLOW[0], SLOW[1].replace("= 3", f"= {every}")))
        report = stability_report.examine(config.load(tmp_path / "rig.toml"))
        refused = [row.name for row in report.verdicts if row.outcome == Outcome.FAIL]
        assert (report.ok, refused) == (ok, [] if ok else ["fresh samples"])
        assert ("loop.rate_hz = 750 at most" in report.refusal()) is not ok


def test_check_counts_what_the_pulse_measured_where_it_is_worse(tmp_path):
    loaded = config.load(rig(tmp_path)._loaded.path)
    before = stability_report.examine(loaded).axes[0]
    late = AxisTiming(2.5e-3, 5e-4, 1.0, 0.0, 1e-3, "2026-11-22")
    after = stability_report.examine(loaded, {loaded.config.axis[0].name: late}).axes[0]
    assert (before.delay_ticks, after.delay_ticks) == (0.0, pytest.approx(2.0))
    assert after.delay_from == "test pulse of 2026-11-22"
    assert after.current_loop_hz == pytest.approx(1 / (2 * np.pi * 5e-4))
    assert after.sampled_data_k_max_nm_rad < 0.4 * before.sampled_data_k_max_nm_rad
    assert not after.ok
    early = AxisTiming(0.0, 0.0, 1.0, 0.0, 1e-3, "2026-11-22")
    assert stability_report.examine(loaded, {loaded.config.axis[0].name: early}).axes[0] == before


@pytest.mark.parametrize(("counts", "outcome"), [(8000, None), (4096, Outcome.WARN), (3400, Outcome.FAIL)])
def test_an_encoder_whose_counts_are_jumps_on_a_quick_loop_is_told(tmp_path, counts, outcome):
    """At 10 kHz a joint of 6 rad/s may move by .9 mrad in a tick; the second sample of a count of twice that
    is a JUMP.
    """
    text = shipped_config("mock-10khz.toml").read_text()
    text = text.replace("encoder_counts_per_rev = 160000", f"encoder_counts_per_rev = {counts}")
    text = text.replace('model = "friction/mock.json"', 'model = ""')
    (tmp_path / "rig.toml").write_text(text)
    report = stability_report.examine(config.load(tmp_path / "rig.toml"), telling=False)
    found = [row.outcome for row in report.verdicts if row.name == "encoder count against a jump"]
    assert found == ([] if outcome is None else [outcome])
    assert ("loop.rate_hz = 9740 at most" in report.refusal()) is (outcome == Outcome.FAIL)
