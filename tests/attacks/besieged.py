"""A daemon with every door open, whom strangers may reach, and how soon it obeys a STOP."""

import subprocess
import sys
from pathlib import Path

from patience import PATIENCE_S, until
from ports import free_ports

from rtctl.client import RigClient
from rtctl.simulation.shipped_files import shipped_config
from rtctl.wire.keys import KeyStore


class Daemon:
    """`rtctl run` of the simulated rig, with keys and a viewers' port on 127.0.0.1. A context manager."""

    def __init__(self, folder, gateway="", **streams):
        self.folder = Path(folder)
        self.store = KeyStore(self.folder / "keys")
        self.key = self.store.new("anna", "operator", self.folder / "anna.key")
        self.port = free_ports(4)
        source = shipped_config("mock.toml")
        doors = f'[gateway]\nbind = "127.0.0.1"\nport = {self.port}\ncurve_dir = "keys"\n{gateway}'
        text = source.read_text().replace('"friction/', f'"{source.parent}/friction/')
        viewers = f"[telemetry]\nplotjuggler = true\nplotjuggler_port = {self.port + 3}\n"
        self.file = self.folder / "rig.toml"
        self.file.write_text(f"{text}\n{viewers}{doors}")
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "rtctl", "run", str(self.file), "--runtime-dir", str(self.folder)],
            **{**quiet, **streams},
        )

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

    def memory_mb(self):
        """Most resident memory of the host so far."""
        for line in Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return float(line.split()[1]) / 1024
        raise AssertionError("the daemon has gone")

    def descriptors(self):
        """Open files and sockets of the host."""
        return sum(1 for _ in Path(f"/proc/{self.process.pid}/fd").iterdir())
