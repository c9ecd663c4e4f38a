"""The short form of `make soak`: half a minute of churn and floods leaves nothing behind."""

import math

import pytest

from rtctl.simulation.shipped_files import shipped_config
from tests.bench import soak

pytestmark = [pytest.mark.system, pytest.mark.timeout(400)]


def test_half_a_minute_of_churn_and_floods_leaks_no_descriptor_and_little_memory():
    rows = {row.name: row for row in soak.rows(shipped_config("mock.toml"), 0.6)}
    assert rows["descriptors gained"].value <= 0
    assert rows["growth of the loop"].ok
    assert rows["growth of the host"].value < 5.0  # pools are still filling; `make soak` holds it to 1 MB
    assert math.isfinite(rows["growth of the host"].value)
