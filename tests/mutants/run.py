"""`make mutants`: every seeded bug, in a copy of the tree, must make a test fail.

    NUMBA_DISABLE_JIT=1 python tests/mutants/run.py [--jobs 2] [--only WORD]

Exits 1 if a bug is not caught or can no longer be planted. Tests run as plain Python, so that a changed law
needs no compiling, but those of modules marked `compiled`; first each set of tests runs on the tree as it is
and must pass: the bugs of one that does not are told, and not tried.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from seed import Seed
from workshop import Outcome, Workshop, say

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT)]

SEEDS: tuple[Seed, ...] = tuple(
    seed for path in sorted(HERE.glob("seeds_*.py")) for seed in importlib.import_module(path.stem).SEEDS
)
"""The seeds of every file beside this one that is named so."""

_workshop: list[Workshop] = []


def _open() -> None:
    _workshop.append(Workshop(ROOT))


def _sound(tests: tuple[str, ...]) -> Outcome:
    return _workshop[0].run(tests)


def _planted(seed: Seed, sound_s: float) -> Outcome:
    return _workshop[0].run(seed.tests, seed.file, seed.spoilt(ROOT), sound_s)


def main() -> int:
    """Plant them all; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--jobs", type=int, default=2, help="bugs tried at a time")
    parser.add_argument("--only", default="", help="only bugs whose file or name contains this")
    options = parser.parse_args()
    if os.environ.get("NUMBA_DISABLE_JIT") != "1":
        raise SystemExit("set NUMBA_DISABLE_JIT=1: compiling each changed law would take half a minute")
    chosen = [seed for seed in SEEDS if options.only in f"{seed.file} {seed.what}"]
    for seed in chosen:
        seed.spoilt(ROOT)
    start, survived = time.monotonic(), 0
    with ProcessPoolExecutor(options.jobs, get_context("spawn"), _open) as pool:
        sets = sorted({seed.tests for seed in chosen})
        sound_s: dict[tuple[str, ...], float] = {}
        for tests, outcome in zip(sets, pool.map(_sound, sets), strict=True):
            if outcome.by:
                say(f"fails without any bug: {outcome.by}: {' '.join(tests)}")
            else:
                sound_s[tests] = outcome.seconds
                say(f"  sound     {outcome.seconds:5.1f} s  {' '.join(tests)}")
        tried = [seed for seed in chosen if seed.tests in sound_s]
        survived += len(chosen) - len(tried)
        trying = {pool.submit(_planted, seed, sound_s[seed.tests]): seed for seed in tried}
        for done in as_completed(trying):
            seed, outcome = trying[done], done.result()
            survived += not outcome.by
            word = "caught  " if outcome.by else "SURVIVED"
            say(f"{word}  {outcome.seconds:5.1f} s  {seed.file}: {seed.what}  [{outcome.by or seed.tests}]")
    say(f"{len(chosen) - survived} of {len(chosen)} seeded bugs caught in {time.monotonic() - start:.0f} s")
    return 1 if survived else 0


if __name__ == "__main__":
    sys.exit(main())
