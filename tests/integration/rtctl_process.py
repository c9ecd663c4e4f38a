"""`rtctl run` as a process: started, ended, and the processes it has."""

import json
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

from nursery import Program
from patience import PATIENCE_S

from rtctl.errors import NoReplyError

CONFIGS = Path(__file__).parents[2] / "configs"


def start(config, folder, *more, popen=Program):
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
    return popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


start_anew = partial(start, popen=subprocess.Popen)
"""For what is about the start of a program, or the end of its interpreter."""


def finish(process, timeout=150):
    out, err = process.communicate(timeout=timeout)
    return process.returncode, (json.loads(out.splitlines()[-1]) if out.strip() else None), err


def greet(client, process, patience_s=PATIENCE_S):
    """Wait for the first answer of the daemon that `process` is; one that has ended instead fails the test at
    once.
    """
    end, client.timeout_s = time.monotonic() + patience_s, 2.0
    while True:
        try:
            client.hello()
        except NoReplyError:
            assert process.poll() is None, f"the daemon ended: {process.communicate()}"
            assert time.monotonic() < end, "the daemon said nothing"
        else:
            break
    client.timeout_s = patience_s


def children(pid):
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
