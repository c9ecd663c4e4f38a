"""Functions called by what `entry_point` gives, compiled or not."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

CALLS = """
import numpy as np
from hw.entry_points import call, call_for_int, entry_point
from hw.jit import compiled

@compiled
def doubled(numbers):
    numbers[0] *= 2.0

@compiled
def length(numbers):
    return len(numbers)

@compiled
def both(double_at, length_at, arguments):
    call(double_at, arguments)
    return call_for_int(length_at, arguments)

numbers = np.array([1.5, 0.0, 0.0])
found = both(entry_point(doubled, numbers), entry_point(length, numbers), (numbers,))
print(found, numbers[0])
"""


@pytest.mark.parametrize("disabled", ["0", "1"])
def test_a_function_is_called_by_its_entry_point(disabled: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", CALLS],
        env=os.environ | {"NUMBA_DISABLE_JIT": disabled},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["3", "3.0"]
