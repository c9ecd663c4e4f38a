import dataclasses
from pathlib import Path

import pytest

from rtctl.friction import artefact
from rtctl.host.exchange import rig_description
from rtctl.host.exchange.rig_description import RigDescription, describe
from rtctl.rig_file.config import Config, LoadedConfig

AXIS = {
    "name": "joint",
    "inertia_kgm2": 0.01,
    "viscous_nms_rad": 0.01,
    "encoder_counts_per_rev": 1000,
    "torque_constant_nm_a": 0.1,
    "lever_m": [0, 0.1, 0],
    "torque_limit_nm": 1.0,
    "torque_rate_nm_s": 100,
    "velocity_limit_rad_s": 12,
    "position_min_rad": -1,
    "position_max_rad": 2,
}


def loaded(tmp_path, **tables):
    config = Config.model_validate(
        {"schema": 1, "rig": {"name": "m"}, "axis": [AXIS], "device": [{"kind": "mock"}], **tables}
    )
    return LoadedConfig.model_construct(path=tmp_path / "m.toml", sha256="ab" * 32, config=config, options={})


def test_bounds_come_from_the_rig_file_and_its_own_limits(tmp_path):
    rig = describe(loaded(tmp_path))
    bounds = rig.axes[0].bounds
    assert bounds["position_rad"] == (-1.0, 2.0)
    assert bounds["velocity_rad_s"] == (-12.0, 12.0)
    assert bounds["pitch_rad"] == (1e-3, 100.0)
    fixed = {"mass_kgm2", "mass_damping_nms_rad"}  # of an axis that displays an impedance
    assert all(bounds[name] == (0.0, 0.0) for name in fixed)
    assert all(low < high for name, (low, high) in bounds.items() if name not in fixed)


def test_every_bounded_key_of_the_table_of_operations_has_a_bound(tmp_path):
    from rtctl.host.exchange.operations import OPERATIONS

    bounds = describe(loaded(tmp_path)).axes[0].bounds
    for operation in OPERATIONS.values():
        for key in operation.keys:
            if key.kind in ("number", "numbers"):
                assert key.low is not None or key.name in bounds


def test_a_virtual_clock_starts_its_time_stamps_at_the_wall_time_of_the_start(tmp_path):
    rig = describe(loaded(tmp_path, loop={"clock": "virtual"}))
    wall = describe(loaded(tmp_path))
    assert rig.virtual
    assert rig.start_wall_ns > wall.start_wall_ns, "a monotonic clock has already run for a while"


@pytest.mark.parametrize(
    ("range_c", "policy", "expected"),
    [
        ((22.0, 31.0), "hybrid", (22.0, 31.0)),
        ((22.0, 31.0), "off", None),
        ((None, None), "hybrid", None),
        ((0.0, 0.0), "hybrid", None),
    ],
)
def test_the_temperatures_of_the_model_in_use_are_known(tmp_path, range_c, policy, expected):
    low, high = range_c
    shipped = artefact.load(Path(__file__).parents[3] / "configs" / "friction" / "mock.json")
    model = dataclasses.replace(shipped, rig="m", temperature_min_c=low, temperature_max_c=high)
    artefact.save(model, tmp_path / "model.json")
    friction = {"model": "model.json", "policy": policy}
    rig = describe(loaded(tmp_path, axis=[{**AXIS, "friction": friction}]))
    assert rig.axes[0].trained_c == expected


def test_a_description_describes_itself():
    rig = RigDescription("m", (), 1000.0)
    assert describe(rig) is rig


def test_the_offset_of_a_clock_that_was_never_set_is_taken_once(monkeypatch):
    now_ns = [10**9]  # since 1970, on a machine that has run for longer
    monkeypatch.setattr(rig_description.time, "time_ns", lambda: now_ns[0])
    monkeypatch.setattr(rig_description.time, "monotonic_ns", lambda: 5 * 10**9)
    first = RigDescription("m", (), 1000.0)
    assert first.start_wall_ns == -4 * 10**9
    now_ns[0] = 10**18  # it is set
    assert dataclasses.replace(first, name="n").start_wall_ns == first.start_wall_ns
