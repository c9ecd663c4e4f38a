"""A joint whose friction is less than its model says, on the real loop: told, stopped, and known again after
a restart.
"""

from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from click.testing import CliRunner
from patience import PATIENCE_S

from rtctl.cli import cli
from rtctl.client import RigClient
from rtctl.control.vocabulary import State
from rtctl.host.auto_arm import AutoArm
from rtctl.host.supervisor import Host
from rtctl.recording.event_log import read_events
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[2] / "configs"
FRICTION = "[device.options.axis.friction]"


@pytest.fixture
def rig(tmp_path, monkeypatch):
    """The mock in simulated time, its dry friction .85 of what was learned."""
    monkeypatch.setenv("RTCTL_STATE_DIR", str(tmp_path / "state"))
    text = (CONFIGS / "mock.toml").read_text().replace('clock = "wall"', 'clock = "virtual"')
    text = text.replace("friction/mock.json", str(CONFIGS / "friction" / "mock.json"))
    assert text.count(FRICTION) == 1
    drift = "[device.options.axis.drift]\npoints = [[0.0, 0.85, 1.0]]\n\n"
    path = tmp_path / "rig.toml"
    path.write_text(text.replace(FRICTION, drift + FRICTION))
    (tmp_path / "run").mkdir(mode=0o700)
    return path


def run(rig, observers, **more):
    """Run until an observer finishes, for a minute at most; what the watch knows at the end."""
    with Host(load(rig), observers=observers, runtime_dir=str(rig.parent / "run"), **more) as host:
        at_start = host.friction.status()
        summary = host.run(PATIENCE_S)
        return summary, at_start, host.friction.status(), host.friction.warnings()


def test_it_is_told_and_stopped_in_the_log_in_recordings_and_after_a_restart(rig, tmp_path):
    seen = []

    def until_it_stops(host, rows):
        seen.extend(np.unique(rows["state"]).tolist())
        if State.ACTIVE in seen and State.IDLE in rows["state"][-1:]:
            host.finish()

    summary, at_start, known, warnings = run(rig, [AutoArm(), until_it_stops], record_to=tmp_path / "rec")
    assert summary["fault_first"] is None
    assert at_start[0]["factor"] is None
    assert known[0]["factor"]["value"] == pytest.approx(0.85, abs=0.02)
    assert [one["name"] for one in warnings] == ["FRICTION_DRIFT", "OVERCOMPENSATION"]
    events, _torn = read_events(tmp_path / "state" / "mock")
    kinds = [
        event.get("name") or event.get("to") for event in events if event["event"] in ("warning", "state")
    ]
    assert kinds[3:6] == ["FRICTION_DRIFT", "OVERCOMPENSATION", "STOPPING"]
    (file,) = (tmp_path / "rec").glob("*.mcap")
    shown = CliRunner().invoke(cli, ["drift", str(file)])
    assert shown.exit_code == 0
    assert "WARNING: dry friction is 0.8" in shown.output
    again = run(rig, [lambda host, _rows: host.finish()])
    assert again[1] == known
    assert [one["name"] for one in again[3]] == ["FRICTION_DRIFT"], (
        "nothing is stopped for what an earlier run saw"
    )


def test_the_compensation_follows_on_request_and_goes_on_from_there_after_a_restart(rig):
    text = rig.read_text().replace("[[0.0, 0.85, 1.0]]", "[[0.0, 0.95, 1.0]]")
    mark = "# ---- the simulated rig"
    assert text.count(mark) == 1
    rig.write_text(text.replace(mark, f"[axis.friction.drift]\nadapt_per_min = 0.01\n\n{mark}"))
    factors = []

    def until_it_has_followed(host, rows):
        factors.extend(rows["friction_factor"][:, 0].tolist())
        if factors and factors[-1] < 0.998:
            host.finish()

    _, at_start, known, _ = run(rig, [AutoArm(), until_it_has_followed])
    assert known[0]["adapting"] is True
    assert at_start[0]["followed"] == factors[0] == 1.0
    assert np.diff(factors).min() >= -0.01 / 60 * 1e-3 * (1 + 1e-6)
    assert 0.95 < known[0]["followed"] <= factors[-1] < 0.998, "the law comes after"

    def until_it_is_taken_up(host, rows):
        factors.extend(rows["friction_factor"][:, 0].tolist())
        if len(factors) > 200:
            host.finish()

    factors.clear()
    again = run(rig, [until_it_is_taken_up])
    assert again[1] == known
    assert set(factors) <= {1.0, factors[-1]}, "at once, as the motor is off"
    assert factors[-1] == pytest.approx(known[0]["followed"], abs=1e-12)


def test_a_client_has_the_compensation_of_a_running_rig_held(rig):
    """Asked over the socket, while the rig runs: what is followed stays where it is."""
    follows = "[axis.friction.drift]\nadapt_per_min = 0.01\n\n# ---- the simulated rig"
    rig.write_text(
        rig.read_text()
        .replace("[[0.0, 0.85, 1.0]]", "[[0.0, 0.95, 1.0]]")
        .replace("# ---- the simulated rig", follows)
    )
    asked, said, after = [], [], []

    def ask():
        with RigClient("mock", runtime_dir=rig.parent / "run", timeout_s=PATIENCE_S) as client:
            said.append(client.set_adaptation(False))
            said.append(client.status()["axes"][0]["adapting"])

    def until_it_is_held(host, rows):
        if not len(rows):
            return
        if rows["friction_factor"][-1, 0] < 0.999 and not asked:
            asked.append(Thread(target=ask))
            asked[0].start()
        if len(said) == 2:
            after.append((int(rows["tick"][-1]), host.friction.status()[0]["followed"]))
            if after[-1][0] - after[0][0] > 5000:
                host.finish()

    run(rig, [AutoArm(), until_it_is_held])
    asked[0].join()
    assert said == [{"joint": False}, False]
    assert after[-1][0] - after[0][0] > 5000
    assert len({factor for _, factor in after}) == 1
