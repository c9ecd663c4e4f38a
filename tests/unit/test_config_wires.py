"""Devices of one rig file on one CAN wire: their frames are added up, and nothing is claimed twice."""

from pathlib import Path

import pytest

from rtctl.errors import ConfigError
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config


def device(kind, name, axis, nodes, *, bus="", more=""):
    axes = "".join(f"[[device.options.axis]]\nnode = {node}\n" for node in nodes)
    return (
        f'[[device]]\nkind = "{kind}"\nname = "{name}"\naxes = ["{axis}"]\n[device.options]\n{more}\n'
        f'[device.options.bus]\nchannel = "can0"\n{bus}\n{axes}'
    )


def rig_file(folder, devices, rate_hz=1000.0):
    """The shipped two-axis mock rig on these devices."""
    text = Path(shipped_config("mock-2axis.toml")).read_text().split("[[device]]")[0]
    text = text.replace("rate_hz = 1000.0", f"rate_hz = {rate_hz}", 1)
    text = text.replace('"friction/', f'"{Path(shipped_config("mock.toml")).parent}/friction/')
    text = text.replace("[rig]", '[rig]\nabsent = ["force"]', 1)
    path = folder / "rig.toml"
    path.write_text(text + "".join(devices))
    return path


def names(path):
    import tomllib

    return [axis["name"] for axis in tomllib.loads(path.read_text())["axis"]]


@pytest.fixture
def axes(tmp_path):
    return names(rig_file(tmp_path, []))


def faults(path):
    with pytest.raises(ConfigError) as refused:
        load(path)
    return refused.value.faults


def pair(axes, *, nodes=(1, 2), buses=("", ""), kind="odrive", mores=("", "")):
    return [
        device(kind, name, axis, [node], bus=bus, more=more)
        for name, axis, node, bus, more in zip(("left", "right"), axes, nodes, buses, mores, strict=True)
    ]


def test_two_devices_that_fit_alone_but_not_together_are_refused_by_name(tmp_path, axes):
    fast = ("feedback_ms = 1.0", "feedback_ms = 1.0\ntemperature_ms = 1")
    load(rig_file(tmp_path, pair(axes)))
    with pytest.raises(ConfigError):
        load(rig_file(tmp_path, pair(axes, mores=(fast[1], fast[1]))))
    (line,) = faults(rig_file(tmp_path, pair(axes, mores=(fast[1], fast[1]))))
    assert "device[0] 'left' and device[1] 'right' share socketcan can0" in line
    assert "device[0].options.bus and device[1].options.bus" in line
    assert "% of the bus at 1 Mbit/s, at most 90 % is allowed" in line
    assert "device[1] 'right' node 2 torque" in line


def test_the_sum_is_that_of_one_device_with_both_drives(tmp_path, axes):
    both = load(rig_file(tmp_path, pair(axes))).device_report()
    *_, (on, lines) = both
    assert on == "device[0] 'left' and device[1] 'right' on socketcan can0"
    alone = [float(lines[0][1].split()[0]) for _, lines in both[:2]]
    assert float(lines[0][1].split()[0]) == pytest.approx(sum(alone), abs=1.0)


def test_on_wires_of_their_own_they_are_not_added_up(tmp_path, axes):
    more = "feedback_ms = 1.0\ntemperature_ms = 1"
    devices = pair(axes, mores=(more, more))
    devices[1] = devices[1].replace("can0", "can1")
    loaded = load(rig_file(tmp_path, devices))
    assert len(loaded.device_report()) == 2


@pytest.mark.parametrize(
    ("buses", "kind", "nodes", "text"),
    [
        (("", "bitrate = 500000"), "odrive", (1, 2),
            "their bitrate differs (1000000, 500000): a wire has one"),
        (("", "fd = true"), "odrive", (1, 2), "their fd differs"),
        (("fd = true", "fd = true\ndata_bitrate = 2000000"), "moteus", (1, 2), "their data_bitrate differs"),
        (("", ""), "odrive", (3, 3), "both use identifier 0x60"),
        (("", ""), "cia402", (1, 2), "both use identifier 0x80"),
        (("fd = true", "fd = true"), "moteus", (4, 4), "both use identifier 0x400"),
        (('interface = "slcan"',) * 2, "odrive", (1, 2), "which only one device can open"),
    ],
)  # fmt: skip
def test_what_cannot_share_a_wire_is_refused_with_both_names(tmp_path, axes, buses, kind, nodes, text):
    (line,) = faults(rig_file(tmp_path, pair(axes, buses=buses, kind=kind, nodes=nodes)))
    assert text in line
    assert "device[0] 'left' and device[1] 'right' share" in line


def test_boards_share_a_wire_as_long_as_no_identifier_is_both_theirs(tmp_path, axes):
    def board(name, axis, first):
        return (
            f'[[device]]\nkind = "can"\nname = "{name}"\naxes = ["{axis}"]\n[device.options.bus]\nchannel = '
            '"can0"\n'
            f"[[device.options.receive]]\nid = {first}\n[[device.options.receive.field]]\n"
            'channel = "position"\nstart_bit = 0\nbits = 16\nunit = "count"\n'
            "[[device.options.receive.field]]\n"
            'channel = "current"\nstart_bit = 16\nbits = 16\nunit = "mA"\n'
            f"[[device.options.send]]\nid = {first + 1}\n[[device.options.send.field]]\n"
            'channel = "current_command"\nstart_bit = 0\nbits = 16\ntype = "int"\nunit = "mA"\n'
        )

    load(rig_file(tmp_path, [board("left", axes[0], 16), board("right", axes[1], 32)]))
    (line,) = faults(rig_file(tmp_path, [board("left", axes[0], 16), board("right", axes[1], 17)]))
    assert "both use identifier 0x11" in line
