"""Every group that `rtctl bench` offers can be asked for."""

import pytest
from click.testing import CliRunner

from rtctl.cli import bench
from rtctl.errors import RtctlError
from tests.bench import groups as measured
from tests.bench.row import Row, in_turns


@pytest.mark.parametrize("name", bench.GROUPS + bench.ON_REQUEST)
def test_every_group_has_something_to_measure(name):
    groups = measured.measurements(quick=True, minutes=0.3, rig_seconds=0.5, asked=measured.Wakeups())
    assert callable(groups[name])


def test_nothing_is_measured_that_nobody_can_ask_for():
    groups = measured.measurements(quick=True, minutes=None, rig_seconds=0.5, asked=measured.Wakeups())
    assert set(groups) == set(bench.GROUPS + bench.ON_REQUEST)


class Turns:
    """Measures 1, 2, 3 and so on; the turn of `at` ends with `error`."""

    def __init__(self, at, error):
        self.found, self._at, self._error = [], at, error

    def measured(self):
        for turn in range(1, 5):
            if turn == self._at:
                raise self._error
            self.found.append(turn)
            yield

    def rows(self):
        yield Row("the sum", float(sum(self.found)), "", f"{len(self.found)} turns")


@pytest.mark.parametrize("error", [KeyboardInterrupt, RtctlError])
@pytest.mark.parametrize(("at", "told"), [(3, [3.0]), (1, [])])
def test_what_was_measured_before_the_end_is_told_and_the_end_is_not_hidden(error, at, told):
    turns, values = Turns(at, error("ended")), []
    with pytest.raises(error):
        values.extend(row.value for row in in_turns(turns.measured(), turns.rows))
    assert values == told


def test_turns_that_nobody_ends_are_all_told():
    turns = Turns(0, None)
    assert [row.value for row in in_turns(turns.measured(), turns.rows)] == [10.0]


@pytest.mark.parametrize("options", [[], ["--json"]])
def test_an_interrupted_bench_prints_the_rows_of_the_turns_that_are_over(monkeypatch, options):
    turns = Turns(3, KeyboardInterrupt())

    def measurements(**_asked):
        return {
            "start": lambda: in_turns(turns.measured(), turns.rows),
            "cycle": lambda: pytest.fail("went on"),
        }

    monkeypatch.setattr(measured, "measurements", measurements)
    found = CliRunner().invoke(bench.command, ["start", "cycle", *options])
    assert found.exit_code != 0
    assert "2 turns" in found.output
