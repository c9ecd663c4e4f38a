"""No test writes into the state folder of the person who runs it; what needs compiled code, or a clock, says
so.
"""

import gc
import os
import signal
import tempfile
from collections import Counter, defaultdict

import few
import pytest
import tiers
from hypothesis import HealthCheck, settings
from patience import PATIENCE_S

# a second thread of so small sums only waits, and that burns a core
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
_FOLDER = tempfile.TemporaryDirectory(prefix="rtctl-state-")
os.environ["RTCTL_STATE_DIR"] = _FOLDER.name

# No test judges by time: a core that others use makes 200 ms of a moment's work, and data slow to draw.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")


def pytest_configure():
    """A shell starts a job in the background with SIGINT ignored, and every program that a test starts would
    inherit that.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_unconfigure():
    _FOLDER.cleanup()


@pytest.hookimpl(tryfirst=True)  # before what chooses by marks
def pytest_collection_modifyitems(config, items):
    cases = defaultdict(lambda: defaultdict(set))
    for item in items:
        clock = tiers.meets_a_clock(item.path)
        test, _, case = item.nodeid.partition("::")[2].removesuffix("]").partition("[")
        cases[item.path][test].add(case)
        if clock:
            item.add_marker(pytest.mark.clock)
        if few.is_left(item.path, test, case):
            item.add_marker(pytest.mark.system if clock else pytest.mark.volume)
    if not any("::" in argument for argument in config.args):  # whole files
        unknown = {one for path, known in cases.items() for one in few.unknown(path, known)}
        if unknown:
            raise pytest.UsageError(f"tests/few.py names what is none: {sorted(unknown)}")
    if os.environ.get("NUMBA_DISABLE_JIT", "0") == "0":
        return
    for item in items:
        if item.get_closest_marker("compiled"):
            item.add_marker(pytest.mark.skip(reason="marked `compiled`, and NUMBA_DISABLE_JIT is set"))


@pytest.fixture(scope="session", autouse=True)
def _devices_are_waited_for():
    """One that has not ended its stop within .1 s does not hang: this machine may be loaded."""
    with pytest.MonkeyPatch.context() as patience:
        patience.setattr("hw.every_device.STOP_TIMEOUT_S", PATIENCE_S)
        yield


_used_s = Counter()


def pytest_collection_finish():
    """What is imported and collected by now is no garbage: not looking through it again and again takes a
    twentieth off. What a test makes seldom refers to itself: looking for that less often takes off the rest.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 10, 20)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Processor time of each file: its own, and that of the programs that it started and that have ended."""
    before_s = sum(os.times()[:4])
    result = yield
    _used_s[tiers.name_of(item.path)] += sum(os.times()[:4]) - before_s
    return result


def pytest_terminal_summary(terminalreporter):
    for name, used_s in _used_s.most_common():
        if used_s > tiers.QUICK_S:
            terminalreporter.write_line(tiers.said_of(name, used_s))
