"""Numba without what it only looks for: none of that is there after it, and all of it can be had."""

import subprocess
import sys

from hw.numba_alone import LOOKED_FOR

CODE = f"""
import sys, hw.jit
assert not set({LOOKED_FOR}) & set(sys.modules), sorted(sys.modules)
from numba.np.linalg import ensure_lapack
ensure_lapack()
assert "scipy" in sys.modules
"""


def test_numba_brings_none_of_them_and_hides_none_of_them():
    subprocess.run([sys.executable, "-c", CODE], check=True)


def test_what_is_there_already_stays():
    subprocess.run(
        [sys.executable, "-c", "import scipy, sys, hw.jit; assert sys.modules['scipy'] is scipy"], check=True
    )
