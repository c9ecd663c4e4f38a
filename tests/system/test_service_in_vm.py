"""The life of a service (service_life.sh) on a whole machine: its own kernel, the hardened unit, the real
user.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from test_in_vm import ROOT, VM, why_not
from test_service_life import why_not as why_no_service

ASK = "RTCTL_VM_SERVICE"
pytestmark = [
    pytest.mark.system,
    pytest.mark.timeout(1500),
    pytest.mark.skipif(ASK not in os.environ, reason=f"twenty minutes on an emulated processor: set {ASK}=1"),
]

SLOWER = 6
TOO_MUCH = {
    "sklearn",
    "scikit_learn.libs",
    "scipy",
    "scipy.libs",
    "matplotlib",
    "PIL",
    "pillow.libs",
    "fontTools",
    "narwhals",
}
"""What fitting and plotting need, and no service: a third of the guest's memory."""

COMPILE = """
mount --bind "$1" /opt
cd /opt  # python3 -m looks there first
exec env PYTHONPATH="/opt/rtctl:$2" NUMBA_CPU_NAME=generic NUMBA_CPU_FEATURES= RTCTL_CACHE_DIR="$3" \
  /usr/bin/python3 -m rtctl run /opt/rtctl/configs/mock.toml --runtime-dir "$4" --for 0.5
"""


def served():
    """Top-level names of what rtctl needs to run, without its extras."""
    found, todo = set(), ["rtctl"]
    while todo:
        name = todo.pop()
        if name not in found:
            found.add(name)
            wanted = [Requirement(text) for text in metadata.requires(name) or ()]
            todo += [one.name for one in wanted if one.marker is None or one.marker.evaluate({"extra": ""})]
    files = [file for name in found for file in metadata.files(name) or ()]
    return {file.parts[0] for file in files} - TOO_MUCH


def staged(folder):
    """The sources as they will lie in the guest's /opt, and the law compiled there for any processor: the
    guest's would take minutes.
    """
    sources, compiled = folder / "opt" / "rtctl", folder / "compiled"
    for name in ("rtctl", "hw", "configs", "systemd"):
        shutil.copytree(ROOT / name, sources / name, ignore=shutil.ignore_patterns("__pycache__"))
    for path in sources.rglob("*"):
        os.utime(path, (1_600_000_000, 1_600_000_000))  # whole seconds, as the archive keeps them
    command = [
        "unshare",
        "--mount",
        "bash",
        "-c",
        COMPILE,
        "-",
        folder / "opt",
        sysconfig.get_paths()["purelib"],
    ]
    subprocess.run([*command, compiled, folder], check=True, capture_output=True, timeout=300)
    return sources, compiled


def test_the_life_of_a_service_under_the_hardened_unit_with_its_real_user(tmp_path):
    missing = why_no_service() or why_not()
    if missing:
        pytest.skip(missing.replace("\n", "; "))
    own = Path("/usr/bin/python3").resolve().name
    if own != f"python{sys.version_info.major}.{sys.version_info.minor}":
        pytest.skip(f"needs the machine's own Python ({own}) to be the environment's version")
    sources, compiled = staged(tmp_path)
    packages = Path(sysconfig.get_paths()["purelib"])
    asked = [
        Path("/usr/bin/python3").resolve(),
        "-c",
        "import sysconfig; print(sysconfig.get_paths()['stdlib'])",
    ]
    library = Path(subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip())
    wanted = served()
    fast = [
        library, f"{packages}=/opt/venv/lib/{library.name}/site-packages", f"{sources}=/sources",
        f"{compiled / 'compiled'}=/opt/venv/compiled", f"{ROOT / 'tests' / 'system'}=/tests",
    ]  # fmt: skip
    skip = [
        f"site-packages/{one.name}"
        for one in packages.iterdir()
        if one.name not in wanted and one.suffix != ".dist-info"
    ]
    skip += [f"{library.name}/{name}" for name in ("test", "idlelib", "tkinter", "ensurepip")]
    environment = {
        **os.environ, "RTCTL_VM_FAST": ":".join(map(str, fast)), "RTCTL_VM_SKIP": ":".join(skip),
        "RTCTL_VM_SYSTEMD": "1", "RTCTL_VM_CPUS": "2", "RTCTL_VM_SECONDS": "1400",
    }  # fmt: skip
    done = subprocess.run(
        [VM, f"bash /tests/service_life.sh /sources /opt/venv /opt/venv/compiled /usr/bin/python3 {SLOWER}"],
        capture_output=True, text=True, check=False, env=environment,
    )  # fmt: skip
    sys.stdout.write(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count("ok ") >= 15
