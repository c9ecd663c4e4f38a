"""A stop is meant for whoever arms: one that asks again until the rig is ready asks in the epoch in which it
decided, and gives up when that is over."""

from types import SimpleNamespace

import pytest

from rtctl.client import RigClient
from rtctl.control.vocabulary import Fault, State
from rtctl.errors import FaultError, RefusedError
from rtctl.experiments.real_run import Comparison
from rtctl.host.auto_arm import AutoArm
from rtctl.identify.motion import Motion
from rtctl.identify.session import arm
from rtctl.tick import new_ticks


class Stopped:
    """A rig that never gets ready, and that somebody else stops after some looks at it."""

    def __init__(self, looks):
        self.looks, self.epoch, self.armed_in, self.asked = looks, 0, [], 0

    def answer(self, op, **values):
        if op == "arm":
            self.armed_in.append(values["epoch"])
            assert values["tick"] == self.asked, "that of the look on which it was decided"
        self.looks -= op == "status"
        self.asked += op == "status"
        self.epoch = 0 if self.looks > 0 else 1
        return {"state": "IDLE", "epoch": self.epoch, "result": {"tick": self.asked}}


@pytest.mark.parametrize("looks", [2, 100])
def test_a_client_that_waits_for_its_rig_does_not_arm_it_again_after_somebodys_stop(
    tmp_path, monkeypatch, looks
):
    stopped = Stopped(looks)
    with RigClient("mock", runtime_dir=tmp_path) as rig:
        monkeypatch.setattr(rig, "_call", stopped.answer)
        with pytest.raises(RefusedError, match="stopped while it armed") as refused:
            rig.arm()
    assert refused.value.code == "wrong_epoch"
    assert set(stopped.armed_in) == {0}


def seen(state, epoch):
    rows = new_ticks(1, 1)
    rows["state"], rows["epoch"] = state, epoch
    return rows


class Host:
    """What an observer asks of a host."""

    def __init__(self):
        self.armed_in = []
        self.writer = SimpleNamespace(command={"shutdown_count": [0], "seq": [0]})

    def arm(self, epoch):
        self.armed_in.append(epoch)

    def set_compensation(self, share):
        pass


def test_a_simulated_rig_that_arms_by_itself_stays_stopped():
    host, observer = Host(), AutoArm()
    observer(host, seen(State.INIT, 3))
    observer(host, seen(State.IDLE, 3))
    assert host.armed_in == [3]
    observer(host, seen(State.IDLE, 4))
    observer._asked = min(observer._asked, 0.0)
    observer(host, seen(State.IDLE, 4))
    assert host.armed_in == [3]


def test_an_experiment_on_the_rig_ends_when_it_is_stopped_before_it_began():
    host, run = Host(), Comparison([SimpleNamespace(compensation=0.0)], 1e-3)
    run(host, seen(State.IDLE, 0))
    with pytest.raises(FaultError, match="stopped while it armed"):
        run(host, seen(State.IDLE, 1))
    assert host.armed_in == [0]


@pytest.mark.parametrize(
    ("first", "at_rad", "told"),
    [
        (Fault.BAD_SAMPLE.bit_length() - 1, 1.001, "armed by BAD_SAMPLE: .* crept on .*--margin"),
        (Fault.BAD_SAMPLE.bit_length() - 1, 1.0, "armed by BAD_SAMPLE: .* check sensor range"),
        (
            Fault.HOST_SILENT.bit_length() - 1,
            0.0,
            "armed by HOST_SILENT: .* see what else runs on the machine",
        ),
        (-1, 0.0, "armed by a stop: the rig went to IDLE; somebody asked for it, or the host stood still"),
    ],
)
def test_an_identification_ends_when_it_is_stopped_before_it_began(first, at_rad, told):
    motion = Motion(SimpleNamespace(axis=0, position_min_rad=-1, position_max_rad=1, period_s=1e-3), None)
    bias = motion.see_any(SimpleNamespace(look_s=0.1))
    next(bias)
    with pytest.raises(StopIteration):
        bias.send(seen(State.IDLE, 0))
    steps = arm(motion)
    assert next(steps).arm_in == 0
    assert steps.send(seen(State.ARMING, 0)).arm_in is None
    rows = seen(State.IDLE, 1)
    rows["fault_first"], rows["position_rad"] = first, at_rad
    with pytest.raises(FaultError, match=told):
        steps.send(rows)
