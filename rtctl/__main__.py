"""The program `rtctl`, and `python -m rtctl`."""

import os
import signal


def main() -> None:
    """Run it. Ctrl-C and SIGTERM while the program is imported end it at once, with a line: there is nothing
    to tidy up yet."""
    # else whoever started this ignores it
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _end)
    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _end)
    from rtctl.cli import main as run

    run()


def _end(number: int, _frame: object) -> None:
    try:
        os.write(2, b"interrupted\n" if number == signal.SIGINT else b"terminated\n")
    except OSError:  # nobody reads it
        pass
    finally:
        # not by the signal itself: who started this would be told of -2, and not of the documented 130
        os._exit(128 + number)


if __name__ == "__main__":
    main()
