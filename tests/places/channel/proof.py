"""A voltage that the mock measures: in the tick, in telemetry, in recordings and what is exported of them;
wrong where a script says so.
"""

import csv
from pathlib import Path

import numpy as np
import pytest
from quick_start import start_soon

from hw.simulators.mock_options import MockOptions
from rtctl.host.exchange.samples import tick_columns
from rtctl.recording.export import export
from rtctl.recording.limits import Limits
from rtctl.recording.parts import Parts
from rtctl.recording.reader import RecordingReader
from rtctl.recording.setup import setup_of
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation
from rtctl.tick import json_schema
from rtctl.wire.encoding import encode
from tests.documents.parts import PARTS

FAULT = (
    '[[device.options.faults]]\nchannel = "supply"\nkind = "offset"\nat_tick = 100\nfor_ticks = 50\nvalue '
    "= -3.0\n"
)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A second of a rig whose hand is held by a spring: ticks, the recording of them, and the truth of the
    last.
    """
    path = Path("configs") / "mock-supply.toml"
    text = Path("configs/mock-spring.toml").read_text()
    text = text.replace("start_s = 1.0 ", "start_s = 0.7 ")  # of its hand: as the rig is armed
    path.write_text(text.replace("[device.options]\n", "[device.options]\nsupply_v = 24.0\n") + FAULT)
    loaded = load(path)
    assert "supply" in loaded.members()[0].channels
    with pytest.MonkeyPatch.context() as patch:
        start_soon(patch)
        simulation = Simulation(loaded)
    rows = np.concatenate([simulation.run(0.2), simulation.arm(), simulation.run(0.6)])
    parts = Parts(
        tmp_path_factory.mktemp("r"), setup_of(loaded, simulation.plan, 7, 10**18), Limits(free_bytes=0)
    )
    parts.add(0, rows, [], simulation.command.copy())
    parts.close({"reason": "test"})
    return rows, RecordingReader(parts.files), simulation.truth


def test_the_tick_shows_what_the_motor_draws_and_what_a_script_makes_of_it(run):
    volts = run[0]["supply_v"][:, 0]
    due = (run[0]["tick"] >= 100) & (run[0]["tick"] < 150)
    assert due.sum() == 50
    np.testing.assert_allclose(volts[due], 21.0, atol=0.1)
    assert volts[0] == 24.0
    drawn_a = np.abs(run[2]["current_a"][:, 0])
    assert drawn_a.max() > 0.1
    np.testing.assert_allclose(volts[-len(drawn_a) + 1 :], 24.0 - 0.1 * drawn_a[:-1], rtol=1e-12)


def test_documents_schema_and_telemetry_have_it(run):
    assert "supply_v" in json_schema(1)["required"]
    assert "| `supply_v` |" in PARTS["tick fields"]()
    told = tick_columns(run[0][-3:])["supply_v"]
    assert told["shape"] == [3, 1]
    assert np.frombuffer(told["data"], told["dtype"]).tolist() == run[0]["supply_v"][-3:, 0].tolist()
    assert encode(told)


def test_a_recording_keeps_it_and_every_export_has_it(run, tmp_path):
    rows, reader, _ = run
    export(reader, "npz", tmp_path / "r.npz")
    with np.load(tmp_path / "r.npz", allow_pickle=False) as found:
        assert found["supply_v"].tobytes() == np.ascontiguousarray(rows["supply_v"]).tobytes()
    export(reader, "csv", tmp_path / "r.csv", ("supply_v",))
    with (tmp_path / "r.csv").open() as file:
        assert [float(line["supply_v.joint"]) for line in csv.DictReader(file)] == rows["supply_v"][
            :, 0
        ].tolist()


def test_a_mock_without_it_gives_none_and_refuses_a_script_for_it():
    assert "supply" not in load("configs/mock-spring.toml").members()[0].channels
    fault = {"channel": "supply", "kind": "nan", "at_tick": 0, "for_ticks": 1}
    with pytest.raises(ValueError, match=r"'supply' needs a sensor: add \[device.options.supply_v\]"):
        MockOptions.model_validate({"faults": [fault]})
