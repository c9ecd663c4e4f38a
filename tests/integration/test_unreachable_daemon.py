"""A daemon that no new client can reach to stop it."""

import shutil

import pytest
from patience import PATIENCE_S, until
from rtctl_process import finish, greet, start
from slow_rig import slow_rig_file

from rtctl.client import RigClient

pytestmark = pytest.mark.compiled


def test_a_daemon_whose_sockets_went_stops_its_rig_and_ends(folder):
    daemon = start(slow_rig_file(folder.parent), folder, "--arm")  # a late tick must not stop it before
    with RigClient("mock", runtime_dir=folder) as client:
        greet(client, daemon, 10 * PATIENCE_S)  # its law may have to be compiled
        until(lambda: client.status()["state"] == "ACTIVE", "armed")
        shutil.rmtree(folder / "mock")
        code, body, said = finish(daemon, PATIENCE_S)
    assert code == 1
    assert "ACTIVE -> STOPPING" in said
    assert "STOPPING -> SHUTDOWN: ramp finished" in said
    assert (
        f"no client could reach the rig to stop it, so it was stopped: {folder}/mock/lock" in body["message"]
    )
