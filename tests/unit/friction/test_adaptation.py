"""The feed-forward follows the watched friction (docs/theory.md 5.10): as far and as fast as it may, and only
by what is known.
"""

import math
from dataclasses import fields
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rtctl.control.compensation_limit import FACTOR_LEAST, FACTOR_MOST
from rtctl.friction import artefact
from rtctl.friction.adaptation import (
    TIGHT,
    Bounds,
    at_factor,
    beyond,
    followed,
    largest_feedforward,
)
from rtctl.friction.drift_estimate import Estimate
from rtctl.friction.drift_verdict import SESSION_S
from rtctl.friction.margins import friction_figures
from rtctl.rig_file.config import load
from rtctl.rig_file.friction_tables import CAP_SHARE_MAX, DriftTable

BOUNDS = Bounds(least=0.7, most=1.05, per_s=0.01 / 60)
T = 1e-3


def seen(factor, error=0.01, session_s=30.0):
    none = dict.fromkeys((field.name for field in fields(Estimate)), 0.0)
    told = {"factor": factor, "factor_error": error, "dry_nm": 0.25, "strokes": 40, "seconds": 24.0}
    return Estimate(**none | told | {"session_seconds": session_s})


def over(minutes, factor, found, bounds=BOUNDS, look_s=0.25, **more):
    """The factor after so much motion, looked at in blocks."""
    for _ in range(round(60 * minutes / look_s)):
        factor = followed(factor, found, bounds, look_s, **more)
    return factor


number = st.floats(0, 3) | st.sampled_from([math.nan, math.inf, -math.inf, -1.0, 1e300])


@given(factor=st.floats(0.7, 1.05), to=number, error=number, session_s=number, moved_s=st.floats(0, 1e4))
def test_no_estimate_moves_it_faster_than_the_rate_or_out_of_its_bounds(
    factor, to, error, session_s, moved_s
):
    step = BOUNDS.per_s * moved_s
    now = followed(factor, seen(to, error, session_s), BOUNDS, moved_s)
    assert factor - step <= now <= factor + step
    assert BOUNDS.least <= now <= BOUNDS.most
    if not (error <= TIGHT and session_s >= SESSION_S):
        assert now <= factor, "an estimate that is not trusted raises nothing"


@pytest.mark.parametrize(("truth", "minutes"), [(0.9, 10), (0.95, 5), (1.03, 3)])
def test_it_arrives_after_a_minute_of_motion_for_each_percent_and_stays(truth, minutes):
    almost = over(minutes - 0.1, 1.0, seen(truth))
    assert abs(almost - truth) == pytest.approx(0.001, abs=1e-9)
    assert over(minutes, 1.0, seen(truth)) == pytest.approx(truth, abs=1e-9)
    assert over(3 * minutes, 1.0, seen(truth)) == truth


@pytest.mark.parametrize(("truth", "end"), [(0.5, 0.7), (1.2, 1.05)])
def test_it_stops_at_its_bounds(truth, end):
    assert over(60, 1.0, seen(truth)) == end


def test_standing_still_a_freeze_and_nothing_seen_leave_it():
    assert followed(0.9, seen(1.0), BOUNDS, 0.0) == 0.9
    assert followed(0.9, seen(0.8), BOUNDS, 60.0, frozen=True) == 0.9
    assert followed(0.9, None, BOUNDS, 60.0) == 0.9
    assert followed(0.9, seen(math.nan), BOUNDS, 60.0) == 0.9
    assert followed(0.9, seen(0.8, error=math.nan), BOUNDS, 60.0) == 0.9


@pytest.mark.parametrize("doubt", [{"error": 2 * TIGHT}, {"session_s": SESSION_S / 2}])
def test_what_is_in_doubt_raises_nothing_and_lowers_as_far_as_it_is_sure(doubt):
    assert over(30, 0.9, seen(1.04, **doubt)) == 0.9
    far = seen(0.75, **doubt)
    assert over(60, 1.0, far) == pytest.approx(0.75 + 3 * far.factor_error)
    assert over(60, 0.76, far) == 0.76, "the friction may be as much"


def test_friction_beyond_the_bounds_is_told_at_the_bound_and_where_it_surely_is():
    assert "no further than to 1.05" in beyond(1.05, seen(1.2), BOUNDS)
    assert "no further than to 0.70" in beyond(0.7, seen(0.6), BOUNDS)
    for factor, found in (
        (1.04, seen(1.2)),
        (1.05, seen(1.06)),
        (1.05, seen(0.6)),
        (0.7, seen(0.69)),
        (1.05, None),
    ):
        assert beyond(factor, found, BOUNDS) == ""
    assert beyond(1.05, seen(math.nan), BOUNDS) == ""


# -- how far: the certificate


def axis_of(adapt=0.01, **friction):
    loaded = load("configs/mock.toml")
    axis = loaded.config.axis[0]
    drift = axis.friction.drift.model_copy(update={"adapt_per_min": adapt})
    table = axis.friction.model_copy(update={"drift": drift, **friction})
    return axis.model_copy(update={"friction": table}), artefact.load(loaded.model_path(axis))


def figures(axis, model, factor):
    return friction_figures(model, Path(), at_factor(axis, factor), T, 2 * math.pi / axis.counts_of_turn)


def test_the_largest_factor_is_the_last_that_passes_the_two_lines_and_leaves_the_damping():
    axis, model = axis_of(gain=0.93, cap_share=0.12)
    most, factor = largest_feedforward(axis, model, T)
    assert 1.0 < factor < FACTOR_MOST
    assert most.friction.gain == pytest.approx(0.93 * factor)
    assert most.friction.cap_share == pytest.approx(0.12 * factor)

    def passes(found):
        return found.two_line_margin_nm >= 0 and found.secant_damping_nms_rad >= axis.viscous_nms_rad

    assert passes(figures(axis, model, factor))
    assert not passes(figures(axis, model, factor + 0.001))


def test_what_is_smaller_passes_wherever_the_largest_does():
    axis, model = axis_of(gain=0.85, cap_share=0.11)
    _, factor = largest_feedforward(axis, model, T)
    found = [figures(axis, model, k) for k in (factor, 1.0, 0.85, FACTOR_LEAST)]
    for name in ("two_line_margin_nm", "secant_damping_nms_rad", "dry_left_nm"):
        values = [getattr(one, name) for one in found]
        assert values == sorted(values), name


def test_a_feed_forward_that_passes_not_even_as_learned_is_not_raised():
    axis, model = axis_of(gain=0.85, cap_share=0.25)  # no cap to speak of
    found = figures(axis, model, 1.0)
    assert found.two_line_margin_nm < 0
    assert figures(axis, model, 1.02).secant_damping_nms_rad > axis.viscous_nms_rad
    assert largest_feedforward(axis, model, T)[1] == 1.0


def test_a_small_gain_may_go_up_by_a_tenth_and_no_cap_above_its_own_bound():
    axis, model = axis_of(gain=0.7, cap_share=0.09)
    assert largest_feedforward(axis, model, T)[1] == FACTOR_MOST
    axis, model = axis_of(gain=0.3, cap_share=CAP_SHARE_MAX)
    most, factor = largest_feedforward(axis, model, T)
    assert factor == 1.0
    assert most.friction.cap_share <= CAP_SHARE_MAX


@pytest.mark.parametrize("how", [{"adapt": 0.0}, {"policy": "observer"}, {"policy": "off"}])
def test_where_nothing_is_asked_for_or_learned_all_is_as_it_was(how):
    axis, model = axis_of(gain=0.7, cap_share=0.09, **how)
    assert largest_feedforward(axis, model, T) == (axis, 1.0)
    assert largest_feedforward(axis_of()[0], None, T)[1] == 1.0


def test_what_is_not_watched_is_refused_to_be_followed():
    with pytest.raises(ValueError, match=r"adapt_per_min 0\.01.*set watch = true"):
        DriftTable(watch=False, adapt_per_min=0.01)
    with pytest.raises(ValueError, match=r"less than or equal to 0\.01"):
        DriftTable(adapt_per_min=0.011)
