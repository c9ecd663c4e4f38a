"""Every group that `rtctl bench` offers can be asked for."""

import pytest

from rtctl.cli import bench


@pytest.mark.parametrize("name", bench.GROUPS + bench.ON_REQUEST)
def test_every_group_has_something_to_measure(name):
    groups = bench.measurements(quick=True, minutes=0.3, rig_seconds=0.5, asked=bench.Wakeups())
    assert callable(groups[name])


def test_nothing_is_measured_that_nobody_can_ask_for():
    groups = bench.measurements(quick=True, minutes=None, rig_seconds=0.5, asked=bench.Wakeups())
    assert set(groups) == set(bench.GROUPS + bench.ON_REQUEST)
