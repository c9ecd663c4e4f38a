"""A serial port as a descriptor: opened by pyserial, used without it. Nothing here blocks once it is open.

Facts this file rests on (measured on Linux ptys, and read in the kernel's n_tty):

* with VMIN = 1 and O_NONBLOCK an empty port gives EAGAIN, a hang-up gives an empty read; with pyserial's
  own VMIN = 0 both look the same;
* TCOFLUSH throws away what waits for the wire, so a stop packet need not queue behind old commands;
* a lock by flock (pyserial's `exclusive`) keeps a second daemon out, but not a stop sent by another process
  after this one hangs. TIOCEXCL would."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import struct
import termios
import time
from pathlib import Path

import serial

from hw.device_holders import holders
from hw.interface import BackendError, LinkLost

CHUNK = 4096
"""The kernel's line discipline holds at most 4095 bytes; one read takes them all."""

# three stop packets of rtctl-frame, 33 bytes, take 34 ms at the slowest rate (9600 bit/s)
DRAIN_S = 0.05
"""Longest wait for a stop packet to leave before a port is closed."""

_PARITY_BITS = termios.PARODD | 0o10000000000  # the second: CMSPAR, mark or space
_TERMIOS2 = struct.Struct("=4I20s2I")
"""The kernel's struct termios2: four words of flags, line discipline and characters, both bit rates."""
# linux/asm-generic; Python's termios lacks them
_TCGETS2, _TCSETS2, _CBAUD, _BOTHER = 0x802C542A, 0x402C542B, 0o10017, 0o10000

_GONE = {errno.EIO, errno.ENODEV, errno.ENXIO, errno.EBADF, errno.EPIPE, errno.ENOENT}


def usb_identity(path: str, sys_tty: Path = Path("/sys/class/tty")) -> str | None:
    """Vendor, product and serial number of the USB device behind a port; None for anything else."""
    here = (sys_tty / Path(os.path.realpath(path)).name / "device").resolve()
    for folder in (here, *here.parents):
        if (folder / "idVendor").is_file():
            found = [folder / name for name in ("idVendor", "idProduct", "serial")]
            try:
                return ":".join(file.read_text(errors="replace").strip() for file in found if file.is_file())
            except OSError:  # unplugged just now: who asks compares, and takes it for another one
                return None
    return None


def _refusal(path: str, error: Exception) -> BackendError:
    number = getattr(error, "errno", None)
    if number in (errno.EACCES, errno.EPERM):
        remedy = (
            "permission denied: add the user to the port's group (usually: sudo usermod -aG dialout "
            "$USER), log in again"
        )
    elif number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        remedy = (
            "no such port: is the board plugged in and powered? ls -l /dev/serial/by-id names those there are"
        )
    # EBUSY by TIOCEXCL of another program, EAGAIN by its flock
    elif number in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in str(error):
        found = [f"{command} (pid {pid})" for pid, command in holders(path)]
        by = ", ".join(found) or "a process of another user (sudo fuser -v shows it)"
        remedy = f"the port is in use by {by}: end it, or name another port"
    elif number == errno.ENOTTY or os.strerror(errno.ENOTTY) in str(error):
        remedy = "not a serial port"
    else:
        remedy = str(error)
    return BackendError(f"serial port {path}: {remedy}")


class Port:
    """One open port.

    Attributes
    ----------
    fd : int
        The non-blocking descriptor, -1 once closed.
    low_latency : bool
        Whether the driver took the low-latency mode (a pty and most CDC devices have none)."""

    def __init__(self, path: str, baud: int) -> None:
        """Open exclusively, raw, 8N1, without flow control. Raises BackendError with the remedy."""
        self.path, self.baud, self.fd, self.low_latency = path, baud, -1, False
        try:
            # by pyserial, which knows the odd rates and exclusive access of each system; used without it
            self._serial = serial.Serial(path, baud, timeout=0, write_timeout=0, exclusive=True)
        except (serial.SerialException, ValueError, OSError) as error:
            raise _refusal(path, error) from error
        try:
            self._prepare(self._serial.fileno())
        except (termios.error, OSError) as error:
            self._serial.close()
            raise BackendError(f"serial port {path}: {error}") from error

    def _prepare(self, fd: int) -> None:
        # pyserial opens so, and does not promise it
        os.set_blocking(fd, False)
        settings = termios.tcgetattr(fd)
        settings[2] &= ~termios.HUPCL  # else each attempt to open again would reset boards that reset on DTR
        # 1: a read of 0 bytes then means a hang-up, and nothing else
        settings[6][termios.VMIN], settings[6][termios.VTIME] = 1, 0
        # at once: TCSADRAIN would wait for bytes that a board which hangs never takes
        termios.tcsetattr(fd, termios.TCSANOW, settings)
        termios.tcflush(fd, termios.TCIOFLUSH)  # what stood there before the port was opened is old
        # FTDI's driver collects for 16 ms otherwise, as its latency timer is set: sixteen cycles
        with contextlib.suppress(ValueError, OSError, NotImplementedError):
            self._serial.set_low_latency_mode(True)
            self.low_latency = True
        self.fd = fd

    def read_into(self, views: list[memoryview]) -> int:
        """Bytes read into the only one of `views`; 0 when none wait. Raises LinkLost."""
        try:
            # into a buffer that is there: `os.read` would make an object of the heap in every cycle
            n = os.readv(self.fd, views)
        except BlockingIOError:
            return 0
        except OSError as error:
            raise self._lost(error) from error
        # VMIN is 1: an empty port raises EAGAIN, so no bytes and no error is a line without another end
        if n == 0:
            raise LinkLost(f"serial port {self.path}: hung up; the board was unplugged or reset")
        return n

    def write(self, packet: memoryview | bytes) -> bool:
        """Send a packet; False when the line is full, which may have taken the beginning of it. Raises
        LinkLost."""
        try:
            # a line that is nearly full takes a part: the board drops what was cut by its checksum
            return os.write(self.fd, packet) == len(packet)
        except BlockingIOError:
            return False
        except OSError as error:
            raise self._lost(error) from error

    def _lost(self, error: OSError) -> LinkLost:
        if error.errno in _GONE:
            return LinkLost(f"serial port {self.path}: {error.strerror}; the board was unplugged or reset")
        return LinkLost(f"serial port {self.path}: {error.strerror}")

    def discard_output(self) -> None:
        """Throw away what has not left yet. Never raises."""
        discard_output(self.fd)

    def close(self) -> None:
        """Let the last packet leave (at most `DRAIN_S`) and release the port. Never raises."""
        if self.fd < 0:
            return
        # a stop has thrown away what was before it: what leaves here is the stop
        _drain(self.fd)
        self.fd = -1
        with contextlib.suppress(OSError, serial.SerialException, termios.error):
            self._serial.close()


def discard_output(fd: int) -> None:
    """Throw away what has not left `fd` yet. Never raises."""
    with contextlib.suppress(OSError, termios.error):
        termios.tcflush(fd, termios.TCOFLUSH)


def _drain(fd: int) -> None:
    """Wait for the output to leave, then drop the rest: the kernel's own close may wait 30 s for it."""
    end = time.monotonic() + DRAIN_S
    with contextlib.suppress(OSError, termios.error):
        # TIOCOUTQ, not tcdrain: that waits without an end for a line that is held
        while struct.unpack("i", fcntl.ioctl(fd, termios.TIOCOUTQ, b"\0\0\0\0"))[0]:
            if time.monotonic() > end:
                termios.tcflush(fd, termios.TCOFLUSH)
                return
            time.sleep(1e-3)


def send_once(path: str, baud: int, packet: bytes) -> bool:
    """Open `path` for a moment, whoever else holds it, and send `packet` before anything queued.

    Returns
    -------
    bool
        Whether all of it went out. Never raises, never blocks longer than `DRAIN_S`."""
    sent = False
    with contextlib.suppress(OSError, termios.error):
        # never the terminal that sends a SIGHUP; no wait for a carrier
        fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC)
        try:
            # a path may be any file by now: a stop packet is written into no log and no pipe
            if os.isatty(fd):
                # a line that takes no settings may well have the right ones: the daemon's
                with contextlib.suppress(OSError, termios.error):
                    _make_raw(fd, baud)
                termios.tcflush(fd, termios.TCOFLUSH)
                sent = os.write(fd, packet) == len(packet)
                _drain(fd)
        finally:
            os.close(fd)
    return sent


def _make_raw(fd: int, baud: int) -> None:
    """Raw, 8N1, without any flow control, whatever a program before has left there: a stop must not wait for
    a line that nobody sets."""
    settings = termios.tcgetattr(fd)
    # what must not survive: seven bits, parity, two stop bits, and a flow control that waits for RTS
    others = termios.CSIZE | termios.PARENB | _PARITY_BITS | termios.CSTOPB | termios.CRTSCTS
    control = settings[2] & ~others | termios.CS8 | termios.CLOCAL | termios.CREAD
    settings[0], settings[1], settings[2], settings[3] = 0, 0, control, 0
    speed = getattr(termios, f"B{baud}", None)
    if speed is not None:
        settings[4] = settings[5] = speed
    termios.tcsetattr(fd, termios.TCSANOW, settings)
    # the others first: a rate that the driver refuses leaves the port raw all the same
    if speed is None:
        _set_any_rate(fd, baud)


def _set_any_rate(fd: int, baud: int) -> None:
    """Set a bit rate that has no name of its own, as pyserial does."""
    *flags, rest, _, _ = _TERMIOS2.unpack(fcntl.ioctl(fd, _TCGETS2, bytes(_TERMIOS2.size)))
    flags[2] = flags[2] & ~_CBAUD | _BOTHER
    fcntl.ioctl(fd, _TCSETS2, _TERMIOS2.pack(*flags, rest, baud, baud))
