"""Has the host's machine code compiled in a process of its own, where there is none yet.

The host follows the loop with the same law. To load it takes 60 MB; a process that has compiled it keeps 250 MB
for as long as it lives, and a daemon lives for months. So whoever starts first after an update has it done elsewhere,
while the loop compiles its own.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

import numpy as np

from hw.compile_key import module_key
from hw.jit import JIT_DISABLED, compiled_folder
from hw.private_cache import is_own, make_private
from rtctl.control.records import MODEL, command_dtype, params_dtype
from rtctl.recording import law_runner
from rtctl.recording.law_arrays import LawArrays
from rtctl.recording.law_runner import LawRunner


class Preparation:
    """Compiles what a host of `n_axes` needs, unless a mark beside the compiled code says that this was done.

    A mark that is wrong does no harm: the host then compiles what it does not find.
    """

    def __init__(self, n_axes: int) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        if JIT_DISABLED or is_own(mark(n_axes)):
            return
        command = [sys.executable, "-m", "rtctl.host.preparation", str(n_axes)]
        # a session of its own: Ctrl-C is for the host, which then ends it
        self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True)

    def done(self) -> bool:
        """Whether the host can go on."""
        return self._process is None or self._process.poll() is not None

    def close(self) -> None:
        """Give it up if it is not done. Idempotent."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()


def mark(n_axes: int) -> Path:
    """The file that says it was done, for what these sources mean."""
    root = compiled_folder()
    told = f"{module_key(Path(str(law_runner.__file__)), root=root)} {n_axes}"
    return root / f"host-{hashlib.sha256(told.encode()).hexdigest()[:20]}"


def compile_for(n_axes: int) -> None:
    """Compile, or load, and leave the mark."""
    arrays = LawArrays(
        np.zeros(1, params_dtype(n_axes)), np.zeros(n_axes, MODEL), np.zeros(1, command_dtype(n_axes))
    )
    LawRunner(arrays, n_axes)
    path = mark(n_axes)
    if make_private(path.parent, levels=1):
        path.touch()


if __name__ == "__main__":
    compile_for(int(sys.argv[1]))
