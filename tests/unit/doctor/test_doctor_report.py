"""Versions, rig file, wake-ups, and the command as a whole."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hw import registry
from hw.interface import Finding
from rtctl.host import machine_examine as whole
from rtctl.host import machine_software, machine_wakeup
from rtctl.host.machine_line import Line

CONFIGS = Path(__file__).parents[3] / "configs"


@pytest.mark.parametrize(
    ("python", "libzmq", "curve", "statuses"),
    [
        ((3, 11, 7), (4, 3, 5), True, ["ok", "ok"]),
        ((3, 10, 9), (4, 3, 4), True, ["fail", "fail"]),
        ((3, 13, 0), (4, 4, 0), False, ["ok", "ok", "warn"]),
    ],
)
def test_versions_are_compared(python, libzmq, curve, statuses):
    assert [line.status for line in machine_software.versions(python, libzmq, curve=curve)] == statuses


def test_the_libraries_installed_here_are_new_enough():
    assert {line.status for line in machine_software.installed()} == {"ok"}


def test_a_good_rig_file_with_its_own_model_is_ok():
    loaded, lines = machine_software.rig_file(str(CONFIGS / "mock.toml"))
    assert [line.status for line in lines + machine_software.model(loaded)] == ["ok"] * 3


def test_every_fault_of_a_rig_file_is_a_line_with_its_key(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text((CONFIGS / "mock.toml").read_text().replace("rate_hz = 1000.0", "rate_hz = 1\noops = 2"))
    loaded, lines = machine_software.rig_file(str(path))
    assert loaded is None
    assert {line.status for line in lines} == {"fail"}
    assert any("loop.rate_hz" in line.found for line in lines)
    assert any("loop.oops" in line.found for line in lines)


def test_a_model_of_another_rig_and_an_unstable_coupling_fail(tmp_path):
    text = (CONFIGS / "mock.toml").read_text()
    model = CONFIGS / "friction" / "mock.json"
    path = tmp_path / "rig.toml"
    path.write_text(
        text.replace('"friction/mock.json"', f'"{model}"').replace('name = "mock"', 'name = "other"')
    )
    loaded, _ = machine_software.rig_file(str(path))
    (line,) = machine_software.model(loaded)
    assert (line.check, line.status) == ("friction model", "fail")
    path.write_text(
        text.replace('"friction/mock.json"', '""').replace(
            "stiffness_nm_rad = 60.0", "stiffness_nm_rad = 6000.0"
        )
    )
    loaded, _ = machine_software.rig_file(str(path))
    assert machine_software.model(loaded)[1].status == "fail"


def wakeups(late_us, missed=0, refused=()):
    return machine_wakeup.Wakeups.of(np.array(late_us) * 1000, missed, 1_000_000, refused)


def test_wake_ups_are_summarised_and_drawn():
    found = wakeups([1] * 990 + [60] * 9 + [7000])
    assert (found.p50_us, found.max_us, sum(found.counts), found.counts[-1]) == (1.0, 7000.0, 1000, 1)
    lines = machine_wakeup.histogram(found)
    assert len(lines) == 3
    assert "990 ####" in lines[0]


@pytest.mark.parametrize(
    ("late_us", "missed", "real", "status"),
    [
        ([5] * 100, 0, True, "ok"),
        ([5] * 99 + [600], 0, True, "warn"),
        ([5] * 1000, 1, True, "warn"),
        ([5] * 100, 5, True, "fail"),
        ([5] * 100, 5, False, "warn"),
    ],
)
def test_late_wake_ups_fail_only_where_a_hand_may_be_on_the_rig(late_us, missed, real, status):
    (line,) = machine_wakeup.judge(wakeups(late_us, missed), 1, real=real, required=False)
    assert line.status == status
    assert bool(line.fix) == (status != "ok")


@pytest.mark.parametrize(
    ("real", "required", "status"), [(True, False, "fail"), (False, True, "fail"), (False, False, "warn")]
)
def test_refused_rights_fail_where_the_rig_would_refuse(real, required, status):
    found = wakeups([5] * 100, refused=("sched-fifo refused: LimitRTPRIO=80",))
    assert machine_wakeup.judge(found, 1, real=real, required=required)[0].status == status


def test_the_measurement_is_one_line_of_json():
    found = machine_wakeup.measure(0.1, 1_000_000, 80, -1)
    assert found is not None
    assert found.wakeups + found.missed >= 100
    assert found.max_us >= found.p999_us >= found.p50_us >= 0


def test_a_report_of_a_made_up_machine(tmp_path, monkeypatch):
    monkeypatch.setattr(machine_wakeup, "measure", lambda *_: wakeups([5] * 100))
    said = []
    report = whole.examine(str(CONFIGS / "mock.toml"), 1.0, root=tmp_path, say=said.append)
    assert list(report.lines) == said
    assert report.ok
    assert {"libzmq", "rig file", "friction model", "device[0] 'mock'", "wake-up"} <= {
        line.check for line in said
    }


def found(options):
    return [("ok", f"{len(options)} options"), Finding("fail", "no licence", "buy one")]


def not_found(options):
    raise OSError("no such bus")


def no_finding(options):
    return [("perhaps", "who knows")]


def lines_of(monkeypatch, folder, name):
    """Lines of the doctor on the mock, whose kind looks at the machine by this function."""
    kind, lookup = f"{__name__}:{name}", registry.lookup
    monkeypatch.setattr(registry, "lookup", lambda one: replace(lookup(one), doctor=kind))
    report = whole.examine(str(CONFIGS / "mock.toml"), 0.0, root=folder)
    return [line for line in report.lines if line.check == "device[0] 'mock'"]


def test_a_backend_may_look_at_the_machine_itself(monkeypatch, tmp_path):
    *_, first, second = lines_of(monkeypatch, tmp_path, "found")
    assert (first.status, second.status, second.found, second.fix) == ("ok", "fail", "no licence", "buy one")
    assert first.found.endswith(" options")


@pytest.mark.parametrize(
    ("name", "text"), [("not_found", "OSError: no such bus"), ("no_finding", "status 'perhaps'; there are")]
)
def test_a_backend_that_looks_wrongly_is_named_and_the_report_goes_on(monkeypatch, tmp_path, name, text):
    line = lines_of(monkeypatch, tmp_path, name)[-1]
    assert line.status == "warn"
    assert name in line.found
    assert text in line.found
    assert "backend mock" in line.fix


def test_a_measurement_that_failed_is_a_warning(tmp_path, monkeypatch):
    monkeypatch.setattr(machine_wakeup, "measure", lambda *_: None)
    report = whole.examine(None, 1.0, root=tmp_path)
    assert report.lines[-1].status == "warn"


def test_every_line_that_is_not_ok_says_how_to_put_it_right(tmp_path):
    report = whole.examine(str(CONFIGS / "serial.toml"), 0.0, root=tmp_path)
    assert not report.ok, "there is no port in an empty tree"
    for line in report.lines:
        assert bool(line.fix) == (line.status != "ok"), line
    assert Line("a", "ok", "b").as_dict() == {"check": "a", "status": "ok", "found": "b", "fix": ""}


def doctor(*arguments):
    command = [sys.executable, "-m", "rtctl", "doctor", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)


def test_the_command_tells_lines_and_exit_code(tmp_path):
    shown = doctor(CONFIGS / "mock.toml", "--no-timing", "--json")
    body = json.loads(shown.stdout)
    assert (shown.returncode == 0) == body["ok"]
    assert body["wakeup"] is None
    assert {"check", "status", "found", "fix"} == set(body["lines"][0])
    path = tmp_path / "rig.toml"
    path.write_text("schema = 1\n")
    shown = doctor(path, "--no-timing")
    assert shown.returncode == 1
    assert "fail" in shown.stdout
    assert "rtctl check" in shown.stdout
