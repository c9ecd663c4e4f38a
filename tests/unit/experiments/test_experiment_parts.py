"""Statistics, pages and the observer of the experiments, without a rig."""

import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.control.records import new_records
from rtctl.control.vocabulary import State
from rtctl.errors import FaultError
from rtctl.experiments import figures, report
from rtctl.experiments.order import Order
from rtctl.experiments.real_run import FIELDS, Comparison, Phase
from rtctl.experiments.report import Outcome, Part, Target
from rtctl.experiments.seeds import over_seeds
from rtctl.experiments.statistics import Estimate, estimate, reduction
from rtctl.experiments.virtual import with_model_scaled
from rtctl.friction.learn.report_page import Picture
from rtctl.friction.learn.report_tables import Table
from rtctl.rig_file.config import load
from rtctl.tick import new_ticks

CONFIGS = Path(__file__).parents[3] / "configs"


def test_the_interval_is_students():
    found = estimate([1.0, 2.0, 3.0, 4.0])
    assert found.mean == pytest.approx(2.5)
    assert found.half == pytest.approx(3.1824463 * np.std([1, 2, 3, 4], ddof=1) / 2, rel=1e-6)
    assert (found.low, found.high) == (found.mean - found.half, found.mean + found.half)


def test_one_run_has_no_interval_and_none_is_refused():
    assert estimate([2.0]) == Estimate(2.0, 0.0, 1)
    with pytest.raises(ValueError, match="no runs"):
        estimate([])


def test_a_model_that_is_wrong_by_a_factor_is_so_at_every_place():
    params, _, _, model = new_records(1)
    model["coefficient"], model["place_coefficient"] = 0.25, 0.04
    with_model_scaled(0.75)(SimpleNamespace(params=params, model=model))
    np.testing.assert_allclose(model["place_coefficient"] / model["coefficient"][0, 0, 0, 0], 0.16)


def test_a_reduction_is_paired_run_by_run():
    found = reduction(np.array([1.0, 10.0]), np.array([0.5, 5.0]))
    assert (found.mean, found.half) == (pytest.approx(0.5), pytest.approx(0.0))


def test_a_figure_that_is_not_a_number_reaches_nothing():
    assert not Target("x", Estimate(math.nan, 0.0, 3), 0.5).reached
    assert Target("x", Estimate(0.5, 0.0, 3), 0.5).reached
    assert "NOT reached: 10 % short" in Target("x", Estimate(0.4, 0.0, 3), 0.5).cells()[-1]


def test_a_figure_may_be_asked_for_from_above():
    few = Target("x", Estimate(11.0, 1.0, 3), 12, "", 1.0, at_most=True)
    assert few.reached
    assert few.cells() == ("x", "at most 12", "11 ± 1", "reached")
    assert not Target("x", Estimate(13.0, 1.0, 3), 12, "", 1.0, at_most=True).reached
    assert not Target("x", Estimate(math.nan, 0.0, 3), 12, at_most=True).reached


def outcome(title="A <b>title</b>"):
    lines = {"a": (np.arange(3), np.arange(3))}
    picture = Picture("curve", "a caption", figures.stacked([("y [N]", lines)], "rotary"))
    table = Table("cap", ("a",), (("<script>",),))
    target = Target("more <than>", Estimate(0.4, 0.01, 3), 0.5)
    numbers = {"value": np.float64(math.nan), "list": np.arange(2), "estimate": Estimate(1.0, math.nan, 2)}
    return Outcome("one", title, "key", (Part("head", ("text",), (picture, table)),), (target,), numbers)


def test_the_page_is_whole_escaped_and_asks_for_nothing(tmp_path):
    page = report.write(tmp_path / "out", [outcome(), outcome("two")], "t", {"rig": "mock"})
    html = page.read_text()
    assert "<script>" not in html
    assert "&lt;script&gt;" in html
    assert "NOT reached" in html
    assert html.count("http") == html.count("http-equiv")
    assert (tmp_path / "out" / "curve.png").read_bytes().startswith(b"\x89PNG")
    document = json.loads((tmp_path / "out" / "report.json").read_text())
    assert document["experiments"]["one"]["value"] is None
    assert document["experiments"]["one"]["estimate"] == {"mean": 1.0, "ci95_half": None, "count": 2}


def test_bars_are_drawn_for_every_group():
    groups = {name: {"a": Estimate(1, 0.1, 3), "b": Estimate(2, 0, 1)} for name in ("x", "y")}
    assert figures.bars(groups, "z [%]", "rotary").startswith(b"\x89PNG")


class FakeHost:
    def __init__(self):
        self.writer = SimpleNamespace(command={"shutdown_count": [0], "seq": np.array([1])})
        self.finished, self.shares, self.arms = False, [], 0

    def set_compensation(self, share):
        self.shares.append(share)
        self.writer.command["seq"] += 1

    def arm(self, _epoch):
        self.arms += 1

    def finish(self):
        self.finished = True


def ticks(host, n, state=State.ACTIVE, seq=None):
    rows = new_ticks(n)
    rows["state"], rows["authority"] = int(state), 1.0
    rows["command_seq"] = host.writer.command["seq"][0] if seq is None else seq
    rows["hand_torque_nm"] = 0.1
    return rows


def test_both_phases_are_measured_for_exactly_their_time_and_only_under_their_command():
    host = FakeHost()
    watcher = Comparison([Phase("off", 0.0, 0.01, 0.02), Phase("on", 1.0, 0.01, 0.02)], 1e-3)
    watcher(host, ticks(host, 5, State.IDLE))
    assert host.arms == 1
    watcher(host, ticks(host, 1))
    assert host.shares[-1] == 0.0
    for _ in range(5):
        watcher(host, ticks(host, 7))
    assert host.shares[-1] == 1.0
    watcher(host, ticks(host, 50, seq=0))  # still ran under the command before
    assert not watcher.complete
    watcher(host, ticks(host, 31))
    assert watcher.complete
    assert host.finished
    for phase in watcher.phases:
        assert {name: len(phase.columns()[name]) for name in FIELDS} == dict.fromkeys(FIELDS, 20)


def test_a_rig_that_leaves_active_ends_the_experiment_with_its_reason():
    host = FakeHost()
    watcher = Comparison([Phase("off", 0.0, 0.01, 0.02)], 1e-3)
    watcher(host, ticks(host, 1))
    with pytest.raises(FaultError, match="left ACTIVE for FAULT"):
        watcher(host, ticks(host, 3, State.FAULT))


def test_a_rig_that_never_arms_is_given_up():
    host = FakeHost()
    watcher = Comparison([Phase("off", 0.0, 0.01, 0.02)], 1.0)
    with pytest.raises(FaultError, match="not armed after 60 s"):
        watcher(host, ticks(host, 61, State.IDLE))


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ([180.4, 195.8], "188 ± 98"),
        ([187.2, 188.8], "188 ± 10"),
        ([1459.0, 1461.0], "1460 ± 13"),
        ([5e-7], "5e-07"),
    ],
)
def test_estimates_are_said_without_powers_of_ten_where_none_is_needed(values, said):
    assert estimate(values).text() == said


def test_a_long_table_is_folded_and_loses_nothing(tmp_path):
    rows = tuple((str(k), "x") for k in range(40))
    table = Table("Long ones.", ("row", "what"), rows)
    page = report.write(tmp_path, [Outcome("a", "A", "", (Part("P", (), (table,)),))], "T", {}).read_text()
    assert "<summary>Long ones. (40 rows)</summary>" in page
    assert page.count("<td>x</td>") == 40


@pytest.mark.parametrize("seeds", [1, 3])
def test_every_seed_is_measured_once_in_order_with_the_rig_and_nothing_else_of_the_order(seeds):
    loaded = load(CONFIGS / "mock.toml")
    order = Order(loaded, seeds=seeds, progress=lambda _share, _text: None, runtime_dir="here")
    found = over_seeds(order, lambda bare, seed: (seed, bare.loaded.sha256, bare.runtime_dir))
    assert found == [(seed, loaded.sha256, None) for seed in range(seeds)]
