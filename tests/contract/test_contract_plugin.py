"""The contract as other people run it: by pytest in a process of its own, on a small package outside this
repository.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import example_package
import pytest

ROOT = Path(__file__).parents[2]


BACKEND = """
import math, time
WIRES = {}

class Wire:
    def __init__(self):
        self.samples, self.told, self.sent = [], None, []

class Good:
    provides, consumes = frozenset({"position"}), frozenset({"torque"})

    def __init__(self, options, rig):
        self.wire = WIRES[options["wire"]]
        self.count, self.angle = 0, 0.0

    def open(self): pass
    def close(self): self.stop()
    def stop(self): self.send(0, 0.0)
    def send(self, enabled, torque): self.wire.sent.append((enabled, torque))

    def read(self, tick):
        for self.angle in self.wire.samples:
            self.count += 1
        self.wire.samples.clear()
        tick["position_rad"][0, 0], tick["sample_count"], tick["link_faults"] = self.angle, self.count, 0

    def write(self, tick):
        torque = float(tick["torque_applied_nm"][0, 0])
        torque = torque if math.isfinite(torque) else 0.0
        self.send(int(tick["enabled"][0]), min(max(torque, -1.0), 1.0) if tick["enabled"][0] else 0.0)

class CallsAllFresh(Good):
    def read(self, tick):
        super().read(tick)
        if not self.count:
            return
        self.extra = getattr(self, "extra", -1) + 1
        tick["sample_count"] = self.extra + 1

class Waits(Good):
    def read(self, tick):
        if not self.wire.samples:
            time.sleep(0.05)
        super().read(tick)

class PassesNan(Good):
    def write(self, tick):
        on = int(tick["enabled"][0])
        self.send(on, float(tick["torque_applied_nm"][0, 0]) if on else 0.0)

class AlwaysEnabled(Good):
    def send(self, enabled, torque): self.wire.sent.append((1, torque))

class SaysNothingOfTheNetwork(Good):
    def open(self):
        import socket
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM).close()
"""

OPTIONS = """
from pydantic import BaseModel, ConfigDict

class WireOptions(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)
    wire: str
"""

INFO = """
from hw.interface import BackendInfo

def info(name):
    return BackendInfo(f"outside.backend:{name}", "outside.options:WireOptions", simulated=False,
        summary="a wire")

GOOD, FRESH, WAITS, NAN, ENABLED, NETWORK = map(
    info, ("Good", "CallsAllFresh", "Waits", "PassesNan", "AlwaysEnabled", "SaysNothingOfTheNetwork"))
"""

TESTS = """
from outside.backend import WIRES, Wire
from rtctl.backend_contract import Case, Contract, Device, Received

def options(folder, which):
    name = f"{folder} {which}"
    WIRES[name] = Wire()
    return {"wire": name}

class Played(Device):
    def step(self):
        wire = self.backend.wire
        wire.told = wire.sent[-1] if wire.sent else wire.told
        wire.samples.append(0.001 * len(wire.sent))

    def received(self):
        told = self.backend.wire.told
        return told and Received([told[1]], bool(told[0]))

class TestOutside(Contract):
    cases = {kind: Case(f"outside-{kind}", options, Played)
             for kind in ("good", "fresh", "waits", "nan", "enabled", "network")}

class TestDumb(Contract):
    cases = {"mute": Case("outside-good", options)}
"""


@pytest.fixture(scope="module")
def verdicts(tmp_path_factory):
    """Case -> the tests of the contract that it fails."""
    folder = tmp_path_factory.mktemp("outside")
    package, made = folder / "outside", folder / "outside-1.0.dist-info"
    package.mkdir()
    made.mkdir()
    for name, text in {"__init__": INFO, "backend": BACKEND, "options": OPTIONS}.items():
        (package / f"{name}.py").write_text(text)
    (folder / "test_contract.py").write_text(TESTS)
    (made / "METADATA").write_text("Metadata-Version: 2.1\nName: outside\nVersion: 1.0\n")
    points = [
        f"outside-{kind} = outside:{kind.upper()}"
        for kind in ("good", "fresh", "waits", "nan", "enabled", "network")
    ]
    (made / "entry_points.txt").write_text("\n".join(["[rtctl.backends]", *points]) + "\n")
    return failed(run(folder, folder))


def run(folder, *path):
    """What pytest says of the tests in `folder`."""
    known = os.pathsep.join(map(str, (*path, ROOT)))
    shown = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "rtctl.backend_contract.plugin", "-p", "no:cacheprovider",
            "-rA", "-q"],
        cwd=folder, env={**os.environ, "PYTHONPATH": known}, capture_output=True, text=True, check=False,
        timeout=170,
    )  # fmt: skip
    assert shown.returncode in (0, 1), shown.stdout + shown.stderr
    return shown.stdout


def failed(text):
    found = {}
    for outcome, test, case in re.findall(
        r"^(PASSED|FAILED|ERROR) \S+::(test_\w+)\[(\w+)", text, re.MULTILINE
    ):
        found.setdefault(case, set())
        if outcome != "PASSED":
            found[case].add(test)
    assert found, text
    return found


def test_a_good_backend_of_another_package_keeps_the_contract(verdicts):
    assert verdicts["good"] == set()


@pytest.mark.parametrize(
    ("case", "test"),
    {
        "fresh": "test_a_sample_is_fresh_once",
        "waits": "test_reading_and_writing_never_wait",
        "nan": "test_no_torque_that_is_no_torque_reaches_the_actuator",
        "enabled": "test_the_actuator_is_enabled_while_it_is_told_to_be_and_no_longer",
        "network": "test_a_kind_that_opens_sockets_of_the_network_says_so",
    }.items(),
)
def test_a_bad_one_is_found_by_the_test_of_what_it_does(verdicts, case, test):
    assert verdicts[case] == {test}


def test_whoever_plays_no_device_is_told_so_and_does_not_pass(verdicts):
    wanted = {"test_a_sample_is_fresh_once", "test_no_torque_that_is_no_torque_reaches_the_actuator"}
    assert wanted <= verdicts["mute"]


def test_the_example_keeps_the_contract_by_the_tests_that_it_ships(tmp_path):
    example_package.write_metadata(tmp_path)
    found = failed(run(example_package.FOLDER / "tests", example_package.FOLDER, tmp_path))
    assert found == {"one": set()}  # "one axis"
