"""Scripted faults in a rig file, in the compiled loop and in the one that calls the backend: one
behaviour.
"""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from one_by_one import require_same, ticks_one_by_one

from hw import registry
from hw.interface import LinkLost
from hw.member import Member
from hw.rig import compose
from rtctl.control.jit import records
from rtctl.control.vocabulary import State
from rtctl.errors import ConfigError
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation
from rtctl.tick import new_ticks
from tests.documents.parts import scripted_faults

CONFIGS = Path(__file__).parents[2] / "configs"
MOCK = CONFIGS / "mock.toml"

MANY = [
    {"channel": "position", "kind": "jump", "value": 0.01, "at_tick": 100, "for_ticks": 1, "every_ticks": 50},
    {"channel": "position", "kind": "nan", "at_tick": 0, "for_ticks": 0, "probability": 0.01},
    {"channel": "force", "kind": "offset", "value": 1.0, "at_s": 0.7, "for_s": 0.1, "axis": 1},
    {"channel": "link", "kind": "drop", "at_tick": 3, "for_ticks": 0, "probability": 0.02},
    {"channel": "link", "kind": "checksum", "at_tick": 3, "for_ticks": 0, "probability": 0.02},
    {"channel": "link", "kind": "lost", "at_s": 1.5, "for_s": 0.02},
    {"channel": "actuator", "kind": "scale", "value": 0.5, "at_s": 1.0, "for_s": 0.0, "probability": 0.5},
]


@pytest.fixture(scope="module")
def loaded():
    return load(MOCK)


def test_the_compiled_loop_gives_the_ticks_that_backend_and_law_give_one_by_one(loaded):
    simulation = Simulation(loaded)
    simulation.script(MANY)
    trace = np.concatenate([simulation.run(0.8), simulation.run(1.2, arm_count=1)])

    options = registry.options_model("mock").model_validate({**loaded.options, "faults": MANY})
    require_same(ticks_one_by_one(loaded, options.model_dump(mode="json"), 2000, arm_at=800), trace)
    assert np.isnan(trace["position_rad"]).any()
    assert (trace["link_faults"] != 0).any()


def test_a_stall_skips_slots_and_counts_them_in_virtual_time(loaded):
    simulation = Simulation(loaded)
    simulation.script([{"channel": "loop", "kind": "stall", "value": 3.0, "at_tick": 5, "for_ticks": 1}])
    trace = simulation.run(0.01)
    assert trace["tick"].tolist() == [0, 1, 2, 3, 4, 5, 9, 10, 11, 12]
    assert trace["missed_ticks"].tolist() == [0] * 6 + [3] * 4
    assert trace["sample_count"].tolist() == list(range(1, 11)), "each read is one sample, none in between"


def test_no_faults_and_faults_that_never_come_are_the_same_run(loaded):
    without, later = Simulation(loaded), Simulation(loaded)
    later.script([{"channel": "actuator", "kind": "dead", "at_s": 1e6, "for_s": 0.0}])
    assert without.arm().tobytes() == later.arm().tobytes()


def test_faults_can_be_scripted_anew_between_two_runs(loaded):
    simulation = Simulation(loaded)
    simulation.arm()
    pressed = {"channel": "estop", "kind": "pressed", "for_ticks": 0}
    simulation.script([{**pressed, "at_s": simulation.time_s + 0.01}])
    trace = simulation.run(0.02)
    assert np.flatnonzero(trace["estop"]).tolist() == list(range(10, 20))
    assert trace["state"][-1] == State.ESTOP
    simulation.script([])
    assert not simulation.run(0.01)["estop"].any()


def test_the_simulation_refuses_what_is_no_fault(loaded):
    with pytest.raises(ConfigError, match=r"fault\[0\]\.axis: 1 is not there; must be below 1"):
        Simulation(loaded).script(
            [{"channel": "position", "kind": "nan", "at_tick": 0, "for_ticks": 1, "axis": 1}]
        )


# -- rig files

SCHEDULE = "[[fault]]\nchannel = 'link'\nkind = 'drop'\nat_s = 0.5\nfor_ticks = 2\n"


def rig_file(folder, options="", schedule=SCHEDULE, **changes):
    text = MOCK.read_text().replace("friction/mock.json", str(CONFIGS / "friction/mock.json"))
    text = text.replace("[device.options]\n", f"[device.options]\n{options}\n")
    for old, new in changes.values():
        assert old in text
        text = text.replace(old, new)
    (folder / "faults.toml").write_text(schedule)
    (folder / "rig.toml").write_text(text)
    return folder / "rig.toml"


def test_a_rig_file_names_a_schedule_beside_it(tmp_path):
    faults = load(rig_file(tmp_path, "faults = 'faults.toml'")).options["faults"]
    assert [(f["channel"], f["kind"], f["at_s"], f["for_ticks"]) for f in faults] == [
        ("link", "drop", 0.5, 2)
    ]


def test_a_schedule_given_on_the_command_line_takes_the_place_of_the_rig_files(tmp_path):
    path = rig_file(tmp_path, "faults = 'absent.toml'")
    assert load(path, script=tmp_path / "faults.toml").options["faults"][0]["kind"] == "drop"


def test_a_bad_schedule_is_refused_with_both_files_key_value_and_bound(tmp_path):
    path = rig_file(tmp_path, "faults = 'faults.toml'", SCHEDULE + "probability = 2.0\naxis = 9\n")
    with pytest.raises(ConfigError) as refused:
        load(path)
    (line,) = refused.value.faults
    rows = path.read_text().splitlines()
    (number,) = (i for i, row in enumerate(rows, 1) if row.startswith("faults"))
    assert line.startswith(f"{path}:{number}: device[0].options.faults: ")
    assert f"{tmp_path / 'faults.toml'}: fault[0].probability: " in line
    assert "must be a number from 0 to 1, not 2.0" in line
    assert "fault[0].axis: " in line


def test_an_axis_the_rig_does_not_have_is_refused_when_the_file_is_read(tmp_path):
    schedule = SCHEDULE.replace("'link'", "'position'").replace("'drop'", "'nan'") + "axis = 1\n"
    with pytest.raises(ConfigError) as refused:
        load(rig_file(tmp_path, "faults = 'faults.toml'", schedule))
    assert "axis: 1 is not there; must be below 1" in refused.value.faults[0]


def test_a_stall_is_refused_where_time_is_virtual(tmp_path):
    schedule = SCHEDULE.replace("'link'", "'loop'").replace("'drop'", "'stall'")
    with pytest.raises(ConfigError) as refused:
        load(
            rig_file(
                tmp_path,
                "faults = 'faults.toml'",
                schedule,
                clock=('clock = "wall"', 'clock = "virtual"'),
            )
        )
    assert "nothing stalls on a virtual clock" in refused.value.faults[0]


def test_a_device_that_is_real_cannot_be_given_faults(tmp_path, monkeypatch):
    monkeypatch.setitem(registry.BUILT_IN, "mock", replace(registry.lookup("mock"), simulated=False))
    registry.lookup.cache_clear()
    try:
        with pytest.raises(ConfigError) as refused:
            load(rig_file(tmp_path), script=tmp_path / "faults.toml")
    finally:
        registry.lookup.cache_clear()
    assert "'mock' is no simulation: no faults are scripted into this rig" in refused.value.faults[0]


# -- what ships


def test_the_tour_goes_through_one_fault_after_another_on_a_shipped_rig():
    faults = load(MOCK, script=CONFIGS / "faults" / "tour.toml").options["faults"]
    assert len(faults) > 10
    for before, after in itertools.pairwise(faults):
        assert after["at_s"] >= before["at_s"] + (before["for_s"] or 0.001)


def test_the_document_has_the_table_of_kinds_there_are(request):
    text = (request.config.rootpath / "docs" / "faults.md").read_text()
    assert scripted_faults() in text, "make docs"


def test_in_a_rig_of_several_devices_a_fault_stays_in_its_own():
    """The force comes from a second device, whose link fails; the first goes on."""
    rig = load(MOCK).config.hardware()

    def member(kind, channels, faults):
        options = registry.options_model("mock").model_validate({"faults": faults})
        return Member("mock", options.model_dump(mode="json"), kind, (0,), channels)

    drive = ("position", "current", "temperature", "estop", "current_command")
    dropped = {"channel": "link", "kind": "checksum", "at_tick": 4, "for_ticks": 2}
    lost = {"channel": "link", "kind": "raise_read", "at_tick": 8, "for_ticks": 1}
    backend = compose([member("drive", drive, []), member("finger", ("force",), [dropped, lost])], rig)
    tick, bits = records(new_ticks(1, 1)), []
    for k in range(8):
        tick["tick"] = k
        backend.read(tick)
        bits.append(int(tick["link_faults"][0]))
        backend.write(tick)
    assert bits == [0, 0, 0, 0, 1, 1, 0, 0]
    tick["tick"] = 8
    with pytest.raises(LinkLost, match="finger: scripted fault"):
        backend.read(tick)
    backend.close()
