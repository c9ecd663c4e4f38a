"""Device backends: the mock rig, recorded playback, serial and CAN devices, force sensors.

This package imports nothing of `rtctl`: a backend fills and reads fields of the tick
record it is handed, by name, and can be tested alone."""

from pathlib import Path


def _installed() -> tuple[int, int] | None:
    """Which file this module lies in now: an installer puts another one in its place."""
    try:
        status = Path(__file__).stat()
    except OSError:  # between taking the old one away and writing the new one
        return None
    return status.st_ino, status.st_mtime_ns


_found = _installed()


def installed_anew() -> bool:
    """Whether this package was replaced since the process imported it: what it imports from now on is of
    another version, and a source on the disk is not what it runs."""
    return _found is None or _installed() != _found
