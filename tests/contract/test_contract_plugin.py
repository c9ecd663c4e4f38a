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
    provides, consumes = frozenset({"position", "velocity"}), frozenset({"torque"})

    def __init__(self, options, rig):
        self.wire = WIRES[options["wire"]]
        self.count, self.angle, self.speed = 0, 0.0, 0.0

    def open(self): pass
    def close(self): self.stop()
    def stop(self): self.send(0, 0.0)
    def send(self, enabled, torque): self.wire.sent.append((enabled, torque))

    def read(self, tick):
        for self.angle, self.speed in self.wire.samples:
            self.count += 1
        self.wire.samples.clear()
        tick["position_rad"][0, 0], tick["device_velocity_rad_s"][0, 0] = self.angle, self.speed
        tick["sample_count"], tick["link_faults"] = self.count, 0

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

class WorksLong(Good):
    def read(self, tick):
        if self.wire.samples:
            time.sleep(0.015)
        super().read(tick)

class PassesNan(Good):
    def write(self, tick):
        on = int(tick["enabled"][0])
        self.send(on, float(tick["torque_applied_nm"][0, 0]) if on else 0.0)

class AlwaysEnabled(Good):
    def send(self, enabled, torque): self.wire.sent.append((1, torque))

class TurnsTorqueRound(Good):
    def send(self, enabled, torque): super().send(enabled, -torque)

class SendsMilliNewtonMetres(Good):
    def send(self, enabled, torque): super().send(enabled, 1000 * torque)

class ShowsDegrees(Good):
    def read(self, tick):
        super().read(tick)
        tick["position_rad"] *= 180 / math.pi

class StartsOverAfterATurn(Good):
    def read(self, tick):
        super().read(tick)
        tick["position_rad"] = (tick["position_rad"] + math.pi) % (2 * math.pi) - math.pi

class FiltersADifference(Good):
    before = smooth = 0.0
    def read(self, tick):
        super().read(tick)
        self.smooth += 0.2 * ((self.angle - self.before) / 1e-3 - self.smooth)
        self.before = self.angle
        tick["device_velocity_rad_s"] = self.smooth

class ShowsRpm(Good):
    def read(self, tick):
        super().read(tick)
        tick["device_velocity_rad_s"] *= 30 / math.pi

class FailsToClose(Good):
    def close(self): raise RuntimeError("no")

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

KINDS = {
    "good": "Good",
    "fresh": "CallsAllFresh",
    "waits": "Waits",
    "long": "WorksLong",
    "nan": "PassesNan",
    "enabled": "AlwaysEnabled",
    "sign": "TurnsTorqueRound",
    "milli": "SendsMilliNewtonMetres",
    "degrees": "ShowsDegrees",
    "turn": "StartsOverAfterATurn",
    "difference": "FiltersADifference",
    "rpm": "ShowsRpm",
    "close": "FailsToClose",
    "network": "SaysNothingOfTheNetwork",
    "joint": "Good",
}
"""Case -> the class that it is run on."""

INFO = f"""
from hw.interface import BackendInfo, Joint

def info(kind, name):
    joint = "outside:joint_of_percents" if kind == "joint" else None
    return BackendInfo("outside.backend:" + name, "outside.options:WireOptions", simulated=False, joint=joint)

def joint_of_percents(options, rig):
    return [Joint(motor_share=40.0)]

KINDS = {KINDS}
for kind, name in KINDS.items():
    globals()[kind] = info(kind, name)
"""

TESTS = """
from outside import KINDS
from outside.backend import WIRES, Wire
from rtctl.backend_contract import Case, Contract, Device, Received

def options(folder, which):
    name = f"{folder} {which}"
    WIRES[name] = Wire()
    return {"wire": name}

class Played(Device):
    shown = None

    def step(self):
        wire = self.backend.wire
        wire.told = wire.sent[-1] if wire.sent else wire.told
        wire.samples.append(self.shown or (0.001 * len(wire.sent), 0.1))

    def show(self, channel, values):
        angle, speed = self.shown or (0.0, 0.0)
        self.shown = (values[0], speed) if channel == "position" else (angle, values[0])
        return True

    def received(self):
        told = self.backend.wire.told
        return told and Received([told[1]], bool(told[0]))

class TestOutside(Contract):
    cases = {kind: Case(f"outside-{kind}", options, Played) for kind in KINDS}

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
    points = [f"outside-{kind} = outside:{kind}" for kind in KINDS]
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
        "long": "test_reading_and_writing_never_wait",
        "nan": "test_no_torque_that_is_no_torque_reaches_the_actuator",
        "enabled": "test_the_actuator_is_enabled_while_it_is_told_to_be_and_no_longer",
        "sign": "test_a_torque_arrives_with_its_sign_and_size",
        "milli": "test_a_torque_arrives_with_its_sign_and_size",
        "degrees": "test_a_joint_is_followed_over_many_turns_in_rad",
        "turn": "test_a_joint_is_followed_over_many_turns_in_rad",
        "difference": "test_what_is_measured_has_its_sign_and_unit_at_once",
        "rpm": "test_what_is_measured_has_its_sign_and_unit_at_once",
        "joint": "test_what_it_declares_to_check_and_doctor_has_the_right_form",
        "network": "test_a_kind_that_opens_sockets_of_the_network_says_so",
    }.items(),
)
def test_a_bad_one_is_found_by_the_test_of_what_it_does(verdicts, case, test):
    assert verdicts[case] == {test}


def test_one_that_fails_to_close_is_found_wherever_it_is_closed(verdicts):
    assert "test_open_and_close_may_be_repeated" in verdicts["close"]
    assert len(verdicts["close"]) > 5


def test_whoever_plays_no_device_is_told_so_and_does_not_pass(verdicts):
    wanted = {
        "test_a_sample_is_fresh_once",
        "test_no_torque_that_is_no_torque_reaches_the_actuator",
        "test_a_joint_is_followed_over_many_turns_in_rad",
    }
    assert wanted <= verdicts["mute"]


def test_the_example_keeps_the_contract_by_the_tests_that_it_ships(tmp_path):
    example_package.write_metadata(tmp_path)
    found = failed(run(example_package.FOLDER / "tests", example_package.FOLDER, tmp_path))
    assert found == {"one": set()}  # "one axis"
