"""Several devices as one backend: exactly-once channels, faults of all, drives side by side."""

import json
from dataclasses import asdict

import numpy as np
import pytest
from rig_fakes import DRIVE, MADE, Fake, drive_and_finger, known, member, read, rig

from hw import registry
from hw.interface import Channels, LinkFault
from hw.member import Member
from hw.rig import Composite, compose
from hw.simulators.mock_backend import MockBackend
from hw.simulators.mock_options import MockOptions
from rtctl.control.jit import records
from rtctl.tick import FIELDS, new_ticks


@pytest.fixture(autouse=True)
def fakes():
    with known():
        yield


def test_one_device_that_serves_the_whole_rig_is_handed_out_as_it_is():
    backend = compose([member("drive", [*DRIVE, "force"], ["torque"])], rig())
    assert type(backend) is Fake


def test_one_device_of_which_only_some_channels_are_used_is_wrapped():
    backend = compose(
        [member("drive", [*DRIVE, "force"], ["torque"], channels=["position", "torque"])], rig()
    )
    assert isinstance(backend, Composite)
    assert (backend.provides, backend.consumes) == ({"position"}, {"torque"})


def test_each_channel_comes_from_its_own_device_and_nothing_else_is_touched():
    backend, drive, finger = drive_and_finger()
    drive.values = {"position_rad": 0.5, "current_a": 2.0, "force_n": [9, 9, 9], "velocity_rad_s": 5.0}
    finger.values = {"force_n": [1, 2, 3], "current_a": 77.0, "estop": 1, "state": 3}
    tick = new_ticks()
    before = tick.copy()
    read(backend, tick)
    assert tick["position_rad"][0, 0] == 0.5
    assert tick["current_a"][0, 0] == 2.0
    assert tick["force_n"][0].tolist() == [1, 2, 3]
    assert tick["estop"][0] == 0
    changed = {f.name for f in FIELDS if tick[f.name].tobytes() != before[f.name].tobytes()}
    assert changed == {"position_rad", "current_a", "force_n", "sample_count"}


def test_the_actuator_gets_the_command_and_the_sensor_gets_none():
    backend, drive, finger = drive_and_finger()
    tick = new_ticks()
    tick["tick"], tick["enabled"], tick["torque_applied_nm"], tick["current_command_a"] = 7, 1, 0.25, 0.5
    read(backend, tick)
    backend.write(tick)
    sent = drive.sent
    assert (sent["tick"][0], sent["enabled"][0], sent["torque_applied_nm"][0, 0]) == (7, 1, 0.25)
    assert sent["current_command_a"][0, 0] == 0.5
    assert "write" not in finger.calls


def test_an_actuator_the_rig_does_not_drive_is_told_zero_and_disabled():
    backend = compose(
        [
            member("drive", DRIVE, ["torque"]),
            member("spare", ["force"], ["torque"], channels=["force"]),
        ],
        rig(),
    )
    tick = new_ticks()
    tick["tick"], tick["enabled"], tick["torque_applied_nm"] = 7, 1, 0.25
    backend.write(tick)
    sent = MADE["spare"].sent
    assert (sent["tick"][0], sent["enabled"][0], sent["torque_applied_nm"][0, 0]) == (7, 0, 0.0)


def test_link_faults_of_all_devices_are_merged_and_clear_again():
    backend, drive, finger = drive_and_finger()
    drive.faults, finger.faults = LinkFault.CHECKSUM, LinkFault.DEVICE
    assert read(backend)["link_faults"][0] == LinkFault.CHECKSUM | LinkFault.DEVICE
    drive.faults = finger.faults = 0
    assert read(backend)["link_faults"][0] == 0


@pytest.mark.parametrize("pressed", ["drive", "pendant"])
def test_any_pressed_emergency_stop_counts(pressed):
    backend = compose(
        [member("drive", [*DRIVE, "force"], ["torque"]), member("pendant", ["estop"], max_age_ticks=3)], rig()
    )
    MADE[pressed].values = {"estop": 1}
    assert read(backend)["estop"][0] == 1


def test_two_drives_serve_an_axis_each():
    backend = compose(
        [
            member("elbow", ["position", "current"], ["torque"], axes=(1,)),
            member("shoulder", ["position", "current"], ["torque"], axes=(0,)),
            member("finger", ["force"], axes=(0, 1)),
        ],
        rig(2),
    )
    shoulder, elbow = MADE["shoulder"], MADE["elbow"]
    assert elbow.rig.gear_ratio.tolist() == [2.0]
    assert elbow.rig.lever_m.tolist() == [[3.0, 4.0, 5.0]]
    shoulder.values = {"position_rad": [0.1], "current_a": [1.0]}
    elbow.values = {"position_rad": [0.2], "current_a": [2.0]}
    MADE["finger"].values = {"force_n": [1, 2, 3]}
    tick = records(new_ticks(1, 2))
    tick["torque_applied_nm"] = [[5.0, 6.0]]
    read(backend, tick)
    backend.write(tick)
    assert tick["position_rad"][0].tolist() == [0.1, 0.2]
    assert tick["current_a"][0].tolist() == [1.0, 2.0]
    assert tick["force_n"][0].tolist() == [1, 2, 3]
    assert shoulder.sent["torque_applied_nm"].tolist() == [[5.0]]
    assert elbow.sent["torque_applied_nm"].tolist() == [[6.0]]


def test_three_axes_are_not_taken_for_the_three_forces():
    backend = compose(
        [
            member("a", ["position"], ["torque"], axes=(2, 0)),
            member("b", ["position", "force"], ["torque"], axes=(1,)),
        ],
        rig(3),
    )
    MADE["a"].values = {"position_rad": [3.0, 1.0]}
    MADE["b"].values = {"position_rad": [2.0], "force_n": [7, 8, 9]}
    tick = read(backend, new_ticks(1, 3))
    assert tick["position_rad"][0].tolist() == [1.0, 2.0, 3.0]
    assert tick["force_n"][0].tolist() == [7, 8, 9]


def test_temperature_is_nan_until_the_sensor_has_shown_one():
    backend = compose(
        [member("drive", [*DRIVE, "force"], ["torque"]), member("probe", ["temperature"], max_age_ticks=9)],
        rig(),
    )
    MADE["probe"].fresh = False
    assert np.isnan(read(backend)["temperature_c"][0, 0])


def test_the_velocity_of_another_device_reaches_its_axes_and_the_others_have_none():
    backend = compose(
        [
            member("drive", [*DRIVE, "force"], ["torque"], axes=(0, 1, 2)),
            member("tacho", ["velocity"], axes=(2, 0), max_age_ticks=2),
        ],
        rig(3),
    )
    MADE["tacho"].values = {"device_velocity_rad_s": [-3.0, 1.0]}
    tick = new_ticks(1, 3)
    tick["device_velocity_rad_s"] = np.nan
    read(backend, tick)
    assert tick["device_velocity_rad_s"][0, [0, 2]].tolist() == [1.0, -3.0]
    assert np.isnan(tick["device_velocity_rad_s"][0, 1])


def test_the_position_is_read_first_whatever_the_order_of_the_file():
    order = []
    backend = compose(
        [member("warmth", ["temperature"]), member("finger", ["force"]), member("drive", DRIVE, ["torque"])],
        rig(),
    )
    for name in MADE:
        MADE[name].on = {"read": lambda name=name: order.append(name)}
    read(backend)
    assert order == ["drive", "finger", "warmth"]


def test_a_split_mock_moves_as_a_whole_one():
    """The mock's motor as one device, the mock's force sensor alone as another: the motor moves the same."""
    options = MockOptions(axis=[{}], hand=[{"kind": "none"}]).model_dump(mode="json")
    whole = MockBackend(options, rig())
    drive = Member("mock", options, "drive", (0,), ("position", "current", "current_command"))
    finger = Member("mock", options, "finger", (0,), ("force",))
    split = compose([drive, finger], rig())
    a, b = records(new_ticks()), records(new_ticks())
    for slot in range(200):
        for backend, tick in ((whole, a), (split, b)):
            tick["tick"] = slot
            backend.read(tick)
            tick["enabled"], tick["current_command_a"] = 1, 2.0 * np.sin(slot / 20)
            backend.write(tick)
        assert a["position_rad"].tobytes() == b["position_rad"].tobytes()
    assert abs(a["position_rad"][0, 0]) > 1e-3


def test_a_member_survives_json():
    one = member("drive", DRIVE, ["torque"], max_age_ticks=2, budget_ns=5)
    assert Member.from_dict(json.loads(json.dumps(asdict(one)))) == one


def test_channels_are_declared_or_asked_of_a_device_that_is_not_opened():
    found = registry.channels("fake", {"name": "x", "provides": ["force"], "consumes": []}, rig())
    assert found == Channels(frozenset({"force"}), frozenset())
    assert MADE["x"].calls == []
    options = registry.options_model("rokubi").model_validate({"port": "/dev/null"}, context={"n_axes": 1})
    assert registry.channels("rokubi", options.model_dump(), rig()) == Channels(
        frozenset({"force"}), frozenset()
    )
