"""Errors a person or a script meets, each with an exit code.

    RtctlError                exit 1   anything below
    ├── ConfigError           exit 3   a rig file with unknown keys, wrong types, values out of bounds
    ├── ModelError            exit 4   a friction model that is missing, edited, or of another rig
    ├── StabilityError        exit 5   a config whose coupling cannot be proved passive
    ├── DeviceError           exit 6   a device that cannot be opened, or was lost
    ├── RealtimeError         exit 7   a real rig without real-time rights
    ├── BusyError             exit 8   another daemon holds this rig, or an address is in use
    ├── LoopDiedError         exit 9   the loop process ended or stalled on its own
    ├── DataError             exit 10  measured data that cannot be used (points, logs)
    │   ├── UnidentifiableError        the data cannot tell a parameter that was asked for
    │   └── ReplayDiffersError         the law does not give again what was recorded
    ├── FaultError            exit 11  the run ended in a latched fault
    ├── ClientError           exit 12  a client could not do what was asked
    │   ├── NoReplyError               the daemon did not answer in time
    │   └── RefusedError               the daemon refused, and said why
    ├── HandOnRigError        exit 13  a hand was on the rig where there must be none
    └── RecordingError        exit 14  the disk refused parts of a recording

Exit code 2 is click's own: wrong command-line usage."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class RtctlError(Exception):
    """Base of all named errors; `exit_code` is what the command line returns."""

    exit_code = 1


class ConfigError(RtctlError):
    """A rig file that must not be used. `faults` lists every fault found, one line each."""

    exit_code = 3

    def __init__(self, message: str, faults: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.faults = faults


class ModelError(RtctlError):
    """A friction model file that is missing, corrupt, edited, or does not fit the rig."""

    exit_code = 4


class StabilityError(RtctlError):
    """The configured coupling is not provably passive."""

    exit_code = 5


class DeviceError(RtctlError):
    """A device that cannot be opened, or that was lost."""

    exit_code = 6


class RealtimeError(RtctlError):
    """Real-time rights were refused on a rig that needs them."""

    exit_code = 7


class BusyError(RtctlError):
    """Something this daemon needs alone is already in use."""

    exit_code = 8


class LoopDiedError(RtctlError):
    """The loop process ended, or stopped advancing, on its own."""

    exit_code = 9


class DataError(RtctlError):
    """Measured data that cannot be used: too little, not finite, wrong columns. `file` is the one of several
    whose fault it is, where it is one's alone."""

    exit_code = 10
    file: Path | None = None


@contextmanager
def of_file(file: Path) -> Iterator[None]:
    """Name the file in each `DataError` that reading it raises."""
    try:
        yield
    except DataError as error:
        error.file = file
        raise


class UnidentifiableError(DataError):
    """A parameter the data cannot tell; `reason` is for programs, the text for people."""

    def __init__(self, reason: str, text: str) -> None:
        super().__init__(text)
        self.reason = reason


class ReplayDiffersError(DataError):
    """A replay whose result is not the recorded one, bit for bit."""


class FaultError(RtctlError):
    """A run that ended in a latched fault."""

    exit_code = 11


class ClientError(RtctlError):
    """A client could not do what was asked."""

    exit_code = 12


class NoReplyError(ClientError):
    """The daemon did not answer in time."""


class RefusedError(ClientError):
    """The daemon refused a request; `code` is for programs, `reason` and the text for people."""

    def __init__(self, code: str, text: str) -> None:
        super().__init__(f"{code}: {text}")
        self.code = code
        self.reason = text


class HandOnRigError(RtctlError):
    """A hand (or a load) on the force sensor of a rig that must move by itself."""

    exit_code = 13


class RecordingError(RtctlError):
    """A recording that has gaps, as where the disk refused it, or is not there at all."""

    exit_code = 14


class TerminatedError(KeyboardInterrupt):
    """SIGTERM before the rig ran, where it ends what Ctrl-C ends; exit code 143."""
