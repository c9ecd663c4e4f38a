"""The band of one log holds on another session of the same joint, whatever its size."""

from dataclasses import replace

import numpy as np
import pytest

from rtctl.friction import artefact
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.learn.point_evidence import with_evidence
from rtctl.friction.learn.report_judge import faults, judge, not_judged
from rtctl.friction.logs.logs import FrictionSamples, level_points
from rtctl.friction.points import FrictionPoints


def session(seed: int, size_nm: float) -> FrictionPoints:
    """Strokes of a joint whose friction is another one at each place by 3 %, and which strokes pass other
    places.
    """
    random, rows = np.random.default_rng(seed), []
    for k in range(60):
        peak, place = random.uniform(0.4, 2.0), random.uniform(0, 2 * np.pi)
        v = (-1) ** k * peak * np.sin(np.linspace(0.2, np.pi - 0.2, 60))
        friction = size_nm * (1 + 0.4 * np.exp(-np.abs(v) / 0.15) + 0.1 * np.abs(v)) * np.sign(v)
        friction *= 1 + 0.03 * np.sin(place + 0.01 * np.arange(60))
        rows.append(np.column_stack([k + np.arange(60) / 60, v, friction]))
    time_s, v, friction = np.vstack(rows).T
    return level_points(FrictionSamples(time_s, v, friction, f"{seed}.csv", "0" * 64))


@pytest.mark.parametrize("size_nm", [0.02, 2.0, 60.0])
def test_it_covers_90_to_99_percent_of_other_sessions(size_nm):
    outside = []
    for first in (1, 11, 21, 31):  # how wide one band is is luck, too
        model = fit_points(session(first, size_nm), rig="x", c=100.0)
        others = (session(seed, size_nm) for seed in range(first + 1, first + 5))
        outside += [one.outside_band_share for other in others for one in judge(model, other)]
    assert 0.002 < np.mean(outside) < 0.1  # 12 % without what stretches of a log differ by


def test_what_is_slower_than_the_slowest_trained_speed_is_told_and_not_judged(tmp_path):
    quick = session(1, 2.0)
    quick = replace(quick, left_out=np.abs(quick.velocity_rad_s) < 0.3)
    model = fit_points(quick, rig="x", c=100.0)
    path = tmp_path / "model.json"
    artefact.save(with_evidence(model, quick), path)
    learned = artefact.load(path)
    band = learned.branches[0].band
    assert band.slowest_rad_s == pytest.approx(quick.branch(1)[0].min(), rel=0.05)
    assert band.slowest_rad_s >= 0.3
    whole = session(2, 2.0)
    one = judge(learned, whole)[0]
    assert 0 < one.slower == (whole.branch(1)[0] < 0.98 * band.slowest_rad_s).sum()
    assert not any("band" in fault for fault in faults((one,)))
    assert any("slower than the trained range" in text for text in not_judged((one,)))
