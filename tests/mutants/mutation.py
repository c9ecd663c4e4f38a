"""`make mutation`: do the tests notice every small change of gate, states, faults, detectors, arming and
window?

    NUMBA_DISABLE_JIT=1 python tests/mutants/mutation.py [--jobs 2] [--only WORD]

Why not a ready tool: mutmut 3 leaves decorated functions alone, which all of these are, and cosmic-ray starts
the whole test program anew for each of a thousand mutations. See docs/decisions/0011-mutation-testing.md.

Survivors that no test can notice are listed with their reasons in SURVIVORS.md. The command fails if less
than 95 % are noticed, if a survivor is not listed, or if one that is listed was noticed after all.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import time
from pathlib import Path

from mutations import Mutation, mutations
from workshop import Workshop, say

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT)]

MODULES = ("gate", "states", "faults", "detectors", "arming", "window")
LEAST = 0.95

LAW = (
    "tests/unit/control/test_state_functions.py", "tests/unit/control/test_detector_functions.py",
    "tests/unit/control/test_pulse_functions.py",
    "tests/unit/control/test_gate.py", "tests/properties/test_control_gate.py",
    "tests/unit/control/test_states.py", "tests/unit/control/test_detectors.py",
    "tests/unit/control/test_arming.py",
)  # fmt: skip
"""Run on every change of a function."""

TOO_LONG = "tests/unit/control/test_states.py::test_exhaustive_every_state_under_every_set_of_events"

TABLES = {
    "faults": ("tests/unit/test_documents.py", "tests/unit/control/test_states.py"),
    "arming": ("tests/unit/control/test_pulse_functions.py", "tests/unit/control/test_arming.py"),
    "detectors": ("tests/unit/control/test_detector_functions.py",),
    "window": ("tests/unit/control/test_detectors.py::test_a_mark_counts_for_a_thousand_ticks_to_the_tick",),
    "states": (
        "tests/unit/control/test_state_functions.py",
        "tests/unit/control/test_states.py::test_requests_become_events_only_where_they_are_allowed",
    ),
    "gate": ("tests/unit/control/test_gate.py",),
}
"""Run on a change outside of functions, which needs everything imported anew."""


def listed() -> dict[str, str]:
    """The survivors that are explained, by key."""
    text = (HERE / "SURVIVORS.md").read_text()
    return dict(re.findall(r"^- `(.+)`: (.+)$", text, re.MULTILINE))


def in_functions(chosen: list[Mutation], jobs: int) -> dict[str, str]:
    """The test that noticed each change of a function, by key; "" for none."""
    import hypothesis
    import pytest
    from forks import Session

    hypothesis.settings.register_profile("mutation", derandomize=True, deadline=None, database=None)
    hypothesis.settings.load_profile("mutation")
    error = os.dup(2)  # pytest takes the other one
    session = Session(chosen, "rtctl.control", jobs, lambda text: _write(error, text))
    options = [
        "-q",
        "-p",
        "no:cacheprovider",
        "-W",
        "ignore::RuntimeWarning",
        "-W",
        "ignore::pytest.PytestAssertRewriteWarning",
        "--durations=0",
        "--timeout=0",
    ]
    os.chdir(ROOT)
    code = pytest.main([*options, "--deselect", TOO_LONG, *LAW], plugins=[session])
    if code != 0:
        raise SystemExit(f"the tests do not pass without any mutation (pytest: {code})")
    return {verdict.mutation.key: verdict.by for verdict in session.verdicts}


def _write(descriptor: int, text: str) -> None:
    os.write(descriptor, text.encode())


def of_tables(chosen: list[Mutation]) -> dict[str, str]:
    """The same for changes outside of functions, each in a copy of the tree."""
    workshop, found = Workshop(ROOT), {}
    for module in MODULES:
        tests = TABLES[module]
        mine = [m for m in chosen if m.module == module]
        if mine and (broken := workshop.run(tests).by):
            raise SystemExit(f"without any mutation this fails: {broken}")
        for mutation in mine:
            found[mutation.key] = workshop.run(tests, f"rtctl/control/{module}.py", mutation.source()).by
    workshop.close()
    return found


def report(found: dict[str, str], seconds: float, *, whole: bool) -> int:
    """Print the figures; the exit code."""
    known = listed()
    survivors = [key for key, by in found.items() if not by]
    for module in MODULES:
        mine = [by for key, by in found.items() if key.split(":")[0].split(".")[0] == module]
        say(f"{module:10} {sum(map(bool, mine)):5} of {len(mine):5} noticed")
    noticed = len(found) - len(survivors)
    share = noticed / max(len(found), 1)
    say(f"{'all':10} {noticed:5} of {len(found):5} noticed, {100 * share:.1f} %, in {seconds:.0f} s")
    unexplained = [key for key in survivors if key not in known]
    for key in unexplained:
        say(f"not noticed by any test, not explained: {key}")
    stale = [key for key in known if found.get(key, "") or (whole and key not in found)]
    for key in stale:
        say(
            f"explained in SURVIVORS.md, but noticed by {found.get(key) or 'nobody: it is no longer made'}: "
            f"{key}"
        )
    return 1 if share < LEAST or unexplained or stale else 0


def main() -> int:
    """Run everything."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--jobs", type=int, default=2, help="mutations tried at a time")
    parser.add_argument("--only", default="", help="only mutations whose name contains this")
    options = parser.parse_args()
    if os.environ.get("NUMBA_DISABLE_JIT") != "1":
        raise SystemExit("set NUMBA_DISABLE_JIT=1: only plain functions can be changed")
    start = time.monotonic()
    every = [m for name in MODULES for m in mutations(ROOT / f"rtctl/control/{name}.py")]
    chosen = [m for m in every if options.only in m.key]
    found = of_tables([m for m in chosen if not m.function])  # first: it needs a process without our packages
    inside = [m for m in chosen if m.function]
    if inside:
        found |= in_functions(inside, options.jobs)
    return report(found, time.monotonic() - start, whole=not options.only)


if __name__ == "__main__":
    sys.exit(main())
