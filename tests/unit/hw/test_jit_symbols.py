"""Symbols of compiled code name what a record holds, not when its process met it."""

import copy

import numba
import numpy as np

import hw.jit  # noqa: F401  sets the rule
from rtctl.control.records import params_dtype


def mangled(dtype):
    return numba.from_dtype(dtype).mangling_args


def test_records_of_rigs_of_different_size_never_share_a_symbol():
    one, two = (mangled(params_dtype(n)) for n in (1, 2))
    assert one != two
    assert one[0] == two[0] == "Record"


def test_a_symbol_does_not_depend_on_the_types_met_before():
    record = numba.from_dtype(np.dtype([("a", "<f8"), ("b", "<i8", (3,))]))
    later = copy.copy(record)
    later._code += 1000  # Numba's running number of types, by which it would name symbols
    assert later.mangling_args == record.mangling_args
