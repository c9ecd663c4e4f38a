"""The small file of what test pulses measured: written whole, read with bounds, believed of the same devices
only.
"""

import json
import math

import pytest

from rtctl.rig_file import config
from rtctl.rig_file import measured_timing as timing
from rtctl.rig_file.measured_timing import AxisTiming
from rtctl.simulation.shipped_files import shipped_config

ONE = AxisTiming(
    delay_s=1e-3,
    lag_s=2e-4,
    gain=1.02,
    offset_nm=-0.01,
    sample_period_s=1e-3,
    date="2026-11-22T10:00:00+00:00",
)


def test_what_is_written_is_read_and_other_axes_stay(tmp_path):
    folder = tmp_path / "new" / "rig"
    assert timing.read(folder, "a") == {}
    timing.write(folder, "a", {"finger": ONE})
    timing.write(folder, "a", {"thumb": ONE})
    assert timing.read(folder, "a") == {"finger": ONE, "thumb": ONE}
    assert [path.name for path in folder.iterdir()] == [timing.NAME]


def test_other_devices_know_nothing_of_it_and_replace_it(tmp_path):
    timing.write(tmp_path, "a", {"finger": ONE})
    assert timing.read(tmp_path, "b") == {}
    timing.write(tmp_path, "b", {"thumb": ONE})
    assert timing.read(tmp_path, "a") == {}
    assert list(timing.read(tmp_path, "b")) == ["thumb"]


@pytest.mark.parametrize("text",
    ["", "{", "[]", "null", '{"devices_sha256": "a"}', '{"devices_sha256": "a", "axes": [1]}',
                                  '{"devices_sha256": "a", "axes": {"finger": 3}}'])  # fmt: skip
def test_a_damaged_file_says_nothing(tmp_path, text):
    (tmp_path / timing.NAME).write_text(text)
    assert timing.read(tmp_path, "a") == {}


@pytest.mark.parametrize("name", list(timing.BOUNDS))
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e9, -1e9, "1", None, True])
def test_every_number_has_both_bounds(tmp_path, name, value):
    table = {**{key: getattr(ONE, key) for key in timing.BOUNDS}, name: value}
    (tmp_path / timing.NAME).write_text(json.dumps({"devices_sha256": "a", "axes": {"finger": table}}))
    assert timing.read(tmp_path, "a") == {}
    if isinstance(value, float):
        assert not timing.plausible(AxisTiming(**table))


def loaded(folder, *changes):
    text = shipped_config("mock.toml").read_text().replace('model = "friction/mock.json"', 'model = ""')
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "rig.toml"
    path.write_text(text)
    return config.load(path)


def test_it_is_of_devices_and_rate_and_not_of_coupling_or_scripted_faults(tmp_path):
    first = timing.devices_sha256(loaded(tmp_path))
    assert (
        timing.devices_sha256(loaded(tmp_path, ("stiffness_nm_rad = 60.0", "stiffness_nm_rad = 20.0")))
        == first
    )
    assert timing.devices_sha256(loaded(tmp_path, ("rate_hz = 1000.0", "rate_hz = 500.0"))) != first
    assert (
        timing.devices_sha256(loaded(tmp_path, ("current_bias_a = 0.01", "current_bias_a = 0.02"))) != first
    )
    script = tmp_path / "faults.toml"
    script.write_text('[[fault]]\nchannel = "link"\nkind = "drop"\nat_s = 1.0\nfor_ticks = 1\n')
    assert timing.devices_sha256(config.load(tmp_path / "rig.toml", script=script)) == timing.devices_sha256(
        config.load(tmp_path / "rig.toml")
    )


def test_it_is_of_the_axes_that_each_device_serves(tmp_path):
    first = config.load(shipped_config("mock-2axis.toml"))
    axes = first.config.axis
    # the drive of one joint is then that of the other
    swapped = first.model_copy(update={"config": first.config.model_copy(update={"axis": axes[::-1]})})
    assert timing.devices_sha256(swapped) != timing.devices_sha256(first)
    stiffer = axes[0].coupling.model_copy(update={"stiffness_nm_rad": 1.0})
    other = (axes[0].model_copy(update={"coupling": stiffer}), *axes[1:])
    same = first.model_copy(update={"config": first.config.model_copy(update={"axis": other})})
    assert timing.devices_sha256(same) == timing.devices_sha256(first)
