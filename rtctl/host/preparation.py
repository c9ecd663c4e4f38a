"""Has the host's machine code compiled in a process of its own, where there is none yet.

The host follows the loop with the same law. To load it takes 60 MB; a process that has compiled it keeps 250
MB for as long as it lives, and a daemon lives for months. So whoever starts first after an update has it done
elsewhere, while the loop compiles its own."""

from __future__ import annotations

import contextlib
import hashlib
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hw import code_cache
from hw.compile_key import module_key
from hw.jit import JIT_DISABLED, compiled_folder
from hw.private_cache import is_own, make_private
from rtctl.control.records import MODEL, command_dtype, params_dtype
from rtctl.recording import law_runner
from rtctl.recording.law_arrays import LawArrays
from rtctl.recording.law_runner import LawRunner

if TYPE_CHECKING:
    from rtctl.rig_file.config import LoadedConfig


class Preparation:
    """Compiles what a host of `n_axes` needs, unless a mark beside the compiled code says that this was done.

    A mark that is wrong does no harm: the host then compiles what it does not find."""

    def __init__(self, n_axes: int) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._compiled = 0
        if JIT_DISABLED or is_own(mark(n_axes)):
            return
        command = [sys.executable, "-m", "rtctl.host.preparation", str(n_axes)]
        # a session of its own: Ctrl-C is for the host, which then ends it
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, start_new_session=True
        )
        os.set_blocking(self._said(), False)

    def _said(self) -> int:
        assert self._process is not None
        assert self._process.stdout is not None
        return self._process.stdout.fileno()

    def done(self) -> bool:
        """Whether the host can go on."""
        return self._process is None or self._process.poll() is not None

    def compiled(self) -> int:
        """Functions that it has compiled so far: none where only the mark was missing."""
        if self._process is not None:
            with contextlib.suppress(BlockingIOError):
                while more := os.read(self._said(), 4096):
                    # one byte a function (`_say_one`): a byte is written whole, and needs no parsing
                    self._compiled += len(more)
        return self._compiled

    def close(self) -> None:
        """Give it up if it is not done. Idempotent."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            if self._process.stdout is not None:
                self._process.stdout.close()
            self._process = None


def mark(n_axes: int) -> Path:
    """The file that says it was done, for what these sources mean."""
    root = compiled_folder()
    # by what the sources mean: an update that changes comments only compiles nothing
    told = f"{module_key(Path(str(law_runner.__file__)), root=root)} {n_axes}"
    return root / f"host-{hashlib.sha256(told.encode()).hexdigest()[:20]}"


def _say_one(_count: int) -> None:
    """A byte for each function: the host counts them (`Preparation.compiled`)."""
    with contextlib.suppress(OSError):  # the host has gone, or does not listen
        os.write(1, b".")


def compile_for(n_axes: int) -> None:
    """Compile, or load, and leave the mark."""
    arrays = LawArrays(
        np.zeros(1, params_dtype(n_axes)), np.zeros(n_axes, MODEL), np.zeros(1, command_dtype(n_axes))
    )
    LawRunner(arrays, n_axes)
    path = mark(n_axes)
    if make_private(path.parent, levels=1):
        path.touch()  # last: a process that was killed on the way leaves no mark


def compile_rig(loaded: LoadedConfig) -> bool:
    """Compile, or load, what loop and host of this rig need; no device is opened.

    False where a device must be open for some of its own functions (CAN): they are left to the first start.
    """
    from hw.interface import BackendError
    from hw.rig import compose
    from rtctl.check import law_plan
    from rtctl.rt.loop import prepare, warm_up
    from rtctl.rt.replug import Replug
    from rtctl.rt.shared_memory import Memory

    plan = law_plan.build(loaded)
    # 8 rows: what is compiled does not depend on how many there are
    memory = Memory.create(plan.n_axes, 8, plan.period_ns)
    memory.params[:] = plan.params
    prepare(plan.n_axes)
    backend = compose(list(loaded.members()), loaded.config.hardware())
    device = Replug(backend, lambda _text: None, lambda _begun: None, lambda _tick: None)
    try:
        warm_up(memory, device)
        complete = True
    except BackendError:
        complete = False
    memory.close()
    compile_for(plan.n_axes)
    return complete


if __name__ == "__main__":
    code_cache.on_compiled.append(_say_one)
    compile_for(int(sys.argv[1]))
