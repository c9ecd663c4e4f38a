"""A person who waits for the start is told what for, and "the first start" only where it is one."""

import subprocess
import sys

import pytest

from hw import code_cache
from hw.jit import JIT_DISABLED
from rtctl.host.supervisor import _why_waiting


def test_only_what_compiles_is_called_a_first_start():
    assert "first start" in _why_waiting(3, preparing=False)
    assert "3 functions" in _why_waiting(3, preparing=False)
    assert "first start" in _why_waiting(0, preparing=True)
    assert "first start" not in _why_waiting(0, preparing=False)
    assert "devices" in _why_waiting(0, preparing=False)


PROGRAM = """
import numpy as np
from hw import code_cache
from hw.encoder import ENCODER_STATE, unwrap
heard = []
code_cache.on_compiled.append(heard.append)
unwrap(1, 32, np.zeros(ENCODER_STATE, np.int64))
print(len(code_cache.made_here), heard == list(range(1, len(heard) + 1)))
"""


@pytest.mark.compiled
@pytest.mark.skipif(JIT_DISABLED, reason="nothing is compiled")
def test_what_is_compiled_is_counted_and_what_is_kept_is_not(tmp_path):
    counted = []
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", PROGRAM],
            env={"RTCTL_CACHE_DIR": str(tmp_path), "PYTHONPATH": ":".join(sys.path)},
            capture_output=True,
            text=True,
            check=True,
        )
        number, in_order = done.stdout.split()
        assert in_order == "True"
        counted.append(int(number))
    assert counted[0] >= 1
    assert counted[1] == 0
    assert isinstance(code_cache.made_here, list)
