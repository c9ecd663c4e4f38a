"""The service under a real systemd in a container; see service_life.sh for what is checked."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent

pytestmark = [pytest.mark.system, pytest.mark.timeout(1200)]


KEPT = """
import shutil, sys
from pathlib import Path
from hw.jit import compiled_folder
from rtctl.host.preparation import compile_rig
from rtctl.rig_file.config import load

opened = set()
sys.addaudithook(lambda event, of: event == "open" and opened.add(str(of[0])))
compile_rig(load("configs/mock.toml"))
for path in list(opened):
    ours = path.startswith(f"{compiled_folder()}/") and Path(path).is_file()
    if ours and "rtctl.rt.clock-" not in path:
        to = sys.argv[1] / Path(path).relative_to(compiled_folder())
        to.parent.mkdir(mode=0o700, exist_ok=True)
        shutil.copy(path, to)
"""
"""Copies the machine code of the rig as this machine has it, but for that of the clock, which is small: the
installation has something left to compile, and not for a minute."""


def why_not():
    if os.geteuid() != 0:
        return "needs root"
    missing = [
        tool for tool in ("systemd-nspawn", "systemd-analyze", "setpriv", "pgrep") if not shutil.which(tool)
    ]
    return f"needs {', '.join(missing)} (Debian: systemd-container, procps)" if missing else ""


@pytest.mark.skipif(bool(why_not()), reason=why_not())
def test_install_deaths_strikes_and_uninstall_under_a_real_systemd(tmp_path):
    root, compiled = HERE.parents[1], tmp_path / "compiled"
    compiled.mkdir(mode=0o700)
    subprocess.run([sys.executable, "-c", KEPT, str(compiled)], cwd=root, check=True, timeout=600)
    binds = {
        root: "/sources",
        sys.prefix: "/opt/venv",
        sys.base_prefix: "/opt/python",
        compiled: "/opt/compiled",
    }
    environment = {
        **os.environ,
        "BIND_RO": " ".join(f"{folder}:{place}" for folder, place in binds.items()),
        "LIMIT_S": "1100",
    }
    done = subprocess.run(
        [
            "bash",
            str(HERE / "in_systemd.sh"),
            str(HERE / "service_life.sh"),
            "/sources",
            "/opt/venv",
            "/opt/compiled",
            "/opt/python/bin/python3",
        ],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    sys.stdout.write(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("\nok ") >= 20
