"""No test writes into the state folder of the person who runs it; what needs compiled code says so."""

import os
import tempfile

import pytest

_FOLDER = tempfile.TemporaryDirectory(prefix="rtctl-state-")
os.environ["RTCTL_STATE_DIR"] = _FOLDER.name


def pytest_unconfigure():
    _FOLDER.cleanup()


def pytest_collection_modifyitems(items):
    if os.environ.get("NUMBA_DISABLE_JIT", "0") == "0":
        return
    for item in items:
        if item.get_closest_marker("compiled"):
            item.add_marker(pytest.mark.skip(reason="marked `compiled`, and NUMBA_DISABLE_JIT is set"))
