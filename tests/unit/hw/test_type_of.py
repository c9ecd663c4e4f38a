"""The type of an array is Numba's own, found out once for each set of fields."""

import numba
import numpy as np
import pytest

from hw.jit import type_of
from rtctl.control.records import command_dtype, params_dtype
from rtctl.tick import new_ticks

FIELDS = [("a", "<i4"), ("b", "<i4"), ("c", "<f8")]


def read_only(array):
    array.flags.writeable = False
    return array


ARRAYS = {
    "plain": np.zeros(3),
    "words": np.zeros((2, 3), np.uint64),
    "every second": np.zeros(6)[::2],
    "ticks of one axis": new_ticks(1, 1),
    "ticks of two": new_ticks(2, 2),
    "parameters": np.zeros(1, params_dtype(1)),
    "commands": np.zeros(2, command_dtype(2)),
    "read only": read_only(np.zeros(1, params_dtype(1))),
    "strided": new_ticks(4, 1)[::2],
    "aligned": np.zeros(1, np.dtype(FIELDS, align=True)),
    "not aligned": np.zeros(1, np.dtype(FIELDS)),
}


@pytest.mark.parametrize("what", ARRAYS)
def test_it_is_what_numba_says(what):
    array = ARRAYS[what]
    for value in (array, (array, np.zeros(2)), (array, array)):
        assert type_of(value) == numba.typeof(value)
    assert type_of(array) == numba.typeof(array), "the second time too"
