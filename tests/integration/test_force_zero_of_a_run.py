"""A hand that pulls while the daemon starts, on the real loop: known by the zero of the run before."""

import json
from contextlib import suppress
from pathlib import Path
from threading import Thread

import pytest
from patience import PATIENCE_S

from rtctl.client import RigClient
from rtctl.control.vocabulary import State
from rtctl.errors import FaultError, RefusedError
from rtctl.host.auto_arm import AutoArm
from rtctl.host.exchange.force_zero import NAME
from rtctl.host.supervisor import Host
from rtctl.rig_file.config import load

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture
def rig(tmp_path, monkeypatch):
    """The mock in simulated time."""
    monkeypatch.setenv("RTCTL_STATE_DIR", str(tmp_path / "state"))
    text = (CONFIGS / "mock.toml").read_text().replace('clock = "wall"', 'clock = "virtual"')
    path = tmp_path / "rig.toml"
    path.write_text(text.replace("friction/mock.json", str(CONFIGS / "friction" / "mock.json")))
    (tmp_path / "run").mkdir(mode=0o700)
    return path


def run(rig, *observers):
    with Host(load(rig), observers=observers, runtime_dir=str(rig.parent / "run")) as host:
        host.run(PATIENCE_S)


def until_active(host, rows):
    if State.ACTIVE in rows["state"]:
        host.finish()


def test_a_rig_that_was_tared_under_a_hand_is_armed_once_somebody_says_that_there_is_none(rig, tmp_path):
    run(rig, AutoArm(), until_active)
    file = tmp_path / "state" / "mock" / NAME
    kept = json.loads(file.read_text())
    kept["axes"]["joint"]["zero"][1] += 5.0  # as if this run had begun without a hand that pulls now
    file.write_text(json.dumps(kept))
    with pytest.raises(FaultError, match=r"tared at .* N m, and at .* ago; further apart than .*--hands-off"):
        run(rig, AutoArm())
    assert json.loads(file.read_text()) == kept
    asked, said = [], []

    def ask():
        with RigClient("mock", runtime_dir=tmp_path / "run", timeout_s=PATIENCE_S) as client:
            for say in (client.arm, client.tare):
                with pytest.raises(RefusedError) as refused:
                    say()
                said.append(str(refused.value))
            client.tare(hands_off=True)
            with suppress(RefusedError):  # FORCE_OFFSET, some seconds later: this hand pulls in truth
                client.arm()

    states = set()

    def once_tared(host, rows):
        states.update(rows["state"].tolist())
        if len(rows) and rows["tick"][-1] > 2000 and not asked:
            asked.append(Thread(target=ask))
            asked[0].start()
        if asked and not asked[0].is_alive():
            host.finish()

    run(rig, once_tared)
    asked[0].join()
    assert "a hand pulled while it was tared" in said[0]
    assert "the force sensor shows" in said[1]
    assert State.ACTIVE in states
    assert json.loads(file.read_text()) != kept
