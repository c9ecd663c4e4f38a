"""What a simulated rig is told of its viscous damping is what its plant has, side by side: told whole in
`viscous_nms_rad`, and shared once, by what the device declares.
"""

from pathlib import Path

import pytest

from rtctl.check.devices_of_axis import joint_of_axis, link_damping
from rtctl.experiments.one_mass import device_of
from rtctl.rig_file import config
from rtctl.simulation.campaign_still_cases import drawn, rig
from rtctl.simulation.closed_loop import Simulation
from rtctl.simulation.family import FAMILY, with_plant

CONFIGS = Path(__file__).parents[2] / "configs"
FILES = sorted(path.name for path in CONFIGS.glob("mock*.toml"))


def sides(plant, axis):
    """(motor, joint, link) of the plant: the least damping that it ever has there, N m s/rad."""
    b, elastic = float(plant["viscous_nms_rad"][axis]), plant["joint_stiffness_nm_rad"][axis] > 0
    behind = b * float(plant["link_viscous_share"][axis]) if elastic else 0.0
    return b - behind, float(plant["joint_damping_nms_rad"][axis]) if elastic else 0.0, behind


def require_true(simulation, axis=0):
    """The law counts on what no hand takes away of these three, and its model has both sides."""
    motor, own, link = sides(simulation.plant_params[0], axis)
    sure = motor + (own * link / (own + link) if link > 0 else 0.0)
    p = simulation.params[0]
    assert p["viscous_nms_rad"][axis] == pytest.approx(motor + link, rel=1e-9)
    for name in ("sure_viscous_nms_rad", "hold_damping_nms_rad", "injected_damping_max_nms_rad"):
        assert p[name][axis] == pytest.approx(sure, rel=1e-9)
    return link > 0


@pytest.mark.parametrize("name", [*FILES, *FAMILY])
def test_what_a_rig_is_told_of_its_damping_is_what_its_plant_has(name):
    loaded = config.load(CONFIGS / ("mock.toml" if name in FAMILY else name))
    loaded = with_plant(loaded, name) if name in FAMILY else loaded
    simulation = Simulation(loaded)
    for axis, table in enumerate(loaded.config.axis):
        motor, own, link = sides(simulation.plant_params[0], axis)
        joint, b = joint_of_axis(loaded, axis), table.viscous_nms_rad
        assert (b - link_damping(b, joint), link_damping(b, joint)) == pytest.approx((motor, link), rel=1e-9)
        assert joint.damping_nms_rad == own
        elastic = require_true(simulation, axis)
        assert elastic == (loaded.options["axis"][0]["elastic"] is not None)
    # a map of what is proved of one mass counts on no more
    assert device_of(loaded).damping == pytest.approx(simulation.params["sure_viscous_nms_rad"][0, 0])


def test_so_are_the_rigs_of_hands_that_hold_still():
    cases = [drawn(1, index) for index in range(40)]
    elastic = [case for case in cases if case.joint_hz > 0][:2]
    assert [require_true(rig(case)) for case in elastic] == [True, True]
    assert not require_true(rig(next(case for case in cases if case.joint_hz == 0)))
