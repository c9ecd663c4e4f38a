"""A subscribing process: `python -m tests.bench.subscriber RIG RUNTIME_DIR` counts every tick until the
daemon goes.

Prints one JSON line: first and last slot received, ticks received, slots missing in between (of which
`missed` were never recorded: the loop skipped them), ticks lost on the way.
"""

from __future__ import annotations

import json
import sys

from rtctl.client import RigClient
from rtctl.errors import ClientError

QUIET_S = 1.5


def follow(rig: str, runtime_dir: str) -> dict[str, int]:
    """Count ticks of `rig` until none has come for `QUIET_S`."""
    received = gaps = first = last = first_missed = last_missed = 0
    with RigClient(rig, runtime_dir=runtime_dir) as client:
        stream = client.ticks()
        rows = stream.receive(30.0)
        if rows is None:
            raise ClientError("no telemetry within 30 s")
        first, last, first_missed = (
            int(rows["tick"][0]),
            int(rows["tick"][0]) - 1,
            int(rows["missed_ticks"][0]),
        )
        while rows is not None:
            gaps += int(rows["tick"][-1]) - last - len(rows)
            received += len(rows)
            last, last_missed = int(rows["tick"][-1]), int(rows["missed_ticks"][-1])
            rows = stream.receive(QUIET_S)
        lost = stream.lost
    missed = last_missed - first_missed
    return {"first": first, "last": last, "received": received, "gaps": gaps, "missed": missed, "lost": lost}


if __name__ == "__main__":
    sys.stdout.write(json.dumps(follow(*sys.argv[1:])) + "\n")
