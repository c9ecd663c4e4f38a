"""A rig file with a rotary and a linear axis on one simulated device."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from rtctl.cli import drift
from rtctl.cli.drift import _lines
from rtctl.errors import ConfigError
from rtctl.friction import drift_recorded
from rtctl.recording import reader
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"
SLIDE = CONFIGS / "mock-linear.toml"


@pytest.mark.parametrize(
    ("old", "new", "refused"),
    [
        ("", "", None),
        ("coulomb_n = 6.0", "coulomb_nm = 6.0",
            "axis[1].friction.coulomb_nm: the axis is linear: write coulomb_n"),
        ("coulomb_nm = 0.25", "coulomb_n = 0.25",
            "axis[0].friction.coulomb_n: unknown key; did you mean coulomb_nm?"),
    ],
)  # fmt: skip
def test_a_device_of_both_motions_has_the_names_of_each_axis_in_its_own_tables(tmp_path, old, new, refused):
    crank, slide = (CONFIGS / "mock.toml").read_text(), SLIDE.read_text()
    carriage = slide[slide.index("[[axis]]") : slide.index("# ----")].replace(
        "[1.0, 0.0, 0.0]", "[0.0, 0.0, 1.0]"
    )
    text = crank.replace("# ----", f"{carriage}\n# ----", 1) + slide[slide.index("[[device.options.axis]]") :]
    path = tmp_path / "rig.toml"
    path.write_text(text.replace('"friction/', f'"{CONFIGS}/friction/').replace(old, new, 1))
    if refused:
        with pytest.raises(ConfigError) as error:
            load(path)
        assert refused in str(error.value.faults)
        return
    options = load(path).options
    assert [one["inertia_kgm2"] for one in options["axis"]] == [0.012, 1.2]
    assert [one["friction"]["coulomb_nm"] for one in options["axis"]] == [0.25, 6.0]
    assert [one["stiffness_nm_rad"] for one in options["hand"]] == [5.0, 500.0]


@pytest.mark.parametrize(("motion", "told"), [("rotary", "offset, mN m"), ("linear", "offset, mN")])
def test_drift_has_the_unit_of_each_axis(motion, told):
    value = {"value": 1.0, "low": 0.9, "high": 1.1}
    names = ("factor", "forward", "backward", "offset_nm")
    axis = {
        **dict.fromkeys(names, value), "axis": "x", "motion": motion, "history": [], "place_trust": 0.0,
        "warning": None, "stop": None,
    }  # fmt: skip
    head = _lines({"left_out": [], "axes": [axis]})[1]
    assert head.endswith(f"  {told}")


def test_drift_of_a_rig_with_one_axis_that_cannot_be_watched_tells_of_the_other(tmp_path, monkeypatch):
    file = tmp_path / "rig-001.mcap"
    file.touch()
    told = SimpleNamespace(
        law=lambda: SimpleNamespace(params=None, model=None, missing=()), axes=["crank", "slide"],
        left_out={}, motions=["rotary", "linear"], batches=list, missing_fields=list,
    )  # fmt: skip
    monkeypatch.setattr(reader, "RecordingReader", lambda _parts: told)
    # the crank has no model: it is left out of what is found
    found = {"axis": "slide", "factor": None, "seconds": 1.0, "strokes": 2, "warning": "", "stop": ""}
    monkeypatch.setattr(drift_recorded, "over_ticks", lambda *_: [found])
    result = CliRunner().invoke(drift.command, [str(file), "--json"])
    assert result.exception is None
    (axis,) = json.loads(result.output)["axes"]
    assert (axis["axis"], axis["motion"]) == ("slide", "linear")
