"""What SIGHUP takes over."""

import pytest

from rtctl.check import law_plan as plan
from rtctl.control.vocabulary import State
from rtctl.host.reload import (
    AT_REST,
    axes_of,
    compare,
    environment_fields,
    files_changed,
    models_replaced,
    refused,
)
from rtctl.recording.setup import setup_of
from rtctl.rig_file import config
from rtctl.rig_file.rig_tables import DeviceTable
from rtctl.simulation.shipped_files import shipped_config, write_copy


def changed(tmp_path, *pairs):
    text = shipped_config("mock.toml").read_text().replace('model = "friction/mock.json"', 'model = ""')
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "rig.toml"
    path.write_text(text)
    return config.load(path)


def test_an_environment_is_taken_and_a_limit_needs_a_restart(tmp_path):
    before = changed(tmp_path)
    after = changed(
        tmp_path,
        ('kind = "free"', 'kind = "spring"\nstiffness_nm_rad = 10.0'),
        ("torque_limit_nm = 2.0", "torque_limit_nm = 1.0"),
    )
    changes = compare(before.config, before.config, after.config)
    assert changes.taken == ["axis[0].environment.kind", "axis[0].environment.stiffness_nm_rad"]
    assert changes.restart == ["axis[0].torque_limit_nm"]
    assert changes.lines() == [
        "reload: axis[0].environment.kind is in force",
        "reload: axis[0].environment.stiffness_nm_rad is in force",
        "reload: axis[0].torque_limit_nm needs a restart; the old value stays",
    ]
    command = plan.build(before).command
    fresh = plan.build(after).command
    command["arm_count"], fresh["arm_count"] = 5, 9
    environment_fields(command, fresh, axes_of(changes.taken))
    assert command["environment_stiffness_nm_rad"][0, 0] == 10.0
    assert command["arm_count"] == 5


def test_an_environment_that_a_client_set_stays_where_the_file_says_of_it_what_it_said(tmp_path):
    loaded = config.load(shipped_config("mock-2axis.toml"))
    command, fresh = (plan.build(loaded).command for _ in range(2))
    command["environment_stiffness_nm_rad"][0] = 3.0, 4.0
    fresh["environment_stiffness_nm_rad"][0] = 5.0, 6.0
    taken = ["axis[1].environment.kind", "axis[1].environment.stiffness_nm_rad"]
    environment_fields(command, fresh, axes_of(taken))
    assert command["environment_stiffness_nm_rad"].tolist() == [[3.0, 6.0]]


def test_nothing_changed_is_said(tmp_path):
    same = changed(tmp_path).config
    assert compare(same, same, same).lines() == ["reload: nothing has changed"]


def test_an_environment_that_is_put_back_is_taken_back(tmp_path):
    first = changed(tmp_path).config
    stiff = changed(tmp_path, ('kind = "free"', 'kind = "spring"\nstiffness_nm_rad = 30.0')).config
    environment = ["axis[0].environment.kind", "axis[0].environment.stiffness_nm_rad"]
    assert compare(first, first, stiff).taken == compare(first, stiff, first).taken == environment
    assert compare(first, stiff, stiff).taken == []


def test_with_other_axes_no_environment_is_taken_for_a_joint_that_it_is_not_meant_for(tmp_path):
    one = changed(tmp_path).config
    stiff = ('kind = "free"', 'kind = "spring"\nstiffness_nm_rad = 30.0')
    renamed = changed(tmp_path, ('[[axis]]\nname = "joint"', '[[axis]]\nname = "other"'), stiff).config
    two = config.load(shipped_config("mock-2axis.toml")).config
    for read in (renamed, two):
        found = compare(one, one, read)
        assert found.taken == []
        assert any(".environment." in key for key in found.restart)


def test_only_a_rig_at_rest_is_reloaded():
    for state in State:
        assert bool(refused(state)) == (state not in AT_REST)


def test_a_model_that_was_learned_anew_under_its_name_is_told():
    assert models_replaced([b"old", b"", b"same"], [b"new", b"first", b"same"], []) == [
        "axis[0].friction.model",
        "axis[1].friction.model",
    ]
    assert models_replaced([b"old"], [b"new"], ["axis[0].friction.model"]) == []  # its key is told already
    assert models_replaced([b"a", b"b"], [b"a"], []) == []


def test_a_plan_knows_what_it_read_of_each_model(tmp_path):
    write_copy("mock.toml", path := tmp_path / "rig.toml", "rig")
    loaded = config.load(path)
    made = plan.build(loaded)
    assert made.model_files == ((tmp_path / "friction" / "rig.json").read_bytes(),)
    (tmp_path / "friction" / "rig.json").write_bytes(b"another one by now")
    attached = setup_of(loaded, made, 1, 0).attachments["model-joint.json"][1]
    assert attached == made.model_files[0]


FAULT = "[[fault]]\nchannel = 'position'\nkind = 'jump'\nat_tick = 5\nfor_ticks = 1\nvalue = {}\n"


@pytest.mark.parametrize("given", ["in the rig file", "on the command line"])
def test_a_schedule_of_faults_of_another_content_is_told(tmp_path, given):
    (tmp_path / "faults.toml").write_text(FAULT.format(0.1))
    in_file = [("[device.options]", '[device.options]\nfaults = "faults.toml"')][: given == "in the rig file"]
    changed(tmp_path, *in_file)
    script = None if in_file else tmp_path / "faults.toml"

    def read(value):
        (tmp_path / "faults.toml").write_text(FAULT.format(value))
        return config.load(tmp_path / "rig.toml", script)

    first = read(0.1)
    assert first.script == script  # what a reload loads again
    assert files_changed(first, read(0.1), []) == []
    assert files_changed(first, read(0.2), []) == ["device[0].options.faults"]
    assert files_changed(first, read(0.2), ["device[0].options.faults"]) == []


def test_a_dbc_file_of_another_content_is_told_and_no_option_that_the_rig_file_tells():
    class Loaded:
        def __init__(self, receive, **options):
            self.options, self.more_options = {"receive": receive, **options}, ()
            self.config = type("Read", (), {"device": (DeviceTable(kind="can", options={"dbc": "a.dbc"}),)})

    first = Loaded([1], stale_ticks=3)
    assert files_changed(first, Loaded([2], stale_ticks=3), []) == ["device[0].options.dbc"]
    assert files_changed(first, Loaded([1], stale_ticks=4), ["device[0].options.stale_ticks"]) == []
    assert files_changed(first, Loaded([2], stale_ticks=3), ["device[0].options.dbc"]) == []
