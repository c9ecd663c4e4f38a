"""`docs/virtual-world.md` and `docs/api.md` as a reader would try them: their snippets in order, and the
page's drag, on an armed rig.
"""

import contextlib
import re
import tempfile
from pathlib import Path

import pytest
from patience import PATIENCE_S, until
from slow_rig import daemon
from standstill import OF_THIS_MACHINE, VOID, patient_clients, stopped_by, undisturbed

from rtctl.client import State
from rtctl.client.view_world import World
from rtctl.errors import ClientError, RefusedError

PAGE = Path(__file__).parents[2] / "docs" / "virtual-world.md"
API = PAGE.with_name("api.md")
PYTHON = re.compile(r"```python\n(.*?)```", re.DOTALL)
SNIPPETS = PYTHON.findall(PAGE.read_text())
STANDSTILLS = 4
"""Tries of a program that a standing machine may silence for the second after which the rig stops."""


@pytest.fixture(scope="module", autouse=True)
def _patience():
    with patient_clients():
        yield


@pytest.fixture(scope="module")
def rig():
    with tempfile.TemporaryDirectory(prefix="rt") as folder, daemon(Path(folder) / "run") as client:
        yield client


def events_since(rig, seen):
    return [event for event in iter(lambda: seen.receive(0.2), None) if event["event"] != "device"]


def program():
    """Runs the snippets of the page as one program; returns the rig's state before the last one."""
    names = {}
    try:
        for snippet in SNIPPETS[:-1]:
            exec(compile(snippet, str(PAGE), "exec"), names)
        state = names["rig"].status()["state"]
        exec(compile(SNIPPETS[-1], str(PAGE), "exec"), names)
    finally:
        names["rig"].close()
    return state


def test_the_snippets_run_as_written_and_the_rig_stays_armed_until_the_last_one_stops_it(rig, monkeypatch):
    monkeypatch.setenv(
        "RTCTL_RUNTIME_DIR", str(Path(rig.endpoints.command.removeprefix("ipc://")).parents[1])
    )
    assert len(SNIPPETS) == 3
    began = rig.latest_state().position_rad[0]
    for _ in range(STANDSTILLS):
        epoch = rig.status()["epoch"]
        with rig.events() as events:
            try:
                armed = program()
            except RefusedError as refused:
                if refused.code not in VOID:
                    raise
                assert stopped_by(rig, events) <= OF_THIS_MACHINE, "stopped, but not for its silence"
                until(lambda: rig.latest_state().state == State.IDLE)
                continue
            until(lambda: rig.latest_state().state == State.IDLE)
            told = events_since(rig, events)
        break
    assert armed == "ACTIVE"
    assert not [event for event in told if event["event"] == "fault"]
    assert rig.status()["epoch"] == epoch + 1  # the stop at the end, and no other
    assert rig.latest_state().position_rad[0] != began


def test_drag_moves_the_joint_of_an_armed_rig_and_a_stop_ends_it_for_good(rig):
    undisturbed(rig, lambda: drag_and_stop(rig))


def drag_and_stop(rig):
    world = World(rig, rig.hello())

    def is_dragged(to):
        if world.trouble or rig.status()["epoch"] != epoch:
            raise RefusedError("lease_lost", world.trouble)
        return to(rig.latest_state().position_rad[0])

    try:
        rig.arm()
        epoch, began = rig.status()["epoch"], rig.latest_state().position_rad[0]
        world.choose("drag", center_rad=began + 0.2)
        until(lambda: is_dragged(lambda at: at > began + 0.02), "the joint to follow")
        world.choose("drag", center_rad=began)  # the mouse goes on: the lease stays
        until(lambda: is_dragged(lambda at: at < began + 0.02), "the joint to come back")
        rig.stop()  # from another window
        until(lambda: "choose drag again" in world.trouble, "the world to let go")
        until(lambda: rig.status()["axes"][0]["environment"]["kind"] == "free")
        until(lambda: rig.status()["state"] == "IDLE")
        rig.arm()
        until(lambda: rig.latest_state().authority == 1.0)
        world.choose("spring", stiffness_nm_rad=2.0)
        world.choose("drag", center_rad=0.0)
        until(lambda: rig.latest_state().lease_held)
        world.choose("wall", center_rad=1.0)
        until(lambda: rig.status()["lease_holder"] is None)
        assert rig.latest_state().state == State.ACTIVE
        rig.stop()
        until(lambda: rig.status()["state"] == "IDLE")
    finally:
        world.close()


def test_a_drag_while_somebody_else_holds_the_lease_is_refused_and_changes_nothing(rig):
    world = World(rig, rig.hello())
    from rtctl.client import RigClient

    with RigClient("mock", endpoints=rig.endpoints, timeout_s=PATIENCE_S) as other:

        def is_refused():
            """For the lease, and not for a stop by a host that stood still, which voids both."""
            other.status()
            with contextlib.suppress(RefusedError), other.lease(wait_s=PATIENCE_S):
                with pytest.raises(ClientError) as refused:
                    world.choose("drag")
                assert rig.status()["axes"][0]["environment"]["kind"] != "remote"
                return "lease_taken" in str(refused.value)

        until(is_refused)
    world.close()


def test_the_snippets_of_the_clients_page_run_as_written(rig, monkeypatch, capsys):
    monkeypatch.setenv(
        "RTCTL_RUNTIME_DIR", str(Path(rig.endpoints.command.removeprefix("ipc://")).parents[1])
    )
    snippets, names = PYTHON.findall(API.read_text()), {}
    assert len(snippets) == 5
    for snippet in snippets:
        exec(compile(snippet, str(API), "exec"), names)
    until(lambda: rig.latest_state().state == State.IDLE)
    told = capsys.readouterr().out.splitlines()
    assert told[0].startswith("mock ")
    assert told[1] == "ACTIVE"
    assert len(names["run"]) >= 300
    assert any(line.startswith("out_of_bounds | stiffness_nm_rad: -1.0") for line in told), told
    assert told[-1] != "nothing heard"
