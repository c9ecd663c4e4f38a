"""Shipped rig files whose comments say how a sensor of six components is described: taken by their word, they
make a rig.
"""

from pathlib import Path

import pytest

from hw.rig import compose
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config

LAW = """
[force_sensor]
moments = true

"""


def uncommented(name, begin, changes):
    """A shipped rig file with its commented field of a moment taken in, three times; and with what its
    comment says of the rest.
    """
    text = Path(shipped_config(name)).read_text()
    whole, found, field = text.partition(begin)
    assert found, "the rig file has a commented field"
    field = field.partition("\n")[2].replace("# ", "", 1).replace("\n# ", "\n")
    for old, new in changes:
        assert whole.count(old) == 1, old
        whole = whole.replace(old, new)
    whole = whole.replace("[[device]]", LAW + "[[device]]", 1)
    return whole.replace(
        "lever_m = [0.0, 0.1, 0.0]", "lever_m = [0.0, 0.1, 0.0]\naxis_direction = [0.0, 0.0, 1.0]"
    ), field


RIGS = {
    "serial-println.toml": ("# A sensor that prints its moments", [("columns = 3", "columns = 6")],
        [("column = 3", "column = {}", 3), ("component = 0", "component = {}", 0)], 1),
    "can-optoforce.toml": (
        "# A six-axis sensor",
        [("length = 16", "length = 22"), ("parts = [8, 8]", "parts = [8, 8, 6]"),
            ("0xAA07080A", "0xAA070810"), ("byte = 14 }", "byte = 20 }")],
        [("byte = 14", "byte = {}", 14), ("axis = 0 ", "axis = {} ", 0)],
        2,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", RIGS)
def test_the_commented_moments_of_a_rig_file_make_a_rig_of_six_components(name, tmp_path):
    begin, changes, places, step = RIGS[name]
    whole, field = uncommented(name, begin, changes)
    field = field[field.index("[[device.options") :]
    for k in range(3):
        one = field
        for (old, new, first), by in zip(places, (step, 1), strict=True):
            assert old in one
            one = one.replace(old, new.format(first + k * by))
        whole += "\n" + one
    (tmp_path / "rig.toml").write_text(whole)
    loaded = load(tmp_path / "rig.toml")
    assert loaded.config.force_sensor.moments
    assert "moment" in compose(loaded.members(), loaded.config.hardware()).provides
