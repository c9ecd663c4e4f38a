"""A rig of a joint and a carriage: faults, warnings, events, status lines, incidents, schema and npz say of
each what its numbers are in.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from test_fault_book import RIG, rows

from rtctl.cli import events as events_command
from rtctl.cli import operate
from rtctl.control.vocabulary import Fault, State
from rtctl.host.exchange.fault_book import FaultBook
from rtctl.host.exchange.timing_watch import TimingWatch
from rtctl.recording.export import export
from rtctl.recording.incident import Incident
from rtctl.recording.incident_plot import plot_incident
from rtctl.recording.incident_report import summary
from rtctl.recording.tick_cdr import RECORDED
from rtctl.rig_file.config import Config
from rtctl.rig_file.linear_keys import schema_of
from rtctl.tick import json_schema, new_ticks
from rtctl.wire.protocol import schema_sha256

MIXED = replace(RIG, axes=(RIG.axes[0], replace(RIG.axes[1], motion="linear")))


@pytest.mark.parametrize(
    ("fault", "seen", "detail"),
    [
        (Fault.BAD_SAMPLE, {"position_rad": [0.0, 2.0]}, "position 2 m, range -1 to 1"),
        (Fault.OVERSPEED, {"velocity_rad_s": [1.0, -13.0]}, "13 m/s, limit 10"),
        (Fault.ACTUATOR_WRONG, {"motor_torque_nm": [0.1, -1.6]}, "sent 0 N, measured -1.6"),
        (Fault.OVERSPEED, {"velocity_rad_s": [-13.0, 1.0]}, "13 rad/s, limit 10"),
        (Fault.FORCE_CLIPPED, {"moment_nm": [2.0, 0.0, 0.0]}, "moment x 2 N m, limit 2"),
    ],
)
def test_a_fault_says_what_its_axis_is_measured_in(fault, seen, detail):
    some = rows(**seen)
    some["faults"][-1] = fault
    book = FaultBook(MIXED)
    book.follow(some)
    assert book.entries(int(fault))[0]["detail"] == detail


def test_what_an_arming_measured_says_the_motion_and_is_told_in_newtons():
    ticks = new_ticks(3, 2)
    ticks["state"] = State.ARMING, State.ARMING, State.ACTIVE
    for name in ("delay_ticks", "lag_ticks", "gain", "offset_nm"):
        ticks[f"arming_{name}"] = 1.0
    (_, joint), (_, slide) = TimingWatch(MIXED).changes(ticks)
    assert (joint["motion"], slide["motion"]) == ("rotary", "linear")
    told = [
        events_command.line({**one, "event": "measured", "timestamp": 0.0, "tick": 1})
        for one in (joint, slide)
    ]
    assert "+1 N m off" in told[0]
    assert "+1 N off" in told[1]


def test_the_status_of_a_carriage_is_in_metres():
    axis = {
        "axis": "slide",
        "environment": {"kind": "free"},
        "compensation": 1.0,
        "display": {"kind": "impedance"},
    }
    told = {
        "rig": "r", "state": "ACTIVE", "authority": 1.0, "enabled": True, "estop": False, "fault_first": None,
        "faults": [],
        "warnings": [], "waiver": False, "lease_holder": None, "position_rad": [0.2, 0.2],
        "velocity_rad_s": [0.5, 0.05],
        "axes": [{**axis, "motion": "rotary"}, {**axis, "motion": "linear"}],
    }  # fmt: skip
    joint, slide = operate.lines(told)[1:]
    assert "0.2000 rad, 0.5000 rad/s" in joint
    assert "0.2000 m, 50.0 mm/s" in slide


def test_the_schema_has_the_unit_of_each_axis_and_that_of_rotary_ones_is_as_before():
    said = {
        name: one["description"] for name, one in json_schema(2, ["rotary", "linear"])["properties"].items()
    }
    assert said["position_rad"].endswith("[rad, m]")
    assert said["torque_applied_nm"].endswith("[N m, N]")
    assert said["current_a"].endswith("[A]")
    assert said["force_n"].endswith("[N]")
    assert json_schema(1, ["linear"])["properties"]["velocity_rad_s"]["description"].endswith("[m/s]")
    assert json_schema(2, ["rotary"] * 2) == json_schema(2)
    assert (
        schema_sha256(2, ["rotary", "rotary"]) == schema_sha256(2) != schema_sha256(2, ["rotary", "linear"])
    )


def test_the_schema_of_a_linear_rig_file_has_its_keys():
    rotary = Config.model_json_schema()
    assert schema_of(rotary, "rotary") == rotary
    axis = schema_of(rotary, "linear")["$defs"]["AxisTable"]
    assert {"torque_limit_n", "position_min_m", "inertia_kg"} <= set(axis["properties"])
    assert set(axis["required"]) <= set(axis["properties"])
    assert not [name for name in axis["properties"] if name.endswith(("_nm", "_rad", "_rad_s", "_kgm2"))]


def test_an_incident_is_told_and_drawn_in_the_units_of_each_axis(tmp_path):
    ticks = new_ticks(50, 2)
    ticks["tick"] = np.arange(50)
    ticks["position_rad"] = 0.1, 0.3
    trigger = {"tick": 30, "from": "ACTIVE", "to": "FAULT", "timestamp": 0.0, "monotonic_s": 0.0}
    about = {"rig": "r", "axes": ["joint", "slide"], "motion": ["rotary", "linear"]}
    lines = summary(Incident(trigger, ticks, [], about))
    assert "  largest |position_rad| 0.1" in lines
    assert "  largest |position_m| 0.3" in lines
    (head,) = [line for line in lines if line.startswith("slide")]
    assert "velocity_m_s" in head
    assert "rad" not in head
    plot_incident(Incident(trigger, ticks, [], about), tmp_path / "i.png")
    assert (tmp_path / "i.png").stat().st_size > 0
    assert "  largest |position_rad| 0.3" in summary(Incident(trigger, ticks, [], {"rig": "r"}))


class Recording:
    """Stands for RecordingReader."""

    def __init__(self, motions):
        self.motions, self.axes = motions, [f"a{k}" for k in range(len(motions))]
        self.about = {"start_wall_ns": "0"}
        self.rows = new_ticks(4, len(motions))

    def batches(self):
        yield self


@pytest.mark.parametrize(
    ("motions", "name", "units"),
    [
        (["linear"], "position_m", ["m"]),
        (["rotary", "linear"], "position_rad", ["rad", "m"]),
        (["rotary"], "position_rad", None),
    ],
)
def test_npz_says_the_units_of_a_rig_with_a_carriage(tmp_path, motions, name, units):
    export(Recording(motions), "npz", tmp_path / "r.npz")
    with np.load(tmp_path / "r.npz") as found:
        assert name in found.files
        assert "force_n" in found.files
        assert len(found.files) == len(RECORDED) + 3 + (units is not None)
        if units is not None:
            assert json.loads(str(found["units"]))[name] == units
            assert math.isfinite(found[name].sum())
