"""The program `rtctl`, and `python -m rtctl`."""

import os
import signal


def main() -> None:
    """Run it. Ctrl-C while the program is imported ends it at once: there is nothing to tidy up yet."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else whoever started this ignores it
        # not by the signal itself: who started this would be told of -2, and not of the documented 130
        signal.signal(signal.SIGINT, lambda *_: os._exit(128 + signal.SIGINT))
    from rtctl.cli import main as run

    run()


if __name__ == "__main__":
    main()
