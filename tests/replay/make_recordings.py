"""Writes tests/recordings anew: `make recordings`."""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

import numpy as np
from scenarios import SCENARIOS, Run

from rtctl.recording.law_arrays import LAW_NAME, LawArrays, pack_law
from rtctl.recording.law_runner import LAW_FIELDS
from rtctl.recording.limits import Limits
from rtctl.recording.parts import Parts
from rtctl.recording.reader import RecordingReader
from rtctl.recording.replay import Replay
from rtctl.recording.setup import Setup, setup_of

FOLDER = Path(__file__).parents[1] / "recordings"
MOST_BYTES = 300_000
LEVEL = 19
EPOCH_NS = 1_767_225_600_000_000_000  # a fixed date: the same law gives the same files


def setup(run: Run) -> Setup:
    """As of a real run, with the law's state at the first tick and without what changes from day to day."""
    made = setup_of(run.loaded, run.sim.plan, 0, EPOCH_NS)
    plan = run.sim.plan
    law = LawArrays(plan.params, plan.model, run.commands[0], run.state)
    about = {**made.about, "python": "", "platform": sys.platform, "law_key": ""}
    about |= {"began_wall_ns": str(EPOCH_NS), "recorded_wall_ns": str(EPOCH_NS)}
    return Setup(about, {LAW_NAME: ("application/zip", pack_law(law))})


def write(name: str, folder: Path) -> Path:
    """Record one scenario."""
    run = SCENARIOS[name].run()
    rows, commands = np.concatenate(run.rows), np.concatenate(run.commands)
    parts = Parts(folder, setup(run), Limits(free_bytes=0), LEVEL)
    parts.add(int(run.state["ticks"][0]), rows, [], commands)
    parts.close({"reason": "reference"})
    (file,) = parts.files
    return file.rename(folder / f"{name}.mcap")


def digest(folder: Path) -> str:
    """Short hash of everything the law wrote in all reference recordings."""
    total = hashlib.sha256()
    for path in sorted(folder.glob("*.mcap")):
        rows = RecordingReader([path]).read().rows
        total.update(path.stem.encode())
        for field in LAW_FIELDS:
            total.update(np.ascontiguousarray(rows[field]).tobytes())
    return total.hexdigest()[:10]


def main() -> None:
    before = digest(FOLDER)
    for old in FOLDER.glob("*.mcap"):
        old.unlink()
    for name in SCENARIOS:
        path = write(name, FOLDER)
        verdict = Replay(RecordingReader([path])).check()
        assert verdict.first is None, f"{name}: {verdict.first}"
        assert not verdict.stopped, f"{name}: {verdict.stopped}"
        size = path.stat().st_size
        assert size < MOST_BYTES, f"{name}: {size} bytes; make the scenario shorter"
        sys.stdout.write(f"{name:<24}{verdict.ticks:>7} ticks {size:>8} B\n")
    after = digest(FOLDER)
    if after == before:
        sys.stdout.write("the law gives the same as before\n")
    else:
        sys.stdout.write(
            "The law gives something else than before. Say in CHANGELOG.md, under 'Behaviour at the "
            "handle',\n"
            f"what a hand will notice, and end that line with: (recordings {after})\n"
        )


if __name__ == "__main__":
    main()
