"""Every group that `rtctl bench` offers can be asked for."""

import pytest

from rtctl.cli.bench import GROUPS, ON_REQUEST, _group


@pytest.mark.parametrize("name", GROUPS + ON_REQUEST)
def test_every_group_has_something_to_measure(name):
    assert callable(_group(name, quick=True, minutes=0.3, rig_seconds=0.5))
