"""A groove in rig file, message, report and page; and who pulls at it, feels what its file says."""

from pathlib import Path

import msgpack
import numpy as np
import pytest
from quick_start import start_soon

from rtctl.check.stability_report import examine
from rtctl.client import view_world
from rtctl.host.exchange.messages import decode
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.rig_file.config import load
from rtctl.simulation.closed_loop import Simulation

CONFIGS = Path("configs")
K, REACH, COUPLING = 3.0, 0.05, 60.0


def loaded(folder, config="mock-spring.toml", more=""):
    text = (CONFIGS / config).read_text()
    spring = '[axis.environment]\nkind = "spring"\n'
    assert spring in text
    assert "start_s = 1.0 " in text
    text = text.replace("start_s = 1.0 ", "start_s = 0.5 ")  # of its hand: as the rig is armed
    path = CONFIGS / f"groove-{folder.name}.toml"  # beside the model that it names
    path.write_text(text.replace(spring, f'{more}[axis.environment]\nkind = "groove"\nreach_rad = {REACH}\n'))
    return load(path)


def test_a_hand_that_pulls_out_of_a_groove_feels_what_it_does_at_the_edge_and_no_more(tmp_path, monkeypatch):
    start_soon(monkeypatch)
    simulation = Simulation(loaded(tmp_path))
    simulation.arm()
    trace = simulation.run(1.1)
    away, proxy = (trace[name][:, 0] for name in ("position_rad", "proxy_position_rad"))
    felt_nm = COUPLING * (away - proxy)
    assert away[-1] > 3 * REACH
    assert felt_nm[-1] == pytest.approx(K * REACH, rel=0.02)
    assert felt_nm.max() < 1.05 * K * REACH
    inside = (away > 0.2 * REACH) & (away < 0.8 * REACH)
    assert inside.any()
    np.testing.assert_allclose(felt_nm[inside], K * proxy[inside], atol=0.1 * K * REACH)


def test_the_report_says_what_a_proof_of_it_needs(tmp_path):
    drive = "[axis.drive]\ncurrent_loop_hz = 300.0\n\n"
    rows = examine(loaded(tmp_path, more=drive)).verdicts
    assert any(
        "groove" in row.meaning for row in rows if row.name == "worlds that are not linear, behind the lag"
    )


def test_a_message_asks_for_it_within_its_bounds():
    rig = RigDescription("mock", (AxisDescription("joint", {"reach_rad": (0.01, 1.0)}),), 1000.0)

    def ask(reach_rad):
        message = {"id": 1, "op": "environment", "axis": 0, "kind": "groove", "reach_rad": reach_rad}
        return decode(msgpack.packb(message), rig)

    assert ask(0.3).values == {"axis": 0, "kind": "groove", "reach_rad": 0.3}
    assert ask(3.0).code == "out_of_bounds"


def test_the_page_offers_it_with_its_slider():
    assert "groove" in view_world.offered()["worlds"]
    assert view_world.offered()["sliders"]["reach_rad"]["label"] == "reach"
