"""`rtctl run` as a process: started, ended, and the processes it has."""

import json
import subprocess
import sys
from pathlib import Path

CONFIGS = Path(__file__).parents[2] / "configs"


def start(config, folder, *more):
    command = [
        sys.executable,
        "-m",
        "rtctl",
        "run",
        str(config),
        "--runtime-dir",
        str(folder),
        "--json",
        *more,
    ]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def finish(process, timeout=150):
    out, err = process.communicate(timeout=timeout)
    return process.returncode, (json.loads(out.splitlines()[-1]) if out.strip() else None), err


def children(pid):
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
