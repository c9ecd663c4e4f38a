"""TCP ports of the gateway, read from made-up trees and from this machine."""

import os
import socket
from pathlib import Path

import pytest
from made_up_tree import process, put

from rtctl.host import machine_network

HEAD = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode"


def listen(root, port, inode, state="0A"):
    line = (
        f"   0: 0100007F:{port:04X} 00000000:0000 {state} 00000000:00000000 00:00000000 00000000  1000      "
        f"  0 {inode} 1"
    )
    put(root, "proc/net/tcp", f"{HEAD}\n{line}")


def test_a_rig_without_a_gateway_is_asked_nothing(tmp_path):
    assert list(machine_network.gateway(tmp_path, "", 9860)) == []


def test_free_ports_are_ok(tmp_path):
    listen(tmp_path, 9863, 7)
    assert [line.status for line in machine_network.gateway(tmp_path, "127.0.0.1", 9860)] == ["ok"]
    listen(tmp_path, 9861, 7, state="06")
    assert [line.status for line in machine_network.gateway(tmp_path, "127.0.0.1", 9860)] == ["ok"]


@pytest.mark.parametrize(
    ("command", "status"), [("/usr/bin/other --serve", "fail"), ("python -m rtctl run rig.toml", "warn")]
)
def test_a_port_that_another_process_holds_names_it(tmp_path, command, status):
    listen(tmp_path, 9861, 4711)
    process(tmp_path, 4242, command, holds="socket:[4711]")
    (line,) = machine_network.gateway(tmp_path, "127.0.0.1", 9860)
    assert (line.status, f"TCP port 9861 is held by {command} (pid 4242)" in line.found) == (status, True)


def test_a_process_of_another_user_is_said_to_be_one(tmp_path):
    listen(tmp_path, 9860, 4711)
    (line,) = machine_network.gateway(tmp_path, "127.0.0.1", 9860)
    assert (line.status, "another user" in line.found) == ("fail", True)
    assert "sport = :9860" in line.fix


def test_a_port_of_this_machine_that_is_listened_on_is_found():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        lines = list(machine_network.gateway(Path("/"), "127.0.0.1", port))
    assert f"TCP port {port} is held by" in lines[0].found
    assert f"(pid {os.getpid()})" in lines[0].found
