"""The host hangs, wherever: the loop of a powered rig does not go on without it."""

import tempfile
import time

import numpy as np
import pytest
from patience import PATIENCE_S

from rtctl.control.vocabulary import Fault, State
from rtctl.host import heartbeat
from rtctl.host.auto_arm import AutoArm
from rtctl.host.supervisor import Host
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config

pytestmark = pytest.mark.compiled
SILENCE_TICKS = 500


class Hang:
    """Keeps the host's one thread once the rig is active, as a disk, a device or a bug might."""

    def __init__(self, seconds):
        self.seconds, self.rows, self.hung = seconds, [], False

    def __call__(self, host, rows):
        self.rows.append(rows)
        if self.hung:
            if len(rows) and rows["state"][-1] == State.IDLE:
                host.finish()
        elif len(rows) and (rows["state"] == State.ACTIVE).any():
            self.hung = True
            time.sleep(self.seconds)


def test_a_host_that_hangs_is_no_longer_what_the_hand_waits_for(monkeypatch):
    monkeypatch.setattr(heartbeat, "LENIENT_S", SILENCE_TICKS / 1000)
    hang = Hang(1.5)
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        loaded = load(shipped_config("mock.toml"))
        with Host(loaded, observers=[AutoArm(), hang], runtime_dir=folder) as host:
            summary = host.run(PATIENCE_S)
    rows = np.concatenate(hang.rows)
    (silent,) = np.nonzero(rows["faults"] & int(Fault.HOST_SILENT))
    assert len(silent), summary
    first = rows[silent[0]]
    assert first["state"] == State.STOPPING
    assert first["fault_first"] == int(Fault.HOST_SILENT).bit_length() - 1
    after = rows[silent[0] + 51 :]
    assert (after["torque_applied_nm"] == 0.0).all()
    assert (after["enabled"] == 0).all(), "it armed itself again"
