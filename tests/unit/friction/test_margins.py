"""The margins judge the very feed-forward that the law gives: one formula of cap and gate."""

from pathlib import Path

import numpy as np
import pytest

from rtctl.check import law_plan as plan
from rtctl.control.feedforward import compensated_magnitude
from rtctl.control.jit import records
from rtctl.control.vocabulary import Policy
from rtctl.friction import artefact, margins
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"


@pytest.mark.parametrize("policy", ["hybrid", "stop_gated", "intent", "stop", "sign"])
@pytest.mark.parametrize(("cap_share", "viscous_gain"), [(0.3, 0.8), (0.02, 0.0)])
def test_the_margins_judge_what_the_law_gives(policy, cap_share, viscous_gain):
    loaded = load(CONFIGS / "mock.toml")
    axis = loaded.config.axis[0]
    table = {"policy": policy, "cap_share": cap_share, "viscous_gain": viscous_gain}
    axis = axis.model_copy(update={"friction": axis.friction.model_copy(update=table)})
    loaded = loaded.model_copy(update={"config": loaded.config.model_copy(update={"axis": (axis,)})})
    built, model = plan.build(loaded), artefact.load(loaded.model_path(axis))
    p, record = records(built.params)[0], records(model.record())[0]
    assert p["friction_policy"][0] == Policy[policy.upper()]
    for branch, part in enumerate(model.branches):
        v = np.linspace(0, part.speed_max_rad_s, 61)
        law = [compensated_magnitude(p, record, 0, branch, float(speed))[0] for speed in v]
        judged = margins._curves(model, branch, axis, v).ff
        np.testing.assert_allclose(law, judged, rtol=1e-12, atol=0)
        beyond = part.speed_max_rad_s + model.speed_fade_rad_s * np.array([0.25, 0.5, 1.5])
        law = [compensated_magnitude(p, record, 0, branch, float(speed))[0] for speed in beyond]
        np.testing.assert_allclose(
            law, margins._curves(model, branch, axis, beyond).ff, rtol=1e-9, atol=1e-15
        )


def test_a_model_of_places_is_judged_at_its_weakest_and_its_strongest_place():
    loaded = load(CONFIGS / "mock-places.toml")
    axis, model = loaded.config.axis[0], artefact.load(loaded.model_path(loaded.config.axis[0]))
    p, record = records(plan.build(loaded).params)[0], records(model.record())[0]
    v = np.linspace(0, 2.0, 21)
    weakest, strongest = margins._at_places(model, 0, axis, v)
    for speed, low, high in zip(v, weakest.ff, strongest.ff, strict=True):
        law = [
            compensated_magnitude(p, record, 0, 0, float(speed), x, 1.0)[0] for x in np.linspace(0, 6.3, 40)
        ]
        assert low - 1e-9 <= min(law) <= max(law) <= high + 1e-9
        assert max(law) - min(law) > 0.9 * (high - low)
    without = axis.model_copy(update={"friction": axis.friction.model_copy(update={"place": "off"})})
    by_place, of_speed = (
        margins.friction_figures(model, Path("m"), one, 1e-3, 4e-5) for one in (axis, without)
    )
    # .95 of the mean is too much at the weakest
    assert by_place.secant_damping_nms_rad > 0 > of_speed.secant_damping_nms_rad
    steepest = model.conservative.steepest_nm_rad + model.place_steepest_nm_rad
    assert by_place.place_stiffness_nm_rad == pytest.approx(0.95 * steepest)
    assert of_speed.place_stiffness_nm_rad == of_speed.conservative_most_nm == 0.0
