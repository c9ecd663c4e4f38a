"""A random rig with a plant of the family: the plant keeps its shape, and the law is told no untruth."""

import numpy as np
import pytest

from rtctl.rig_file import config
from rtctl.simulation import campaign_plants, campaign_rigs
from rtctl.simulation.shipped_files import shipped_config


@pytest.fixture(scope="module")
def loaded():
    return config.load(shipped_config("mock.toml"))


def rig(loaded, index, name, monkeypatch):
    monkeypatch.setattr(campaign_plants, "drawn", lambda _draw: name)
    made = campaign_rigs.make(loaded, 5, index, passive=True, faults=0, ticks=1000)
    assert made.plant == name
    return made.simulation


@pytest.mark.parametrize("name", campaign_plants.NAMES)
@pytest.mark.parametrize("index", [1, 2, 3])
def test_friction_from_below_damping_of_the_motor_and_all_that_is_late_are_true(
    loaded, name, index, monkeypatch
):
    plain, put = (
        rig(loaded, index, campaign_plants.AS_DRAWN, monkeypatch),
        rig(loaded, index, name, monkeypatch),
    )
    p, drawn, told = put.plant_params[0], plain.plant_params[0], put.params[0]
    elastic = p["joint_stiffness_nm_rad"][0] > 0
    dry, viscous = ((1 - p[f"link_{kind}_share"][0]) if elastic else 1.0 for kind in ("dry", "viscous"))
    least = 1 - np.abs(p["friction_wave"][0, :, 0]).sum()
    assert p["coulomb_nm"][0] * dry * least >= drawn["coulomb_nm"][0] * (1 - 1e-12)
    assert p["bristle_max_nm"][0] >= p["breakaway_nm"][0] * (2 - least)
    assert p["viscous_nms_rad"][0] * viscous >= told["viscous_nms_rad"][0] * (1 - 1e-12)
    # what thins out is part of the model's curve: as much of it on the motor's side, in this rig's size
    assert p["thinning_nms_rad"][0] * viscous == pytest.approx(drawn["thinning_nms_rad"][0], rel=1e-12)
    assert drawn["thinning_nms_rad"][0] / 0.02 == pytest.approx(drawn["coulomb_nm"][0] / 0.25, rel=1e-12)
    assert told["viscous_nms_rad"][0] == plain.params[0]["viscous_nms_rad"][0]
    late = p["torque_delay_ticks"][0] + p["transport_delay_ticks"] + max(0, p["sample_every_ticks"] - 1)
    assert told["follow_delay_ticks"][0] >= late + p["current_lag_s"][0] / p["period_s"]
    assert p["inertia_kgm2"][0] == told["inertia_kgm2"][0]
    if name != "strong-stiction":
        assert (p["second_share"][0], p["second_rad_s"][0]) == (0.5, 0.5)
    else:
        assert (p["second_share"][0], drawn["second_share"][0]) == (0.0, 0.5)
    # drift and load only add
    assert (p["drift_dry"][0, : p["drift_count"][0]] >= 1).all()
    assert (p["drift_viscous"][0, : p["drift_count"][0]] >= 1).all()


def test_an_elastic_joint_keeps_its_resonance_in_every_size(loaded, monkeypatch):
    for index in range(5):
        p = rig(loaded, index, "elasto-plastic-30hz", monkeypatch).plant_params[0]
        reduced = p["inertia_kgm2"][0] * p["link_inertia_share"][0] * (1 - p["link_inertia_share"][0])
        assert np.sqrt(p["joint_stiffness_nm_rad"][0] / reduced) / (2 * np.pi) == pytest.approx(30, rel=1e-3)


def test_half_of_the_rigs_are_as_they_were_and_all_plants_come():
    names = [campaign_plants.drawn(np.random.default_rng((1, k, 17))) for k in range(1000)]
    assert 0.45 < names.count(campaign_plants.AS_DRAWN) / 1000 < 0.55
    assert set(names) == {campaign_plants.AS_DRAWN, *campaign_plants.NAMES}
    assert all(name in names for name in campaign_plants.NAMES)
