"""The kernel ends the view of a service that is out of memory: the lines of its unit, under a real systemd
with a real memory controller. The children stand for host, loop and view.
"""

import os
import subprocess

import pytest
from test_in_vm import ROOT, VM, why_not

from rtctl.client.view import OOM_SCORE
from rtctl.host.service_steps import UNIT, shipped

pytestmark = [pytest.mark.system, pytest.mark.timeout(700)]

CHILD = """
import signal, subprocess, sys, time
signal.signal(signal.SIGTERM, lambda *_: (print(sys.argv[1], "was told to end", flush=True), sys.exit(0)))
if sys.argv[1] == "host":
    loop, view = (subprocess.Popen([sys.executable, *sys.argv[:1], who]) for who in ("loop", "view"))
    view.wait()
    print("the view ended with", view.returncode, flush=True)
if sys.argv[1] == "view":
    open("/proc/self/oom_score_adj", "w").write("SCORE")
    eaten = [bytearray(b"1" * 1000000) for _ in range(10000)]
time.sleep(1000)
"""

SCRIPT = """
export SYSTEMD_COLORS=0 SYSTEMD_PAGER=cat
cat >/run/child.py <<'CHILD'
{child}CHILD
cat >/run/systemd/system/rig.service <<'UNIT'
[Service]
ExecStart=/usr/bin/python3 /run/child.py host
MemoryMax=60M
MemorySwapMax=0
{lines}
UNIT
systemctl daemon-reload; systemctl start rig
for _ in $(seq 120); do journalctl -o cat -u rig | grep -q 'OOM killer' && break; sleep 1; done
sleep 3; systemctl show rig -p ActiveState -p Result; journalctl -o cat -u rig
"""


@pytest.mark.skipif(bool(why_not()), reason=why_not())
def test_a_view_that_is_ended_for_its_memory_stops_no_rig():
    lines = [line for line in shipped(UNIT).decode().splitlines() if line.startswith("OOM")]
    child = CHILD.replace("SCORE", str(OOM_SCORE))
    done = subprocess.run(
        [VM, SCRIPT.format(child=child, lines="\n".join(lines))],
        cwd=ROOT, env={**os.environ, "RTCTL_VM_SYSTEMD": "1", "RTCTL_VM_SECONDS": "600"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "killed by the OOM killer" in done.stdout
    assert "the view ended with -9" in done.stdout
    assert "ActiveState=active\n" in done.stdout
    assert "told to end" not in done.stdout
