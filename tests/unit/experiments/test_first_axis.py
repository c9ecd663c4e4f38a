"""Experiments are of the first axis: what a rig file says of a second one is in no figure."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.experiments import admittance, policies, policies_on_family, virtual
from rtctl.experiments.order import Order
from rtctl.experiments.virtual import FAST_SINE, Variant


def test_how_a_second_hand_is_held_says_nothing_of_the_first():
    def rig(*hands):
        axes = [SimpleNamespace(motion="linear"), SimpleNamespace(motion="rotary")]
        config = SimpleNamespace(axis=axes, device=[SimpleNamespace(options={"hand": hands})])
        return virtual._hand(SimpleNamespace(config=config))

    told = {"kind": "sines", "stiffness_nm_rad": 5.0}
    assert rig({"kind": "sines"}, told) == rig({"kind": "sines"}) != (1.0, 1.0)
    assert rig(told, {"kind": "sines"}) == rig(told) == (1.0, 1.0)


def test_the_hand_of_a_second_axis_is_in_no_figure(monkeypatch):
    torque = np.column_stack([np.full(100, 0.2), np.full(100, 3.0)])
    run = SimpleNamespace(truth={"hand_torque_nm": torque}, trace={"hand_torque_nm": torque})
    monkeypatch.setattr(virtual, "measure", lambda *_: run)
    monkeypatch.setattr(virtual, "hand_energy_min_j", lambda _: 0.0)
    for module in (policies, policies_on_family):
        monkeypatch.setattr(module, "over_seeds", lambda order, once: [once(order, 0)])
    order, off = Order(loaded=SimpleNamespace()), Variant("off", 0.0)
    assert policies._hand(order, FAST_SINE, off)["rms"] == pytest.approx(0.2)
    assert policies_on_family._hand_nm(order, FAST_SINE, off) == pytest.approx(0.2)
    assert admittance._one_hand_nm(order, 0, motion=FAST_SINE, share=0.0) == pytest.approx(0.2)
