"""Child processes of a measurement, among them the daemon of a simulated rig: there for its time, gone with
it.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

END_S = 10.0
"""Time a child has to end by itself once it is asked to."""

START_S = 300.0
"""Patience with a daemon's first answer: its first start compiles."""

SAID = "said"
"""File with the standard error of a daemon."""


def end(process: subprocess.Popen[bytes]) -> None:
    """Ask a child to end, insist after `END_S`, and wait for it."""
    process.terminate()
    try:
        process.wait(END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


@contextmanager
def daemon(
    config: Path,
    folder: Path,
    more: str,
    *options: str,
    environment: Mapping[str, str] | None = None,
    seconds: float = 3000.0,
) -> Iterator[subprocess.Popen[bytes]]:
    """Run the daemon of rig file `config` with `more` of TOML at its end; it ends with the block, and what it
    says of errors is in `folder`/`SAID`.

    Parameters
    ----------
    folder
        Gets the rig file, and is the runtime folder.
    seconds
        It ends by itself after so long, whatever becomes of the measurement.
    """
    text = config.read_text().replace('"friction/', f'"{config.parent}/friction/')
    path = folder / "rig.toml"
    path.write_text(f"{text}\n{more}")
    command = ["run", str(path), "--runtime-dir", str(folder), "--for", f"{seconds:.0f}", *options]
    with (folder / SAID).open("wb") as said:
        process = subprocess.Popen(
            [sys.executable, "-m", "rtctl", *command],
            stdout=subprocess.DEVNULL,
            stderr=said,
            env=environment,
        )
    try:
        yield process
    finally:
        end(process)
