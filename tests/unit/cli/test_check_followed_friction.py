"""What `rtctl check` says of a feed-forward that follows the friction, and that law and certificate are of
its largest factor.
"""

from pathlib import Path

import pytest

from rtctl.check.law_plan import build
from rtctl.check.stability_report import examine
from rtctl.check.verdict import Outcome
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[3] / "configs"
ROW = "compensation that follows the friction"
KEYS = ("friction_gain", "friction_cap_nm", "friction_ungated_cap_nm")


def rig(name="mock.toml", per_min=0.01, absent=(), **friction):
    loaded = load(CONFIGS / name)
    axis = loaded.config.axis[0]
    drift = axis.friction.drift.model_copy(update={"adapt_per_min": per_min})
    table = axis.friction.model_copy(update={"drift": drift, **friction})
    axis = axis.model_copy(update={"friction": table})
    head = loaded.config.rig.model_copy(update={"absent": absent})
    config = loaded.config.model_copy(update={"axis": (axis,), "rig": head})
    return loaded.model_copy(update={"config": config})


def row(loaded):
    return {one.name: one for one in examine(loaded).axes[0].verdicts}[ROW]


def test_law_and_certificate_are_of_the_largest_factor():
    asked, plain = (rig(per_min=k, gain=0.89, cap_share=0.1163) for k in (0.01, 0.0))
    largest = examine(asked).axes[0].friction.factor_max
    assert 1.05 < largest < 1.1
    p, q = build(asked).params[0], build(plain).params[0]
    assert p["friction_raise"][0] == largest - 1.0
    assert p["friction_change_step"][0] == pytest.approx(0.01 / 60 * 1e-3)
    assert q["friction_raise"][0] == q["friction_change_step"][0] == 0.0
    for key in KEYS:
        assert p[key][0] == pytest.approx(largest * q[key][0]), key
    assert p["friction_floor_nm"][0] == q["friction_floor_nm"][0], (
        "no friction is credited that was only seen"
    )
    found = [examine(one).axes[0].friction for one in (asked, plain)]
    assert found[0].feedforward_max_nm == pytest.approx(largest * found[1].feedforward_max_nm)
    assert 0 <= found[0].two_line_margin_nm < found[1].two_line_margin_nm


def test_what_is_given_back_over_a_turn_is_no_friction_and_follows_nothing():
    asked, plain = (build(rig("mock-places.toml", per_min=k, gain=0.5, cap_share=0.05)) for k in (0.01, 0.0))
    assert asked.params["friction_raise"][0, 0] > 0
    assert asked.params["conservative_gain"] == plain.params["conservative_gain"] > 0


@pytest.mark.parametrize(
    ("friction", "figure", "said"),
    [
        (
            {"gain": 0.7, "cap_share": 0.09},
            "0.7 to 1.100",
            "every row of this table holds at the largest factor",
        ),
        ({"gain": 0.89, "cap_share": 0.1163}, "0.7 to 1.080", "less friction.gain and cap_share leave room"),
        ({}, "0.7 to 1.000", "less friction.gain and cap_share leave room"),
    ],
)
def test_the_row_says_how_far_and_what_would_leave_room(friction, figure, said):
    found = row(rig(**friction))
    assert (found.figure, found.outcome) == (figure, Outcome.PASS)
    assert said in found.meaning
    assert "by 1 % a minute of motion at most" in found.meaning


def test_a_rig_that_asks_for_nothing_has_no_row_and_one_with_nothing_to_go_by_a_warning():
    assert ROW not in {one.name for one in examine(rig(per_min=0.0)).axes[0].verdicts}
    for loaded in (rig(policy="observer"), rig(model=""), rig(absent=("force",), policy="stop")):
        found = row(loaded)
        assert found.outcome == Outcome.WARN
        assert "follows nothing" in found.meaning


def test_a_place_that_is_seen_is_told_by_which_motion():
    """Of a joint turned faster than that the trust stayed 0, and nothing said why."""
    rows = {}
    for place in ("seen", "given"):
        loaded = rig("mock-places.toml", per_min=0.0, place=place)
        rows[place] = {one.name: one for one in examine(loaded, telling=False).axes[0].verdicts}
    told = rows["seen"]["places that are seen"]
    judged_rad_s = build(rig("mock-places.toml", per_min=0.0, place="seen")).params["place_speed_rad_s"][0, 0]
    assert told.outcome == Outcome.PASS
    assert float(told.figure.split()[0]) == pytest.approx(judged_rad_s, rel=0.01)
    assert "places that are seen" not in rows["given"]
