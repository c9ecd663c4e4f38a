"""The demonstration's picture: what is kept of the ticks, and what is drawn of it."""

import numpy as np
import pytest

from rtctl.cli.demo_figure import draw
from rtctl.cli.demo_run import TRACE_HZ, Demo
from rtctl.control.vocabulary import State
from rtctl.errors import DataError
from rtctl.tick import new_ticks

RATE_HZ = 1000.0


class Rig:
    """What the observer asks of the host."""

    def __init__(self):
        self.shares, self.ended = [], False

    def set_compensation(self, share):
        self.shares.append(share)

    def finish(self):
        self.ended = True


@pytest.fixture
def demo(monkeypatch):
    made = Demo(RATE_HZ, 1.0, lambda *_: None)
    monkeypatch.setattr(made, "_arm", lambda *_: None)
    return made


def feed(demo, sizes):
    """Ticks whose hand torque is their number, in batches of these sizes."""
    rig, done = Rig(), 0
    for size in sizes:
        rows = new_ticks(size, 1)
        rows["state"], rows["authority"] = State.ACTIVE, 1.0
        rows["hand_torque_nm"][:, 0] = np.arange(done, done + size)
        demo(rig, rows)
        done += size
    return rig


@pytest.mark.parametrize("sizes", [[4000], [1] * 30 + [3970], [7] * 571 + [3], [1999, 2, 1999]])
def test_the_trace_has_every_twentieth_tick_however_they_come(demo, sizes):
    rig = feed(demo, sizes)
    time_s, torque = demo.trace()
    assert rig.ended
    assert rig.shares[-1] == 1.0
    assert torque.tolist() == list(range(0, 4000, round(RATE_HZ / TRACE_HZ)))
    assert time_s == pytest.approx(torque / RATE_HZ)
    assert demo.switch_s == 2.0


@pytest.mark.parametrize("state", [State.STOPPING, State.FAULT, State.ESTOP, State.LOCKOUT])
def test_a_rig_that_was_stopped_ends_the_demonstration(demo, state):
    rig = feed(demo, [100])
    assert not rig.ended
    rows = new_ticks(5, 1)
    rows["state"], rows["epoch"] = state, 1
    demo(rig, rows[:0])
    assert not rig.ended
    demo(rig, rows)
    assert rig.ended


def test_the_picture_names_both_figures_and_has_no_date(tmp_path):
    time_s = np.arange(0, 18, 0.02)
    draw(tmp_path / "a.svg", time_s, np.sin(time_s), 9.0, (0.2921, 0.0513))
    draw(tmp_path / "b.svg", time_s, np.sin(time_s), 9.0, (0.2921, 0.0513))
    text = (tmp_path / "a.svg").read_text()
    assert "compensation off: 0.292 N m RMS" in text
    assert "compensation on: 0.051 N m RMS" in text
    assert text == (tmp_path / "b.svg").read_text()
    draw(tmp_path / "c.svg", time_s, np.sin(time_s), 9.0, (0.2921, 0.0513), "linear")
    text = (tmp_path / "c.svg").read_text()
    assert "compensation on: 0.051 N RMS" in text
    assert "force of the hand, N<" in text


def test_a_picture_that_cannot_be_written_is_told(tmp_path):
    with pytest.raises(DataError, match=r"a\.png: cannot write"):
        draw(tmp_path / "nowhere" / "a.png", np.zeros(2), np.zeros(2), 1.0, (1.0, 1.0))
