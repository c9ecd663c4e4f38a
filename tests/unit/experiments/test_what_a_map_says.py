"""The sentences of the stability map and of free motion follow from what was found."""

import numpy as np
import pytest

from rtctl.errors import ConfigError
from rtctl.experiments import free_motion, stability_map
from rtctl.experiments.one_mass import Device, proven
from rtctl.experiments.order import Order
from rtctl.experiments.stability_map import SHARES
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config

DEVICE = Device(0.012, 0.05, 1e-3, "rotary")


def made(times: float, below: float, above: float):
    """The outcome where every hand is unstable from `times` the proven stiffness on."""
    edges = [times * proven(DEVICE, share) for share in SHARES]
    return stability_map._outcome(DEVICE, {14: edges}, {0.0: edges}, below, above)


@pytest.fixture(autouse=True)
def undrawn(monkeypatch):
    monkeypatch.setattr(stability_map, "_picture", lambda *_: None)


def test_a_hand_that_is_unstable_inside_the_proven_region_is_said_so():
    good, bad = made(1.05, 0.9, 1.1), made(0.9, 1.2, 0.8)
    assert "No simulated hand is unstable inside" in good.key
    assert "from 5.0 to 5.0 % above it" in good.key
    assert "promises 4 to 23 times as much" in good.key
    assert "A simulated hand is unstable at 0.9 times the proven stiffness" in bad.key
    (told,) = good.parts[0].paragraphs
    assert "no hand's energy grows on the proven bound" in told
    assert "every one grows a tenth above" in told
    (told,) = bad.parts[0].paragraphs
    assert "some hand's energy grows on the proven bound" in told
    assert "not every one grows a tenth above" in told


def test_a_joint_without_damping_has_no_map(monkeypatch):
    monkeypatch.setattr(stability_map, "_edge", lambda *_: pytest.fail("it is mapped"))
    loaded = load(shipped_config("mock.toml"))
    axis = loaded.config.axis[0].model_copy(update={"viscous_nms_rad": 0.0})
    config = loaded.config.model_copy(update={"axis": (axis,)})
    with pytest.raises(ConfigError, match=r"axis\[0\]\.viscous_nms_rad is 0"):
        stability_map.run(Order(loaded.model_copy(update={"config": config}), simulate=True))


def test_what_a_model_too_low_saves_is_read_off_the_table():
    saved = {free_motion.OFF: 0.0, free_motion.LOW_ALONE: 0.5, free_motion.LOW_MODEL: 0.4}
    one = {variant.name: {"hand_rms_nm": np.full(2, 1.0 - less)} for variant, less in saved.items()}
    told = free_motion._explanation({motion.name: one for motion in free_motion.MOTIONS})
    assert "That saves 50.0 ± 0 and 50.0 ± 0 %" in told
    assert "it is 40.0 ± 0 and 40.0 ± 0 %" in told
