"""The moments of force-torque sensors, from frame to tick, and that a rig may leave them out."""

import struct

import numpy as np
import pytest
from pydantic import ValidationError

from hw import registry
from hw.force import optoforce, rdt, rokubi
from hw.force.options import OptoForceOptions, RdtOptions, RokubiOptions
from hw.force.sample import ForceSample
from hw.interface import BackendError, LinkFault, Rig
from rtctl.tick import new_ticks

RIG = Rig(1, 1e-3, np.ones(1), np.ones(1), np.ones(1), np.ones(1), np.ones((1, 3)))
TURNED = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 2.0]]


def shown(reading, moments=TURNED):
    tick, sample = new_ticks(), ForceSample(np.eye(3), moments)
    tick["moment_nm"] = np.nan
    assert sample.take(reading) == 0
    sample.show(tick, 0)
    return tick[0]


@pytest.mark.parametrize(
    "reading",
    [
        rokubi.decode(rokubi.encode((1.0, 2.0, 3.0), 7, 0, (4.0, 5.0, 6.0))),
        rdt.decode(rdt.encode(1, 7, (1, 2, 3), 0, (4, 5, 6)))[1],
        optoforce.decode(optoforce.encode("6-axis", [1, 2, 3, 4, 5, 6], 7)),
    ],
    ids=["rokubi", "rdt", "optoforce"],
)
def test_all_six_components_reach_the_tick(reading):
    tick = shown(reading)
    assert tick["force_n"].tolist() == [1.0, 2.0, 3.0]
    assert tick["moment_nm"].tolist() == [-5.0, 4.0, 12.0]
    assert np.isnan(shown(reading, None)["moment_nm"]).all(), "a rig that does not ask for them"


def test_layouts_of_forces_only_have_no_moment():
    frame = optoforce.encode("4x3-axis", list(range(1, 13)))
    assert optoforce.decode(frame, 1).moment == (0.0, 0.0, 0.0)
    assert optoforce.decode(frame, 1).force == (4, 5, 6)


@pytest.mark.parametrize("k", range(3))
def test_a_moment_that_is_no_number_is_not_vouched_for(k):
    moment = [0.0, 0.0, 0.0]
    moment[k] = float("nan")
    reading = rokubi.decode(rokubi.encode((1.0, 2.0, 3.0), 7, 0, tuple(moment)))
    assert ForceSample(np.eye(3)).take(reading) == LinkFault.DEVICE


OPTIONS = {
    "rokubi": (RokubiOptions, {"port": "/dev/null"}),
    "rdt": (RdtOptions, {"host": "127.0.0.1"}),
    "optoforce": (
        OptoForceOptions,
        {"port": "/dev/null", "counts_per_n": [1, 1, 1], "layout": "6-axis", "counts_per_nm": [10, 20, 40]},
    ),
}


@pytest.mark.parametrize("kind", OPTIONS)
def test_the_channel_is_there_when_it_is_asked_for(kind):
    model, given = OPTIONS[kind]
    for moments, channels in ((False, {"force"}), (True, {"force", "moment"})):
        options = model.model_validate({**given, "moments": moments}).model_dump(mode="json")
        assert registry.channels(kind, options, RIG).provides == channels


def test_counts_become_newton_metres():
    model, given = OPTIONS["optoforce"]
    options = model.model_validate({**given, "moments": True}).model_dump(mode="json")
    sensor = registry.create("optoforce", options, RIG)
    tick = new_ticks()
    sensor._sample.take(optoforce.decode(optoforce.encode("6-axis", [1, 2, 3, 10, 20, 40], 7)))
    sensor._sample.show(tick, 0)
    assert tick["moment_nm"][0].tolist() == [1.0, 1.0, 1.0]
    model, given = OPTIONS["rdt"]
    options = model.model_validate({**given, "moments": True, "counts_per_nm": 1000.0}).model_dump(
        mode="json"
    )
    sensor = registry.create("rdt", options, RIG)
    sensor._sample.take(rdt.decode(struct.pack(">3I6i", 1, 1, 0, 0, 0, 0, 1000, -2000, 0))[1])
    sensor._sample.show(tick, 0)
    assert tick["moment_nm"][0].tolist() == [1.0, -2.0, 0.0]


@pytest.mark.parametrize(
    ("kind", "wrong", "told"),
    [
        ("rokubi", {"moment_matrix": [[0, 0, 0]] * 3}, "every moment would be 0"),
        ("optoforce", {"layout": "3-axis"}, "layout = '6-axis'"),
        ("optoforce", {"counts_per_nm": None}, "counts_per_nm"),
    ],
)
def test_moments_that_cannot_be_right_are_refused(kind, wrong, told):
    model, given = OPTIONS[kind]
    table = {k: v for k, v in {**given, "moments": True, **wrong}.items() if v is not None}
    with pytest.raises((ValidationError, BackendError), match=told):
        model.model_validate(table)
