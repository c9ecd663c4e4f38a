"""The devices of a rig file make up a whole rig, or the file is refused naming devices and keys."""

from pathlib import Path

import pytest

from hw import registry
from hw.interface import BackendInfo, Channels
from rtctl.errors import ConfigError
from rtctl.rig_file.config import load

AXIS = """
[[axis]]
name = "{name}"
inertia_kgm2 = 0.012
viscous_nms_rad = 0.05
encoder_counts_per_rev = 160000
torque_constant_nm_a = 0.02
lever_m = [0.0, 0.1, 0.0]
torque_limit_nm = 1.0
torque_rate_nm_s = 200
velocity_limit_rad_s = 10
"""
HEAD = '[rig]\nname = "bench"\n'


def _info(provides, consumes, simulated=False):
    return BackendInfo(
        factory="none:none",
        options="hw.simulators.mock_options:MockOptions",
        simulated=simulated,
        channels=Channels(frozenset(provides.split()), frozenset(consumes.split())),
    )


KINDS = {
    "drive": _info("position current estop", "torque"),
    "finger": _info("force", ""),
    "board": _info("position current force temperature", "torque current_command"),
    "pendant": _info("estop", ""),
    "warmth": _info("temperature", ""),
    "tacho": _info("velocity", ""),
}


@pytest.fixture(autouse=True)
def kinds(monkeypatch):
    for name, info in KINDS.items():
        monkeypatch.setitem(registry.BUILT_IN, name, info)
    registry.lookup.cache_clear()
    yield
    registry.lookup.cache_clear()


@pytest.fixture
def rig(tmp_path):
    def _load(*devices, axes=("joint",), head=HEAD, rate_hz=1000, clock="wall"):
        text = head + f'[loop]\nrate_hz = {rate_hz}\nclock = "{clock}"\n'
        text += "".join(AXIS.format(name=name) for name in axes)
        for device in devices:
            kind, _, more = device.partition("\n")
            text += f'[[device]]\nkind = "{kind}"\n{more}\n'
        path = tmp_path / "rig.toml"
        path.write_text(text)
        return load(path)

    return _load


@pytest.fixture
def faults(rig):
    def _faults(*devices, **more):
        with pytest.raises(ConfigError) as caught:
            rig(*devices, **more)
        return caught.value.faults

    return _faults


def test_a_drive_and_a_force_sensor_make_a_rig(rig):
    loaded = rig("drive", "finger\nrate_hz = 500")
    drive, finger = loaded.members()
    assert drive.channels == ("current", "estop", "position", "torque")
    assert (drive.max_age_ticks, finger.max_age_ticks) == (0, 2)
    assert drive.budget_ns == finger.budget_ns == 200_000
    assert finger.label == "device[1] 'finger'"
    assert not loaded.config.simulated


def test_each_device_has_its_own_options(rig):
    loaded = rig("drive\n[device.options]\nseed = 5", "finger\n[device.options]\nseed = 6")
    assert [member.options["seed"] for member in loaded.members()] == [5, 6]


def test_a_fault_in_the_options_of_any_device_is_named(faults):
    (line,) = faults("drive", "finger\n[device.options]\nnonsense = 1")
    assert "device[1].options.nonsense" in line


def test_a_channel_provided_twice_names_both_devices_and_the_key(faults):
    (line,) = faults("board", "finger")
    for part in ("device[0] 'board'", "device[1] 'finger'", "both provide force", "device[1].channels"):
        assert part in line


def test_the_key_it_names_is_the_remedy(rig):
    loaded = rig('board\nchannels = ["position", "current", "torque"]', "finger")
    assert loaded.members()[0].channels == ("current", "position", "torque")


def test_two_devices_may_not_drive_one_axis(faults):
    (line,) = faults("drive", 'board\nchannels = ["force", "torque"]')
    assert "device[0] 'drive' and device[1] 'board' both take the command of axis 'joint'" in line


def test_a_gap_names_the_channel_and_what_the_devices_have(faults):
    (line,) = faults("drive\nname = 'motor'")
    assert "no device provides force" in line
    assert "device[0] 'motor' has current, estop, position, torque" in line
    assert 'rig.absent = ["force"]' in line
    lines = faults("finger", "warmth")
    assert len(lines) == 3
    assert any("no device takes the torque or current of axis 'joint'" in line for line in lines)


def test_a_sensor_the_rig_does_not_have_can_be_stated(rig, faults):
    assert rig("drive", head=HEAD + 'absent = ["force"]\n')
    (line,) = faults("drive", "finger", head=HEAD + 'absent = ["force"]\n')
    assert "rig.absent: device[1] 'finger' provides 'force'" in line


def test_several_emergency_stops_are_one(rig):
    assert len(rig("drive", "finger", "pendant").members()) == 3


def test_a_drive_per_axis(rig, faults):
    one, two = 'drive\nname = "a"\naxes = ["x"]', 'drive\nname = "b"\naxes = ["y"]'
    loaded = rig(one, two, "finger", axes=("x", "y"))
    assert [member.axes for member in loaded.members()] == [(0,), (1,), (0, 1)]
    lines = faults(one, "finger", axes=("x", "y"))
    assert any("no device provides position of axis 'y'" in line for line in lines)
    lines = faults("drive", two, "finger", axes=("x", "y"))
    assert any("both provide position of axis 'y'" in line for line in lines)
    assert not any("'x'" in line for line in lines)


@pytest.fixture
def use_velocity(monkeypatch):
    """Every axis of the rig file looks at the velocity that a device measures."""
    monkeypatch.setitem(globals(), "AXIS", AXIS + '[axis.velocity]\ndevice = "check"\n')


def test_the_velocity_is_optional_and_comes_from_one_device(rig, faults):
    assert len(rig("drive", "finger").members()) == 2
    loaded = rig("drive", "finger", "tacho")
    assert loaded.members()[2].channels == ("velocity",)
    (line,) = faults("drive", "finger", "tacho", 'tacho\nname = "second"')
    assert "device[2] 'tacho' and device[3] 'second' both provide velocity" in line
    (line,) = faults("drive", "finger", "tacho\nmax_age_ticks = 3")
    assert "velocity bears 2" in line


def test_a_law_that_looks_at_the_velocity_needs_a_device_that_has_it(rig, faults, use_velocity):
    assert rig("drive", "finger", "tacho")
    (line,) = faults("drive", "finger")
    for part in (
        "axis[0].velocity.device",
        "no device provides velocity",
        "device[0] 'drive' has",
        'device = "record"',
    ):
        assert part in line
    (line,) = faults("drive", "finger", 'tacho\naxes = ["y"]', axes=("x", "y"))
    assert "axis[0].velocity.device: no device provides velocity of axis 'x'" in line


@pytest.mark.parametrize(
    ("device", "words"),
    [
        ('finger\naxes = ["elbow"]', "device[1].axes: no axis is called 'elbow'; there are joint"),
        ('finger\naxes = ["joint", "joint"]', "names an axis twice"),
        ('finger\nchannels = ["velocity"]', "'velocity' is not a channel of 'finger', which has force"),
        ('finger\nname = "motor"', "device[0].name and device[1].name: both are 'motor'"),
        ("finger\nrate_hz = 50", "device[1].rate_hz: samples of device[1] 'finger' could be 20 ticks old"),
        ("finger\nmax_age_ticks = 11", "device[1].max_age_ticks"),
        ("finger\nbudget_us = 900", "together, above 800 us"),
    ],
)
def test_wrong_tables_are_refused_naming_the_key(faults, device, words):
    (line,) = faults('drive\nname = "motor"', device)
    assert words in line


def test_the_position_must_be_new_in_every_cycle(faults):
    (line,) = faults("drive\nrate_hz = 500", "finger")
    assert "device[0].rate_hz: 500 is below loop.rate_hz 1000" in line
    (line,) = faults("drive\nmax_age_ticks = 1", "finger")
    assert "position bears 0" in line


def test_a_virtual_clock_runs_nothing_real(rig, faults):
    assert rig("mock", clock="virtual")
    mock = 'mock\nchannels = ["position", "current", "current_command"]'
    (line,) = faults(mock, "finger", clock="virtual")
    assert "loop.clock" in line
    assert "device[1] 'finger' is not simulated" in line


def test_ages_are_bounded_in_time_not_in_ticks(rig):
    assert rig("drive", "finger\nrate_hz = 500", rate_hz=10_000).members()[1].max_age_ticks == 20
    assert rig("drive", "finger\nrate_hz = 1245").members()[1].max_age_ticks == 1


def test_a_simulated_device_has_no_budget(rig):
    mock = 'mock\nchannels = ["position", "current", "current_command"]'
    loaded = rig(mock, "finger")
    assert [member.budget_ns for member in loaded.members()] == [0, 400_000]
    assert not loaded.config.simulated


def test_the_mock_alone_is_a_rig_and_costs_no_composition(rig):
    (one,) = rig("mock").members()
    assert (one.axes, one.max_age_ticks, one.budget_ns) == ((0,), 0, 0)


def test_a_copy_with_other_tables_has_devices_of_its_own(rig):
    loaded = rig("mock")
    (before,) = loaded.members()
    assert loaded.members()[0] is before
    (other,) = loaded.model_copy(update={"options": {**loaded.options, "seed": 7}}).members()
    assert (before.options["seed"], other.options["seed"]) == (1, 7)
    table = loaded.config.device[0].model_copy(update={"name": "arm"})
    config = loaded.config.model_copy(update={"device": (table,)})
    assert loaded.model_copy(update={"config": config}).members()[0].label == "device[0] 'arm'"
    assert loaded.members()[0] is before


def test_more_than_eight_devices_are_refused(faults):
    assert any("device" in line for line in faults(*["pendant"] * 9))


def test_the_shipped_rig_of_two_makers_devices_is_whole():
    path = Path(__file__).parents[2] / "configs" / "drive-and-force-sensor.toml"
    drive, sensor = load(path).members()
    assert {"position", "current"} <= set(drive.channels)
    assert (sensor.channels, sensor.max_age_ticks) == (("force",), 2)
