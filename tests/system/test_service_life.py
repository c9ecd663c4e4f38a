"""The service under a real systemd in a container; see service_life.sh for what is checked."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent

pytestmark = [pytest.mark.system, pytest.mark.timeout(1200)]


def why_not():
    if os.geteuid() != 0:
        return "needs root"
    missing = [
        tool for tool in ("systemd-nspawn", "systemd-analyze", "setpriv", "pgrep") if not shutil.which(tool)
    ]
    if missing:
        return f"needs {', '.join(missing)} (Debian: systemd-container, procps)"
    own = Path("/usr/bin/python3").resolve().name
    if own != f"python{sys.version_info.major}.{sys.version_info.minor}":
        return f"needs the machine's own Python ({own}) to be the environment's version"
    return ""


@pytest.mark.skipif(bool(why_not()), reason=why_not())
def test_install_deaths_strikes_and_uninstall_under_a_real_systemd():
    environment = {
        **os.environ,
        "BIND_RO": f"{HERE.parents[1]}:/sources",
        "BIND_RO_2": f"{sys.prefix}:/opt/venv",
        "LIMIT_S": "1100",
    }
    done = subprocess.run(
        ["bash", str(HERE / "in_systemd.sh"), str(HERE / "service_life.sh"), "/sources", "/opt/venv"],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    sys.stdout.write(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("\nok ") >= 20
