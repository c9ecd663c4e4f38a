"""The mock rig at a tenth of its rate, with a hand that rests: a renderer may be silent ten times longer, for
1 s.
"""

import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

from nursery import Program
from patience import PATIENCE_S

from rtctl.client import RigClient

CONFIGS = Path(__file__).parents[2] / "configs"
CHANGES = (
    ("amplitude_rad = 0.3", "amplitude_rad = 0.0"),
    ('"friction/', f'"{CONFIGS}/friction/'),
    ("rate_hz = 1000.0", "rate_hz = 100.0"),
    ("stiffness_nm_rad = 60.0", "stiffness_nm_rad = 5.0"),
    ("intent_nm = 0.05", "intent_lowpass_hz = 7.0\nintent_nm = 0.05"),
)


def slow_rig_file(folder: Path) -> Path:
    """Write the rig file into `folder`."""
    text = (CONFIGS / "mock.toml").read_text()
    for shipped, here in CHANGES:
        assert shipped in text
        text = text.replace(shipped, here)
    path = folder / "rig.toml"
    path.write_text(text)
    return path


@contextmanager
def daemon(folder: Path):
    """Runs it with its sockets in `folder`; gives a client that has had an answer."""
    folder.mkdir(mode=0o700, exist_ok=True)
    file = slow_rig_file(folder)
    command = [sys.executable, "-m", "rtctl", "run", str(file), "--runtime-dir", str(folder)]
    process = Program([*command, "--for", "400", "--json"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    try:
        with RigClient("mock", runtime_dir=folder, timeout_s=120.0) as client:
            client.hello()  # the first start compiles
            client.timeout_s = PATIENCE_S
            yield client
    finally:
        process.kill()
        process.communicate()
