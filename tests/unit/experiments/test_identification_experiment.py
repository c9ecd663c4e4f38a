"""Repeated identification: what it averages, and that a seed is a whole rig of its own."""

from pathlib import Path

import pytest

from rtctl.errors import DataError
from rtctl.experiments import identification
from rtctl.experiments.order import Order
from rtctl.identify.settings import Settings
from rtctl.rig_file.config import load

CONFIG = Path(__file__).parents[3] / "configs" / "mock-identify.toml"
SHORT = Settings(train_levels=10, test_levels=4, measurements=10, spots=5, warm_up_s=2.0, bias_s=1.0)


def row(family, ratio, vectors=(0, 0), **more):
    return {
        "family": family, "training_mean_error_nm": 1e-3, "prediction_mean_error_nm": 1e-3 * ratio,
        "prediction_over_training": ratio, "support_vectors": list(vectors), "off_share": 0.001, **more,
    }  # fmt: skip


def test_the_figures_are_means_over_the_seeds_and_the_spread_of_one_run_is_said():
    found = [
        [row("nu-spline", ratio, (8, n)), row("chosen", ratio, chosen="gaussian")]
        for ratio, n in ((0.9, 10), (1.3, 12))
    ]
    one = identification.outcome([1, 2], found)
    assert one.numbers["models"]["nu-spline"]["prediction_over_training"].mean == pytest.approx(1.1)
    assert one.numbers["models"]["nu-spline"]["support_vectors"].mean == 11
    assert "0.90 to 1.30" in one.key
    assert all(target.reached for target in one.targets)
    found[1][1]["refused"] = {"tustin": "direction +1: too many cells"}
    told = identification.outcome([1, 2], found).key
    assert told.endswith(" tustin has no figure in 1 of them: direction +1: too many cells.")
    (single, _) = found
    alone = identification.outcome([7], [single]).key
    assert "seed 7. The chosen" in alone
    assert "interval" not in alone
    worse = identification.outcome([1, 2], [[row("chosen", 1.2, chosen="x")]] * 2)
    assert not worse.targets[0].reached


def test_one_seed_is_one_identification_and_another_seed_another(monkeypatch):
    loaded, measured, kept = load(CONFIG), identification.measured, {}

    def kept_by_seed(rig, seed, settings):
        kept[seed] = measured(rig, seed, settings)
        return kept[seed]

    monkeypatch.setattr(identification, "measured", kept_by_seed)
    rows = identification.repeat(loaded, 1, SHORT, families=("coulomb_viscous", "lorentzian"))
    assert [r["family"] for r in rows][-1] == "chosen"
    assert rows[-1]["chosen"] == "lorentzian"
    assert 0.005 < rows[-1]["off_share"] < 0.04  # no formula has the shape of the rig
    assert list(kept) == [1]
    first, second = kept[1].of("train"), measured(loaded, 2, SHORT).of("train")
    assert len(first.direction) == 2 * 11
    assert sorted(first.velocity_rad_s)[:3] != sorted(second.velocity_rad_s)[:3]


def test_points_of_a_file_are_refused_because_it_measures_its_own(tmp_path):
    with pytest.raises(DataError, match="drop --points"):
        identification.run(Order(load(CONFIG), points=tmp_path / "p.csv"))
