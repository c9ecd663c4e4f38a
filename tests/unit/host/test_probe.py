"""`rtctl probe`: shows every device, arms nothing, and says what is wrong with which."""

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hw import registry
from hw.interface import BackendError, BackendInfo, Channels, LinkFault, LinkLost, Words
from rtctl.cli.probe import _lines as lines_of
from rtctl.errors import ConfigError
from rtctl.host.probe_device_readings import devices, watch
from rtctl.rig_file.config import load
from rtctl.wire.endpoints import RuntimeDirectory

MOCK = Path(__file__).parents[3] / "configs" / "mock.toml"
MADE = []


class Fake:
    """Three good samples, one damaged, then nothing new; `script` may raise at a cycle."""

    provides = frozenset({"force"})
    consumes = frozenset({"torque"})
    script = {}

    def __init__(self, options, rig):
        self.calls, self.cycle = [], 0
        MADE.append(self)

    def open(self):
        self.calls.append("open")
        self.script.get("open", lambda: None)()

    def read(self, tick):
        self.cycle += 1
        self.script.get(self.cycle, lambda: None)()
        tick["sample_count"] = min(self.cycle, 3)
        tick["force_n"][0] = (self.cycle, 2.0, math.nan)
        tick["link_faults"] = LinkFault.CHECKSUM if self.cycle == 4 else 0

    def write(self, tick):
        self.calls.append(("write", int(tick["enabled"][0]), float(tick["torque_applied_nm"][0, 0])))

    def stop(self):
        self.calls.append("stop")

    def close(self):
        self.calls.append("close")

    def counts(self):
        return {"received": self.cycle}


def lose():
    raise LinkLost("hung up")


def refuse():
    raise BackendError("no such port")


@pytest.fixture
def loaded(tmp_path, monkeypatch):
    channels = Channels(Fake.provides, Fake.consumes)
    info = BackendInfo(f"{__name__}:Fake", "hw.simulators.mock_options:MockOptions", False, channels)
    monkeypatch.setitem(registry.BUILT_IN, "fake", info)
    monkeypatch.setattr(Fake, "script", {})
    registry.lookup.cache_clear()
    text = MOCK.read_text().replace('model = "friction/mock.json"', 'model = ""')
    text = text.replace(
        'kind = "mock"', 'kind = "mock"\nchannels = ["position", "current", "current_command"]'
    )
    path = tmp_path / "rig.toml"
    path.write_text(text + '\n[[device]]\nkind = "fake"\nname = "finger"\nchannels = ["force"]\n')
    yield load(path)
    registry.lookup.cache_clear()
    MADE.clear()


def run(loaded, cycles, **more):
    found = devices(loaded, **more)
    for device in found:
        device.open()
    for slot in range(cycles):
        for device in found:
            device.read(slot)
    return [device.report() for device in found]


def test_it_shows_values_with_axis_unit_and_spread(loaded):
    mock, finger = run(loaded, 3)
    assert (finger["device"], finger["kind"], finger["samples"]) == ("device[1] 'finger'", "fake", 3)
    x, y, z = finger["values"]
    assert (x["of"], x["unit"], x["value"], x["min"], x["max"]) == ("x", "N", 3.0, 1.0, 3.0)
    assert x["std"] == pytest.approx(np.std([1, 2, 3]))
    assert (y["of"], y["value"], y["std"]) == ("y", 2.0, 0.0)
    assert math.isnan(z["value"])
    assert {value["channel"]: value["of"] for value in mock["values"]}["position"] == "joint"


def test_a_carriage_is_shown_in_metres():
    (device,) = devices(load(MOCK.with_name("mock-linear.toml")))
    device.open()
    device.read(0)
    units = {value["channel"]: value["unit"] for value in device.report()["values"]}
    device.close()
    assert (units["position"], units["force"], units["current"]) == ("m", "N", "A")


def test_it_counts_fresh_samples_damage_and_what_the_link_counts(loaded):
    (finger,) = run(loaded, 6, only="finger")
    assert (finger["cycles"], finger["samples"]) == (6, 3)
    assert finger["faults"]["CHECKSUM"] == 1
    assert finger["counts"] == {"received": 6}
    assert finger["age_ms"] >= 0
    assert finger["age_max_ms"] > 0


def test_it_shows_what_the_device_says_and_what_it_said_in_a_fault_that_is_over(loaded, monkeypatch):
    def words(self):
        return [Words("OVERLOAD" if self.cycle == 4 else "")]

    monkeypatch.setattr(Fake, "words", words, raising=False)
    (finger,) = run(loaded, 6, only="finger")
    assert finger["words"] == [{"axis": "joint", "text": "OVERLOAD", "now": False, "fault_cycles": 1}]
    assert any("said (axis joint) in 1 cycles with a fault: OVERLOAD" in text for text in lines_of(finger))


def test_nothing_is_written_unless_asked_and_then_disabled_zeros(loaded):
    run(loaded, 3)
    assert MADE[-1].calls == ["open"]
    run(loaded, 2, poll=True)
    assert MADE[-1].calls == ["open", ("write", 0, 0.0), ("write", 0, 0.0)]


class Asked(Fake):
    """Answers only when it is asked, and never shows more than it was asked for."""

    asked = 0

    def read(self, tick):
        tick["sample_count"] = self.asked

    def ask(self):
        self.asked += 1
        self.calls.append("ask")


def test_a_device_that_answers_only_when_asked_is_asked_and_never_commanded(loaded, monkeypatch):
    info = BackendInfo(
        f"{__name__}:Asked",
        "hw.simulators.mock_options:MockOptions",
        False,
        Channels(Fake.provides, Fake.consumes),
    )
    monkeypatch.setitem(registry.BUILT_IN, "fake", info)
    registry.lookup.cache_clear()
    (finger,) = run(loaded, 50, only="finger")
    assert finger["samples"] == 49
    assert MADE[-1].calls == ["open"] + ["ask"] * 50


class Biased(Fake):
    """Shows a sensor's bias at first, then a pull of 2 N along x."""

    def read(self, tick):
        self.cycle += 1
        tick["sample_count"] = self.cycle
        tick["force_n"][0] = (5.0 + 2.0 * (self.cycle > 300), -3.0, math.nan)


def test_the_force_is_shown_tared_by_its_first_samples_as_before_arming(loaded, monkeypatch):
    info = BackendInfo(
        f"{__name__}:Biased",
        "hw.simulators.mock_options:MockOptions",
        False,
        Channels(Fake.provides, Fake.consumes),
    )
    monkeypatch.setitem(registry.BUILT_IN, "fake", info)
    registry.lookup.cache_clear()
    (finger,) = run(loaded, 299, only="finger")  # tare_s is 0.3 s, 300 samples
    assert [(value["value"], value["tare"]) for value in finger["values"][:2]] == [(5.0, None), (-3.0, None)]
    assert "untared yet: let go" in "".join(lines_of(finger))
    (finger,) = run(loaded, 400, only="finger")
    x, y, z = finger["values"]
    assert (x["value"], x["tare"], x["min"], x["max"]) == (2.0, 5.0, 0.0, 2.0)
    assert (y["value"], y["tare"]) == (0.0, -3.0)
    assert math.isnan(z["value"])
    assert "tared by 5" in "".join(lines_of(finger))


@pytest.mark.parametrize("only", ["1", "finger"])
def test_one_device_is_picked_by_number_or_name(loaded, only):
    assert [device.member.label for device in devices(loaded, only)] == ["device[1] 'finger'"]


def test_a_device_that_is_not_there_is_named_with_those_that_are(loaded):
    with pytest.raises(ConfigError, match=r"no device '7'; there are 0 \(mock\), 1 \(finger\)"):
        devices(loaded, "7")


def test_one_device_that_cannot_be_opened_does_not_hide_the_others(loaded):
    Fake.script = {"open": refuse}
    mock, finger = run(loaded, 3)
    assert finger["error"] == "no such port"
    assert (mock["error"], mock["samples"]) == ("", 3)


def test_watching_ends_when_every_device_is_lost_and_closes_them(loaded):
    Fake.script = {3: lose}
    found = devices(loaded, "finger")
    watch(found, 1e-4, None, lambda: None)
    assert found[0].error == "hung up"
    assert MADE[-1].calls == ["open", "close"]


def test_ctrl_c_closes_the_devices(loaded):
    def _interrupt():
        raise KeyboardInterrupt

    found = devices(loaded, "finger")
    with pytest.raises(KeyboardInterrupt):
        watch(found, 1e-4, None, _interrupt, every_s=0.0)
    assert MADE[-1].calls == ["open", "close"]


def probe(*arguments):
    command = [sys.executable, "-m", "rtctl", "probe", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)


def test_the_command_prints_one_json_object(tmp_path):
    shown = probe(MOCK, "--json", "--seconds", "0.2", "--runtime-dir", tmp_path / "run")
    assert shown.returncode == 0, shown.stderr
    body = json.loads(shown.stdout)
    assert body["ok"]
    assert body["devices"][0]["samples"] > 0


def test_the_command_names_a_missing_port_and_exits_with_6(tmp_path):
    text = MOCK.read_text().replace('model = "friction/mock.json"', 'model = ""')
    text = text.replace(
        'kind = "mock"', 'kind = "mock"\nchannels = ["position", "current", "current_command"]'
    )
    path = tmp_path / "rig.toml"
    port = tmp_path / "no-port"
    path.write_text(text + f'\n[[device]]\nkind = "rokubi"\n[device.options]\nport = "{port}"\n')
    shown = probe(path, "--seconds", "0.2", "--runtime-dir", tmp_path / "run")
    assert shown.returncode == 6
    assert "device[1] 'rokubi'" in shown.stderr
    assert str(port) in shown.stderr
    assert "position" in shown.stdout, "the other device is shown all the same"


def test_a_rig_that_is_running_is_not_probed(tmp_path):
    with RuntimeDirectory.acquire("mock", tmp_path / "run"):
        shown = probe(MOCK, "--seconds", "0.2", "--runtime-dir", tmp_path / "run")
    assert shown.returncode == 8
