"""Both pages in a real Chromium, on a running mock rig; the pictures are kept in the test's folder."""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from rtctl.client import RigClient

pytestmark = [pytest.mark.system, pytest.mark.timeout(600)]

HERE = Path(__file__).parent / "view"
CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.fixture(scope="module")
def look(tmp_path_factory):
    """Command of the looking program, its one package installed as locked."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if not (chromium and shutil.which("node") and shutil.which("npm")):
        pytest.skip("needs a browser and Node.js: apt-get install chromium nodejs npm")
    folder = tmp_path_factory.mktemp("look")
    for name in ("package.json", "package-lock.json", "look.mjs"):
        shutil.copy(HERE / name, folder)
    install = ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"]
    done = subprocess.run(install, cwd=folder, capture_output=True, text=True, check=False, timeout=300)
    if done.returncode != 0:
        pytest.skip(f"npm cannot install the package: {done.stderr.strip()[-300:]}")
    return ["node", str(folder / "look.mjs")], chromium


@pytest.fixture(params=["mock", "admittance"])
def url(request):
    """Address and key of the page of a running simulated rig, of either display."""
    rig_name = request.param
    with tempfile.TemporaryDirectory(prefix="rt") as name:
        run = [
            sys.executable,
            "-m",
            "rtctl",
            "run",
            str(CONFIGS / f"{rig_name}.toml"),
            "--runtime-dir",
            name,
            "--for",
            "400",
        ]
        rig = subprocess.Popen(run, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        view = None
        try:
            with RigClient(rig_name, runtime_dir=name, timeout_s=200.0) as client:
                client.hello()
            page = [sys.executable, "-m", "rtctl", "view", rig_name, "--runtime-dir", name, "--port", "0"]
            view = subprocess.Popen(
                page, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"}
            )
            found = re.match(r"(http://\S+/)#key=(\S+)", view.stdout.readline())
            yield found[1], found[2]
        finally:
            for process in (view, rig):
                if process is not None:
                    process.terminate()
                    process.communicate(timeout=60)


def test_both_pages_work_and_ask_for_nothing_elsewhere(look, url, tmp_path):
    command, chromium = look
    done = subprocess.run(
        [*command, *url, str(tmp_path), chromium], capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr
    facts = json.loads(done.stdout.splitlines()[-1])
    sys.stdout.write(json.dumps(facts) + "\n")
    assert facts["foreign"] == []
    assert facts["errors"] == []
    assert facts["points"] > 300
    assert facts["velocity_points"] > 50
    assert facts["signals"] > 50
    assert facts["paused"] == "Go on"
    assert facts["held"][0] == facts["held"][1]
    assert facts["zoomed"][0] == facts["zoomed"][1]
    low, high = facts["zoomed"][0]
    assert 1.0 < high - low < 3.0, "a fifth of the ten seconds shown"
    assert facts["followed"][1] > high
    assert facts["operator_hidden"]
    assert "operator key" in facts["arm_without_key"]
    assert not facts["overflow"]
    assert facts["stopped"] == "IDLE"
    assert facts["world_overflow"] == []
    for kind, law_kind in {
        "free": "free",
        "wall": "wall",
        "spring": "spring",
        "detents": "detents",
        "damper": "damper",
        "ball": "wall",
    }.items():
        assert facts[kind] == [law_kind, kind, "ACTIVE", ""]
        assert facts["frame_hz"][kind] > 0  # printed above; a busy machine has no say in a test
    for picture in ("view.png", "phone.png", "world.png"):
        assert (tmp_path / picture).stat().st_size > 10_000


def test_the_bench_times_the_page_and_weighs_its_server():
    if not (shutil.which("chromium") or shutil.which("chromium-browser")):
        pytest.skip("needs a browser: apt-get install chromium")
    command = [sys.executable, "-m", "rtctl", "bench", "view", "--quick", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    found = {row["name"]: row["value"] for row in json.loads(done.stdout)["rows"]}
    sys.stdout.write(json.dumps(found) + "\n")
    assert len(found) == 4
    assert all(0.0 < value < 1e5 for value in found.values())
