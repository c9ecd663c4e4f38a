"""The loop process: `python -m rtctl.rt FD HOST`, started by the host with that process id; FD is the socket
between them.

What must hold from the first moment is done here, before anything heavy is imported (`rtctl.rt.process`)."""

from __future__ import annotations

import gc
import sys

from rtctl.rt import birth


def main() -> int:
    """Run one loop. Returns the exit status: 0 shut down, 1 anything else."""
    line_fd, host = int(sys.argv[1]), int(sys.argv[2])
    birth.be_guarded(host)
    # what is imported is no garbage: not looking for it takes a tenth off (`rtctl.rt.process` goes on
    # collecting)
    gc.disable()
    from rtctl.rt import process

    return process.main(line_fd, host)


if __name__ == "__main__":
    sys.exit(main())
