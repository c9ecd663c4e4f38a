"""The program `rtctl`, and `python -m rtctl`."""

import signal


def main() -> None:
    """Run it. Ctrl-C while the program is imported ends it at once: there is nothing to tidy up yet."""
    heard = signal.getsignal(signal.SIGINT)
    if heard is signal.default_int_handler:  # else whoever started this wants Ctrl-C ignored
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from rtctl.cli import main as run

    signal.signal(signal.SIGINT, heard)
    run()


if __name__ == "__main__":
    main()
