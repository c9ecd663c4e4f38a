"""A daemon with every door open, whom strangers may reach, and how soon it obeys a STOP."""

import os
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from patience import PATIENCE_S, until
from ports import free_ports

from rtctl.client import RigClient
from rtctl.control.vocabulary import State
from rtctl.demo import shipped_config
from rtctl.keys import KeyStore

MOST_MB = 300.0


class Daemon:
    """`rtctl run` of the simulated rig, with keys and a viewers' port on 127.0.0.1. A context manager."""

    def __init__(self, folder, **streams):
        self.folder = Path(folder)
        self.store = KeyStore(self.folder / "keys")
        self.key = self.store.new("anna", "operator", self.folder / "anna.key")
        self.port = free_ports(4)
        source = shipped_config("mock.toml")
        doors = f'[gateway]\nbind = "127.0.0.1"\nport = {self.port}\ncurve_dir = "keys"\n'
        text = source.read_text().replace('"friction/', f'"{source.parent}/friction/')
        viewers = f"[telemetry]\nplotjuggler = true\nplotjuggler_port = {self.port + 3}\n"
        self.file = self.folder / "rig.toml"
        self.file.write_text(f"{text}\n{viewers}{doors}")
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "rtctl", "run", str(self.file), "--runtime-dir", str(self.folder)],
            **{**quiet, **streams},
        )
        self.ipc = f"ipc://{self.folder}/mock"
        self.viewer = f"tcp://127.0.0.1:{self.port + 3}"
        self.tcp = f"tcp://127.0.0.1:{self.port}"

    def __enter__(self):
        until(lambda: (self.folder / "mock" / "command").exists() or self.process.poll() is not None)
        self.client = RigClient("mock", runtime_dir=self.folder, timeout_s=PATIENCE_S)
        self.client.hello()
        return self

    def __exit__(self, *_):
        self.client.close()
        self.process.terminate()
        try:
            self.process.wait(20.0)
        finally:
            self.process.kill()
            self.process.wait()

    def arm(self):
        """Bring the rig to ACTIVE."""
        if self.client.status()["state"] != "IDLE":
            self.client.reset(timeout_s=PATIENCE_S)
        self.client.arm(timeout_s=PATIENCE_S)

    def obeys_a_stop(self, client=None):
        """Milliseconds from sending a STOP to the tick from which on the torque goes to zero. The rig must be armed."""
        with self.client.ticks() as ticks:
            assert (ticks.receive(PATIENCE_S)["state"] == State.ACTIVE).any()
            sent_ns = time.monotonic_ns()
            (client or self.client).stop()
            deadline = time.monotonic() + PATIENCE_S
            while time.monotonic() < deadline:
                batch = ticks.receive(PATIENCE_S)
                if batch is not None and len(batch) and batch["state"][-1] != State.ACTIVE:
                    first = int(np.argmax(batch["state"] != State.ACTIVE))
                    return (int(batch["time_ns"][first]) - sent_ns) / 1e6
        raise AssertionError("the STOP was not obeyed")

    def memory_mb(self):
        """Most resident memory of the host so far."""
        for line in Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return float(line.split()[1]) / 1024
        raise AssertionError("the daemon has gone")

    def descriptors(self):
        """Open files and sockets of the host."""
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))


@contextmanager
def attack(kind, address, seconds=60.0, socket_type="DEALER"):
    """An attacker in a process of its own, at work when this returns."""
    command = [sys.executable, "-m", "rtctl.bench.attacker", kind, address, str(seconds), socket_type]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        time.sleep(1.0)
        yield process
    finally:
        process.kill()
        process.wait()
