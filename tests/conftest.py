"""No test writes into the state folder of the person who runs it."""

import os
import tempfile

_FOLDER = tempfile.TemporaryDirectory(prefix="rtctl-state-")
os.environ["RTCTL_STATE_DIR"] = _FOLDER.name


def pytest_unconfigure():
    _FOLDER.cleanup()
