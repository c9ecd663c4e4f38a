"""The CAN contract on a real kernel, in a virtual machine: `make test-system`."""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

VM = Path(__file__).parent / "vm"
ROOT = Path(__file__).parents[2]

pytestmark = [pytest.mark.system, pytest.mark.timeout(600)]


NEEDED = (
    "numpy", "numpy.libs", "numba", "llvmlite", "pydantic", "pydantic_core", "annotated_types", "typing_inspection",
    "typing_extensions.py", "pytest", "_pytest", "pluggy", "iniconfig", "packaging", "pygments", "pytest_timeout.py", "can", "wrapt",
    "canopen", "serial", "hypothesis", "_hypothesis_pytestplugin.py", "_hypothesis_globals.py", "py.py", "sortedcontainers", "click",
)  # fmt: skip
"""What the tests in the guest import of the packages; their metadata comes along."""


def environment():
    """What is copied into the guest's memory: Python's library, its packages, this repository."""
    library = sysconfig.get_paths()["stdlib"]
    packages = sysconfig.get_paths()["purelib"]
    fast = [library, packages, *(str(ROOT / name) for name in ("hw", "rtctl", "tests"))]
    skip = [
        f"site-packages/{one.name}"
        for one in Path(packages).iterdir()
        if one.name not in NEEDED and one.suffix != ".dist-info"
    ]
    skip += [
        f"{Path(library).name}/{name}"
        for name in ("test", "idlelib", "tkinter", "ensurepip", "site-packages")
    ]
    return {**os.environ, "RTCTL_VM_FAST": ":".join(fast), "RTCTL_VM_SKIP": ":".join(skip)}


def reason():
    return subprocess.run(
        [VM, "--why"], capture_output=True, text=True, check=True, timeout=10
    ).stdout.strip()


def test_can_on_vcan_and_on_two_wired_controllers():
    missing = reason()
    if missing:
        pytest.skip(missing)
    tests = "tests/system/test_socketcan.py tests/contract/test_backend_contract.py tests/contract/test_can_contract.py"
    command = (
        f"PYTHONPATH={ROOT} NUMBA_DISABLE_JIT=1 PYTEST_DISABLE_PLUGIN_AUTOLOAD=1 RTCTL_CAN_WIRES=vcan0:vcan0,can0:can1 {sys.executable} -m pytest "
        f"-q --color=no -p pytest_timeout -p no:cacheprovider --durations=3 {tests} -k 'socketcan or vcan0 or can0'"
    )
    done = subprocess.run(
        [VM, command], cwd=ROOT, text=True, capture_output=True, check=False, env=environment()
    )
    sys.stdout.write(done.stdout[-4000:])
    assert done.returncode == 0, (done.stdout + done.stderr)[-4000:]
    assert " passed" in done.stdout
